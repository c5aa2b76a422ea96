//! The reference of the faults, printed from their table.

use core::fmt;

use super::fault::{Detection, Fault, Reaction};

/// Prints the table of faults as Markdown.
///
/// `docs/faults.md` is this print-out; a test compares the two.
#[derive(Debug, Clone, Copy, Default)]
pub struct FaultReference;

impl fmt::Display for FaultReference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "| display | number | reactions | code | 603Fh | model | cause | remedy |"
        )?;
        writeln!(f, "|---|---|---|---|---|---|---|---|")?;
        for fault in Fault::ALL {
            write!(f, "| {} | {} | ", fault.display(), fault.number())?;
            for (place, reaction) in fault.reactions().iter().enumerate() {
                write!(f, "{}{}", if place == 0 { "" } else { ", " }, name(*reaction))?;
            }
            match fault.reaction_code() {
                Some(code) => write!(f, " | C{code:04}")?,
                None => write!(f, " | –")?,
            }
            let model = match fault.detection() {
                Detection::Monitored => "modelled",
                Detection::Injected => "injected only",
            };
            writeln!(
                f,
                " | {:04X} | {model} | {} | {} |",
                fault.drivecom_code(),
                fault.cause(),
                fault.remedy()
            )?;
        }
        Ok(())
    }
}

const fn name(reaction: Reaction) -> &'static str {
    match reaction {
        Reaction::Off => "off",
        Reaction::FailQsp => "FAIL-QSP",
        Reaction::Warning => "warning",
        Reaction::Message => "message",
        Reaction::Trip => "TRIP",
    }
}

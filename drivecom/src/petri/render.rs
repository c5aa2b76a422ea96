//! Drawings of a net, generated from its table.

use core::fmt;

use super::marking::PLACES;
use super::net::{Action, Guard, Net, Puts, Transition};

impl<'a> Net<'a> {
    /// The net as a Graphviz graph: circles are places, boxes transitions, dotted arrows "needs empty".
    #[must_use]
    pub const fn dot(&self) -> DotRendering<'a> {
        DotRendering(*self)
    }

    /// The net as a Markdown table, one row per transition.
    #[must_use]
    pub const fn table(&self) -> TableRendering<'a> {
        TableRendering(*self)
    }
}

/// Prints a net as Graphviz; made by [`Net::dot`].
#[derive(Debug, Clone, Copy)]
pub struct DotRendering<'a>(Net<'a>);

impl fmt::Display for DotRendering<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "digraph net {{")?;
        for place in 1..=PLACES {
            writeln!(f, "  p{place} [shape=circle, label=\"{place}\"];")?;
        }
        for transition in self.0.transitions {
            let n = transition.number;
            write!(f, "  t{n} [shape=box, label=\"T{n}")?;
            if transition.guard != Guard::Always {
                write!(f, "\\n[{}]", transition.guard.text())?;
            }
            if let Some(action) = transition.action {
                write!(f, "\\n{}", action.text())?;
            }
            writeln!(f, "\"];")?;
            write_arcs(f, transition)?;
        }
        writeln!(f, "}}")
    }
}

/// Prints a net as a Markdown table; made by [`Net::table`].
#[derive(Debug, Clone, Copy)]
pub struct TableRendering<'a>(Net<'a>);

impl fmt::Display for TableRendering<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "| T | takes | needs empty | guard | puts | action |")?;
        writeln!(f, "|---|---|---|---|---|---|")?;
        for t in self.0.transitions {
            write!(
                f,
                "| {} | {} | {} | {} | ",
                t.number,
                t.takes,
                t.needs_empty,
                t.guard.text()
            )?;
            match t.puts {
                Puts::Places(places) => write!(f, "{places}")?,
                Puts::Choice { when, then, otherwise } => write!(f, "{then} if {}, else {otherwise}", when.text())?,
            }
            writeln!(f, " | {} |", t.action.map_or("–", Action::text))?;
        }
        Ok(())
    }
}

impl Guard {
    /// The guard in a few words.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Always => "–",
            Self::TelegramIsRead => "telegram is read",
            Self::TelegramIsWrite => "telegram is write",
            Self::HandshakeSet => "received handshake = 1",
            Self::HandshakeClear => "received handshake = 0",
            Self::CounterAboveFive => "counter > 5",
        }
    }
}

impl Action {
    /// The action in a few words.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::PointToFirst => "pointer := first telegram",
            Self::LoadAddress => "address register := pointer",
            Self::LatchWriteData => "send.data := telegram.data",
            Self::SendServiceHandshakeCleared => "send.service := telegram.service, bit 6 cleared",
            Self::SendServiceHandshakeSet => "send.service := telegram.service, bit 6 set",
            Self::SendAddressing => "send.subindex, send.index := telegram's",
            Self::StoreReadData => "telegram.data := received.data",
            Self::NextTelegram => "next telegram",
            Self::ExchangeParameterImage => "read PAR, then write PAR",
        }
    }
}

fn write_arcs(f: &mut fmt::Formatter<'_>, transition: &Transition) -> fmt::Result {
    let n = transition.number;
    for place in transition.takes.iter() {
        writeln!(f, "  p{place} -> t{n};")?;
    }
    for place in transition.needs_empty.iter() {
        writeln!(f, "  p{place} -> t{n} [style=dotted, arrowhead=odot];")?;
    }
    match transition.puts {
        Puts::Places(places) => {
            for place in places.iter() {
                writeln!(f, "  t{n} -> p{place};")?;
            }
        }
        Puts::Choice { when, then, otherwise } => {
            for place in then.iter() {
                writeln!(f, "  t{n} -> p{place} [label=\"{}\"];", when.text())?;
            }
            for place in otherwise.iter() {
                writeln!(f, "  t{n} -> p{place} [label=\"else\"];")?;
            }
        }
    }
    Ok(())
}

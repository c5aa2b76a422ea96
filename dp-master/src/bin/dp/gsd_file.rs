//! GSD files named in arguments.

use std::path::Path;

use dp_master::gsd::{Reading, parse};

use crate::output::Trouble;

/// Reads a GSD file. What is wrong inside is in the reading.
///
/// # Errors
///
/// One sentence when the file cannot be read at all, or has nothing of a GSD file.
pub(crate) fn read_gsd(path: &Path) -> Result<Reading, Trouble> {
    let octets = std::fs::read(path)
        .map_err(|error| Trouble::given(format_args!("{} cannot be read: {error}", path.display())))?;
    let reading = parse(&octets);
    let general = &reading.gsd.general;
    if general.ident_number.is_none() && general.vendor_name.is_none() && general.model_name.is_none() {
        return Err(Trouble::given(format_args!(
            "{} is no GSD file: it names neither vendor nor model nor ident number",
            path.display()
        )));
    }
    Ok(reading)
}

//! The references in `docs/` are the tables of the crate.
//!
//! Run with `UPDATE_DOCS=1` to write them anew after a change of a table.
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use std::fs;
use std::path::Path;

use lenze9300_model::code::CodeReference;
use lenze9300_model::device::FaultReference;

const CODES: &str = "# Codes of the modelled drive

Factory setting, range and step as the keypad shows them; `modelled` works, `stored only` is checked, kept and saved and
changes nothing. A code that is not listed does not exist. Sources and assumptions: `src/code/table.rs`.

";

const FAULTS: &str = "# Faults of the modelled drive

Reactions that the device permits, the factory setting first, and the code that chooses among them. `modelled` faults are
found by the model; `injected only` ones are set by an operator or a test and have the same consequences. The fault memory
(C0168) adds 1000 for a message and 2000 for a warning. Sources and assumptions: `src/device/fault.rs`.

";

fn compare(name: &str, printed: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(name);
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, printed).unwrap();
    }
    let stored = fs::read_to_string(&path).unwrap().replace("\r\n", "\n");
    assert!(
        stored == printed,
        "docs/{name} is not what the table prints; run with UPDATE_DOCS=1:\n{printed}"
    );
}

#[test]
fn the_reference_of_the_codes_is_printed_from_their_table() {
    compare("codes.md", &format!("{CODES}{CodeReference}"));
}

#[test]
fn the_reference_of_the_faults_is_printed_from_their_table() {
    compare("faults.md", &format!("{FAULTS}{FaultReference}"));
}

//! MACHINE.toml and what is reckoned from it.

mod advise;
mod budget;
mod files;
mod fit;
mod machine_file;
mod robust;
mod size;
mod size_and_model;
mod sweep;

use film_feed::catalogue::Catalogue;
use film_feed::machine_file::MachineFile;
use film_feed::size::Sizing;

/// The example of the documentation: the axis of the thesis.
const THESIS: &str = include_str!("../../../docs/examples/machine.toml");

fn machine(text: &str) -> MachineFile {
    MachineFile::read(text, &Catalogue::built_in()).unwrap_or_else(|error| panic!("{error}"))
}

/// The axis of the thesis with some lines changed; each must be there.
fn changed(changes: &[(&str, &str)]) -> MachineFile {
    let mut text = THESIS.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "the example has no `{from}`");
        text = text.replace(from, to);
    }
    machine(&text)
}

fn assert_near(what: &str, found: f64, expected: f64, share: f64) {
    let error = (found - expected).abs();
    assert!(error <= share * expected.abs(), "{what}: {found}, expected {expected}");
}

/// The figure of a row of a sizing.
fn value(sizing: &Sizing, id: &str) -> f64 {
    sizing.row(id).unwrap_or_else(|| panic!("there is no row {id}")).value
}

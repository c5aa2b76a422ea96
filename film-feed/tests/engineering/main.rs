//! MACHINE.toml and what is reckoned from it.

mod advise;
mod budget;
mod fit;
mod machine_file;
mod robust;
mod size;
mod sweep;

use film_feed::catalogue::Catalogue;
use film_feed::machine_file::MachineFile;

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

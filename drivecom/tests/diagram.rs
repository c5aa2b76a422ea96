//! The drawings in `docs/` are the tables of the crate.
//!
//! Run with `UPDATE_DOCS=1` to write them anew after a change of a table.
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use std::fs;
use std::path::Path;

use drivecom::StateDiagram;
use drivecom::petri::PARAMETER_NET;

fn compare(name: &str, drawn: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(name);
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, drawn).unwrap();
    }
    let stored = fs::read_to_string(&path).unwrap().replace("\r\n", "\n");
    assert!(
        stored == drawn,
        "docs/{name} is not what the table draws; run with UPDATE_DOCS=1:\n{drawn}"
    );
}

#[test]
fn the_state_diagram_is_drawn_from_the_transition_table() {
    compare("states.mmd", &StateDiagram.to_string());
}

#[test]
fn the_picture_of_the_parameter_net_is_drawn_from_its_table() {
    compare("parameter-net.dot", &PARAMETER_NET.dot().to_string());
}

#[test]
fn the_table_of_the_parameter_net_is_printed_from_its_rows() {
    compare("parameter-net.md", &PARAMETER_NET.table().to_string());
}

#[test]
fn every_numbered_transition_has_an_arrow() {
    let drawn = StateDiagram.to_string();
    for number in 0..16 {
        assert!(
            drawn.contains(&format!(" : {number} ")),
            "transition {number} is missing"
        );
    }
}

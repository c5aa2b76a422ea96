//! `dp info`.

#![cfg(feature = "tool")]

use crate::common::{Scratch, assert_refused, dp};

/// The file of the modelled drive.
const DRIVE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../lenze9300-model/gsd/LENZ00DA.GSD");

#[test]
fn a_gsd_file_is_shown_on_one_page() {
    let ended = dp(&["info", DRIVE], "");
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""));
    // Film-feed specification and 9300 facts, section 1: ident number, configuration of the thesis, max Tsdr.
    for part in [
        "ident number 0x00DA, slave\n",
        "1500 kbit/s (150)",
        "PAR(Cons.) + PZD(4W Cons.): 16 in, 16 out (F3 F3)\n",
    ] {
        assert!(ended.out.contains(part), "{part}\n{}", ended.out);
    }
}

#[test]
fn json_is_everything_that_was_read() {
    let ended = dp(&["info", "--json", DRIVE], "");
    let reading: serde_json::Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(reading["gsd"]["general"]["ident_number"], 0x00DA);
    assert_eq!(reading["gsd"]["modules"].as_array().unwrap().len(), 64);
    assert_eq!(reading["diagnostics"], serde_json::json!([]));
}

#[test]
fn warnings_and_errors_are_told_by_line_and_errors_fail() {
    let file = Scratch::with(
        "wrong.gsd",
        "#Profibus_DP\nGSD_Revision = 1\nVendor_Name = \"V\"\nModel_Name = \"M\"\nIdent_Number = 0x10000\nFoo_Bar = 1\n",
    );
    let ended = dp(&["info", file.path()], "");
    assert_eq!((ended.code, ended.err.as_str()), (Some(1), ""));
    for begin in [
        format!("{}:5: error: ", file.path()),
        format!("{}:6: warning: ", file.path()),
    ] {
        assert!(
            ended.out.lines().any(|line| line.starts_with(&begin)),
            "{begin}\n{}",
            ended.out
        );
    }
}

#[test]
fn what_is_no_gsd_file_is_refused_in_one_sentence() {
    assert_refused(
        &["info", "/nonexistent/x.gsd"],
        &["/nonexistent/x.gsd cannot be read: No such file or directory (os error 2)"],
    );
    let text = Scratch::with("text", "hello");
    assert_refused(
        &["info", text.path()],
        &[&format!(
            "{} is no GSD file: it names neither vendor nor model nor ident number",
            text.path()
        )],
    );
}

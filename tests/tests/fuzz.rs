//! The bodies of the fuzz targets, on random octets and on everything the fuzzer found worth keeping (`fuzz/corpus`).
//!
//! `fuzz/README.md` says how to run the fuzzer itself.
#![allow(
    clippy::unwrap_used,
    reason = "a test may unwrap: the panic is its report; helpers of tests are not covered by the setting"
)]

use std::path::Path;

use proptest::prelude::*;

#[path = "../../fuzz/bodies/mod.rs"]
mod bodies;

/// Runs a body on every file of its corpus; a panic names the file.
fn replay(target: &str, body: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../fuzz/corpus")
        .join(target);
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    assert!(!files.is_empty(), "{} is empty", folder.display());
    for file in files {
        let octets = std::fs::read(&file).unwrap();
        if std::panic::catch_unwind(|| body(&octets)).is_err() {
            panic!("{}", file.display());
        }
    }
}

/// Octets in which small numbers, addresses and start delimiters are frequent.
fn octets(most: usize) -> impl Strategy<Value = Vec<u8>> {
    let octet = prop_oneof![
        any::<u8>(),
        0..16_u8,
        prop::sample::select(vec![
            0x10, 0x68, 0xA2, 0xDC, 0xE5, 0x16, 0x83, 0x82, 0x5D, 0x7D, 0xFD, 0xFE, 0xFF
        ]),
    ];
    prop::collection::vec(octet, 0..most)
}

/// Lines as they stand in GSD files, in any order and with anything between.
fn lines() -> impl Strategy<Value = Vec<u8>> {
    let known = include_str!("../../lenze9300-model/gsd/LENZ00DA.GSD")
        .lines()
        .map(|line| format!("{line}\n"));
    let more = [
        "Module=\"x\" 0xC1,0x83,\\\n",
        "EndModule\n",
        "PrmText=1\nText(0)=\"off\"\nEndPrmText\n",
        "ExtUserPrmData=1 \"a\"\nBitArea(2-5) 1 0-9\nPrm_Text_Ref=1\nEndExtUserPrmData\n",
        "Ext_User_Prm_Data_Ref(3)=1\n",
        "Unit_Diag_Area=0-7\nValue(3)=\"hot\"\nUnit_Diag_Area_End\n",
        "SlotDefinition\nSlot(1)=\"s\" 1 1-2\nEndSlotDefinition\n",
        "; a remark",
        "\"",
        "=",
        "(",
        "99999999999999999999",
        "-1",
    ];
    let known: Vec<String> = known.chain(more.map(str::to_owned)).collect();
    let piece = prop_oneof![
        8 => prop::sample::select(known).prop_map(String::into_bytes),
        1 => prop::collection::vec(any::<u8>(), 0..6),
    ];
    prop::collection::vec(piece, 0..40).prop_map(|pieces| pieces.concat())
}

#[test]
fn the_corpus_of_the_decoder_is_clean() {
    replay("decoder", bodies::decoder::run);
}

#[test]
fn the_corpus_of_the_slave_is_clean() {
    replay("slave", bodies::slave::run);
}

#[test]
fn the_corpus_of_the_master_is_clean() {
    replay("master", bodies::master::run);
}

#[test]
fn the_corpus_of_the_capture_reader_is_clean() {
    replay("capture", bodies::capture::run);
}

#[test]
fn the_corpus_of_the_gsd_reader_is_clean() {
    replay("gsd", bodies::gsd::run);
}

#[test]
fn the_corpus_of_the_parameter_channel_is_clean() {
    replay("parameter_channel", bodies::parameter_channel::run);
}

#[test]
fn the_corpus_of_the_system_bus_is_clean() {
    replay("system_bus", bodies::system_bus::run);
}

#[test]
fn the_corpus_of_the_files_is_clean() {
    replay("toml_files", bodies::toml_files::run);
}

#[test]
fn the_corpus_of_the_block_is_clean() {
    replay("block", bodies::block::run);
}

#[test]
fn the_corpus_of_the_can_messages_is_clean() {
    replay("can_messages", bodies::can_messages::run);
}

#[test]
fn the_corpus_of_the_panel_is_clean() {
    replay("panel", bodies::panel::run);
}

/// Pages that come and go, orders with any values, broken ones, and frames that pass.
fn page_lines() -> impl Strategy<Value = Vec<u8>> {
    let number = prop_oneof![
        prop::sample::select(vec!["0", "1", "-1", "3", "100", "1e-4", "-3", "101", "1e999", "null"])
            .prop_map(str::to_owned),
        any::<i32>().prop_map(|value| value.to_string()),
        any::<f64>().prop_map(|value| value.to_string()),
    ];
    let name = prop::sample::select(vec![
        "enable",
        "pos_start",
        "read_mark",
        "distance",
        "velocity",
        "OC2",
        "EEr",
        "C0061",
        "C1301/1",
        "C0002",
        "C9999",
        "1200.0",
        "x",
        "",
    ]);
    let order = (
        prop::sample::select(vec![
            r#"{"do":"take_control"}"#,
            r#"{"do":"release_control"}"#,
            r#"{"do":"speed","factor":N}"#,
            r#"{"do":"step","ms":N}"#,
            r#"{"do":"set","input":"S","value":N}"#,
            r#"{"do":"start"}"#,
            r#"{"do":"rethread","printed":true}"#,
            r#"{"do":"blank_mark"}"#,
            r#"{"do":"live_list"}"#,
            r#"{"do":"noise","bit_error_rate":N}"#,
            r#"{"do":"cable","plugged":false}"#,
            r#"{"do":"second_master","present":true}"#,
            r#"{"do":"mains","on":false}"#,
            r#"{"do":"terminal28","high":false}"#,
            r#"{"do":"load","nm":N}"#,
            r#"{"do":"fault","name":"S","present":true}"#,
            r#"{"do":"read_code","code":"S"}"#,
            r#"{"do":"write_code","code":"S","value":"N"}"#,
            r#"{"do":"channels","names":["S","position"]}"#,
        ]),
        name,
        number,
    )
        .prop_map(|(order, name, number)| order.replace('S', name).replace('N', &number));
    let said = prop_oneof![
        8 => order,
        4 => Just("+".to_owned()),
        1 => Just("-".to_owned()),
        2 => Just(String::new()),
        1 => "[^\n]{0,20}",
    ];
    prop::collection::vec((0..4_u8, said), 0..25).prop_map(|lines| {
        lines
            .iter()
            .map(|(page, said)| format!("{page}{said}\n"))
            .collect::<String>()
            .into_bytes()
    })
}

/// Lines of the four kinds of files, in any order and with anything between; the first octet is the kind.
fn file_lines() -> impl Strategy<Value = Vec<u8>> {
    let known = [
        include_str!("../../docs/examples/machine.toml"),
        include_str!("../../film-feed/catalogue/motors.toml"),
        include_str!("../../lenze9300-model/programs/film-feed.toml"),
        "[codes]\n\"C1301/1\" = 1200.0\nC0105 = 0.5\nC0011 = 4000\nC0086 = 1\n",
    ];
    let kinds: Vec<_> = (0_u8..).zip(known).collect();
    prop::sample::select(kinds).prop_flat_map(|(kind, text)| {
        let known: Vec<String> = text.lines().map(|line| format!("{line}\n")).collect();
        let more = [
            "= 1\n",
            "x = 1e999\n",
            "x = nan\n",
            "[",
            "\"",
            "[[record]]\n",
            "-1\n",
            "ß = 1\n",
        ];
        let whole = known.len();
        let other = prop::sample::select(more.map(str::to_owned).to_vec());
        // Most of the file as it is, with a few lines changed.
        let changes = prop::collection::vec((0..whole.max(1), prop_oneof![other, Just(String::new())]), 0..4);
        changes.prop_map(move |changes| {
            let mut lines = known.clone();
            for (place, line) in changes {
                lines[place] = line;
            }
            let mut octets = vec![kind];
            octets.extend_from_slice(lines.concat().as_bytes());
            octets
        })
    })
}

/// Lines of an adapter, whole and broken.
fn adapter_lines() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        "t[0-9A-F]{3}[0-9]([0-9A-Fg]{2}){0,9}([0-9A-F]{4})?\r".prop_map(String::into_bytes),
        "[rTRFzZ][0-9A-F]{0,12}[\r\x07]".prop_map(String::into_bytes),
        prop::collection::vec(any::<u8>(), 0..40),
    ];
    prop::collection::vec(piece, 0..8).prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_text_is_read_as_a_file_or_told_with_its_lines(octets in file_lines()) {
        bodies::toml_files::run(&octets);
    }

    #[test]
    fn the_block_keeps_its_ranges_with_any_inputs(octets in prop::collection::vec(any::<u8>(), 0..1000)) {
        bodies::block::run(&octets);
    }

    #[test]
    fn any_adapter_and_any_node_are_understood_or_passed_over(octets in prop_oneof![adapter_lines(), octets(200)]) {
        bodies::can_messages::run(&octets);
    }

    #[test]
    fn any_stream_is_decoded_as_the_rules_say(octets in octets(300)) {
        bodies::decoder::run(&octets);
    }

    #[test]
    fn a_slave_survives_anything_and_starts_up_again(octets in octets(200)) {
        bodies::slave::run(&octets);
    }

    #[test]
    fn any_text_is_read_as_a_gsd_file(octets in lines()) {
        bodies::gsd::run(&octets);
    }

    #[test]
    fn a_parameter_channel_survives_anything_and_answers_again(octets in octets(200)) {
        bodies::parameter_channel::run(&octets);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn pages_that_say_anything_leave_a_panel_that_goes_on(octets in page_lines()) {
        bodies::panel::run(&octets);
    }

    #[test]
    fn a_node_of_the_system_bus_survives_anything_and_answers_again(octets in octets(200)) {
        bodies::system_bus::run(&octets);
    }

    #[test]
    fn a_master_survives_anything_and_exchanges_data_again(octets in octets(120)) {
        bodies::master::run(&octets);
    }
}

//! The block against traces of an independent S7 soft PLC that executed the printed source (`tests/data/README.md`).

use std::{fs, path::Path};

use film_feed::replay::{Line, Replay};
use serde_json::{Map, Value};

/// Replays `tests/data/<name>` and compares every field of every answer. Returns the number of cycles.
fn replays_like_the_soft_plc(name: &str) -> usize {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    let text = fs::read_to_string(&path).expect("the trace is there");
    let mut replay = Replay::new();
    let (mut cycles, mut scene) = (0, String::new());
    for (line, number) in text.lines().zip(1..) {
        let parsed = Replay::parse(line.as_bytes()).expect("the line is understood");
        let expected: Map<String, Value> = serde_json::from_str(line).expect("the line is an object");
        let mut answer = String::new();
        replay.step(&parsed, &mut answer);
        if let Line::PowerUp { .. } = parsed {
            scene = expected["reset"].to_string();
            assert_eq!(answer, "");
            continue;
        }
        cycles += 1;
        let got: Map<String, Value> = serde_json::from_str(&answer).expect("the answer is one object");
        for key in ["c", "o", "po", "qo", "m", "at", "ci"] {
            assert_eq!(
                got.get(key),
                expected.get(key),
                "{name} line {number}, {scene}: field {key}"
            );
        }
        assert_eq!(got.len(), 7);
    }
    cycles
}

#[test]
fn feeds_replay_bit_for_bit() {
    assert_eq!(replays_like_the_soft_plc("feeds.jsonl"), 420);
}

#[test]
fn disturbed_parameter_exchanges_replay_bit_for_bit() {
    assert_eq!(replays_like_the_soft_plc("disturbed.jsonl"), 2_151);
}

#[test]
fn random_inputs_at_matching_and_foreign_addresses_replay_bit_for_bit() {
    assert_eq!(replays_like_the_soft_plc("addresses.jsonl"), 520);
}

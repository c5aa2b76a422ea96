//! `lenze9300 step`, `lenze9300 bode` and `lenze9300 signals` as processes: keys, exit codes, sentences, pictures.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use std::process::{Command, Output};

use serde_json::Value;

fn lenze9300(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lenze9300"))
        .args(arguments)
        .output()
        .unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = lenze9300(&[arguments, &["--json"]].concat());
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The keys that the issue names, in their order.
const KEYS: [&str; 10] = [
    "loop",
    "tick_us",
    "kp",
    "tn_ms",
    "overshoot_percent",
    "rise_s",
    "settle_2pct_s",
    "crossover_hz",
    "phase_margin_deg",
    "gain_margin_db",
];

#[test]
fn both_commands_print_exactly_the_ten_keys() {
    for command in ["step", "bode"] {
        for name in ["current", "speed", "position"] {
            let output = lenze9300(&[command, "--loop", name, "--json"]);
            let text = String::from_utf8(output.stdout).unwrap();
            let value: Value = serde_json::from_str(&text).unwrap();
            assert_eq!(value.as_object().unwrap().len(), KEYS.len());
            let places: Vec<usize> = KEYS
                .iter()
                .map(|key| text.find(&format!("\"{key}\":")).unwrap())
                .collect();
            assert!(places.is_sorted(), "{text}");
            assert_eq!(value["loop"], name);
            assert_eq!(value["tick_us"], 125.0);
            assert!(
                output.stderr.is_empty(),
                "no limit is reached with the codes of the thesis"
            );
        }
    }
}

#[test]
fn the_codes_of_the_thesis_are_the_default() {
    // Source: design, section 6: 80 V/A, 0.01671 Nm·s/rad, 50 1/s; C0076 = 1.5 ms, C0071 = 20 ms.
    let current = json(&["step", "--loop", "current"]);
    assert!((current["kp"].as_f64().unwrap() - 80.0).abs() < 0.01);
    assert_eq!(current["tn_ms"], 1.5);
    let speed = json(&["step", "--loop", "speed"]);
    assert!((speed["kp"].as_f64().unwrap() - 0.01671).abs() < 5e-6);
    assert_eq!(speed["tn_ms"], 20.0);
    let position = json(&["step", "--loop", "position"]);
    assert_eq!(position["kp"], 50.0);
    assert_eq!(position["tn_ms"], Value::Null);
}

#[test]
fn codes_tick_and_inertia_can_be_set() {
    let current = json(&[
        "step",
        "--loop",
        "current",
        "--set",
        "C0075=0.3",
        "--set",
        "c0076/0=3",
        "--tick",
        "62.5",
    ]);
    assert!((current["kp"].as_f64().unwrap() - 32.0).abs() < 0.01);
    assert_eq!(current["tn_ms"], 3.0);
    assert_eq!(current["tick_us"], 62.5);
    // The open speed loop is K_p/(J s) where it crosses 1: half the inertia, twice the frequency.
    let heavy = json(&["bode", "--loop", "speed", "--inertia", "1e-4", "--load-inertia", "1e-4"]);
    let light = json(&[
        "bode",
        "--loop",
        "speed",
        "--inertia",
        "1e-4",
        "--load-inertia",
        "0",
        "--set",
        "C0071=600",
    ]);
    let ratio = light["crossover_hz"].as_f64().unwrap() / heavy["crossover_hz"].as_f64().unwrap();
    assert!((1.6..2.1).contains(&ratio), "{ratio}");
    assert_eq!(
        light["tn_ms"],
        Value::Null,
        "C0071 above 512 ms switches the integral part off"
    );
}

#[test]
fn an_unstable_loop_ran_and_failed() {
    let output = lenze9300(&["step", "--loop", "speed", "--set", "C0070=255", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("unstable"));
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value["overshoot_percent"], Value::Null);
    assert!(value["gain_margin_db"].as_f64().unwrap() < 0.0);
}

#[test]
fn mistakes_are_told_in_one_sentence_with_exit_code_2() {
    for (arguments, part) in [
        (&["step"][..], "--loop"),
        (
            &["bode", "--loop", "torque"],
            "possible values: current, speed, position",
        ),
        (&["step", "--loop", "speed", "--set", "C0070"], "C0070=6.5"),
        (&["step", "--loop", "speed", "--set", "C9999=1"], "no code C9999"),
        (&["step", "--loop", "speed", "--set", "C0070=256"], "0…255"),
        (&["step", "--loop", "speed", "--set", "C0070/3=5"], "C0070/3"),
        (&["step", "--loop", "speed", "--set", "C0070=0"], "no gain"),
        (&["step", "--loop", "speed", "--inertia", "0"], "kg m²"),
        (&["step", "--loop", "speed", "--tick", "5"], "10…250 µs"),
        (
            &["step", "--loop", "speed", "--plot", "/nonexistent-directory/x.svg"],
            "cannot be written",
        ),
    ] {
        let output = lenze9300(arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
        assert!(text.contains(part), "{arguments:?}: {text}");
        assert_eq!(text.trim_end().lines().count(), 1, "{text}");
    }
}

#[test]
fn a_picture_shows_the_curve_and_names_its_axes() {
    for (command, words) in [
        ("step", ["time in ms", "share of the step"]),
        ("bode", ["frequency in Hz", "phase in °"]),
    ] {
        let path = std::env::temp_dir().join(format!("lenze9300-{}-{command}.svg", std::process::id()));
        let output = lenze9300(&[command, "--loop", "speed", "--plot", path.to_str().unwrap()]);
        assert!(output.status.success(), "{output:?}");
        let svg = std::fs::read_to_string(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("<polyline"));
        for word in words {
            assert!(svg.contains(word), "{word}");
        }
    }
}

#[test]
fn the_signals_are_listed_as_table_and_as_json() {
    let output = lenze9300(&["signals"]);
    assert!(output.status.success());
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(
        told.lines()
            .any(|line| line.starts_with("POS-NOUT     %      speed of the interpolator")),
        "{told}"
    );
    let signals = json(&["signals"]);
    let signals = signals.as_array().unwrap();
    assert_eq!(signals.len() + 1, told.lines().count());
    assert_eq!(signals[0]["name"], "POS-SETP");
    assert_eq!(signals[0]["unit"], "inc");
}

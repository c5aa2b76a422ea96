//! Advice as the command line gives it. That each hazard is real shows `tests/tests/advice.rs`.

use std::fs;
use std::process::{Command, Output};

use super::THESIS;

fn film_feed(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_film-feed"))
        .args(args)
        .output()
        .expect("the program is built")
}

fn told(output: &Output) -> (Option<i32>, String, String) {
    let text = |octets: &[u8]| String::from_utf8_lossy(octets).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_machine_file_is_advised_on_and_the_exit_code_tells_whether_it_can_work() {
    let path = std::env::temp_dir().join(format!("film-feed-advise-{}.toml", std::process::id()));
    let machine = path.to_str().unwrap();
    fs::write(&path, THESIS).unwrap();
    let (code, text, error) = told(&film_feed(&["advise", machine]));
    assert_eq!((code, error.as_str()), (Some(0), ""));
    assert!(text.ends_with("nothing goes wrong by these values alone\n"), "{text}");
    assert!(
        text.contains("unwanted_start") && !text.contains("Goes wrong with these values"),
        "{text}"
    );

    // Marks read at 540 mm/s: the film runs backwards. To the earliest mark it moves for 1.242 s to record 04 and 0.205 s in it, so a start
    // every 1.46 s is taken, but JOB_FIN is not seen before it.
    let changed = THESIS
        .replace("mode = \"length\"", "mode = \"mark\"")
        .replace("mark_speed_mm_s = 240.0", "mark_speed_mm_s = 540.0")
        .replace("cycle_s = 3.0", "cycle_s = 1.46");
    fs::write(&path, changed).unwrap();
    let (code, text, error) = told(&film_feed(&["advise", machine, "--json"]));
    assert_eq!((code, error.as_str()), (Some(1), ""));
    let advice: serde_json::Value = serde_json::from_str(&text).unwrap();
    let failing: Vec<&str> = advice["findings"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|finding| finding["severity"] == "fails")
        .filter_map(|finding| finding["id"].as_str())
        .collect();
    assert_eq!(
        (advice["ok"].as_bool(), failing),
        (Some(false), vec!["reversal", "cycle"])
    );
    let keys: Vec<&String> = advice["findings"][0].as_object().unwrap().keys().collect();
    assert_eq!(keys.len(), 7, "{keys:?}");

    fs::write(&path, THESIS.replace("gear_numerator = 7", "gear_numerator = 0")).unwrap();
    let (code, text, error) = told(&film_feed(&["advise", machine]));
    assert_eq!((code, text.as_str()), (Some(2), ""));
    assert!(error.contains("gear_numerator"), "{error}");
    fs::remove_file(&path).unwrap();
}

#[test]
fn a_run_warns_before_it_begins_and_reports_the_same() {
    let (code, _, error) = told(&film_feed(&[
        "run",
        "--print-marks",
        "--feeds",
        "1",
        "--mark-speed",
        "45",
    ]));
    assert_eq!(code, Some(0), "{error}");
    assert!(
        error.starts_with("film-feed: warning: reversal: braking from the mark-reading velocity 540.0 mm/s"),
        "{error}"
    );
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    // Standard output stays one JSON object.
    let (_, text, error) = told(&film_feed(&[
        "run",
        "--print-marks",
        "--feeds",
        "1",
        "--mark-speed",
        "45",
        "--json",
    ]));
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(report["feeds"][0]["reversed"], true);
    assert!(error.contains("warning: reversal"), "{error}");
    let (_, _, quiet) = told(&film_feed(&["run", "--feeds", "1"]));
    assert_eq!(quiet, "");
}

//! The panel on a line instead of the simulated machine: the drive is a process of its own behind a pseudo-terminal, in real time.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use std::net::TcpStream;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use system_tests::running::Running;
use tungstenite::{Message, WebSocket};

fn hear(page: &mut WebSocket<TcpStream>, kind: &str) -> Value {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(20) {
        if let Message::Text(text) = page.read().unwrap() {
            let told: Value = serde_json::from_str(&text).unwrap();
            if told["t"] == kind {
                return told;
            }
        }
    }
    panic!("no {kind} came");
}

fn until(page: &mut WebSocket<TcpStream>, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let begun = Instant::now();
    loop {
        let frame = hear(page, "frame");
        if is_so(&frame) {
            return frame;
        }
        assert!(
            begun.elapsed() < Duration::from_secs(40),
            "{what}: never; {}",
            frame["outputs"]
        );
    }
}

#[test]
fn a_feed_is_started_and_seen_through_the_panel_on_a_line() {
    let link = std::env::temp_dir().join(format!("panel-line-{}", std::process::id()));
    let link = link.to_str().unwrap();
    let (drive, line) =
        Running::ready(Command::new(env!("CARGO_BIN_EXE_lenze9300-under-test")).args(["serve", "--pty", link]));
    assert!(line.contains("answering at address 3"), "{line}");
    let (_panel, line) = Running::ready(Command::new(env!("CARGO_BIN_EXE_film-feed-under-test")).args([
        "panel",
        "--listen",
        "127.0.0.1:0",
        "--port",
        link,
    ]));
    let at = line.split("http://").nth(1).unwrap();
    let at = &at[..at.find(';').unwrap()];
    let stream = TcpStream::connect(at).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let (mut page, _) = tungstenite::client(format!("ws://{at}/live"), stream).unwrap();
    let say = |page: &mut WebSocket<TcpStream>, order: Value| page.send(Message::text(order.to_string())).unwrap();

    assert_eq!(hear(&mut page, "hello")["is_real"], true);
    until(&mut page, "data exchange", |frame| {
        frame["bus"]["slave"] == "data exchange"
    });
    say(&mut page, json!({ "do": "set", "input": "enable", "value": 1 }));
    until(&mut page, "DRIVE_RDY", |frame| frame["outputs"]["drive_ready"] == true);
    // The thesis' values take two rounds of the parameter telegrams to the drive.
    until(&mut page, "two rounds", |frame| {
        frame["parameters"]["rounds"].as_u64().unwrap() >= 2
    });
    say(&mut page, json!({ "do": "start" }));
    let frame = until(&mut page, "a feed", |frame| {
        !frame["machine"]["feeds"].as_array().unwrap().is_empty()
    });
    let feed = &frame["machine"]["feeds"][0];
    // What POS_ACT says of 1200 mm: ±0.01 mm (film-feed specification, section 1).
    assert!(
        feed["finished"] == true && feed["error_um"].as_f64().unwrap().abs() <= 10.0,
        "{feed}"
    );
    assert_eq!(frame["drive"]["state"], "operation enabled");
    let frame = until(&mut page, "telegrams", |frame| {
        !frame["bus"]["heard"].as_array().unwrap().is_empty()
    });
    assert!(frame["bus"]["heard"].to_string().contains("Data_Exchange"), "{frame}");
    // The PLC's master at address 2, the module at 3 (film-feed specification, section 1).
    say(&mut page, json!({ "do": "live_list" }));
    until(&mut page, "asking", |frame| frame["bus"]["asking"] == true);
    let frame = until(&mut page, "all asked", |frame| frame["bus"]["asking"] == false);
    let stations = json!([[2, "master in the ring"], [3, "slave"]]);
    assert_eq!(frame["bus"]["stations"], stations);
    assert_eq!(
        frame["bus"]["slave"], "data exchange",
        "no cycle came too late for the watchdog"
    );

    // Codes go through DP-V1 beside the exchange: the feed constant of the thesis (9300 fact sheet, section 11), and the
    // acceleration time of the main set-value, three decimals (section 4.4), which no feed uses.
    say(&mut page, json!({ "do": "read_code", "code": "C1204" }));
    let code = hear(&mut page, "code");
    assert_eq!(
        (&code["code"], &code["value"]),
        (&json!("C1204"), &json!("179.0708")),
        "{code}"
    );
    say(
        &mut page,
        json!({ "do": "write_code", "code": "C0012", "value": "0.5" }),
    );
    say(&mut page, json!({ "do": "read_code", "code": "C0012" }));
    assert!(
        hear(&mut page, "done")["what"]
            .as_str()
            .unwrap()
            .starts_with("C0012 = 0.5")
    );
    assert_eq!(hear(&mut page, "code")["value"], "0.500");
    // The drive says why not.
    say(&mut page, json!({ "do": "read_code", "code": "C0099" }));
    let why = hear(&mut page, "refused")["why"].as_str().unwrap().to_owned();
    assert_eq!(why, "C0099: the drive has no such code");
    let frame = hear(&mut page, "frame");
    assert_eq!(frame["bus"]["slave"], "data exchange", "codes do not hold up the cycle");

    // What only a simulated machine can do is refused.
    say(&mut page, json!({ "do": "speed", "factor": 10.0 }));
    let why = hear(&mut page, "refused")["why"].as_str().unwrap().to_owned();
    assert!(why.contains("this one is real"), "{why}");
    // Gone: the block keeps what it had, and the page says where the slave stands.
    drop(drive);
    until(&mut page, "the drive is gone", |frame| {
        frame["bus"]["slave"] != "data exchange"
    });
    // A code that is asked for now is answered, too: with why it cannot be had.
    say(&mut page, json!({ "do": "read_code", "code": "C1204" }));
    let why = hear(&mut page, "refused")["why"].as_str().unwrap().to_owned();
    assert!(why.starts_with("no connection to station 3"), "{why}");
}

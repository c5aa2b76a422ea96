//! The panel's server against pages that mean no good: none of them reaches the engine, which goes on for the others.
#![cfg(feature = "panel")]
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::error::ProtocolError;
use tungstenite::{Message, WebSocket};

const TOKEN: &str = "0123456789abcdef";

/// `film-feed panel`, ended with its test.
struct Panel {
    child: Child,
    at: SocketAddr,
}

impl Panel {
    fn new(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_film-feed"))
            .args(["panel", "--listen", "127.0.0.1:0"])
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap())
            .read_line(&mut line)
            .unwrap();
        let at = line.split("http://").nth(1).unwrap();
        let at = at[..at.find(['/', ';']).unwrap()].parse().unwrap();
        Self { child, at }
    }

    fn page(&self, origin: Option<&str>, query: &str) -> Result<Page, u16> {
        let mut request = format!("ws://{}/live{query}", self.at).into_client_request().unwrap();
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", origin.parse().unwrap());
        }
        let stream = TcpStream::connect(self.at).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        match tungstenite::client(request, stream) {
            Ok((socket, _)) => Ok(Page(socket)),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
                Err(answer.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        }
    }

    /// A page of our own.
    fn own_page(&self) -> Page {
        self.page(Some(&format!("http://{}", self.at)), "").unwrap()
    }
}

impl Drop for Panel {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Page(WebSocket<TcpStream>);

impl Page {
    fn say(&mut self, order: &Value) {
        self.0.send(Message::text(order.to_string())).unwrap();
    }

    /// The next message of a kind.
    fn hear(&mut self, kind: &str) -> Value {
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(10) {
            if let Message::Text(text) = self.0.read().unwrap() {
                let told: Value = serde_json::from_str(&text).unwrap();
                if told["t"] == kind {
                    return told;
                }
            }
        }
        panic!("no {kind} came");
    }

    /// Why the server ended the connection: code and reason; none when the system ended it, which it does when the server closes
    /// with octets of ours unread.
    fn farewell(&mut self) -> Option<(u16, String)> {
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(10) {
            match self.0.read() {
                Ok(Message::Close(Some(close))) => return Some((close.code.into(), close.reason.to_string())),
                Ok(_) => {}
                Err(tungstenite::Error::Protocol(ProtocolError::ResetWithoutClosingHandshake)) => return None,
                Err(tungstenite::Error::Io(error)) if error.kind() == ErrorKind::ConnectionReset => return None,
                Err(error) => panic!("{error}"),
            }
        }
        panic!("the server does not end the connection");
    }
}

#[test]
fn wrong_origins_hosts_and_tokens_are_turned_away() {
    let panel = Panel::new(&[]);
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1"] {
        assert_eq!(panel.page(Some(origin), "").map(drop), Err(403), "{origin}");
    }
    panel.own_page().hear("hello");
    // Host: a name that somebody points at loopback.
    let mut stream = TcpStream::connect(panel.at).unwrap();
    let port = panel.at.port();
    write!(
        stream,
        "GET / HTTP/1.1\r\nHost: evil.example:{port}\r\nConnection: close\r\n\r\n"
    )
    .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 403"), "{answer}");

    let secret = Panel::new(&["--token", TOKEN]);
    for query in ["", "?token=", "?token=0123456789abcdeg"] {
        assert_eq!(secret.page(None, query).map(drop), Err(403), "{query}");
    }
    secret.page(None, &format!("?token={TOKEN}")).unwrap().hear("hello");
}

#[test]
fn of_pages_that_come_at_the_same_moment_no_more_get_in_than_there_are_places() {
    let panel = Panel::new(&[]);
    let origin = format!("http://{}", panel.at);
    let come = || {
        std::thread::scope(|scope| {
            let coming: Vec<_> = (0..40).map(|_| scope.spawn(|| panel.page(Some(&origin), ""))).collect();
            coming.into_iter().map(|page| page.join().unwrap()).collect::<Vec<_>>()
        })
    };
    let pages = come();
    // 16 places (SECURITY.md), 503 for the others.
    assert_eq!(pages.iter().filter(|page| page.is_ok()).count(), 16);
    assert!(
        pages
            .iter()
            .flat_map(|page| page.as_ref().err())
            .all(|status| *status == 503)
    );
    // Who goes leaves his place.
    drop(pages);
    let begun = Instant::now();
    while panel.page(Some(&origin), "").is_err() {
        assert!(begun.elapsed() < Duration::from_secs(5), "no place came free");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn pings_and_connections_without_a_request_hold_up_nobody() {
    let panel = Panel::new(&[]);
    let mut witness = panel.own_page();
    let mut last = witness.hear("frame")["seq"].as_u64().unwrap();
    // Two hundred that begin a request and do not end it.
    let half: Vec<_> = (0..200)
        .map(|_| {
            let mut stream = TcpStream::connect(panel.at).unwrap();
            stream.write_all(b"GET / HTTP/1.1\r\nHost: 127").unwrap();
            stream
        })
        .collect();
    let mut page = panel.own_page();
    for _ in 0..300 {
        if page.0.send(Message::Ping(vec![0; 100].into())).is_err() {
            break;
        }
    }
    if let Some((code, reason)) = page.farewell() {
        assert!(code == 1008 && reason.contains("too many orders"), "{code} {reason}");
    }
    for _ in 0..20 {
        let seq = witness.hear("frame")["seq"].as_u64().unwrap();
        assert_eq!(seq, last + 1, "no frame is lost");
        last = seq;
    }
    drop(half);
}

#[test]
fn what_is_no_order_ends_the_connection_and_nothing_else() {
    let panel = Panel::new(&[]);
    let mut witness = panel.own_page();
    let first = witness.hear("frame")["seq"].as_u64().unwrap();
    let text = |text: &str| Message::text(text.to_owned());
    for (message, code) in [
        (text("{"), 1007),
        (text(r#"{"do":"format"}"#), 1007),
        (text(r#"{"do":"speed","factor":1,"more":1}"#), 1007),
        (Message::binary(vec![0; 10]), 1003),
    ] {
        let mut page = panel.own_page();
        page.0.send(message.clone()).unwrap();
        assert_eq!(page.farewell().map(|(code, _)| code), Some(code), "{message:?}");
    }
    // Longer than any order: the server gives up on it.
    let mut page = panel.own_page();
    page.0.send(text(&"x".repeat(10_000))).unwrap();
    let told = page.farewell().map(|(code, _)| code);
    // 1009 is "message too big" (RFC 6455, section 7.4.1).
    assert!(told.is_none_or(|code| code == 1009), "{told:?}");
    // A flood.
    let mut page = panel.own_page();
    for _ in 0..150 {
        if page.0.send(text(r#"{"do":"read_code","code":"C0061"}"#)).is_err() {
            break;
        }
    }
    let (code, reason) = page.farewell().unwrap();
    assert!(code == 1008 && reason.contains("too many orders"), "{code} {reason}");
    // The witness has seen every frame meanwhile.
    let mut last = first;
    while last < first + 20 {
        let seq = witness.hear("frame")["seq"].as_u64().unwrap();
        assert_eq!(seq, last + 1, "no frame is lost");
        last = seq;
    }
}

#[test]
fn one_page_at_a_time_changes_things() {
    let panel = Panel::new(&[]);
    let mut first = panel.own_page();
    assert_eq!(first.hear("control")["yours"], true, "who is alone has the control");
    let mut second = panel.own_page();
    assert_eq!(second.hear("control")["yours"], false);
    second.say(&json!({ "do": "set", "input": "enable", "value": 1 }));
    assert!(
        second.hear("refused")["why"]
            .as_str()
            .unwrap()
            .contains("another page has the control")
    );
    // Looking is free.
    second.say(&json!({ "do": "read_code", "code": "C0061" }));
    assert!(second.hear("code")["shown"].as_str().unwrap().ends_with("°C"));
    second.say(&json!({ "do": "take_control" }));
    second.hear("refused");
    first.say(&json!({ "do": "release_control" }));
    while second.hear("control")["taken"] == true {}
    second.say(&json!({ "do": "take_control" }));
    assert_eq!(second.hear("control")["yours"], true);
    second.say(&json!({ "do": "set", "input": "enable", "value": 1 }));
    while second.hear("frame")["outputs"]["drive_ready"] == false {}
    // Whoever goes gives it up.
    drop(second);
    while first.hear("control")["taken"] == true {}
}

#[test]
fn values_out_of_range_are_refused_with_what_is_allowed() {
    let panel = Panel::new(&[]);
    let mut page = panel.own_page();
    for (order, part) in [
        (
            json!({ "do": "set", "input": "velocity", "value": 999 }),
            "Geschw: 9.99 is not allowed, 10.00 to 100.00 %",
        ),
        (
            json!({ "do": "set", "input": "Freigabe", "value": 1 }),
            "`Freigabe` is no input",
        ),
        (json!({ "do": "speed", "factor": 101.0 }), "allowed is 0 to 100"),
        (json!({ "do": "step", "ms": 5 }), "paused"),
        (json!({ "do": "load", "nm": 4.0 }), "allowed is -3 to 3"),
        (json!({ "do": "noise", "bit_error_rate": 0.5 }), "allowed is 0 to 0.001"),
        (
            json!({ "do": "fault", "name": "XX", "present": true }),
            "`XX` is no fault",
        ),
        (json!({ "do": "read_code", "code": "C9998" }), "C9998"),
        (
            json!({ "do": "write_code", "code": "C0012", "value": "much" }),
            "`much` is no value",
        ),
        (json!({ "do": "channels", "names": ["X"] }), "`X` is no signal"),
        (json!({ "do": "channels", "names": [] }), "1 to 8 channels"),
    ] {
        page.say(&order);
        let why = page.hear("refused")["why"].as_str().unwrap().to_owned();
        assert!(why.contains(part), "{order}: {why}");
    }
}

#[test]
fn eight_channels_of_a_kilohertz_lose_no_sample() {
    let panel = Panel::new(&[]);
    let mut page = panel.own_page();
    page.hear("hello");
    let names = [
        "POS-SETP",
        "POS-ACT",
        "POS-ERR",
        "POS-NOUT",
        "MCTRL-NACT",
        "M-ACT",
        "I-ACT",
        "U-DC",
    ];
    page.say(&json!({ "do": "channels", "names": names }));
    let mut expected = None;
    let mut rows = 0;
    let mut last_s: Option<f64> = None;
    while rows < 3000 {
        let frame = page.hear("frame");
        let samples = &frame["samples"];
        if samples["channels"] != json!(names) {
            continue;
        }
        let first = samples["first"].as_u64().unwrap();
        assert_eq!(*expected.get_or_insert(first), first, "by their numbers");
        assert_eq!(samples["interval_ms"], 1);
        for row in samples["rows"].as_array().unwrap() {
            assert_eq!(row.as_array().unwrap().len(), 9);
            // A kilohertz by their times, too.
            let time_s = row[0].as_f64().unwrap();
            if let Some(last_s) = last_s {
                assert!((time_s - last_s - 0.001).abs() < 1e-9, "{time_s}");
            }
            last_s = Some(time_s);
            rows += 1;
        }
        expected = Some(first + samples["rows"].as_array().unwrap().len() as u64);
    }
}

#[test]
fn a_page_that_reads_nothing_holds_up_nobody() {
    let panel = Panel::new(&[]);
    let mut witness = panel.own_page();
    witness.say(&json!({ "do": "speed", "factor": 100.0 }));
    let mut slow = panel.own_page();
    slow.say(&json!({ "do": "read_code", "code": "C0061" }));
    // Reads nothing. The kernel's buffers and our queue fill up at some 20 kB a frame.
    let begun = Instant::now();
    let mut last = witness.hear("frame")["seq"].as_u64().unwrap();
    while begun.elapsed() < Duration::from_secs(4) {
        let seq = witness.hear("frame")["seq"].as_u64().unwrap();
        assert_eq!(seq, last + 1);
        last = seq;
    }
}

#[test]
fn the_capture_is_a_pcapng_file_and_guarded_like_everything_else() {
    let panel = Panel::new(&["--token", TOKEN]);
    let mut page = panel.page(None, &format!("?token={TOKEN}")).unwrap();
    page.hear("frame");
    page.hear("frame");
    let get = |path: &str| {
        let mut stream = TcpStream::connect(panel.at).unwrap();
        write!(
            stream,
            "GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n",
            panel.at
        )
        .unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        answer
    };
    assert!(get("/capture.pcapng").starts_with(b"HTTP/1.1 403"));
    let answer = get(&format!("/capture.pcapng?token={TOKEN}"));
    assert!(answer.starts_with(b"HTTP/1.1 200"));
    let body = answer.windows(4).position(|window| window == b"\r\n\r\n").unwrap() + 4;
    let capture = dp_master::phy::CaptureReader::new(&answer[body..]).unwrap();
    let telegrams = capture
        .map_while(Result::ok)
        .filter(|packet| packet.telegram().is_ok())
        .count();
    assert!(telegrams > 20, "{telegrams}");
}

#[test]
fn a_second_master_enters_the_ring_and_the_feed_goes_on() {
    let panel = Panel::new(&[]);
    let mut page = panel.own_page();
    page.say(&json!({ "do": "set", "input": "enable", "value": 1 }));
    while page.hear("frame")["outputs"]["drive_ready"] == false {}
    page.say(&json!({ "do": "second_master", "present": true }));
    let heard = |frame: &Value, what: &str| {
        let heard = frame["bus"]["heard"].as_array().unwrap();
        heard.iter().any(|line| line[1].as_str().unwrap().starts_with(what))
    };
    while !heard(&page.hear("frame"), "2 → 1  token") {}
    page.say(&json!({ "do": "speed", "factor": 10.0 }));
    page.say(&json!({ "do": "start" }));
    loop {
        let frame = page.hear("frame");
        if let Some(feed) = frame["machine"]["feeds"].as_array().unwrap().first() {
            // ±0.01 mm, film-feed specification 1.
            assert!(
                feed["error_um"].as_f64().unwrap().abs() <= 10.0 && feed["finished"] == true,
                "{feed}"
            );
            break;
        }
    }
    // It goes as if its plug were pulled: the ring closes again without it.
    page.say(&json!({ "do": "second_master", "present": false }));
    while !heard(&page.hear("frame"), "2 → 2  token") {}
    assert_eq!(page.hear("frame")["bus"]["slave"], "data exchange");
}

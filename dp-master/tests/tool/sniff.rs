//! `dp sniff`: on a capture of the virtual line, whose times are exact, and live on a pseudo-terminal.

#![cfg(all(feature = "tool", unix))]

use std::time::{Duration as StdDuration, Instant as StdInstant};

use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, Mode, SlaveConfig, SlaveIdentity, SlaveState,
};
use dp_master::fdl::BusParams;
use dp_master::phy::{CaptureReader, CaptureWriter, Port, PortId, PseudoTerminal, Script, Tap, VirtualBus, pump};
use dp_master::station::Station;
use dp_master::time::{Baud, Duration, Instant};

use crate::common::{Scratch, assert_refused, dp, end, start};

const BAUD: Baud = Baud::B1500000;

/// A start-up and some cycles of one master and one slave, 2 + 2 octets; the request with this number of the exchange is lost.
fn recorded(lost_burst: Option<u64>) -> Vec<u8> {
    let (plc, drive) = (Address::new(2).unwrap(), Address::new(3).unwrap());
    let config = MasterConfig {
        min_cycle: Duration::from_millis(1),
        ..MasterConfig::new(plc, BusParams::standard(BAUD))
    };
    let mut master = DpMaster::<1>::new(config).unwrap();
    let axis = master
        .add_slave(SlaveConfig::new(drive, 0x00DA, &[0x31]).unwrap())
        .unwrap();
    master.set_mode(Mode::Operate);
    let accepted = AcceptedConfigurations::Table(&[&[0x31]]);
    let mut slave = DpSlave::new(SlaveIdentity::new(drive, 0x00DA, BAUD, accepted)).unwrap();
    let mut bus = VirtualBus::new(BAUD);
    let ports = [bus.attach(), bus.attach(), bus.attach()];
    let mut capture = CaptureWriter::new(Vec::new(), BAUD, Duration::ZERO).unwrap();
    let mut tap = Tap::new(BAUD, |trace: dp_master::phy::Trace<'_>| capture.write(&trace).unwrap());
    let mut now = Instant::ZERO;
    let end = Instant::from_nanos(100_000_000);
    let mut scripted = false;
    while now < end {
        if let Some(ahead) = lost_burst
            && !scripted
            && master.state(axis) == SlaveState::DataExchange
            && master.exchanges(axis) == 20
        {
            scripted = true;
            bus.script(Script::Drop {
                burst: bus.bursts() + ahead,
            });
        }
        let mut stations: [(PortId, &mut dyn Station); 3] =
            [(ports[0], &mut master), (ports[1], &mut slave), (ports[2], &mut tap)];
        now = pump(&mut bus, now, &mut stations).unwrap();
    }
    assert_eq!(master.state(axis), SlaveState::DataExchange);
    drop(tap);
    capture.finish().unwrap()
}

fn capture_file(lost_burst: Option<u64>) -> Scratch {
    let file = Scratch::new("line.pcapng");
    std::fs::write(&file.0, recorded(lost_burst)).unwrap();
    file
}

fn statistics(arguments: &[&str]) -> serde_json::Value {
    let ended = dp(arguments, "");
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""), "{arguments:?}");
    serde_json::from_str(ended.out.lines().last().unwrap()).unwrap()
}

#[test]
fn a_capture_is_shown_telegram_by_telegram() {
    let file = capture_file(None);
    let ended = dp(
        &[
            "sniff",
            "--read",
            file.path(),
            "--no-tokens",
            "--service",
            "slave_diag",
            "--service",
            "Set_Prm",
            "--service",
            "Chk_Cfg",
        ],
        "",
    );
    let telegrams: Vec<&str> = ended
        .out
        .lines()
        .take_while(|line| !line.is_empty())
        .map(|line| line[12..].trim_start())
        .collect();
    // The start-up of IEC 61158-6-3: diagnosis (a slave without parameters is not ready), parameters, configuration, diagnosis.
    assert_eq!(
        telegrams,
        [
            "2 → 3  SRD high first  Slave_Diag",
            "3 → 2  DL slave  Slave_Diag  [Station_Not_Ready Prm_Req] master none ident 00DA",
            "2 → 3  SRD high FCB=0  Set_Prm  lock WD off min Tsdr 11 ident 00DA group 00",
            "2 → 3  SRD high FCB=1  Chk_Cfg  31 = 2 octets in+out",
            "2 → 3  SRD high FCB=0  Slave_Diag",
            "3 → 2  DL slave  Slave_Diag  [] master 2 ident 00DA",
        ]
    );
    assert_eq!(ended.code, Some(0), "{}", ended.err);
}

#[test]
fn the_statistics_of_a_capture_are_those_of_the_line() {
    let file = capture_file(None);
    let report = statistics(&["sniff", "--read", file.path(), "--quiet", "--json"]);
    assert_eq!(report["baud"], 1_500_000);
    assert_eq!((&report["retries"], &report["unanswered"]), (&0.into(), &0.into()));
    assert_eq!(report["discarded"], serde_json::json!({}));
    let stations = report["stations"].as_array().unwrap();
    assert_eq!(stations.len(), 2);
    assert_eq!(
        (&stations[0]["address"], &stations[0]["kind"]),
        (&2.into(), &"master".into())
    );
    assert_eq!(
        (&stations[1]["address"], &stations[1]["kind"]),
        (&3.into(), &"slave".into())
    );
    // The slave answers after its min Tsdr of 11 tBIT; the master keeps a cycle of 1 ms.
    let reply = stations[1]["reply_bits"].as_array().unwrap();
    assert!(
        reply.iter().all(|bits| (10.0..=12.0).contains(&bits.as_f64().unwrap())),
        "{reply:?}"
    );
    let cycle = stations[1]["cycle_ms"].as_array().unwrap();
    assert!((cycle[1].as_f64().unwrap() - 1.0).abs() < 0.01, "{cycle:?}");
    let exchange = report["services"]
        .as_array()
        .unwrap()
        .iter()
        .find(|service| service["service"] == "Data_Exchange")
        .unwrap();
    assert_eq!(exchange["requests"], exchange["replies"]);
    // 100 ms of one cycle a millisecond, less the first search for other masters: 126 slot times of 300 tBIT and what is between them.
    assert!(exchange["requests"].as_u64().unwrap() > 50, "{exchange}");
    // A master alone passes the token to itself: the mean is the time from the first to the last one by the rotations between them.
    let tokens: Vec<Instant> = CaptureReader::new(recorded(None).as_slice())
        .unwrap()
        .map(Result::unwrap)
        .filter(|packet| packet.octets == [0xDC, 0x02, 0x02])
        .map(|packet| packet.start)
        .collect();
    let span = *tokens.last().unwrap() - tokens[0];
    let mean_ms = span.as_nanos() as f64 / 1e6 / (tokens.len() - 1) as f64;
    let told = report["token_rotation_ms"]["2"][1].as_f64().unwrap();
    assert!((told - mean_ms).abs() < 0.001, "{told} ms, by hand {mean_ms} ms");
}

#[test]
fn a_lost_request_is_a_retry_and_no_answer() {
    // What comes after the twentieth exchange: token or request, whichever; it is lost for everybody, so the listener sees the reply
    // missing or the repetition only. A lost reply shows both.
    let mut seen = Vec::new();
    for ahead in 0..4 {
        let file = capture_file(Some(ahead));
        let report = statistics(&["sniff", "--read", file.path(), "--quiet", "--json"]);
        seen.push((
            report["retries"].as_u64().unwrap(),
            report["unanswered"].as_u64().unwrap(),
        ));
    }
    // Among four bursts in a row are a token, a request that nobody hears, and a reply that nobody hears: only the last one leaves a
    // request unanswered and then repeated.
    assert!(seen.contains(&(1, 1)), "{seen:?}");
    assert!(seen.contains(&(0, 0)), "{seen:?}");
}

#[test]
fn the_text_of_the_statistics_names_service_station_and_token() {
    let file = capture_file(None);
    let ended = dp(&["sniff", "--read", file.path(), "-q"], "");
    for begin in [
        "Data_Exchange ",
        "3        slave ",
        "token of 2: one rotation ",
        "0 retries, 0 unanswered, 0 times octets",
    ] {
        assert!(
            ended.out.lines().any(|line| line.starts_with(begin)),
            "{begin}\n{}",
            ended.out
        );
    }
}

#[test]
fn what_is_shown_is_written_as_a_capture_again() {
    let file = capture_file(None);
    let copy = Scratch::new("copy.pcapng");
    let ended = dp(
        &[
            "sniff",
            "--read",
            file.path(),
            "--service",
            "Set_Prm",
            "--write",
            copy.path(),
            "--quiet",
        ],
        "",
    );
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let all: Vec<_> = CaptureReader::new(recorded(None).as_slice())
        .unwrap()
        .map(Result::unwrap)
        .collect();
    let mut reader = CaptureReader::new(std::fs::File::open(&copy.0).unwrap()).unwrap();
    let written: Vec<_> = reader.by_ref().map(Result::unwrap).collect();
    assert_eq!(written.len(), 1);
    assert!(all.contains(&written[0]), "same octets, same time: {written:?}");
    assert_eq!(reader.baud(), Some(BAUD));
}

#[test]
fn a_capture_that_ends_too_soon_is_shown_up_to_there_and_fails() {
    let octets = recorded(None);
    let file = Scratch::new("cut.pcapng");
    std::fs::write(&file.0, &octets[..octets.len() / 2 + 1]).unwrap();
    let ended = dp(&["sniff", "--read", file.path(), "-q"], "");
    assert_eq!(ended.code, Some(1));
    assert!(ended.out.contains("Data_Exchange"), "{}", ended.out);
    assert_eq!(
        ended.err,
        format!("dp: {}: the capture ends inside a block\n", file.path())
    );
}

// --- live ---------------------------------------------------------------------------------------------------------------------------------

#[test]
fn a_line_is_shown_live_and_nothing_is_ever_sent() {
    let link = Scratch::new("line");
    let (mut line, _) = PseudoTerminal::open(BAUD).unwrap();
    line.link(&link.0).unwrap();
    let mut child = start(&["sniff", "--port", link.path(), "--baud", "1500000", "--count", "3"]);
    // It may not listen yet: the telegrams are repeated until it has seen enough.
    let begin = StdInstant::now();
    while child.try_wait().unwrap().is_none() && begin.elapsed() < StdDuration::from_secs(20) {
        line.send(&[0xDC, 0x02, 0x02]).unwrap();
        line.send(&[0x10, 0x03, 0x02, 0x49, 0x4E, 0x16]).unwrap();
        std::thread::sleep(StdDuration::from_millis(20));
    }
    let ended = end(child);
    let shown = ended.out;
    assert_eq!(ended.code, Some(0), "{shown}{}", ended.err);
    assert!(
        shown.contains("2 → 2  token\n") && shown.contains("2 → 3  FDL_Status request\n"),
        "{shown}"
    );
    assert!(shown.contains("3 telegrams in "), "{shown}");
    assert_eq!(
        line.receive(&mut [0; 8], StdDuration::from_millis(20)).unwrap(),
        0,
        "a listener has sent"
    );
}

#[test]
fn the_baud_rate_is_found_where_telegrams_are() {
    let link = Scratch::new("line");
    let (mut line, _) = PseudoTerminal::open(BAUD).unwrap();
    line.link(&link.0).unwrap();
    let mut child = start(&["sniff", "--port", link.path(), "--baud", "auto", "--count", "1", "-q"]);
    let begin = StdInstant::now();
    while child.try_wait().unwrap().is_none() && begin.elapsed() < StdDuration::from_secs(30) {
        line.send(&[0xDC, 0x02, 0x02]).unwrap();
        std::thread::sleep(StdDuration::from_millis(5));
    }
    let ended = end(child);
    // A pseudo-terminal runs at any rate, so it is the first one that is tried.
    assert!(
        ended.err.ends_with("dp: the line runs at 1500000 bit/s\n"),
        "{}",
        ended.err
    );
    assert_eq!(ended.code, Some(0), "{}", ended.out);
}

#[test]
fn a_silent_line_ends_after_its_time_with_nothing() {
    let link = Scratch::new("line");
    let (mut line, _) = PseudoTerminal::open(BAUD).unwrap();
    line.link(&link.0).unwrap();
    let ended = dp(
        &["sniff", "--port", link.path(), "--baud", "1500000", "--duration", "0.3"],
        "",
    );
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert!(ended.out.contains("0 telegrams in 0.000 s"), "{}", ended.out);
}

// --- mistakes -----------------------------------------------------------------------------------------------------------------------------

#[test]
fn what_is_wrong_is_told_in_one_sentence() {
    let hint = "; `dp help` and `dp COMMAND --help` list what is allowed";
    assert_refused(
        &["sniff"],
        &[&format!(
            "the following required arguments were not provided: --port <PATH>{hint}"
        )],
    );
    assert_refused(
        &["sniff", "--port", "/dev/nowhere"],
        &["--baud RATE is needed with --port; `auto` tries all ten"],
    );
    assert_refused(
        &["sniff", "--port", "/dev/nowhere", "--baud", "9600"],
        &["there is no port /dev/nowhere"],
    );
    assert_refused(
        &["sniff", "--port", "/dev/nowhere", "--baud", "auto"],
        &[
            "listening on /dev/nowhere at each baud rate",
            "there is no port /dev/nowhere",
        ],
    );
    assert_refused(
        &["sniff", "--port", "pty:/tmp/x", "--baud", "9600"],
        &["a new pseudo-terminal has nobody to listen to, give the path of a serial device or tcp://host:port"],
    );
    assert_refused(
        &["sniff", "--port", "tcp://127.0.0.1:9", "--baud", "auto"],
        &["the baud rate of a serial-device server is set there and cannot be tried out, give it with --baud RATE"],
    );
    assert_refused(
        &["sniff", "--read", "/nonexistent/x"],
        &["/nonexistent/x: No such file or directory (os error 2)"],
    );
    let text = Scratch::with("text", "no capture at all");
    assert_refused(
        &["sniff", "--read", text.path()],
        &[&format!("{}: the file is no pcapng capture", text.path())],
    );
    let ended = dp(&["sniff", "--read", text.path(), "--service", "Diagnosis"], "");
    assert_eq!(ended.code, Some(2));
    assert!(
        ended.err.contains("allowed are Token, ") && ended.err.contains("Slave_Diag"),
        "{}",
        ended.err
    );
}

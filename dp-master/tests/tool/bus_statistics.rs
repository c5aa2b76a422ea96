//! `dp sniff` on a line made by hand, where every figure is known: 500 kbit/s, so that a bit takes 2 µs and a character 22 µs.

use dp_master::phy::{CaptureWriter, Direction, Trace};
use dp_master::time::{Baud, Duration, Instant};
use serde_json::{Value, json};

use crate::common::{Scratch, dp};

const BAUD: Baud = Baud::B500000;

/// SD1: no data. Source of the formats and function codes: IEC 61158-4-3.
fn sd1(da: u8, sa: u8, fc: u8) -> Vec<u8> {
    vec![0x10, da, sa, fc, da.wrapping_add(sa).wrapping_add(fc), 0x16]
}

/// SD2: with data.
fn sd2(da: u8, sa: u8, fc: u8, data: &[u8]) -> Vec<u8> {
    let length = u8::try_from(data.len() + 3).unwrap();
    let body = [&[da, sa, fc], data].concat();
    let sum = body.iter().fold(0_u8, |sum, octet| sum.wrapping_add(*octet));
    [&[0x68, length, length, 0x68], &body[..], &[sum, 0x16]].concat()
}

/// SD4.
fn token(da: u8, sa: u8) -> Vec<u8> {
    vec![0xDC, da, sa]
}

/// SRD of high priority with FCV = 1, and FCB.
const FCB_0: u8 = 0x5D;
const FCB_1: u8 = 0x7D;
/// The first one to a station: FCV = 0.
const FIRST: u8 = 0x6D;

/// Masters 1 and 2, slaves 3, 4 and 6; nobody at 5. Begin of each telegram in microseconds.
fn line() -> Vec<(u64, Vec<u8>)> {
    // Slave_Diag: DSAP 60, SSAP 62; the highest bit of the addresses says that access points follow.
    let diagnosis = || sd2(0x86, 0x82, FIRST, &[60, 62]);
    vec![
        (1_000, token(2, 1)),
        (1_200, sd2(3, 2, FCB_1, &[0x01])),
        // 11 bits after the request, which took 10 characters.
        (1_442, sd2(2, 3, 0x08, &[0xAA])),
        (1_800, sd2(4, 2, FCB_0, &[0x01])),
        // Nobody answered: the same frame count bit again, and now an acknowledgement after 20 bits.
        (2_400, sd2(4, 2, FCB_0, &[0x01])),
        (2_660, vec![0xE5]),
        (3_000, token(1, 2)),
        (4_000, token(2, 1)),
        (4_200, sd2(3, 2, FCB_0, &[0x01])),
        // Refused after 30 bits: RS, no service.
        (4_480, sd1(2, 3, 0x03)),
        // FDL_Status of an address where nobody is.
        (5_000, sd1(5, 2, 0x49)),
        // Twice a wrong check sum, and a telegram that ends after its start delimiter.
        (5_600, vec![0x10, 3, 2, 0x49, 0x00, 0x16]),
        (5_800, vec![0x10, 3, 2, 0x49, 0x00, 0x16]),
        (6_000, vec![0x68]),
        (7_000, token(1, 2)),
        (9_000, token(2, 1)),
        (9_200, sd2(3, 2, FCB_1, &[0x01])),
        (9_460, sd2(2, 3, 0x08, &[0xAA])),
        // Global_Control to all: SDN, DSAP 58, SSAP 62.
        (10_000, sd2(0xFF, 0x82, 0x46, &[58, 62, 0, 0])),
        (11_000, diagnosis()),
        (12_000, diagnosis()),
        (13_000, token(1, 2)),
        (14_000, token(2, 1)),
        // After a token it is a new one.
        (15_000, diagnosis()),
        (16_000, sd2(3, 2, FCB_0, &[0x01])),
        // Another one answers.
        (16_260, sd2(2, 4, 0x08, &[0xBB])),
        (17_000, sd2(4, 2, FCB_1, &[0x01])),
        (17_242, vec![0xE5]),
    ]
}

fn recorded() -> Scratch {
    let mut capture = CaptureWriter::new(Vec::new(), BAUD, Duration::ZERO).unwrap();
    for (micros, octets) in line() {
        let start = Instant::ZERO + Duration::from_micros(micros);
        let end = start + Duration::from_micros(22 * octets.len() as u64);
        // What master 2 asked was recorded by itself.
        let own = matches!(octets[..], [0x68, _, _, _, _, 0x02 | 0x82, ..]);
        let direction = if own { Direction::Sent } else { Direction::Received };
        capture.write(&Trace::of(start, end, direction, &octets)).unwrap();
    }
    let file = Scratch::new("by-hand.pcapng");
    std::fs::write(&file.0, capture.finish().unwrap()).unwrap();
    file
}

/// What the program says about the line.
fn sniffed(arguments: &[&str]) -> String {
    let file = recorded();
    let ended = dp(&[&["sniff", "--read", file.path()], arguments].concat(), "");
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""), "{arguments:?}");
    ended.out
}

/// Lines of JSON of one type.
fn records(arguments: &[&str], kind: &str) -> Vec<Value> {
    let told = sniffed(&[arguments, &["--json"]].concat());
    let records = told.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    records.filter(|record| record["type"] == kind).collect()
}

#[test]
fn every_figure_of_a_line_made_by_hand_is_right() {
    let mut reports = records(&["--quiet"], "statistics");
    let mut report = reports.pop().unwrap();
    assert_eq!(reports, [Value::Null; 0], "once");
    // 194 characters of 22 µs in 16 264 µs.
    let busy = report["busy_percent"].take().as_f64().unwrap();
    assert!((busy - 100.0 * 4_268.0 / 16_264.0).abs() < 1e-9, "{busy}");
    let station = |address: u8, kind, sent: u8, asked: u8| {
        json!({
            "address": address, "kind": kind, "sent": sent, "asked": asked, "unanswered": 0, "retries": 0, "negative": 0,
            "reply_bits": null, "cycle_ms": null,
        })
    };
    let with = |mut station: Value, fields: Value| {
        let fields = fields.as_object().unwrap().clone();
        station.as_object_mut().unwrap().extend(fields);
        station
    };
    assert_eq!(
        report,
        json!({
            "type": "statistics",
            "baud": 500_000,
            "seconds": 0.016_264,
            "telegrams": 25,
            "busy_percent": null,
            "discarded": {"check sum": 2, "truncated": 1},
            "retries": 2,
            // To 4, three times to 6, and to 3, where another one answered.
            "unanswered": 5,
            "services": [
                {"service": "Token", "requests": 7, "replies": 0},
                {"service": "FDL_Status", "requests": 1, "replies": 0},
                {"service": "Data_Exchange", "requests": 7, "replies": 5},
                {"service": "Global_Control", "requests": 1, "replies": 0},
                {"service": "Slave_Diag", "requests": 3, "replies": 0},
            ],
            "stations": [
                station(1, "master", 4, 0),
                // Three tokens and twelve requests.
                station(2, "master", 15, 0),
                // 11, 30 and 20 bits; 3, 5 and 6.8 ms. Means of whole nanoseconds, and of those whole bits.
                with(station(3, "slave", 3, 4), json!({
                    "unanswered": 1, "negative": 1, "reply_bits": [11.0, 20.0, 30.0], "cycle_ms": [3.0, 4.933_333, 6.8],
                })),
                // The repetition is no cycle of its own: 17.0 − 1.8 ms.
                with(station(4, "slave", 3, 3), json!({
                    "unanswered": 1, "retries": 1, "reply_bits": [11.0, 15.0, 20.0], "cycle_ms": [15.2, 15.2, 15.2],
                })),
                with(station(6, "slave", 0, 3), json!({"unanswered": 3, "retries": 1})),
            ],
            // At 3, 7 and 13 ms; at 1, 4, 9 and 14 ms.
            "token_rotation_ms": {"1": [4.0, 5.0, 6.0], "2": [3.0, 4.333_333, 5.0]},
        })
    );
}

#[test]
fn the_same_figures_stand_in_the_text() {
    let told = sniffed(&["--quiet"]);
    let words: Vec<Vec<&str>> = told.lines().map(|line| line.split_whitespace().collect()).collect();
    let lines: Vec<String> = words.into_iter().map(|words| words.join(" ")).collect();
    assert_eq!(
        lines,
        [
            "25 telegrams in 0.016 s at 500000 bit/s, the line was busy 26.2 % of the time",
            "2 retries, 5 unanswered, 3 times octets that are no telegram: 2 check sum, 1 truncated",
            "",
            "service requests replies",
            "Token 7",
            "FDL_Status 1 0",
            "Data_Exchange 7 5",
            "Global_Control 1",
            "Slave_Diag 3 0",
            "",
            "station sent asked unanswered retries refused reply tBIT cycle ms",
            "1 master 4 0 0 0 0",
            "2 master 15 0 0 0 0",
            "3 slave 3 4 1 0 1 11 / 20 / 30 3.000 / 4.933 / 6.800",
            "4 slave 3 3 1 1 0 11 / 15 / 20 15.200 / 15.200 / 15.200",
            "6 slave 0 3 3 1 0",
            "",
            "token of 1: one rotation 4.000 / 5.000 / 6.000 ms",
            "token of 2: one rotation 3.000 / 4.333 / 5.000 ms",
            "",
            "spans are least / mean / most",
        ]
    );
}

#[test]
fn telegrams_are_shown_with_their_time_and_repetitions_marked() {
    let told = sniffed(&[]);
    let shown: Vec<&str> = told.lines().take_while(|line| !line.is_empty()).collect();
    assert_eq!(shown.len(), 28);
    // The time counts from the first telegram.
    assert!(shown[0].starts_with("    0.000000  1 → 2  token"), "{}", shown[0]);
    assert!(shown[27].starts_with("    0.016242  "), "{}", shown[27]);
    let retries: Vec<&str> = shown
        .iter()
        .filter(|line| line.ends_with("  (retry)"))
        .map(|line| line[..12].trim_start())
        .collect();
    assert_eq!(retries, ["0.001400", "0.011000"]);
    let discarded: Vec<&&str> = shown.iter().filter(|line| line.contains("  no telegram: ")).collect();
    assert_eq!(discarded.len(), 3);
    assert!(discarded[0].ends_with("  10 03 02 49 00 16"), "{}", discarded[0]);
}

#[test]
fn a_telegram_has_its_fields_as_json() {
    let shown = records(&[], "telegram");
    let mut request = shown[1].clone();
    request["text"].take();
    assert_eq!(
        request,
        json!({
            "type": "telegram", "time_s": 0.000_2, "direction": "sent", "format": "SD2", "service": "Data_Exchange", "sa": 2, "da": 3,
            "fc": "7D", "role": "request", "data": "01", "text": null, "octets": "68 04 04 68 03 02 7D 01 83 16",
        })
    );
    assert_eq!(shown[2]["role"], "response");
    assert_eq!(shown[2].get("direction"), None, "it came from the line");
    let diagnosis = shown.iter().find(|record| record["service"] == "Slave_Diag").unwrap();
    assert_eq!((&diagnosis["dsap"], &diagnosis["ssap"]), (&json!(60), &json!(62)));
    let formats: Vec<&str> = [0, 5, 9]
        .map(|place: usize| shown[place]["format"].as_str().unwrap())
        .into();
    assert_eq!(formats, ["SD4", "SC", "SD1"]);
    let discarded = records(&[], "discarded");
    assert_eq!(discarded.len(), 3);
    assert_eq!(discarded[2]["octets"], "68");
}

#[test]
fn filters_choose_what_is_shown_and_not_what_is_counted() {
    for (arguments, shown, discarded) in [
        (&["--no-tokens"][..], 18, 3),
        // Three requests to it and what it said in another's place; a short acknowledgement names nobody.
        (&["--station", "4"], 4, 0),
        (&["--station", "1"], 7, 0),
        (&["--station", "5", "--station", "6"], 4, 0),
        (&["--service", "Slave_Diag"], 3, 0),
        (&["--service", "short_ack", "--service", "Token"], 9, 0),
        (&["--service", "Token", "--station", "5"], 0, 0),
        (&["--quiet"], 0, 0),
    ] {
        assert_eq!(records(arguments, "telegram").len(), shown, "{arguments:?}");
        assert_eq!(records(arguments, "discarded").len(), discarded, "{arguments:?}");
        assert_eq!(records(arguments, "statistics")[0]["telegrams"], 25, "{arguments:?}");
    }
}

#[test]
fn it_ends_after_as_many_telegrams_as_were_wanted() {
    let report = &records(&["--quiet", "--count", "5"], "statistics")[0];
    assert_eq!(report["telegrams"], 5);
    // The repetition waits for its answer no more.
    assert_eq!((&report["retries"], &report["unanswered"]), (&json!(1), &json!(2)));
}

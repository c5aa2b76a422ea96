//! `dp decode`.

#![cfg(feature = "tool")]

use crate::common::{Scratch, assert_refused, dp};

/// A start-up as the film-feed specification (section 2) and the 9300 facts (1.5) describe it: octets and what they mean.
const START_UP: &str = "\
DC 02 02                                            # token of a master alone
68 05 05 68 83 82 6D 3C 3E EC 16                    # Slave_Diag, first
68 0F 0F 68 83 82 5D 3D 3E 88 05 01 0B 00 DA 00 C0 00 00 10 16
E5
10 03 02 49 4E 16
";

#[test]
fn telegrams_from_standard_input_are_explained_one_a_line() {
    let ended = dp(&["decode"], START_UP);
    assert_eq!(
        ended.out,
        "2 → 2  token\n\
         2 → 3  SRD high first  Slave_Diag\n\
         2 → 3  SRD high FCB=0  Set_Prm  lock WD 50 ms min Tsdr 11 ident 00DA group 00 user C0 00 00\n\
         short acknowledgement\n\
         2 → 3  FDL_Status request\n"
    );
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""));
}

#[test]
fn octets_may_be_written_in_any_usual_way() {
    for words in [
        &["10", "03", "02", "49", "4E", "16"][..],
        &["100302494e16"],
        &["0x10,0x03,0x02,0x49,0x4E,0x16"],
        &["10:03:02:49:4E:16"],
        &["10-03-02-49-4E-16"],
    ] {
        let arguments: Vec<&str> = ["decode"].iter().chain(words).copied().collect();
        let ended = dp(&arguments, "");
        assert_eq!(ended.out, "2 → 3  FDL_Status request\n", "{words:?}");
        assert_eq!(ended.code, Some(0), "{words:?}");
    }
}

#[test]
fn octets_that_are_no_telegram_are_shown_with_the_reason_and_fail() {
    let ended = dp(
        &[
            "decode", "10", "03", "02", "49", "4F", "16", "DC", "02", "02", "68", "05",
        ],
        "",
    );
    assert_eq!(
        ended.out,
        "no telegram: frame check sequence must be 0x4e, got 0x4f  10 03 02 49 4F 16\n\
         2 → 2  token\n\
         no telegram: telegram not complete when the line fell silent  68 05\n"
    );
    assert_eq!((ended.code, ended.err.as_str()), (Some(1), ""));
}

#[test]
fn verbose_gives_one_fact_a_line() {
    let ended = dp(&["decode", "--verbose", "10 03 02 49 4E 16"], "");
    assert_eq!(
        ended.out,
        "SD1, 6 octets\n  destination  3\n  source       2\n  function     49 FDL status\n  service      FDL_Status\n"
    );
}

#[test]
fn json_gives_one_object_for_each_telegram() {
    let ended = dp(&["decode", "--json"], START_UP);
    let objects: Vec<serde_json::Value> = ended
        .out
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(objects.len(), 5);
    let prm = &objects[2];
    for (key, value) in [
        ("type", "telegram"),
        ("format", "SD2"),
        ("service", "Set_Prm"),
        ("fc", "5D"),
        ("role", "request"),
    ] {
        assert_eq!(prm[key], value, "{prm}");
    }
    assert_eq!((&prm["da"], &prm["sa"]), (&3.into(), &2.into()));
    assert_eq!((&prm["dsap"], &prm["ssap"]), (&61.into(), &62.into()));
    assert_eq!(prm["data"], "88 05 01 0B 00 DA 00 C0 00 00");
    let broken = dp(&["decode", "--json", "68 05"], "");
    assert_eq!(
        broken.out,
        "{\"type\":\"discarded\",\"text\":\"telegram not complete when the line fell silent\",\"octets\":\"68 05\"}\n"
    );
}

#[test]
fn a_file_is_read_and_a_mistake_in_it_is_told_with_its_line() {
    let good = Scratch::with("good.txt", START_UP);
    assert_eq!(dp(&["decode", "--file", good.path()], "").out.lines().count(), 5);
    let bad = Scratch::with("bad.txt", "DC 02 02\n10 03 0Z 49\n");
    let sentence = format!(
        "{}:2: `0Z` is no row of octets, pairs of hexadecimal digits are needed such as 10 03 or 1003",
        bad.path()
    );
    assert_refused(&["decode", "--file", bad.path()], &[&sentence]);
    let capture = Scratch::new("capture.pcapng");
    std::fs::write(&capture.0, [0x0A, 0x0D, 0x0D, 0x0A, 0]).unwrap();
    let sentence = format!(
        "{0} is a capture and no text, use `dp sniff --read {0}`",
        capture.path()
    );
    assert_refused(&["decode", "--file", capture.path()], &[&sentence]);
    let binary = Scratch::new("binary");
    std::fs::write(&binary.0, [0xFF, 0xFE]).unwrap();
    let sentence = format!("{} is no text, hexadecimal is needed", binary.path());
    assert_refused(&["decode", "--file", binary.path()], &[&sentence]);
    assert_refused(
        &["decode", "--file", "/nonexistent/x"],
        &["/nonexistent/x cannot be read: No such file or directory (os error 2)"],
    );
}

#[test]
fn what_cannot_be_octets_is_told_in_one_sentence() {
    assert_refused(
        &["decode"],
        &["there are no octets, give them in hexadecimal such as 10 03 02 49 4E 16"],
    );
    for word in ["123", "1G", "ü0"] {
        let sentence =
            format!("`{word}` is no row of octets, pairs of hexadecimal digits are needed such as 10 03 or 1003");
        assert_refused(&["decode", "10", word], &[&sentence]);
    }
    let ended = dp(&["decode"], "10\n0x1\n");
    assert_eq!(
        ended.err,
        "dp: line 2: `0x1` is no row of octets, pairs of hexadecimal digits are needed such as 10 03 or 1003\n"
    );
    assert_refused(
        &[],
        &["a command is needed, such as `dp decode 10 03 02 49 4E 16`; `dp --help` lists them"],
    );
    assert_refused(
        &["decode", "--jason"],
        &["unexpected argument '--jason' found; `dp help` and `dp COMMAND --help` list what is allowed"],
    );
}

//! `dp list`, `dp diag`, `dp get-cfg`, `dp read-inputs`, `dp read-outputs`, `dp set-address`, against a slave on a pseudo-terminal.

#![cfg(all(feature = "tool", unix))]

use crate::common::slave::RunningSlave;
use crate::common::{Scratch, assert_refused, dp};

/// A GSD file for the slave; the texts are for what it reports.
const GSD: &str = "#Profibus_DP\nGSD_Revision = 1\nVendor_Name = \"Smith & Sons\"\nModel_Name = \"Lamp\"\nRevision = \"1\"\n\
    Ident_Number = 0x0BAD\nProtocol_Ident = 0\nStation_Type = 0\nHardware_Release = \"1\"\nSoftware_Release = \"1\"\n\
    1.5M_supp = 1\nMaxTsdr_1.5M = 150\nMin_Slave_Intervall = 1\nUnit_Diag_Bit(9) = \"fuse blown\"\nModule = \"2 in 2 out\" 0x31\nEndModule\n";

/// Device-related block with bit 9 set: header, two octets.
const FUSE_BLOWN: &[u8] = &[0x03, 0x00, 0x02];

#[test]
fn the_list_has_every_station_with_its_type_ident_owner_and_name() {
    let slave = RunningSlave::start(3, &[]);
    let gsd = Scratch::with("lamp.gsd", GSD);
    let arguments = ["list", "--port", slave.link.path(), "--to", "8", "--gsd", gsd.path()];
    let ended = dp(&arguments, "");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert_eq!(
        ended.out,
        "address  station          ident  master   status\n\
        \x20     0  master in ring                   this program\n\
        \x20     3  slave            0BAD   none     [Station_Not_Ready Prm_Req]  Lamp\n"
    );
    let json = dp(&["list", "--port", slave.link.path(), "--to", "8", "--json"], "");
    let found: Vec<serde_json::Value> = json
        .out
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(found.len(), 2, "{}{}", json.out, json.err);
    assert_eq!(found[1]["address"], 3);
    assert_eq!(found[1]["station"], "slave");
    assert_eq!(found[1]["ident"], "0BAD");
}

#[test]
fn a_line_where_nobody_answers_fails_with_what_to_look_at() {
    let slave = RunningSlave::start(9, &[]);
    let ended = dp(
        &["list", "--port", slave.link.path(), "--to", "4", "--latency", "5"],
        "",
    );
    assert_eq!(ended.code, Some(1), "{}", ended.out);
    assert_eq!(
        ended.err,
        "dp: nobody else answers; are baud rate, polarity of A and B, and terminators right?\n"
    );
}

#[test]
fn a_diagnosis_is_told_in_the_words_of_the_standard_and_of_the_maker() {
    let slave = RunningSlave::start(3, FUSE_BLOWN);
    let gsd = Scratch::with("lamp.gsd", GSD);
    let arguments = [
        "diag",
        "--port",
        slave.link.path(),
        "--address",
        "3",
        "--gsd",
        gsd.path(),
    ];
    let ended = dp(&arguments, "");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert_eq!(
        ended.out,
        "station 3, ident number 0BAD\n\
         no master has parametrised it\n\
        \x20 Station_Not_Ready        not ready to exchange data\n\
        \x20 Ext_Diag                 the extended diagnosis reports a fault\n\
        \x20 Prm_Req                  waits for parameters\n\
         extended diagnosis 03 00 02\n\
        \x20 device: 00 02\n\
        \x20 \"fuse blown\"\n"
    );
    let json = dp(
        &[
            "diag",
            "--port",
            slave.link.path(),
            "--address",
            "3",
            "--gsd",
            gsd.path(),
            "--json",
        ],
        "",
    );
    let report: serde_json::Value = serde_json::from_str(&json.out).unwrap();
    assert_eq!(report["texts"][0]["text"], "fuse blown");
    assert_eq!(
        report["status"],
        serde_json::json!(["Station_Not_Ready", "Ext_Diag", "Prm_Req"])
    );
}

#[test]
fn a_gsd_file_of_another_device_is_noticed() {
    let slave = RunningSlave::start(3, &[]);
    let gsd = Scratch::with("other.gsd", &GSD.replace("0x0BAD", "0x1234"));
    let ended = dp(
        &[
            "diag",
            "--port",
            slave.link.path(),
            "--address",
            "3",
            "--gsd",
            gsd.path(),
        ],
        "",
    );
    assert_eq!(ended.code, Some(0));
    assert_eq!(
        ended.err,
        "dp: the GSD file is for ident number 1234, the slave has 0BAD: texts may be wrong\n"
    );
}

#[test]
fn the_configuration_is_read_from_a_slave_that_nobody_owns() {
    let slave = RunningSlave::start(3, &[]);
    let ended = dp(&["get-cfg", "--port", slave.link.path(), "--address", "3"], "");
    assert_eq!(
        ended.out, "station 3: 31\n    0  31 = 2 octets in+out\n2 octets of inputs, 2 octets of outputs\n",
        "{}",
        ended.err
    );
    assert_eq!(ended.code, Some(0));
}

#[test]
fn images_are_refused_outside_data_exchange_and_absent_stations_are_told() {
    let slave = RunningSlave::start(3, &[]);
    for command in ["read-inputs", "read-outputs"] {
        let ended = dp(&[command, "--port", slave.link.path(), "--address", "3"], "");
        assert_eq!((ended.code, ended.out.as_str()), (Some(1), ""), "{command}");
        assert_eq!(
            ended.err, "dp: station 3: the station refused: RS, no such service or access point now\n",
            "{command}"
        );
    }
    for command in ["diag", "get-cfg", "read-inputs"] {
        let ended = dp(
            &[command, "--port", slave.link.path(), "--address", "4", "--latency", "5"],
            "",
        );
        assert_eq!(
            (ended.code, ended.err.as_str()),
            (Some(1), "dp: station 4 does not answer\n"),
            "{command}"
        );
    }
}

#[test]
fn an_address_is_changed_and_looked_at_afterwards() {
    let slave = RunningSlave::start(126, &[]);
    let ended = dp(
        &[
            "set-address",
            "--port",
            slave.link.path(),
            "--from",
            "126",
            "--to",
            "12",
            "--latency",
            "20",
        ],
        "",
    );
    assert_eq!(
        ended.out, "station 126 is station 12 now, ident number 0BAD\n",
        "{}",
        ended.err
    );
    assert_eq!(ended.code, Some(0));
    assert_eq!(slave.stop().address().value(), 12);
}

#[test]
fn an_address_that_is_taken_or_refused_leaves_everything_as_it_was() {
    let slave = RunningSlave::start(5, &[]);
    let line = slave.link.path().to_owned();
    let taken = dp(
        &[
            "set-address",
            "--port",
            &line,
            "--from",
            "4",
            "--to",
            "5",
            "--latency",
            "20",
        ],
        "",
    );
    assert_eq!(taken.code, Some(1));
    assert_eq!(taken.err, "dp: address 5 is taken by a slave, nothing was changed\n");
    let refused = dp(
        &[
            "set-address",
            "--port",
            &line,
            "--from",
            "5",
            "--to",
            "6",
            "--ident",
            "0x1234",
            "--latency",
            "20",
        ],
        "",
    );
    assert_eq!(refused.code, Some(1));
    assert!(
        refused
            .err
            .starts_with("dp: nobody answers at address 6: station 5 keeps its address"),
        "{}",
        refused.err
    );
    assert_refused(
        &["set-address", "--port", &line, "--from", "5", "--to", "126"],
        &["--to must be 0…125: 126 is for slaves that wait for an address"],
    );
    assert_eq!(slave.stop().address().value(), 5);
}

#[test]
fn what_is_wrong_in_arguments_is_told_in_one_sentence() {
    let hint = "; `dp help` and `dp COMMAND --help` list what is allowed";
    for (arguments, sentence) in [
        (
            &["diag", "--port", "/dev/nowhere"][..],
            "the following required arguments were not provided: --address <N>",
        ),
        (
            &["list"],
            "the following required arguments were not provided: --port <PATH>",
        ),
        (
            &["diag", "--port", "x", "--address", "127"],
            "invalid value '127' for '--address <N>': allowed is an address 0…126",
        ),
        (
            &["list", "--port", "tcp://x"],
            "invalid value 'tcp://x' for '--port <PATH>': tcp://x is no server, tcp://host:port with a port of 1…65535 is needed",
        ),
        (
            &["list", "--port", "x", "--rs485", "dtr"],
            "invalid value 'dtr' for '--rs485 <HOW>': allowed are adapter, rts and kernel, the latter two as rts-inverted and \
             kernel-inverted too, with delays of 0…100 ms as in rts:1:1",
        ),
    ] {
        assert_refused(arguments, &[&format!("{sentence}{hint}")]);
    }
    assert_refused(&["list", "--port", "/dev/nowhere"], &["there is no port /dev/nowhere"]);
    assert_refused(&["list", "--port", "/dev/null"], &["/dev/null is no serial port"]);
    let text = Scratch::with("text", "hello");
    assert_refused(
        &["list", "--port", "/dev/nowhere", "--gsd", text.path()],
        &[&format!(
            "{} is no GSD file: it names neither vendor nor model nor ident number",
            text.path()
        )],
    );
}

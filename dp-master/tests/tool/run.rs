//! `dp run`, against a slave on a pseudo-terminal.

#![cfg(all(feature = "tool", unix))]

use std::io::Write;

use dp_master::phy::{CaptureReader, Content, Direction};
use dp_master::time::Baud;
use dp_master::wire::{Service, Telegram};

use crate::common::slave::RunningSlave;
use crate::common::{Scratch, assert_refused, dp, end, start};

/// A file for the slave of these tests; HSA low, so that a lone master looks for others quickly.
fn config(slave: &RunningSlave, more: &str) -> Scratch {
    Scratch::with(
        "run.toml",
        &format!(
            "port = \"{}\"\nbaud = 1500000\naddress = 2\nhsa = 4\ncycle_ms = 2.0\n{more}\n[[slave]]\nname = \"lamp\"\naddress = 3\n\
             ident = 0x0BAD\nidentifiers = \"31\"\nwatchdog_ms = 500\noutputs = \"12 34\"\n",
            slave.link.path()
        ),
    )
}

fn objects(out: &str) -> Vec<serde_json::Value> {
    out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn a_master_exchanges_data_and_tells_it_once_a_second() {
    let slave = RunningSlave::start(3, &[]);
    let config = config(&slave, "");
    let ended = dp(&["run", config.path(), "--json", "--duration", "3"], "");
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""), "{}", ended.out);
    let told = objects(&ended.out);
    assert!(
        told.iter().any(|object| object["text"] == "lamp (3) exchanges data"),
        "{}",
        ended.out
    );
    let exchanging = told
        .iter()
        .rfind(|object| object["slaves"][0]["exchanging"] == true)
        .unwrap();
    let lamp = &exchanging["slaves"][0];
    // The slave answers with the complement of its outputs.
    assert_eq!(
        (&lamp["outputs"], &lamp["inputs"]),
        (&"12 34".into(), &"ED CB".into()),
        "{lamp}"
    );
    assert_eq!(lamp["state"], "Data_Exchange");
    assert_eq!(
        (&exchanging["mode"], &exchanging["ring"]),
        (&"operate".into(), &serde_json::json!([2]))
    );
    assert_eq!(told.last().unwrap()["mode"], "stop");
    let statuses = told.iter().filter(|object| object["type"] == "status").count();
    assert!(
        (3..=6).contains(&statuses),
        "{statuses} in three seconds, and one at the end"
    );
}

#[test]
fn outputs_and_modes_are_set_by_typing_and_the_end_is_in_good_order() {
    let slave = RunningSlave::start(3, &[]);
    let config = config(&slave, "mode = \"clear\"");
    let capture = Scratch::new("run.pcapng");
    let mut child = start(&["run", config.path(), "--capture", capture.path()]);
    let mut typed = child.stdin.take().unwrap();
    // What is typed early waits for its turn; between the lines the slave gets some cycles.
    std::thread::sleep(std::time::Duration::from_millis(1500));
    for line in [
        "set lamp 1 0x77",
        "set lamp 2 1",
        "set lump 0 1",
        "dance",
        "operate",
        "show",
    ] {
        writeln!(typed, "{line}").unwrap();
        std::thread::sleep(std::time::Duration::from_millis(300));
    }
    writeln!(typed, "quit").unwrap();
    drop(typed);
    let ended = end(child);
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""), "{}", ended.out);
    for part in [
        "`lamp` has 2 octets of outputs, 2 and 1 more do not fit\n",
        "there is no slave `lump`, there are lamp\n",
        "`dance` is no command, allowed are set SLAVE OCTET VALUE…, stop, clear, operate, sync, unsync, freeze, unfreeze, show, quit\n",
        "    in   ED 88\n    out  12 77\n",
    ] {
        assert!(ended.out.contains(part), "{part}\n{}", ended.out);
    }

    // On the line: zeros in Clear, the outputs in Operate, zeros again, and Clear_Data before the end.
    let mut outputs = Vec::new();
    let mut controls = Vec::new();
    for packet in CaptureReader::new(std::fs::File::open(&capture.0).unwrap()).unwrap() {
        let packet = packet.unwrap();
        let trace = packet.trace(Baud::B1500000);
        let Content::Telegram(telegram @ Telegram::Data { header, data }) = trace.content else {
            continue;
        };
        match (Service::of(&telegram), trace.direction) {
            (Service::DataExchange, Direction::Sent)
                if header.fc.is_request() && outputs.last() != Some(&data.to_vec()) =>
            {
                outputs.push(data.to_vec());
            }
            (Service::GlobalControl, Direction::Sent) => controls.push(data.first().copied().unwrap()),
            _ => {}
        }
    }
    assert_eq!(outputs, [vec![0, 0], vec![0x12, 0x77], vec![0, 0]]);
    // Clear_Data is bit 1 (IEC 61158-6-3, Global_Control).
    assert_eq!(controls.first(), Some(&0x02));
    assert_eq!(controls.last(), Some(&0x02));
    assert!(controls.contains(&0x00), "{controls:?}");
    assert_eq!(slave.stop().outputs(), [0, 0]);
}

#[test]
fn ctrl_c_ends_in_good_order_too() {
    let slave = RunningSlave::start(3, &[]);
    let config = config(&slave, "");
    let child = start(&["run", config.path()]);
    std::thread::sleep(std::time::Duration::from_millis(2500));
    let status = std::process::Command::new("sh")
        .args(["-c", &format!("kill -INT {}", child.id())])
        .status()
        .unwrap();
    assert!(status.success());
    let ended = end(child);
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""), "{}", ended.out);
    assert!(
        ended.out.contains("  clear\n") && ended.out.contains("  stop\n"),
        "{}",
        ended.out
    );
    assert_eq!(slave.stop().outputs(), [0, 0]);
}

#[test]
fn a_slave_that_never_exchanges_fails_with_its_reason() {
    let slave = RunningSlave::start(3, &[]);
    let wrong = Scratch::with(
        "wrong.toml",
        &std::fs::read_to_string(&config(&slave, "").0)
            .unwrap()
            .replace("0x0BAD", "0x1234"),
    );
    let ended = dp(&["run", wrong.path(), "--duration", "2"], "");
    assert_eq!(ended.code, Some(1), "{}", ended.out);
    assert!(
        ended
            .err
            .starts_with("dp: slave lamp at address 3 never exchanged data: lamp (3) refuses the parameters [")
            && ended.err.contains("its ident number is 0BAD"),
        "{}",
        ended.err
    );
}

#[test]
fn a_slave_may_come_from_its_gsd_file() {
    let slave = RunningSlave::start(3, &[]);
    let gsd = Scratch::with(
        "lamp.gsd",
        "#Profibus_DP\nGSD_Revision = 1\nVendor_Name = \"V\"\nModel_Name = \"Lamp\"\nRevision = \"1\"\nIdent_Number = 0x0BAD\n\
         Protocol_Ident = 0\nStation_Type = 0\nHardware_Release = \"1\"\nSoftware_Release = \"1\"\n1.5M_supp = 1\n\
         MaxTsdr_1.5M = 150\nMin_Slave_Intervall = 1\nSlave_Family = 0\nMax_Diag_Data_Len = 6\nModule = \"2 in 2 out\" 0x31\nEndModule\n",
    );
    let config = Scratch::with(
        "gsd.toml",
        &format!(
            "port = \"{}\"\nbaud = 1500000\naddress = 2\nhsa = 4\n[[slave]]\naddress = 3\ngsd = \"{}\"\n",
            slave.link.path(),
            gsd.0.file_name().unwrap().to_str().unwrap()
        ),
    );
    let ended = dp(&["run", config.path(), "--duration", "2"], "");
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""), "{}", ended.out);
    assert!(ended.out.contains("3 (3) exchanges data"), "{}", ended.out);

    // A file with a mistake that does not matter here is told and used.
    let content = std::fs::read_to_string(&gsd.0)
        .unwrap()
        .replace("Max_Diag_Data_Len = 6\n", "");
    std::fs::write(&gsd.0, content).unwrap();
    let ended = dp(&["run", config.path(), "--duration", "2"], "");
    assert_eq!(ended.code, Some(0), "{}", ended.out);
    assert!(
        ended.err.starts_with(&format!("dp: {}: error in line ", gsd.path())) && ended.err.lines().count() == 1,
        "{}",
        ended.err
    );
}

#[test]
fn every_mistake_in_a_file_is_told_with_its_line_and_what_is_allowed() {
    let file = Scratch::with(
        "wrong.toml",
        "port = \"udp://x:1\"\nbaud = 1500000\naddress = 2\nmode = \"run\"\n[[slave]]\nname = \"a b\"\naddress = 2\nident = 1\n\
         identifiers = \"3\"\n[[slave]]\naddress = 4\nident = 0x10000\nidentifiers = \"31\"\noutputs = \"00\"\n[[slave]]\naddress = 5\n\
         gsd = \"none.gsd\"\nident = 3\n",
    );
    let line = |number: usize, sentence: &str| format!("{}:{number}: {sentence}", file.path());
    assert_refused(
        &["run", file.path()],
        &[
            &line(
                1,
                "`port` is \"udp://x:1\", udp://x:1 is no port, allowed are a path such as /dev/ttyUSB0, tcp://host:port and pty:LINK",
            ),
            &line(4, "`mode` is \"run\", allowed is \"stop\", \"clear\" or \"operate\""),
            &line(6, "`name` is \"a b\", a name is a text without spaces"),
            &line(
                9,
                "`identifiers` is \"3\", allowed are octets such as \"F3 0A\" or [0xF3, 10]",
            ),
            &line(12, "`ident` is 0x10000, allowed is a whole number 0…65535"),
            &line(
                17,
                "`gsd` is \"none.gsd\", which cannot be read: No such file or directory (os error 2)",
            ),
            &line(18, "`ident` comes from the GSD file, leave one of them out"),
        ],
    );
    let twice = Scratch::with(
        "twice.toml",
        "baud = 1500000\naddress = 2\n[[slave]]\nname = \"a\"\naddress = 2\nident = 1\nidentifiers = \"31\"\n\
         [[slave]]\nname = \"a\"\naddress = 2\nident = 1\nidentifiers = \"31\"\noutputs = \"00\"\n",
    );
    let line = |number: usize, sentence: &str| format!("{}:{number}: {sentence}", twice.path());
    assert_refused(
        &["run", twice.path()],
        &[
            &line(5, "address 2 is our own, a slave needs another one"),
            &line(9, "there is a slave `a` already"),
            &line(10, "address 2 is our own, a slave needs another one"),
            &line(10, "address 2 is that of slave `a` already"),
            &line(13, "`outputs` has 1 octets, the slave has 2"),
        ],
    );
    let bare = Scratch::with("bare.toml", "baud = 1500000\naddress = 2\n");
    assert_refused(
        &["run", bare.path()],
        &[&format!("{}:1: the file needs `slave`", bare.path())],
    );
    let portless = Scratch::with(
        "portless.toml",
        "baud = 1500000\naddress = 2\n[[slave]]\naddress = 3\nident = 1\nidentifiers = \"31\"\n",
    );
    assert_refused(
        &["run", portless.path()],
        &[&format!(
            "{} names no port, write port = \"/dev/ttyUSB0\" or give --port PATH",
            portless.path()
        )],
    );
}

#[test]
fn the_example_in_the_documentation_is_read_without_a_mistake() {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/examples/run.toml");
    // Everything in it is right, so what is missing is the port that is named.
    assert_refused(
        &["run", example, "--port", "/dev/nowhere"],
        &["there is no port /dev/nowhere"],
    );
}

//! The Wireshark dissector reads what the capture writer wrote.
//!
//! Needs `tshark` with Lua. Without it the tests say that they were skipped and pass; with `REQUIRE_TSHARK=1` in the environment (as
//! `.ci/run` sets it) they fail instead.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, DpMaster, DpSlave, ExtDiag, MasterConfig, Mode, Overflow, SlaveConfig, SlaveIdentity,
};
use dp_master::fdl::BusParams;
use dp_master::phy::{CaptureWriter, Direction, PortId, Script, Tap, Trace, Tracer, VirtualBus, pump};
use dp_master::station::{LineError, Station};
use dp_master::time::{Baud, Duration, Instant};

const BAUD: Baud = Baud::B1500000;

/// Whether `tshark` with Lua is there; what to do without it is decided here.
fn tshark_is_there() -> bool {
    let version = Command::new("tshark").arg("--version").output();
    let reason = match version {
        Ok(output)
            if String::from_utf8_lossy(&output.stdout)
                .replace('\n', " ")
                .contains("with Lua") =>
        {
            return true;
        }
        Ok(_) => "tshark was built without Lua",
        Err(_) => "tshark is not installed",
    };
    assert!(
        std::env::var_os("REQUIRE_TSHARK").is_none(),
        "REQUIRE_TSHARK is set, but {reason}"
    );
    eprintln!("skipped: {reason}");
    false
}

/// A file that goes away with the test.
struct Capture(PathBuf);

impl Capture {
    fn new(name: &str, write: impl FnOnce(&mut CaptureWriter<std::fs::File>)) -> Self {
        let path = std::env::temp_dir().join(format!("dp-master-{}-{name}.pcapng", std::process::id()));
        let file = std::fs::File::create(&path).unwrap();
        let mut writer = CaptureWriter::new(file, BAUD, Duration::ZERO).unwrap();
        write(&mut writer);
        writer.finish().unwrap();
        Self(path)
    }
}

impl Drop for Capture {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

type Packet = HashMap<&'static str, String>;

/// The named fields of every packet. A field that occurs several times has its values separated by commas; one that is missing is empty.
fn dissect(capture: &Capture, fields: &[&'static str]) -> Vec<Packet> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("wireshark/profibus.lua");
    let mut tshark = Command::new("tshark");
    tshark.arg("-X").arg(format!("lua_script:{}", script.display()));
    tshark.args(["-o", &format!("profibus.baud:{}", BAUD.bits_per_second())]);
    // Two passes: in the first one a request does not know its answer yet.
    tshark.arg("-2").arg("-r").arg(&capture.0);
    tshark.args(["-T", "fields", "-E", "separator=|"]);
    for field in fields {
        tshark.args(["-e", field]);
    }
    let output = tshark.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !errors.contains("Lua"), "{errors}");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(!text.contains("Lua Error"), "{text}");
    text.lines()
        .map(|line| fields.iter().copied().zip(line.split('|').map(str::to_owned)).collect())
        .collect()
}

/// Start-up, exchange of data, a diagnosis and three disturbances of a master and a slave.
fn record_a_run(file: &mut CaptureWriter<std::fs::File>) {
    let (plc, drive) = (Address::new(2).unwrap(), Address::new(3).unwrap());
    let mut master = DpMaster::<1>::new(MasterConfig::new(plc, BusParams::standard(BAUD))).unwrap();
    let axis = master
        .add_slave(SlaveConfig::new(drive, 0x00DA, &[0xF3, 0xF3]).unwrap())
        .unwrap();
    master.set_outputs(axis, &[0x11; 16]).unwrap();
    master.set_mode(Mode::Operate);
    let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF3]]);
    let mut slave = DpSlave::new(SlaveIdentity::new(drive, 0x00DA, BAUD, accepted)).unwrap();
    slave.set_inputs(&[0x22; 16]);

    let mut bus = VirtualBus::new(BAUD);
    let ports = [bus.attach(), bus.attach(), bus.attach()];
    let mut tap = Tap::new(BAUD, |trace: Trace<'_>| file.write(&trace).unwrap());
    let mut now = Instant::ZERO;
    let mut steps = 0;
    while master.exchanges(axis) < 12 {
        let exchanges = master.exchanges(axis);
        if exchanges > steps {
            steps = exchanges;
            // The next telegram is the token, then come a request and its answer.
            let burst = bus.bursts();
            // Two bits of a data octet, which keeps the parity.
            let flip = |burst| Script::Flip {
                burst,
                character: 9,
                bits: 0b000_0000_0110,
            };
            match exchanges {
                3 => slave
                    .set_ext_diag(ExtDiag::Fault, &[0x03, 0x32, 0x10], Overflow::Complete)
                    .unwrap(),
                7 => bus.script(flip(burst + 1)),
                8 => bus.script(flip(burst + 2)),
                10 => bus.script(Script::Spoil {
                    burst,
                    character: 0,
                    error: LineError::Parity,
                }),
                _ => {}
            }
        }
        let mut stations: [(PortId, &mut dyn Station); 3] =
            [(ports[0], &mut master), (ports[1], &mut slave), (ports[2], &mut tap)];
        now = pump(&mut bus, now, &mut stations).unwrap();
    }
    tap.finish();
}

const RUN_FIELDS: [&str; 24] = [
    "frame.number",
    "_ws.col.Protocol",
    "_ws.col.Info",
    "profibus.sd",
    "profibus.da",
    "profibus.sa",
    "profibus.fc",
    "profibus.dsap",
    "profibus.ssap",
    "profibus.service",
    "profibus.fcs.status",
    "profibus.request_in",
    "profibus.response_in",
    "profibus.response_time",
    "profibus.t_sdr",
    "profibus.retry_of",
    "profibus.token.rotation",
    "profibus.lost",
    "profibus_dp.diag.ext_diag",
    "profibus_dp.diag.prm_req",
    "profibus_dp.diag.block.data",
    "profibus_dp.ident",
    "profibus_dp.cfg.inputs",
    "profibus_dp.outputs",
];

#[test]
fn a_recorded_run_is_decoded() {
    if !tshark_is_there() {
        return;
    }
    let capture = Capture::new("run", record_a_run);
    let packets = dissect(&capture, &RUN_FIELDS);
    let of = |service: &str| -> Vec<&Packet> {
        packets
            .iter()
            .filter(|packet| packet["profibus.service"] == service)
            .collect()
    };
    // Everything the run consists of is there, with addresses, access points and function code.
    let token = of("Token")[0];
    assert_eq!(token["profibus.sd"], "0xdc");
    assert_eq!((&*token["profibus.da"], &*token["profibus.sa"]), ("2", "2"));
    assert!(
        of("Token")
            .iter()
            .any(|token| !token["profibus.token.rotation"].is_empty())
    );

    let [question, answer, ..] = of("Slave_Diag")[..] else {
        panic!("no Slave_Diag")
    };
    assert_eq!((&*question["profibus.dsap"], &*question["profibus.ssap"]), ("60", "62"));
    assert_eq!(question["profibus.fc"], "0x6d");
    assert_eq!(question["_ws.col.Protocol"], "PROFIBUS DP");
    assert_eq!(question["profibus.response_in"], answer["frame.number"]);
    assert_eq!(answer["profibus.request_in"], question["frame.number"]);
    assert_eq!(answer["profibus_dp.diag.prm_req"], "1");
    assert_eq!(answer["profibus_dp.ident"], "0x00da");
    // Eleven characters at 1.5 Mbit/s and 11 tBIT are 132 bits, 88 µs; the slave answers after its min Tsdr of 11 tBIT.
    let time: f64 = answer["profibus.response_time"].parse().unwrap();
    assert!((time - 88e-6).abs() < 2e-9, "{time}");
    let t_sdr: f64 = answer["profibus.t_sdr"].parse().unwrap();
    assert!((t_sdr - 11.0).abs() < 0.01, "{t_sdr}");
    assert!(answer["_ws.col.Info"].contains("[Station_Not_Ready Prm_Req] master none ident 00DA"));

    let set_prm = of("Set_Prm")[0];
    assert_eq!(set_prm["profibus.dsap"], "61");
    let chk_cfg = of("Chk_Cfg")[0];
    assert_eq!(chk_cfg["profibus_dp.cfg.inputs"], "16");
    assert!(
        chk_cfg["_ws.col.Info"].ends_with("F3 = 4 words in+out whole, F3 = 4 words in+out whole"),
        "{}",
        chk_cfg["_ws.col.Info"]
    );
    assert!(!of("Short_Ack").is_empty());
    assert_eq!(of("Global_Control")[0]["profibus.da"], "127");

    let exchange = of("Data_Exchange");
    let outputs = exchange
        .iter()
        .find(|packet| !packet["profibus_dp.outputs"].is_empty())
        .unwrap();
    assert_eq!(outputs["profibus_dp.outputs"], "11".repeat(16));
    let fault = of("Slave_Diag")
        .into_iter()
        .find(|packet| packet["profibus_dp.diag.ext_diag"] == "1")
        .unwrap();
    assert_eq!(fault["profibus_dp.diag.block.data"], "3210");

    // A request and an answer with two flipped bits: the frame check sequence shows it, and after the answer the request comes again.
    let wrong: Vec<_> = packets
        .iter()
        .filter(|packet| packet["profibus.fcs.status"] == "0")
        .collect();
    assert_eq!(wrong.len(), 2);
    assert!(
        wrong[0]["_ws.col.Info"].ends_with("[bad FCS]"),
        "{}",
        wrong[0]["_ws.col.Info"]
    );
    assert!(wrong.iter().all(|packet| packet["profibus_dp.outputs"].is_empty()));
    assert!(packets.iter().any(|packet| !packet["profibus.retry_of"].is_empty()));
    // The character lost at the end is counted, and what stood behind it is no telegram.
    assert!(packets.iter().any(|packet| packet["profibus.lost"] == "1"));
}

/// A telegram with data: SD2, or SD3 with exactly eight octets.
fn telegram(da: u8, sa: u8, fc: u8, data: &[u8]) -> Vec<u8> {
    let mut octets = match data.len() {
        0 => vec![0x10],
        8 => vec![0xA2],
        length => vec![0x68, length as u8 + 3, length as u8 + 3, 0x68],
    };
    let mut body = vec![da, sa, fc];
    body.extend(data);
    let sum = body.iter().fold(0_u8, |sum, octet| sum.wrapping_add(*octet));
    octets.extend(body);
    octets.extend([sum, 0x16]);
    octets
}

/// Dissects telegrams put together by hand, 1 ms apart.
fn dissect_octets(name: &str, telegrams: &[Vec<u8>], fields: &[&'static str]) -> Vec<Packet> {
    let capture = Capture::new(name, |file| {
        for (octets, millis) in telegrams.iter().zip(0..) {
            let start = Instant::ZERO + Duration::from_millis(millis);
            let end = start + BAUD.characters(octets.len());
            file.write(&Trace::of(start, end, Direction::Sent, octets)).unwrap();
        }
    });
    let packets = dissect(&capture, fields);
    assert_eq!(packets.len(), telegrams.len());
    packets
}

#[test]
fn the_other_services_of_dp_v0_are_decoded() {
    if !tshark_is_there() {
        return;
    }
    let telegrams = [
        // Set_Slave_Add to address 9, ident 00DA, never again.
        telegram(0x83, 0x82, 0x6D, &[55, 62, 9, 0x00, 0xDA, 0xFF]),
        vec![0xE5],
        // Get_Cfg and its answer in the special format: one word out whole, two octets in, one octet of the manufacturer.
        telegram(0x83, 0x82, 0x5D, &[59, 62]),
        telegram(0x82, 0x83, 0x08, &[62, 59, 0xC1, 0xC0, 0x01, 0x77]),
        // Slave_Diag: identifier block with module 2, channel block of module 1 (input 3, word, overload), revision 5.
        telegram(0x83, 0x82, 0x7D, &[60, 62]),
        telegram(
            0x82,
            0x83,
            0x08,
            &[
                62, 60, 0x08, 0x0C, 0x00, 2, 0x00, 0xDA, 0x42, 0x04, 0x81, 0x43, 0xA4, 0xC5,
            ],
        ),
        // A length of 0 cannot be divided.
        telegram(0x82, 0x83, 0x08, &[62, 60, 0x08, 0x0C, 0x00, 2, 0x00, 0xDA, 0x00]),
        // Set_Prm of a DP-V1 slave with WD_Base_1ms: 5 · 3 · 1 ms.
        telegram(
            0x83,
            0x82,
            0x5D,
            &[61, 62, 0x88, 5, 3, 11, 0x00, 0xDA, 0x01, 0x84, 0x00, 0x00],
        ),
        // Global_Control: Sync and Freeze to group 1.
        telegram(0xFF, 0x82, 0x46, &[58, 62, 0x28, 0x01]),
        // The outputs go out as SD3, and the slave has no service there.
        telegram(0x03, 0x02, 0x7D, &[1, 2, 3, 4, 5, 6, 7, 8]),
        telegram(0x02, 0x03, 0x03, &[]),
        // FDL status of a master in the ring.
        telegram(0x04, 0x02, 0x49, &[]),
        telegram(0x02, 0x04, 0x30, &[]),
    ];
    let packets = dissect_octets(
        "v0",
        &telegrams,
        &[
            "_ws.col.Info",
            "_ws.expert.message",
            "profibus.service",
            "profibus.sd",
            "profibus.fc.station",
            "profibus_dp.ssa.new_address",
            "profibus_dp.ssa.no_add_chg",
            "profibus_dp.cfg.inputs",
            "profibus_dp.cfg.outputs",
            "profibus_dp.diag.module",
            "profibus_dp.diag.channel.module",
            "profibus_dp.diag.channel.direction",
            "profibus_dp.diag.channel.number",
            "profibus_dp.diag.channel.type",
            "profibus_dp.diag.channel.fault",
            "profibus_dp.diag.revision",
            "profibus_dp.prm.watchdog",
            "profibus_dp.gc.sync",
            "profibus_dp.gc.freeze",
            "profibus_dp.gc.group",
            "profibus_dp.outputs",
        ],
    );
    let [
        address,
        ack,
        _,
        cfg,
        _,
        diag,
        malformed,
        prm,
        control,
        sd3,
        refused,
        _,
        status,
    ] = &packets[..]
    else {
        panic!("{}", packets.len())
    };
    assert_eq!(address["profibus_dp.ssa.new_address"], "9");
    assert_eq!(address["profibus_dp.ssa.no_add_chg"], "1");
    assert_eq!(ack["_ws.col.Info"], "3 → 2  short acknowledgement  Set_Slave_Add");
    assert_eq!(
        (&*cfg["profibus_dp.cfg.inputs"], &*cfg["profibus_dp.cfg.outputs"]),
        ("2", "2")
    );
    assert_eq!(diag["profibus_dp.diag.module"], "2");
    let channel: Vec<_> = ["module", "direction", "number", "type", "fault"]
        .map(|part| {
            let field = format!("profibus_dp.diag.channel.{part}");
            diag.iter().find(|(name, _)| **name == field).unwrap().1.as_str()
        })
        .to_vec();
    // 43h: bits 7 and 6 are 01, an input; channel 3. A4h: type 5 is a word, fault 4 an overload.
    assert_eq!(channel, ["1", "1", "3", "5", "4"]);
    assert_eq!(diag["profibus_dp.diag.revision"], "5");
    assert!(diag["_ws.expert.message"].contains("Ext_Diag"));
    assert!(malformed["_ws.expert.message"].contains("length 0"));
    assert_eq!(prm["profibus_dp.prm.watchdog"], "15");
    assert_eq!(
        (&*control["profibus_dp.gc.sync"], &*control["profibus_dp.gc.freeze"]),
        ("1", "1")
    );
    assert_eq!(control["profibus_dp.gc.group"], "0x01");
    assert_eq!(
        (&*sd3["profibus.sd"], &*sd3["profibus_dp.outputs"]),
        ("0xa2", "0102030405060708")
    );
    assert_eq!(refused["profibus.service"], "Data_Exchange");
    assert!(refused["_ws.expert.message"].contains("refused"));
    assert_eq!(
        (&*status["profibus.service"], &*status["profibus.fc.station"]),
        ("FDL_Status", "3")
    );
}

#[test]
fn the_pdus_of_dp_v1_are_decoded() {
    if !tshark_is_there() {
        return;
    }
    let telegrams = [
        // MSAC1: read of slot 1, index 47, at most 240 octets; the answer comes with a later poll.
        telegram(0x83, 0x82, 0x6D, &[51, 51, 0x5E, 1, 47, 240]),
        telegram(0x82, 0x83, 0x08, &[51, 51, 0x5E, 1, 47, 2, 0xAB, 0xCD]),
        // Invalid index.
        telegram(0x82, 0x83, 0x08, &[51, 51, 0xDE, 0x80, 0xB0, 0x05]),
        // Alarm_Ack of slot 2, process alarm, sequence 3, appears.
        telegram(0x83, 0x82, 0x5D, &[50, 51, 0x5C, 2, 2, 0x19]),
        // MSAC2: the resource manager names access point 5 and 1 s; Initiate with 1 s; its answer with 48 octets.
        telegram(0x82, 0x83, 0x08, &[50, 49, 0x56, 5, 0x00, 0x64]),
        telegram(
            0x83,
            0x82,
            0x6D,
            &[
                5, 50, 0x57, 0, 0, 0, 0x00, 0x64, 1, 0, 0, 0, 0x12, 0x34, 0, 2, 0, 2, 0, 0, 0, 0,
            ],
        ),
        telegram(
            0x82,
            0x83,
            0x08,
            &[50, 5, 0x57, 48, 1, 0, 0, 0, 0x12, 0x34, 0, 2, 0, 2, 0, 0, 0, 0],
        ),
        // Data_Transport, Idle, Abort by the MSAC2 machine for a timeout.
        telegram(0x83, 0x82, 0x5D, &[5, 50, 0x51, 0, 1, 1, 0x99]),
        telegram(0x83, 0x82, 0x7D, &[5, 50, 0x48]),
        telegram(0x83, 0x82, 0x5D, &[5, 50, 0x58, 0x02, 0x13]),
        // A slave's diagnosis with a process alarm: slot 4, sequence 2, appears.
        telegram(
            0x82,
            0x83,
            0x08,
            &[62, 60, 0x08, 0x0C, 0x00, 2, 0x00, 0xDA, 0x05, 0x02, 0x04, 0x11, 0x77],
        ),
    ];
    let packets = dissect_octets(
        "v1",
        &telegrams,
        &[
            "_ws.col.Info",
            "profibus.service",
            "profibus_dp.v1.function",
            "profibus_dp.v1.negative",
            "profibus_dp.v1.slot",
            "profibus_dp.v1.index",
            "profibus_dp.v1.length",
            "profibus_dp.v1.data",
            "profibus_dp.v1.error_code_1",
            "profibus_dp.v1.error_code_2",
            "profibus_dp.v1.server_sap",
            "profibus_dp.v1.send_timeout",
            "profibus_dp.v1.max_len_data_unit",
            "profibus_dp.v1.profile_ident",
            "profibus_dp.v1.abort.instance",
            "profibus_dp.v1.abort.reason",
            "profibus_dp.alarm.type",
            "profibus_dp.alarm.sequence",
            "profibus_dp.alarm.specifier",
        ],
    );
    let part = |packet: usize, name: &str| {
        let field = format!("profibus_dp.{name}");
        packets[packet]
            .iter()
            .find(|(key, _)| **key == field)
            .unwrap()
            .1
            .clone()
    };
    let access = |packet| ["slot", "index", "length"].map(|name| part(packet, &format!("v1.{name}")));
    assert_eq!(packets[0]["profibus.service"], "MSAC1");
    assert_eq!(access(0), ["1", "47", "240"]);
    assert_eq!(access(1), ["1", "47", "2"]);
    assert_eq!(part(1, "v1.data"), "abcd");
    assert_eq!(
        (part(2, "v1.negative"), part(2, "v1.error_code_1")),
        ("1".into(), "0xb0".into())
    );
    assert!(packets[2]["_ws.col.Info"].ends_with("Read refused B0 05, invalid index"));
    assert_eq!(
        (part(3, "v1.slot"), part(3, "alarm.type"), part(3, "alarm.sequence")),
        ("2".into(), "2".into(), "3".into())
    );
    assert_eq!(packets[4]["profibus.service"], "MSAC2");
    assert_eq!(
        (part(4, "v1.server_sap"), part(4, "v1.send_timeout")),
        ("5".into(), "100".into())
    );
    assert_eq!(
        (part(5, "v1.send_timeout"), part(5, "v1.profile_ident")),
        ("100".into(), "0x1234".into())
    );
    assert_eq!(
        (part(6, "v1.max_len_data_unit"), part(6, "v1.profile_ident")),
        ("48".into(), "0x1234".into())
    );
    assert_eq!(part(7, "v1.data"), "99");
    assert_eq!(part(8, "v1.function"), "0x48");
    assert_eq!(
        (part(9, "v1.abort.instance"), part(9, "v1.abort.reason")),
        ("1".into(), "3".into())
    );
    assert!(packets[9]["_ws.col.Info"].ends_with("Abort by MSAC2: ABT_TO, timeout"));
    assert_eq!(part(10, "v1.slot"), "4");
    assert_eq!(
        ["type", "sequence", "specifier"].map(|name| part(10, &format!("alarm.{name}"))),
        ["2", "2", "1"]
    );
}

#[test]
fn what_is_no_telegram_is_shown_with_its_reason_and_every_short_octet_string_is_survived() {
    if !tshark_is_there() {
        return;
    }
    let mut telegrams = vec![
        vec![0x68, 0x05, 0x06, 0x68, 0x03, 0x02],
        vec![0x10, 0x03, 0x02, 0x49, 0x4F, 0x16],
        vec![0x00, 0x11],
        vec![0xDC, 0x7F, 0x02],
    ];
    // Every beginning of data units that the services take apart: none may be an error of the script.
    for (slave_sap, fc) in (49..=62).flat_map(|sap| [(sap, 0x5D), (sap, 0x08)]) {
        for length in 0..=8 {
            let (dsap, ssap, da, sa) = match (fc, slave_sap) {
                (0x08, 49) => (50, slave_sap, 0x82, 0x83),
                (0x08, 50 | 51) => (51, slave_sap, 0x82, 0x83),
                (0x08, _) => (62, slave_sap, 0x82, 0x83),
                (_, 49) => (slave_sap, 50, 0x83, 0x82),
                (_, 50 | 51) => (slave_sap, 51, 0x83, 0x82),
                _ => (slave_sap, 62, 0x83, 0x82),
            };
            for first in [
                0x00, 0x40, 0x48, 0x51, 0x56, 0x57, 0x58, 0x5C, 0x5E, 0x80, 0xC3, 0xDE, 0xF3,
            ] {
                let mut data = vec![dsap, ssap, first, 0x07, 0x45, 0xC1, 0x3F, 0x80, 0xFE, 0x01];
                data.truncate(2 + length);
                telegrams.push(telegram(da, sa, fc, &data));
            }
        }
    }
    let packets = dissect_octets(
        "broken",
        &telegrams,
        &["_ws.col.Info", "_ws.expert.message", "profibus.fcs.status"],
    );
    assert_eq!(
        packets[0]["_ws.col.Info"],
        "no valid telegram: length LE is 5, but repeated as 6"
    );
    assert_eq!(packets[1]["profibus.fcs.status"], "0");
    assert!(
        packets[1]["_ws.expert.message"].contains("must be 0x4e, got 0x4f"),
        "{}",
        packets[1]["_ws.expert.message"]
    );
    assert_eq!(
        packets[2]["_ws.col.Info"],
        "no valid telegram: octet 0x00 is no start delimiter"
    );
    assert!(packets[3]["_ws.col.Info"].starts_with("no valid telegram"));
    let broken: Vec<_> = packets
        .iter()
        .filter(|packet| packet["_ws.expert.message"].contains("Lua"))
        .collect();
    assert!(broken.is_empty(), "{broken:?}");
}

#[test]
fn a_character_lost_alone_is_a_packet_without_octets() {
    if !tshark_is_there() {
        return;
    }
    let capture = Capture::new("lost", |file| {
        Tracer::new(BAUD).push_line_error(Instant::from_nanos(100_000), LineError::Parity, |trace| {
            file.write(&trace).unwrap();
        });
    });
    let packets = dissect(
        &capture,
        &["frame.number", "frame.len", "frame.cap_len", "_ws.expert.message"],
    );
    assert_eq!(packets.len(), 1);
    assert_eq!((&*packets[0]["frame.len"], &*packets[0]["frame.cap_len"]), ("1", "0"));
    assert!(!packets[0]["_ws.expert.message"].contains("Lua"), "{:?}", packets[0]);
}

//! `dp busparam`.

#![cfg(feature = "tool")]

use crate::common::{Scratch, assert_refused, dp};

/// The installation of the thesis (ch. 8.2): one master, one slave with 16 + 16 octets, 3 m at 12 Mbit/s.
const THESIS: &str = "\
baud = 12000000
profile = \"dp\"

[[segment]]
length_m = 3.0
stations = 2

[[master]]
address = 2

[[master.slave]]
address = 3
outputs = 16
inputs = 16
";

#[test]
fn the_installation_of_the_thesis_is_calculated_from_a_file() {
    let file = Scratch::with("network.toml", THESIS);
    let ended = dp(&["busparam", file.path()], "");
    // Tsl, Tsdr, Tset, Tqui: profile DP at 12 Mbit/s (IEC 61784-1 CPF 3), and 1 tBIT for 2 · 3 m at 5 ns/m.
    // Tid1 = 33 + 2 + 2·16 + 9 = 76; a tBIT is 83.3 ns.
    // Cycle: token 33 + Tid1 76 + way 1, request 25 · 11, min Tsdr 11, reply 25 · 11, Tid1 76, way 1.
    for line in [
        "                                 tBIT             µs",
        "Tsl                              1001         83.417",
        "min Tsdr                           11          0.917",
        "max Tsdr                          800         66.667",
        "Tset                               16          1.334",
        "Tqui                                9          0.750",
        "Tid1                               76          6.334",
        "Tid2                              800         66.667",
        "there and back, 2·Ttd               1          0.084",
        "cycle, least                      748         62.334",
        "retry limit                         4",
        "HSA                                 2",
        "the network keeps all rules",
    ] {
        assert!(ended.out.lines().any(|got| got == line), "{line}\n{}", ended.out);
    }
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""));

    let arguments = [
        "busparam",
        "--baud",
        "12000000",
        "--slave",
        "3:16:16",
        "--segment",
        "3:2",
    ];
    assert_eq!(dp(&arguments, "").out, ended.out, "arguments say the same as the file");
}

#[test]
fn every_violated_rule_is_named_and_the_exit_code_is_1() {
    // Film-feed specification, section 2: 100 m at 12 Mbit/s, 32 stations, no stubs above 1.5 Mbit/s.
    let arguments = [
        "busparam",
        "--baud",
        "12000000",
        "--segment",
        "120:40:3",
        "--slave",
        "3:16:16",
        "--slave",
        "3:2:2",
        "--watchdog",
        "1",
    ];
    let ended = dp(&arguments, "");
    assert_eq!((ended.code, ended.err.as_str()), (Some(1), ""));
    let violated: Vec<&str> = ended
        .out
        .lines()
        .filter(|line| line.starts_with("violated: "))
        .collect();
    for (got, wanted) in violated.iter().zip([
        "violated: segment 1 is 120.00 m long, at 12000 kbit/s at most 100 m are allowed",
        "violated: segment 1 has 40 stations, at most 32 are allowed, repeaters counted",
        "violated: segment 1 has 3.00 m of stub lines, at 12000 kbit/s at most 0 m are allowed",
        "violated: address 3 is given twice",
        "violated: the watchdog must be 10 ms to 650250 ms with this Ttr, got 1 ms",
    ]) {
        assert_eq!(*got, wanted);
    }
    assert_eq!(violated.len(), 5, "{violated:?}");
}

#[test]
fn json_has_each_value_in_bit_times_and_microseconds() {
    let ended = dp(&["busparam", "--baud", "1500000", "--slave", "3:16:16", "--json"], "");
    let report: serde_json::Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(ended.out.lines().count(), 1);
    // Tsl of profile DP at 1.5 Mbit/s is 300 tBIT, 200 µs.
    assert_eq!(report["times"]["t_sl"], serde_json::json!({ "bits": 300, "us": 200.0 }));
    assert_eq!(report["violations"], serde_json::json!([]));
    assert_eq!(report["baud"], 1_500_000);
    let broken = dp(&["busparam", "--baud", "1500000", "--segment", "300", "--json"], "");
    assert_eq!(broken.code, Some(1));
    let report: serde_json::Value = serde_json::from_str(&broken.out).unwrap();
    assert_eq!(
        report["violations"],
        serde_json::json!(["segment 1 is 300.00 m long, at 1500 kbit/s at most 200 m are allowed"])
    );
}

#[test]
fn everything_a_network_may_have_is_read_from_a_file() {
    let file = Scratch::with(
        "whole.toml",
        "baud = 500000\nprofile = \"user\"\nhsa = 10\nacyclic = 2\nrepeaters = 1\nwatchdog_ms = 500\n\
         [[segment]]\nlength_m = 380.5\nstations = 20\nstubs_m = 4\n[[segment]]\nlength_m = 100\n\
         [optical]\nmodules = 2\nfibre_m = 1500\ntopology = \"line\"\n\
         [others]\nmasters = 1\nslaves = 3\noutputs = 2\ninputs = 4\n\
         [[master]]\naddress = 1\n[[master.slave]]\naddress = 5\noutputs = 8\ninputs = 8\nmax_tsdr = 100\n\
         [user]\nt_sl = 420\nt_sdr_max = 300\nt_tr = 60000\nretry_limit = 2\ngap_factor = 20\nhsa = 10\n",
    );
    let ended = dp(&["busparam", file.path()], "");
    for line in [
        "Tsl                               420        840.000",
        "max Tsdr                          300        600.000",
        "Ttr                             60000     120000.000",
        "retry limit                         2",
        "GAP factor                         20",
        "HSA                                10",
    ] {
        assert!(
            ended.out.lines().any(|got| got == line),
            "{line}\n{}{}",
            ended.out,
            ended.err
        );
    }
    assert_eq!(ended.code, Some(0), "{}", ended.out);
}

#[test]
fn every_mistake_in_a_file_is_told_with_its_line_and_what_is_allowed() {
    let file = Scratch::with(
        "wrong.toml",
        "baud = 115200\nprofile = \"fast\"\n[[segment]]\nlenght_m = 3\n[[master]]\naddress = 127\n[[master.slave]]\n\
         address = 3\noutputs = \"16\"\n[user]\nt_sl = -1\n",
    );
    let line = |number: usize, sentence: &str| format!("{}:{number}: {sentence}", file.path());
    assert_refused(
        &["busparam", file.path()],
        &[
            &line(
                1,
                "`baud` is 115200, allowed are the ten PROFIBUS rates 9600, 19200, 45450, 93750, 187500, 500000, 1500000, \
                 3000000, 6000000 and 12000000 bit/s",
            ),
            &line(
                2,
                "`profile` is \"fast\", allowed is \"dp\", \"standard\", \"universal\" or \"user\"",
            ),
            &line(3, "[[segment]] needs `length_m`"),
            &line(
                4,
                "`lenght_m` is unknown in [[segment]], allowed are `length_m`, `stations` and `stubs_m`",
            ),
            &line(6, "`address` is 127, allowed is a whole number 0…126"),
            &line(7, "[[master.slave]] needs `inputs`"),
            &line(9, "`outputs` is \"16\", allowed is a whole number 0…1000"),
            &line(11, "`t_sl` is -1, allowed is a whole number 0…4294967295"),
        ],
    );
    let file = Scratch::with("empty.toml", "[user]\n");
    let sentence = format!("{}:1: the file needs `baud`", file.path());
    assert_refused(&["busparam", file.path()], &[&sentence]);
}

#[test]
fn what_is_wrong_in_arguments_is_told_in_one_sentence() {
    let hint = "; `dp help` and `dp COMMAND --help` list what is allowed";
    for (arguments, sentence) in [
        (
            &["--slave", "3:16"][..],
            "invalid value '3:16' for '--slave <ADDRESS:OUT:IN[:TSDR][@MASTER]>': allowed are address 0…126, octets 0…1000 of outputs and inputs, max Tsdr and @MASTER, such as 3:16:16:150@2",
        ),
        (&["--segment", "-3"], "unexpected argument '-3' found"),
        (
            &["--segment", "3:x"],
            "invalid value '3:x' for '--segment <METRES[:STATIONS[:STUBS]]>': allowed are metres, stations 0…1000 and metres of stub lines, such as 120:12:1.5",
        ),
        (
            &["--optical", "4"],
            "invalid value '4' for '--optical <MODULES:METRES[:ring]>': allowed are modules 1…1000 and whole metres of glass, such as 4:2000 or 4:2000:ring",
        ),
        (
            &["--hsa", "127"],
            "invalid value '127' for '--hsa <N>': allowed is an address 0…126",
        ),
        (
            &["--watchdog", "long"],
            "invalid value 'long' for '--watchdog <MS>': allowed are 0…1000000 ms",
        ),
    ] {
        let all: Vec<&str> = ["busparam", "--baud", "1500000"]
            .iter()
            .chain(arguments)
            .copied()
            .collect();
        let ended = dp(&all, "");
        assert_eq!((ended.code, ended.out.as_str()), (Some(2), ""), "{arguments:?}");
        assert_eq!(ended.err, format!("dp: {sentence}{hint}\n"), "{arguments:?}");
    }
    assert_refused(
        &["busparam", "--baud", "1500000", "--slave", "3:1:1@9"],
        &["slave 3 belongs to a master that is not given, name it with --master"],
    );
    assert_refused(
        &["busparam", "/nonexistent/x.toml"],
        &["/nonexistent/x.toml cannot be read: No such file or directory (os error 2)"],
    );
}

#[test]
fn the_example_in_the_documentation_keeps_all_rules() {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/examples/network.toml");
    let ended = dp(&["busparam", example], "");
    assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""), "{}", ended.out);
}

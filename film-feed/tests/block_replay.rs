//! `film-feed replay` as a program: formats, messages, exit codes.

use std::{
    io::{BufRead, BufReader, Write},
    process::{Command, Output, Stdio},
};

use film_feed::cli::replay::{ReplayError, replay};
use proptest::prelude::*;

/// A cycle line with the given number, inputs and images.
fn cycle(number: i64, inputs: &str, pi: &str, qi: &str) -> String {
    format!(r#"{{"c":{number},"i":[{inputs}],"pi":"{pi}","qi":"{qi}"}}"#)
}

const NOTHING: &str = "null,null,null,null,null,null,null,null,null,null,null,null";
const ZERO: &str = "0000000000000000";

fn answers(input: &str) -> String {
    let mut output = Vec::new();
    replay(input.as_bytes(), &mut output, false).expect("works");
    String::from_utf8(output).expect("works")
}

/// The message for a broken input, after checking that nothing was written.
fn refused(input: &str) -> String {
    let mut output = Vec::new();
    let error = replay(input.as_bytes(), &mut output, false).expect_err("is refused");
    assert!(output.is_empty(), "something was written");
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

fn program(arguments: &[&str], input: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_film-feed"))
        .arg("replay")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("works");
    child
        .stdin
        .take()
        .expect("works")
        .write_all(input.as_bytes())
        .expect("works");
    child.wait_with_output().expect("works")
}

#[test]
fn cycles_before_any_reset_run_from_an_implicit_power_up() {
    let line = cycle(1, NOTHING, ZERO, ZERO);
    let explicit = format!("{{\"reset\":null}}\n{line}\n");
    assert_eq!(answers(&line), answers(&explicit));
    // Control word 0x0076 (film-feed specification, 8.1 point 13: not ready, no fault: bit 0 low); first telegram C1302/1 with
    // the minimum 10.00 % (point 3) and handshake 1.
    assert_eq!(
        answers(&line),
        concat!(
            r#"{"c":1,"o":[0,0,0,0,0,0,4294967295],"po":"0076000000000000","qo":"72015ae9000186a0","#,
            r#""m":"00000110010","at":0,"ci":[1000,1000,1000,2000]}"#,
            "\n"
        )
    );
}

#[test]
fn a_reset_powers_up_again_and_takes_the_addresses_or_their_defaults() {
    let line = cycle(9, NOTHING, "0001000000000000", ZERO);
    let text = format!(
        "{line}\n{{\"reset\":\"foreign\",\"module_adr\":300}}\n{line}\n\n{{\"reset\":[1],\"pzd_adr\":300,\"module_adr\":300}}\n{line}\n"
    );
    let lines: Vec<_> = answers(&text).lines().map(str::to_owned).collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[0], lines[2]);
    // Nothing arrives at 280 when the module is at 300.
    assert!(
        lines[1].contains(r#""po":"0000000000000000","qo":"0000000000000000""#),
        "{}",
        lines[1]
    );
}

#[test]
fn the_block_addressed_8_too_low_takes_the_parameter_area_for_process_data() {
    let text = format!(
        "{{\"reset\":1,\"pzd_adr\":272,\"module_adr\":280}}\n{}",
        cycle(1, NOTHING, ZERO, "4237000000000000")
    );
    // The status word 0x4237 comes from qi; the control word 0x0077 goes to qo; 264 does not exist.
    assert!(answers(&text).contains(r#""o":[1,1,0,1,0,0,4294967295],"po":"0000000000000000","qo":"0077000000000000""#));
}

#[test]
fn numbers_and_booleans_are_the_same_and_null_leaves_an_input_alone() {
    let with = |first: &str| {
        answers(&format!(
            "{}\n{}",
            cycle(1, first, ZERO, ZERO),
            cycle(2, NOTHING, ZERO, ZERO)
        ))
    };
    let numbers = with("1,0,0,0,1,0,0,1,5000,6000,7000,12345");
    assert_eq!(
        numbers,
        with("true,false,false,false,true,false,false,true,5000,6000,7000,12345")
    );
    // Bit 15 (mark) and bit 3 (enable) are high, bit 5 (start, inverted) low, in the second cycle too.
    assert!(
        numbers.lines().nth(1).unwrap().contains(r#""po":"805e000000000000""#),
        "{numbers}"
    );
    assert!(
        numbers
            .lines()
            .nth(1)
            .unwrap()
            .contains(r#""ci":[5000,5000,7000,12345]"#),
        "{numbers}"
    );
}

#[test]
fn any_integer_is_echoed_as_cycle_number() {
    for number in [-1, 0, i64::MAX, i64::MIN] {
        assert!(answers(&cycle(number, NOTHING, ZERO, ZERO)).starts_with(&format!("{{\"c\":{number},")));
    }
}

#[test]
fn a_broken_line_gives_a_sentence_with_its_number_and_no_output() {
    let good = cycle(1, NOTHING, ZERO, ZERO);
    let bad = |line: &str| refused(&format!("{good}\n\n{line}\n{good}\n"));
    let inputs = |list: &str| bad(&cycle(2, list, ZERO, ZERO));
    for (message, part) in [
        (bad("{\"c\":"), "not JSON"),
        (bad("[1]"), "neither a power-up nor a cycle"),
        (bad("{\"note\":1}"), "neither a power-up nor a cycle"),
        (bad("{\"c\":1}"), "key \"i\" is missing"),
        (
            bad(&good.replace("\"c\":1", "\"c\":1.5")),
            "\"c\" is 1.5; allowed is an integer",
        ),
        (
            bad("{\"reset\":1,\"pzd_adr\":65536}"),
            "\"pzd_adr\" is 65536; allowed is an integer from 0 to 65535",
        ),
        (
            bad("{\"reset\":1,\"module_adr\":-1}"),
            "\"module_adr\" is -1; allowed is an integer from 0 to 65535",
        ),
        (inputs("0,0"), "\"i\" is a list of 2; allowed is a list of 12 values"),
        (
            inputs("0,0,0,0,2,0,0,0,0,0,0,0"),
            "input POS_START is 2; allowed is 0, 1, false, true or null",
        ),
        (
            inputs("0,0,0,0,0,0,0,0,0,0,0,32768"),
            "input Strecke is 32768; allowed is an integer from -32768 to 32767",
        ),
        (
            inputs("0,0,0,0,0,0,0,0,\"1\",0,0,0"),
            "input Geschw is \"1\"; allowed is an integer",
        ),
        (
            bad(&cycle(2, NOTHING, "0", ZERO)),
            "\"pi\" is \"0\"; allowed are 16 hexadecimal digits",
        ),
        (
            bad(&cycle(2, NOTHING, ZERO, "+000000000000000")),
            "\"qi\" is \"+000000000000000\"; allowed are 16",
        ),
    ] {
        assert!(message.starts_with("line 3: "), "{message}");
        assert!(message.contains(part), "{message}: {part}");
        assert!(!message.contains('\n'), "{message}");
    }
}

#[test]
fn unusual_but_allowed_lines_are_read_like_plain_ones() {
    let plain = cycle(7, NOTHING, "82370001ABCDEF09", ZERO);
    let expected = answers(&plain);
    let with = |from: &str, to: &str| answers(&plain.replace(from, to));
    // Other keys, whatever they hold; upper or lower case; an escaped digit; a repeated key, where the last one counts.
    assert_eq!(with("{", r#"{"o":[1],"note":{"a":null},"#), expected);
    assert_eq!(with("ABCDEF", "abcdef"), expected);
    assert_eq!(with("8237", "\\u0038237"), expected);
    assert_eq!(with("{", "{\"c\":3,"), expected);
    assert_eq!(with("{", " { "), expected);
    // A power-up wins over a cycle in the same line, also with null.
    assert_eq!(with("{", "{\"reset\":null,"), "");
    // Beyond the plain integers.
    assert!(with("\"c\":7", "\"c\":18446744073709551615").starts_with("{\"c\":18446744073709551615,"));
}

#[test]
fn octets_that_are_no_text_are_refused_with_their_line() {
    let error = replay(&b"\n\xFF\xFE{}\n"[..], Vec::new(), false).unwrap_err();
    assert!(matches!(error, ReplayError::Line { line: 2, .. }));
}

#[test]
fn the_program_answers_on_standard_output_and_fails_with_code_2() {
    let good = cycle(5, NOTHING, ZERO, ZERO);
    let output = program(&[], &format!("\u{FEFF}{good}\r\n"));
    assert!(output.status.success());
    assert_eq!(String::from_utf8(output.stdout).unwrap(), answers(&good));

    let output = program(&[], &format!("{good}\nnonsense\n"));
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
    assert!(String::from_utf8(output.stderr).unwrap().contains("line 2: not JSON"));

    let output = program(&["--input", "there-is-no-such-file.jsonl"], "");
    assert_eq!(output.status.code(), Some(2));
    assert!(
        String::from_utf8(output.stderr)
            .unwrap()
            .contains("there-is-no-such-file.jsonl")
    );
}

#[test]
fn stream_answers_each_line_before_the_next_arrives() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_film-feed"))
        .args(["replay", "--stream"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    for number in 1..=3 {
        writeln!(input, "{}", cycle(number, NOTHING, ZERO, ZERO)).unwrap();
        let mut answer = String::new();
        output.read_line(&mut answer).unwrap();
        assert!(answer.starts_with(&format!("{{\"c\":{number},")), "{answer}");
    }
    writeln!(input, "nonsense").unwrap();
    drop(input);
    assert_eq!(child.wait().unwrap().code(), Some(2));
}

proptest! {
    /// A line cut short, or with one octet changed, is understood or refused; it never panics and never leaves half an answer.
    #[test]
    fn a_damaged_line_never_panics(position in 0_usize..200, octet: u8, cut in 0_usize..200) {
        let mut line = cycle(7, "1,0,0,0,0,0,0,1,-5,2500,10000,12000", "8237000100000000", ZERO).into_bytes();
        let end = line.len();
        line[position % end] = octet;
        line.truncate(cut.max(1));
        let mut output = Vec::new();
        match replay(&line[..], &mut output, false) {
            Ok(()) => {
                let whole = output.is_empty() || output.ends_with(b"}\n");
                prop_assert!(whole);
            }
            Err(error) => {
                prop_assert!(output.is_empty());
                prop_assert!(error.to_string().starts_with("line "));
            }
        }
    }
}

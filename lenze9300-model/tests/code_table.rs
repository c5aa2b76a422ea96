//! The declaration table of the codes.

use lenze9300_model::code::table::number::*;
use lenze9300_model::code::{CODE_TABLE, CodeStore, DataLength, Domain, Form, Kind, Writable, entry};

#[test]
fn every_line_is_found_by_its_number() {
    for line in CODE_TABLE {
        assert_eq!(entry(line.number), Some(line));
    }
    assert!(CODE_TABLE.windows(2).all(|pair| pair[0].number < pair[1].number));
}

#[test]
fn every_factory_value_lies_in_its_domain() {
    for line in CODE_TABLE {
        let value = line.factory;
        match line.domain {
            Domain::Range { min, max, step } => {
                assert!((min..=max).contains(&value), "C{:04}", line.number);
                assert!(step > 0, "C{:04}", line.number);
            }
            Domain::Selection(values) => {
                assert!(values.contains(&value), "C{:04}", line.number);
                assert!(values.windows(2).all(|pair| pair[0] < pair[1]), "C{:04}", line.number);
            }
        }
    }
}

#[test]
fn displays_are_never_writable_and_nothing_else_is_so() {
    for line in CODE_TABLE {
        assert_eq!(
            line.kind == Kind::Display,
            line.writable == Writable::Never,
            "C{:04}",
            line.number
        );
    }
}

/// 9300 facts 3.2, table.
#[test]
fn the_index_is_24575_less_the_code() {
    let index = |code| entry(code).unwrap().index();
    assert_eq!(index(C1301), 0x5AEA);
    assert_eq!(index(C1302), 0x5AE9);
    assert_eq!(index(C1303), 0x5AE8);
    assert_eq!(index(C1204), 0x5B4B);
    assert_eq!(index(C1202), 0x5B4D);
    assert_eq!(index(C1203), 0x5B4C);
    assert_eq!(index(C0086), 0x5FA9);
}

/// 9300 facts 3.4: the codes of the model that are printed in brackets, and C1202 to C1204.
#[test]
fn exactly_these_codes_need_the_inhibit() {
    let listed: Vec<u16> = CODE_TABLE
        .iter()
        .filter(|line| line.writable == Writable::OnlyInhibited)
        .map(|line| line.number)
        .collect();
    let expected = [5, 6, 81, 84, 85, 86, 87, 88, 89, 90, 91, 173, 1202, 1203, 1204];
    assert_eq!(listed, expected);
}

/// 9300 facts 3.2 for C0150; C0255 because 327 680 · 10 000 does not fit.
#[test]
fn only_the_status_word_and_the_following_error_limit_are_plain() {
    let plain: Vec<u16> = CODE_TABLE
        .iter()
        .filter(|line| line.form == Form::Plain)
        .map(|line| line.number)
        .collect();
    assert_eq!(plain, [150, 255]);
    assert_eq!(entry(C0150).unwrap().length, DataLength::Two);
}

/// 9300 facts 4.4, columns range and factory.
#[test]
fn ranges_and_factory_values_are_those_of_the_manual() {
    let range = |code| match entry(code).unwrap().domain {
        Domain::Range { min, max, step } => (min, max, step),
        Domain::Selection(_) => panic!("C{code:04} is a selection"),
    };
    let codes = CodeStore::factory();
    assert_eq!(range(C0011), (500_0000, 16_000 * 10_000, 1_0000));
    assert_eq!(range(C0022), (0, 3_7500, 100));
    assert_eq!(range(C0070), (0, 255_0000, 5000));
    assert_eq!(range(C0071), (1_0000, 600_0000, 5000));
    assert_eq!(range(C0075), (0, 15_9900, 100));
    assert_eq!(range(C0076), (5000, 2000_0000, 1000));
    assert_eq!(range(C0105), (0, 999_9000, 10));
    assert_eq!(range(C0254), (0, 3_9999, 1));
    assert_eq!(range(C0255), (10, 180_000_000, 1));
    assert_eq!(range(C0497), (0, 50_0000, 1000));
    assert_eq!(range(C1301), (-2_140_000_000, 2_140_000_000, 1));
    assert_eq!(range(C1302), (0, 100_0000, 100));
    for (code, value) in [
        (C0011, 3000_0000),
        (C0075, 3500),
        (C0076, 1_8000),
        (C0105, 0),
        (C0142, 1_0000),
        (C0173, 1_0000),
        (C0254, 4000),
        (C0255, 327_680),
        (C0497, 2_0000),
        (C1882, 0),
        (C1883, 65_535 * 10_000),
    ] {
        assert_eq!(codes.read(code, 0), Ok(value), "C{code:04}");
    }
}

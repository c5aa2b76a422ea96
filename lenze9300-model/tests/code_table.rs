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
        assert!(line.factory.len() <= line.count(), "C{:04}", line.number);
        for &value in line.factory {
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

/// 9300 facts 3.4: the codes of the model that are printed in brackets, and C1202 to C1204. Readings: C0002, because a set holds
/// such codes; C0850 to C0853, which are wiring.
#[test]
fn exactly_these_codes_need_the_inhibit() {
    let listed: Vec<u16> = CODE_TABLE
        .iter()
        .filter(|line| line.writable == Writable::OnlyInhibited)
        .map(|line| line.number)
        .collect();
    let expected = [
        2, 5, 6, 25, 81, 84, 85, 86, 87, 88, 89, 90, 91, 95, 156, 173, 350, 351, 352, 357, 850, 852, 853, 1202, 1203,
        1204,
    ];
    assert_eq!(listed, expected);
}

/// 9300 facts 3.2 for C0135 and C0150; C0255 because 327 680 · 10 000 does not fit; seconds and increments for the same reason.
#[test]
fn words_and_what_does_not_fit_are_plain() {
    let plain: Vec<u16> = CODE_TABLE
        .iter()
        .filter(|line| line.form == Form::Plain)
        .map(|line| line.number)
        .collect();
    assert_eq!(plain, [135, 150, 155, 169, 178, 179, 255, 859]);
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
        (C0582, 2_0000),
        (C0581, 0),
        (C0585, 3_0000),
        (C0596, 5500_0000),
        (C1882, 0),
        (C1883, 65_535 * 10_000),
    ] {
        assert_eq!(codes.read(code, 0), Ok(value), "C{code:04}");
    }
}

/// 9300 facts 4.4 and 5: C0039, C0354 and C0356 have a factory value for each subcode.
#[test]
fn factory_values_can_differ_by_subcode() {
    let codes = CodeStore::factory();
    let of = |code, subcodes: std::ops::RangeInclusive<u8>| -> Vec<f64> {
        subcodes.map(|subcode| codes.number(code, subcode)).collect()
    };
    assert_eq!(of(C0039, 1..=7), [100.0, 75.0, 50.0, 25.0, 0.0, 0.0, 0.0]);
    assert_eq!(of(C0354, 1..=6), [129.0, 1.0, 257.0, 258.0, 385.0, 386.0]);
    assert_eq!(of(C0356, 1..=4), [3000.0, 10.0, 10.0, 20.0]);
}

/// Every row of the table of 9300 facts 4.4 and of the system bus in section 5 but those that `FEATURES.md` names as absent.
#[test]
fn the_table_has_the_codes_of_the_manual() {
    let expected = [
        2, 3, 5, 6, 11, 12, 13, 18, 19, 22, 25, 37, 39, 40, 42, 43, 50, 51, 52, 53, 54, 56, 57, 58, 59, 60, 61, 63, 64,
        67, 70, 71, 72, 75, 76, 81, 84, 85, 86, 87, 88, 89, 90, 91, 95, 105, 121, 122, 126, 135, 142, 150, 155, 156,
        161, 167, 168, 169, 170, 173, 178, 179, 183, 254, 255, 350, 351, 352, 353, 354, 355, 356, 357, 358, 359, 360,
        361, 366, 367, 368, 369, 497, 581, 582, 583, 584, 585, 586, 587, 588, 589, 590, 591, 592, 593, 594, 595, 596,
        597, 598, 850, 852, 853, 858, 859, 1202, 1203, 1204, 1205, 1211, 1218, 1240, 1250, 1301, 1302, 1303, 1304,
        1305, 1882, 1883,
    ];
    let numbers: Vec<u16> = CODE_TABLE.iter().map(|line| line.number).collect();
    assert_eq!(numbers, expected);
}

#[test]
fn a_value_is_shown_with_the_decimals_of_its_step_and_its_unit() {
    let show = |code, raw| entry(code).unwrap().show(raw);
    assert_eq!(show(C1204, 179_0708), "179.0708 units/rev");
    assert_eq!(show(C0011, 3000_0000), "3000 rpm");
    assert_eq!(show(C0070, 5_5000), "5.5");
    assert_eq!(show(C0105, 1_2500), "1.250 s");
    assert_eq!(show(C1301, -5000), "-0.5000 units");
    assert_eq!(show(C0255, 327_680), "327680 inc");
    assert_eq!(show(C0086, 108_0000), "108");
    // What lies between two steps is not hidden.
    assert_eq!(show(C0011, 3000_0001), "3000.0001 rpm");
}

//! Reading and writing codes.

use lenze9300_model::code::table::number::*;
use lenze9300_model::code::{CODE_TABLE, CodeError, CodeStore, Concern, DataLength, ErrorReply, Inhibit, WriteEffect};
use proptest::prelude::*;

fn reply(error: CodeError) -> [u8; 4] {
    error.reply().octets()
}

/// Film-feed specification, section 5.
#[test]
fn the_preset_is_the_commissioning_of_the_film_feed() {
    let codes = CodeStore::thesis();
    for (code, value) in [
        (C0005, 20_213.0),
        (C0173, 1.0),
        (C0086, 108.0),
        (C0006, 3.0),
        (C0011, 3000.0),
        (C0022, 1.35),
        (C0070, 5.0),
        (C0071, 20.0),
        (C0075, 0.75),
        (C0076, 1.5),
        (C0081, 0.25),
        (C0084, 19.8),
        (C0085, 30.5),
        (C0087, 4000.0),
        (C0088, 0.9),
        (C0089, 200.0),
        (C0090, 245.0),
        (C0091, 1.0),
        (C1202, 7.0),
        (C1203, 1.0),
        (C1204, 179.0708),
        (C1240, 1200.0),
        (C1250, 2400.0),
        (C1211, 1.0),
    ] {
        assert_eq!(codes.number(code, 0), value, "C{code:04}");
    }
    // 9300 facts 3.2: data bytes 00 1B 52 F4.
    assert_eq!(codes.read(C1204, 0).unwrap().to_be_bytes(), [0x00, 0x1B, 0x52, 0xF4]);
    // 9300 facts 11: 2561.847046 inc/mm.
    assert_eq!(codes.read(C1205, 0), Ok(2561_8470));
}

/// 9300 facts 3.3, and the example at its end.
#[test]
fn each_error_is_its_row_of_the_list() {
    let mut codes = CodeStore::thesis();
    let unknown = codes.read(1251, 0).unwrap_err();
    assert_eq!(unknown, CodeError::UnknownCode { code: 1251 });
    assert_eq!(reply(unknown), [0x06, 0x07, 0x00, 0x00]);
    assert_eq!(reply(codes.read(9999, 0).unwrap_err()), [0x06, 0x07, 0x00, 0x00]);

    let subcode = codes.read(C1302, 35).unwrap_err();
    assert_eq!(
        subcode,
        CodeError::UnknownSubcode {
            code: C1302,
            got: 35,
            first: 1,
            last: 34
        }
    );
    assert_eq!(reply(subcode), [0x06, 0x05, 0x00, 0x11]);
    assert_eq!(reply(codes.read(C1302, 0).unwrap_err()), [0x06, 0x05, 0x00, 0x11]);
    assert_eq!(reply(codes.read(C0011, 1).unwrap_err()), [0x06, 0x05, 0x00, 0x11]);

    let display = codes.write(C0051, 0, 0, Inhibit::Active).unwrap_err();
    assert_eq!(
        display,
        CodeError::ReadOnly {
            code: C0051,
            subcode: 0
        }
    );
    assert_eq!(reply(display), [0x06, 0x03, 0x00, 0x00]);

    let enabled = codes.write(C0086, 0, 108_0000, Inhibit::Inactive).unwrap_err();
    assert_eq!(
        enabled,
        CodeError::OnlyWhileInhibited {
            code: C0086,
            subcode: 0
        }
    );
    assert_eq!(reply(enabled), [0x08, 0x00, 0x00, 0x30]);

    let high = codes.write(C1302, 1, 100_0100, Inhibit::Inactive).unwrap_err();
    assert_eq!(
        high,
        CodeError::TooHigh {
            code: C1302,
            subcode: 1,
            max: 100_0000,
            got: 100_0100
        }
    );
    assert_eq!(reply(high), [0x08, 0x00, 0x00, 0x31]);

    let low = codes.write(C1302, 1, -1, Inhibit::Inactive).unwrap_err();
    assert_eq!(
        low,
        CodeError::TooLow {
            code: C1302,
            subcode: 1,
            min: 0,
            got: -1
        }
    );
    assert_eq!(reply(low), [0x08, 0x00, 0x00, 0x32]);

    let unlisted = codes.write(C0086, 0, 109_0000, Inhibit::Active).unwrap_err();
    assert_eq!(
        reply(unlisted),
        [0x08, 0x00, 0x00, 0x31],
        "above the greatest of the selection"
    );
    let unlisted = codes.write(C0086, 0, 5_0000, Inhibit::Active).unwrap_err();
    assert!(matches!(unlisted, CodeError::OutsideSelection { got: 5_0000, .. }));
    assert_eq!(reply(unlisted), [0x08, 0x00, 0x00, 0x30]);

    assert_eq!(
        reply(codes.check_length(C1301, 2).unwrap_err()),
        [0x06, 0x05, 0x00, 0x13]
    );
    assert_eq!(
        reply(codes.check_length(C0150, 4).unwrap_err()),
        [0x06, 0x05, 0x00, 0x12]
    );
    assert_eq!(
        codes.check_length(C0150, 4),
        Err(CodeError::DataTooLong {
            code: C0150,
            expected: DataLength::Two,
            got: 4
        })
    );
    assert_eq!(codes.check_length(C1301, 4), Ok(()));
    assert_eq!(reply(CodeError::ImpermissibleJob { job: 3 }), [0x06, 0x05, 0x00, 0x10]);
    assert_eq!(
        CodeError::TransferRunning.reply(),
        ErrorReply {
            class: 0x08,
            code: 0x00,
            additional: 0x0000
        }
    );
}

/// 9300 facts 4.4 (C0086) with 9, rows 12 and 13.
#[test]
fn the_motor_list_sets_exactly_its_dependants() {
    let mut codes = CodeStore::factory();
    let before = codes.clone();
    let effect = codes.write(C0086, 0, 108_0000, Inhibit::Active);
    assert_eq!(effect, Ok(WriteEffect::Changed(Concern::MotorList)));
    let dependants = [6, 22, 70, 71, 75, 76, 81, 84, 85, 87, 88, 89, 90, 91, 583, 584, 594];
    for line in CODE_TABLE.iter().filter(|line| line.last_subcode == 0) {
        let changed = codes.read(line.number, 0) != before.read(line.number, 0);
        if line.number == 86 {
            assert!(changed);
        } else if changed {
            assert!(dependants.contains(&line.number), "C{:04} changed", line.number);
        }
    }
    // Whatever they were before, they have the motor's values afterwards.
    codes.write(C0022, 0, 2_0000, Inhibit::Inactive).unwrap();
    codes.write(C0070, 0, 9_0000, Inhibit::Inactive).unwrap();
    codes.write(C0011, 0, 2500_0000, Inhibit::Inactive).unwrap();
    codes.write(C0086, 0, 108_0000, Inhibit::Active).unwrap();
    assert_eq!(codes.number(C0022, 0), 1.35);
    assert_eq!(codes.number(C0070, 0), 5.0);
    assert_eq!(codes.number(C0011, 0), 2500.0);
}

#[test]
fn motor_data_by_hand_mean_no_lenze_motor() {
    for (code, value) in [
        (C0006, 1_0000),
        (C0081, 5000),
        (C0084, 20_0000),
        (C0085, 30_0000),
        (C0087, 3000_0000),
        (C0088, 1_0000),
        (C0089, 100_0000),
        (C0090, 240_0000),
        (C0091, 9000),
    ] {
        let mut codes = CodeStore::thesis();
        let effect = codes.write(code, 0, value, Inhibit::Active);
        assert_eq!(effect, Ok(WriteEffect::Changed(Concern::Motor)), "C{code:04}");
        assert_eq!(codes.read(C0086, 0), Ok(0), "C{code:04}");
    }
    let mut codes = CodeStore::thesis();
    codes.write(C0022, 0, 2_0000, Inhibit::Active).unwrap();
    assert_eq!(codes.read(C0086, 0), Ok(108_0000), "C0022 is no motor datum");
}

#[test]
fn a_refused_write_changes_nothing() {
    let mut codes = CodeStore::thesis();
    let before = codes.clone();
    assert!(codes.write(C0086, 0, 0, Inhibit::Inactive).is_err());
    assert!(codes.write(C1204, 0, 100_0000, Inhibit::Inactive).is_err());
    assert!(codes.write(C1302, 1, i32::MAX, Inhibit::Active).is_err());
    assert!(codes.write(C1302, 1, i32::MIN, Inhibit::Active).is_err());
    assert_eq!(codes, before);
}

/// 9300 facts 3.4: the block writes the variables cyclically while the drive is enabled.
#[test]
fn variables_are_writable_while_enabled_and_repeats_change_nothing() {
    let mut codes = CodeStore::thesis();
    let changed = Ok(WriteEffect::Changed(Concern::Program));
    assert_eq!(codes.write(C1301, 1, 12_000_000, Inhibit::Inactive), changed);
    let generation = codes.generation();
    let again = codes.write(C1301, 1, 12_000_000, Inhibit::Inactive);
    assert_eq!(again, Ok(WriteEffect::Unchanged));
    assert_eq!(codes.generation(), generation);
}

/// 9300 facts 4.1: a test accepts 1099.9996 to 1100.0002 for 1200 mm − 100 mm.
#[test]
fn the_wired_position_is_formed_in_increments_and_cannot_be_written() {
    let mut codes = CodeStore::thesis();
    codes.write(C1301, 1, 1200_0000, Inhibit::Inactive).unwrap();
    let shown = codes.read(C1301, 61).unwrap();
    assert!((1099_9996..=1100_0002).contains(&shown), "{shown}");
    let refused = codes.write(C1301, 61, 0, Inhibit::Active).unwrap_err();
    assert_eq!(
        refused,
        CodeError::ReadOnly {
            code: C1301,
            subcode: 61
        }
    );
    assert!(codes.write(C1301, 60, 1_0000, Inhibit::Inactive).is_ok());
    assert_eq!(codes.read(C1301, 2), Ok(0), "nobody writes C1301/2");
}

#[test]
fn values_between_two_steps_are_cut() {
    let mut codes = CodeStore::thesis();
    codes.write(C1302, 1, 85_3799, Inhibit::Inactive).unwrap();
    assert_eq!(codes.read(C1302, 1), Ok(85_3700));
    codes.write(C0070, 0, 5_4999, Inhibit::Inactive).unwrap();
    assert_eq!(codes.number(C0070, 0), 5.0);
}

#[test]
fn a_command_changes_no_value_until_the_drive_shows_the_state() {
    let mut codes = CodeStore::thesis();
    codes.publish(C0043, 0, 1_0000).unwrap();
    let command = |value| Ok(WriteEffect::Command { code: C0043, value });
    assert_eq!(codes.write(C0043, 0, 1_0000, Inhibit::Inactive), command(1_0000));
    assert_eq!(codes.write(C0043, 0, 0, Inhibit::Inactive), command(0));
    assert_eq!(codes.read(C0043, 0), Ok(1_0000), "until the drive has reset it");
}

#[test]
fn the_drive_publishes_displays_within_their_range_and_nothing_else() {
    let mut codes = CodeStore::thesis();
    codes.publish(C0053, 0, 566_0000).unwrap();
    assert_eq!(codes.number(C0053, 0), 566.0);
    codes.publish(C0053, 0, i32::MAX).unwrap();
    assert_eq!(codes.number(C0053, 0), 900.0);
    assert!(codes.publish(C0011, 0, 0).is_err());
}

proptest! {
    #[test]
    fn any_write_is_answered_and_leaves_every_value_in_its_range(
        code in 0_u16..2000, subcode in 0_u8..=255, value: i32, inhibited: bool,
    ) {
        let mut codes = CodeStore::thesis();
        let inhibit = if inhibited { Inhibit::Active } else { Inhibit::Inactive };
        let accepted = codes.write(code, subcode, value, inhibit).is_ok();
        prop_assert!(!accepted || codes.read(code, subcode).is_ok());
        for line in CODE_TABLE {
            for subcode in line.first_subcode..=line.last_subcode {
                let value = codes.read(line.number, subcode).unwrap();
                prop_assert!((line.domain.min()..=line.domain.max()).contains(&value));
            }
        }
    }
}

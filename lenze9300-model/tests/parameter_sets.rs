//! Parameter sets: C0002, C0003, what the supply takes away, what differs from the factory setting.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use drivecom::AifControl;
use lenze9300_model::TICKS_PER_MS;
use lenze9300_model::code::table::number::*;
use lenze9300_model::code::{CodeError, CodeStore, Difference, Inhibit};
use lenze9300_model::device::{Drive, DriveConfig, SetNumber, SetNumberError};

const INHIBITED: AifControl = AifControl(0).with_controller_inhibit(true);

fn steps(drive: &mut Drive, milliseconds: u32) {
    for _ in 0..milliseconds * TICKS_PER_MS as u32 {
        drive.tick();
    }
}

/// Inhibited, past its self test.
fn drive() -> Drive {
    let mut drive = Drive::new(DriveConfig::default());
    drive.set_aif(INHIBITED);
    steps(&mut drive, 200);
    drive
}

fn transfer(drive: &mut Drive, code: u16, set: i32) {
    drive.write_code(code, 0, set * 10_000).unwrap();
    steps(drive, 201);
}

fn restarted(drive: Drive) -> Drive {
    Drive::power_up(DriveConfig::default(), drive.power_off())
}

#[test]
fn what_was_not_saved_is_lost_with_the_supply() {
    // 9300 facts 3.2: writing is to RAM and is lost at power-off unless C0003 = 1…4 saves.
    let mut drive = drive();
    drive.write_code(C0070, 0, 7_0000).unwrap();
    let mut drive = restarted(drive);
    assert_eq!(drive.read_code(C0070, 0), Ok(5_0000));
}

#[test]
fn set_1_is_loaded_at_every_power_up() {
    let mut drive = drive();
    drive.write_code(C0070, 0, 7_0000).unwrap();
    transfer(&mut drive, C0003, 1);
    drive.write_code(C0070, 0, 9_0000).unwrap();
    transfer(&mut drive, C0003, 2);
    let mut drive = restarted(drive);
    assert_eq!(drive.read_code(C0070, 0), Ok(7_0000));
    drive.set_aif(INHIBITED);
    steps(&mut drive, 200);
    transfer(&mut drive, C0002, 2);
    assert_eq!(drive.read_code(C0070, 0), Ok(9_0000));
}

#[test]
fn c0002_zero_loads_the_factory_setting_and_the_gains_follow() {
    let mut drive = drive();
    transfer(&mut drive, C0002, 0);
    let factory = CodeStore::factory();
    assert_eq!(drive.codes().differences(&factory).count(), 0);
    // The controllers work with it: C0075 = 0.35 instead of 0.75 (9300 facts 4.4).
    assert_eq!(drive.axis().params().codes.c0075_current_gain, 0.35);
    assert_eq!(drive.read_code(C1205, 0), factory.read(C1205, 0));
}

#[test]
fn during_a_transfer_every_job_is_refused() {
    // 9300 facts 3.3: 8/0/0000.
    let mut drive = drive();
    drive.write_code(C0003, 0, 4_0000).unwrap();
    for _ in 0..199 {
        steps(&mut drive, 1);
        assert_eq!(drive.read_code(C0011, 0), Err(CodeError::TransferRunning));
    }
    assert_eq!(drive.write_code(C0011, 0, 2000_0000), Err(CodeError::TransferRunning));
    steps(&mut drive, 1);
    assert_eq!(drive.read_code(C0011, 0), Ok(3000_0000));
    assert_eq!(
        drive.write_code(C0003, 0, 5_0000),
        Err(CodeError::TooHigh {
            code: 3,
            subcode: 0,
            max: 4_0000,
            got: 5_0000
        })
    );
}

#[test]
fn a_set_is_not_loaded_into_an_enabled_drive() {
    let mut drive = drive();
    drive.set_aif(AifControl(0));
    steps(&mut drive, 3);
    assert_eq!(
        drive.write_code(C0002, 0, 1_0000),
        Err(CodeError::OnlyWhileInhibited { code: 2, subcode: 0 })
    );
    // Saving it is harmless.
    assert_eq!(drive.write_code(C0003, 0, 3_0000), Ok(()));
}

#[test]
fn what_differs_from_the_factory_setting_is_what_was_commissioned() {
    // Film-feed specification, section 5: the codes of the thesis that have another value as delivered.
    let (thesis, factory) = (CodeStore::thesis(), CodeStore::factory());
    let codes: Vec<u16> = thesis.differences(&factory).map(|difference| difference.code).collect();
    assert_eq!(
        codes,
        [
            5, 22, 70, 71, 75, 76, 81, 84, 85, 86, 87, 88, 89, 90, 583, 584, 594, 1202, 1204, 1240, 1250
        ]
    );
    let mut changed = thesis.clone();
    changed.write(C1301, 1, 1200_0000, Inhibit::Inactive).unwrap();
    let only: Vec<Difference> = changed.differences(&thesis).collect();
    // The wired positions follow by themselves and are no setting.
    let expected = Difference {
        code: 1301,
        subcode: 1,
        here: 1200_0000,
        there: 0,
    };
    assert_eq!(only, [expected]);
}

#[test]
fn there_are_four_sets() {
    assert_eq!(SetNumber::new(0), Err(SetNumberError { got: 0 }));
    assert_eq!(SetNumber::new(5), Err(SetNumberError { got: 5 }));
    assert!((1..=4).all(|number| SetNumber::new(number).is_ok()));
}

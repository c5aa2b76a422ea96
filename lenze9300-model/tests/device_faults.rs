//! Faults as the codes configure them: reactions, fault memory, reset ways, restart, control word C0135.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use drivecom::AifControl;
use lenze9300_model::code::table::number::*;
use lenze9300_model::device::{Drive, DriveConfig, Fault, FaultSet, Reaction};
use lenze9300_model::plant::Mains;
use lenze9300_model::traverse::{Mode, Program, Record, Target};
use lenze9300_model::{Pulses, TICKS_PER_MS};

const ENABLED: AifControl = AifControl(0);
const INHIBITED: AifControl = ENABLED.with_controller_inhibit(true);

/// Something that is done to a drive.
type Act = fn(&mut Drive);

fn steps(drive: &mut Drive, milliseconds: u32) {
    for _ in 0..milliseconds * TICKS_PER_MS as u32 {
        drive.tick();
    }
}

fn ready_with(config: DriveConfig) -> Drive {
    let mut drive = Drive::new(config);
    drive.set_aif(ENABLED);
    steps(&mut drive, 200);
    drive
}

fn ready() -> Drive {
    let drive = ready_with(DriveConfig::default());
    assert_eq!(drive.diagnosis(), 0);
    drive
}

fn number(drive: &mut Drive, code: u16, subcode: u8) -> i32 {
    drive.read_code(code, subcode).unwrap() / 10_000
}

fn pulses(drive: &Drive) -> Pulses {
    drive.axis().sample().pulses
}

// ---- reactions

#[test]
fn every_fault_reacts_as_its_code_says() {
    // 9300 facts 4.4 (0 TRIP, 1 message, 2 warning, 3 off) and 4.9.
    for fault in Fault::ALL {
        // Without a code there is no choice but the factory setting.
        let choices = if fault.reaction_code().is_some() {
            fault.reactions()
        } else {
            &fault.reactions()[..1]
        };
        for &reaction in choices {
            let mut drive = ready();
            if let Some(code) = fault.reaction_code() {
                let value = match reaction {
                    Reaction::Trip => 0,
                    Reaction::Message => 1,
                    Reaction::Warning => 2,
                    _ => 3,
                };
                drive.write_code(code, 0, value * 10_000).unwrap();
            }
            drive.inject(fault, true);
            steps(&mut drive, 3);
            let status = drive.status();
            let seen = (status.trip, status.message, status.warning);
            let stopped = matches!(reaction, Reaction::Trip | Reaction::Message);
            let expected = (
                (reaction == Reaction::Trip).then_some(fault),
                reaction == Reaction::Message,
                reaction == Reaction::Warning,
            );
            assert_eq!(seen, expected, "{fault} as {reaction:?}");
            assert_eq!(pulses(&drive) == Pulses::Inhibited, stopped, "{fault} as {reaction:?}");
            let shown = if reaction == Reaction::Off {
                0
            } else {
                i32::from(fault.lecom_number(reaction))
            };
            assert_eq!(number(&mut drive, C0067, 0), shown, "{fault} as {reaction:?}");
            assert_eq!(number(&mut drive, C0168, 1), shown, "{fault} as {reaction:?}");
        }
    }
}

#[test]
fn fail_qsp_stops_the_axis_by_quick_stop_and_keeps_the_torque() {
    let mut drive = ready_with(DriveConfig {
        fail_qsp: FaultSet::default().with(Fault::P01, true),
        ..DriveConfig::default()
    });
    drive.inject(Fault::P01, true);
    steps(&mut drive, 3);
    assert!(drive.status().fail_qsp);
    // 9300 facts 4.4: C0183 = 151, quick stop from inside; 2.4: drive state 10.
    assert_eq!(number(&mut drive, C0183, 0), 151);
    assert_eq!(drive.status_word() >> 8 & 0xF, 10);
    assert_eq!(pulses(&drive), Pulses::Enabled);
    drive.inject(Fault::P01, false);
    steps(&mut drive, 3);
    assert_eq!(number(&mut drive, C0183, 0), 0);
}

#[test]
fn p15_warns_before_p14_trips_when_its_tolerance_is_the_smaller() {
    let mut drive = ready();
    // C1218/2 below C1218/1 = 5 units. The axis is held by a torque above its limit and cannot follow.
    drive.write_code(C1218, 2, 1_0000).unwrap();
    drive.set_load_torque(2.0);
    let mut warned = false;
    for _ in 0..2000 {
        steps(&mut drive, 1);
        if drive.status().trip.is_some() {
            break;
        }
        warned |= drive.status().warning;
    }
    assert_eq!(drive.status().trip, Some(Fault::P14));
    assert!(warned);
}

#[test]
fn c0173_moves_the_undervoltage_threshold() {
    // 9300 facts 4.8: LU below 285 V with C0173 = 1, below 342 V with 3. 230 V mains give 325 V.
    let mut config = DriveConfig::default();
    config.axis.dc_link.mains_v_rms = 230.0;
    let mut drive = ready_with(config);
    assert!(!drive.status().message);
    drive.set_aif(INHIBITED);
    steps(&mut drive, 2);
    drive.write_code(C0173, 0, 3_0000).unwrap();
    drive.set_aif(ENABLED);
    steps(&mut drive, 5);
    assert!(drive.status().undervoltage);
    assert_eq!(number(&mut drive, C0067, 0), 1030);
}

// ---- fault memory

#[test]
fn the_fault_memory_keeps_number_time_and_count() {
    let mut drive = ready();
    let occur = |drive: &mut Drive, fault| {
        drive.inject(fault, true);
        steps(drive, 3);
        drive.inject(fault, false);
        steps(drive, 3);
        drive.write_code(C0043, 0, 0).unwrap();
        steps(drive, 3);
    };
    steps(&mut drive, 1800);
    occur(&mut drive, Fault::Sd2);
    steps(&mut drive, 1000);
    occur(&mut drive, Fault::Sd2);
    occur(&mut drive, Fault::Oc2);
    // The present fault is none; the latest stands first. The first Sd2 came at 2.0 s, the second at 3.0 s of C0179.
    let row = |drive: &mut Drive, subcode| {
        (
            number(drive, C0168, subcode),
            drive.read_code(C0169, subcode).unwrap(),
            number(drive, C0170, subcode),
        )
    };
    assert_eq!(row(&mut drive, 1), (0, 0, 0));
    assert_eq!(row(&mut drive, 2), (12, 3, 1));
    assert_eq!(row(&mut drive, 3), (82, 3, 2));
    assert_eq!(row(&mut drive, 4), (0, 0, 0));
    drive.write_code(C0167, 0, 1_0000).unwrap();
    assert_eq!(row(&mut drive, 2), (0, 0, 0));
}

#[test]
fn the_fault_memory_survives_the_supply() {
    let mut drive = ready();
    drive.inject(Fault::Oc2, true);
    steps(&mut drive, 3);
    drive.inject(Fault::Oc2, false);
    steps(&mut drive, 3);
    drive.write_code(C0043, 0, 0).unwrap();
    steps(&mut drive, 3);
    let mut drive = Drive::power_up(DriveConfig::default(), drive.power_off());
    assert_eq!(number(&mut drive, C0168, 2), 12);
}

// ---- reset

#[test]
fn c0043_resets_a_trip_and_shows_it() {
    let mut drive = ready();
    drive.inject(Fault::Sd2, true);
    steps(&mut drive, 3);
    assert_eq!(number(&mut drive, C0043, 0), 1);
    drive.write_code(C0043, 0, 0).unwrap();
    steps(&mut drive, 3);
    assert_eq!(drive.status().trip, Some(Fault::Sd2), "the cause is there");
    drive.inject(Fault::Sd2, false);
    steps(&mut drive, 3);
    drive.write_code(C0043, 0, 0).unwrap();
    steps(&mut drive, 3);
    assert_eq!(number(&mut drive, C0043, 0), 0);
    assert_eq!(pulses(&drive), Pulses::Enabled);
}

// ---- control by codes

#[test]
fn c0135_works_beside_the_bus_module() {
    // 9300 facts 2.4: bit 3 QSP, 8 DISABLE, 9 CINH, 10 TRIP-SET, 11 TRIP-RESET; C0183: 152, 111, 124.
    let mut drive = ready();
    for (word, diagnosis, expected) in [
        (1 << 3, 152, Pulses::Enabled),
        (1 << 8, 111, Pulses::Inhibited),
        (1 << 9, 124, Pulses::Inhibited),
        (0, 0, Pulses::Enabled),
    ] {
        drive.write_code(C0135, 0, word).unwrap();
        steps(&mut drive, 3);
        assert_eq!(number(&mut drive, C0183, 0), diagnosis);
        assert_eq!(pulses(&drive), expected, "{word:#x}");
        assert_eq!(drive.read_code(C0135, 0), Ok(word));
    }
    drive.write_code(C0135, 0, 1 << 10).unwrap();
    steps(&mut drive, 3);
    assert_eq!(drive.status().trip, Some(Fault::Eer));
    drive.write_code(C0135, 0, 0).unwrap();
    steps(&mut drive, 3);
    drive.write_code(C0135, 0, 1 << 11).unwrap();
    steps(&mut drive, 3);
    assert_eq!(drive.status().trip, None);
}

#[test]
fn c0040_inhibits_and_tells_what_is_in_force() {
    let mut drive = ready();
    assert_eq!(number(&mut drive, C0040, 0), 1);
    drive.write_code(C0040, 0, 0).unwrap();
    steps(&mut drive, 3);
    assert_eq!((number(&mut drive, C0040, 0), number(&mut drive, C0183, 0)), (0, 124));
    assert_eq!(pulses(&drive), Pulses::Inhibited);
    drive.write_code(C0040, 0, 1_0000).unwrap();
    steps(&mut drive, 3);
    assert_eq!(number(&mut drive, C0040, 0), 1);
    // Another source of the inhibit is shown, too.
    drive.set_terminal_28(false);
    steps(&mut drive, 3);
    assert_eq!(number(&mut drive, C0040, 0), 0);
}

// ---- restart protection

#[test]
fn with_c0142_zero_a_standing_enable_does_not_start_the_drive_after_mains_on() {
    // 9300 facts 4.4: 0 = restart lock after mains on, message > 0.5 s, TRIP; C0183 = 141.
    let mut config = DriveConfig::default();
    config
        .codes
        .write(C0142, 0, 0, lenze9300_model::code::Inhibit::Active)
        .unwrap();
    let mut drive = ready_with(config);
    assert_eq!(drive.diagnosis(), 141);
    assert_eq!(pulses(&drive), Pulses::Inhibited);
    drive.set_aif(INHIBITED);
    steps(&mut drive, 2);
    drive.set_aif(ENABLED);
    steps(&mut drive, 2);
    assert_eq!(drive.diagnosis(), 0);
    assert_eq!(pulses(&drive), Pulses::Enabled);
}

#[test]
fn with_c0142_zero_a_standing_enable_does_not_start_the_drive_after_a_trip() {
    let mut drive = ready();
    drive.write_code(C0142, 0, 0).unwrap();
    drive.inject(Fault::Oc2, true);
    steps(&mut drive, 3);
    drive.inject(Fault::Oc2, false);
    steps(&mut drive, 3);
    drive.write_code(C0043, 0, 0).unwrap();
    steps(&mut drive, 100);
    assert_eq!((drive.status().trip, drive.diagnosis()), (None, 141));
    drive.set_terminal_28(false);
    steps(&mut drive, 2);
    drive.set_terminal_28(true);
    steps(&mut drive, 2);
    assert_eq!(pulses(&drive), Pulses::Enabled);
}

#[test]
fn an_enable_that_is_given_after_the_reset_needs_no_second_one() {
    let mut drive = ready();
    drive.write_code(C0142, 0, 0).unwrap();
    drive.inject(Fault::Oc2, true);
    steps(&mut drive, 3);
    drive.inject(Fault::Oc2, false);
    drive.set_aif(INHIBITED);
    steps(&mut drive, 3);
    drive.write_code(C0043, 0, 0).unwrap();
    steps(&mut drive, 3);
    drive.set_aif(ENABLED);
    steps(&mut drive, 3);
    assert_eq!(pulses(&drive), Pulses::Enabled);
}

// ---- displays

#[test]
fn the_displays_agree_with_the_motor_and_the_sample() {
    let mut drive = ready();
    drive.set_load_torque(0.3);
    steps(&mut drive, 300);
    let sample = *drive.axis().sample();
    let shown = |drive: &mut Drive, code| f64::from(drive.read_code(code, 0).unwrap()) / 10_000.0;
    // Source: 9300 facts 6: pole pairs 60 · 200/4000 = 3, 1.05 Nm at C0022 = 1.35 A.
    assert_eq!(shown(&mut drive, C0059), 3.0);
    assert!((shown(&mut drive, C0057) - 1.05).abs() < 1e-3);
    assert!((shown(&mut drive, C0056) - 100.0 * sample.torque_ref / 1.05).abs() < 0.1);
    // 0.3 Nm and friction of 0.05 Nm to either side over 0.778 Nm/A: 0.321 to 0.450 A.
    assert!(
        (0.32..0.451).contains(&shown(&mut drive, C0054)),
        "{}",
        shown(&mut drive, C0054)
    );
    assert_eq!(
        shown(&mut drive, C0060),
        (sample.position.rem_euclid(65_536) / 32) as f64
    );
    assert_eq!(drive.read_code(C0859, 0), Ok(drive.position() as i32));
}

#[test]
fn c0150_shows_state_and_reasons_bit_by_bit() {
    // 9300 facts 2.4: 1 IMP, 6 n = 0, 7 CINH, 8–11 state (3 inhibited, 6 enabled, 7 message, 8 TRIP), 12 warning, 13 message.
    let rows: [(&str, Act, i32); 5] = [
        ("enabled", |_| {}, 0x0640),
        ("inhibited", |drive| drive.set_aif(INHIBITED), 0x03C2),
        ("warning", |drive| drive.inject(Fault::Oh4, true), 0x1640),
        ("message", |drive| drive.inject(Fault::Ou, true), 0x2742),
        ("TRIP", |drive| drive.inject(Fault::Oc2, true), 0x0842),
    ];
    for (name, act, word) in rows {
        let mut drive = ready();
        act(&mut drive);
        steps(&mut drive, 3);
        let shown = drive.read_code(C0150, 0).unwrap();
        assert_eq!(shown, word, "{name}: {shown:#06x}");
    }
}

#[test]
fn the_hours_count_mains_and_enable() {
    let mut drive = ready();
    // 0.2 s have passed, 0.1 s of them enabled.
    steps(&mut drive, 2800);
    drive.set_aif(INHIBITED);
    steps(&mut drive, 1000);
    drive.set_mains(Mains::Off);
    steps(&mut drive, 2000);
    assert_eq!(drive.read_code(C0179, 0), Ok(4));
    assert_eq!(drive.read_code(C0178, 0), Ok(2));
}

// ---- the traversing program

#[test]
fn an_absolute_record_without_reference_trips_with_p06_and_the_trip_can_be_reset() {
    let absolute = Record::new(Mode::Absolute, Target::Variable(1));
    let mut drive = ready_with(DriveConfig {
        program: Program::new([(1, absolute)]).unwrap(),
        ..DriveConfig::default()
    });
    drive.set_aif(ENABLED.with_program_start(true));
    steps(&mut drive, 3);
    assert_eq!(drive.status().trip, Some(Fault::P06));
    assert_eq!(number(&mut drive, C0067, 0), 156);
    drive.set_aif(INHIBITED.with_program_reset(true));
    steps(&mut drive, 3);
    drive.write_code(C0043, 0, 0).unwrap();
    steps(&mut drive, 3);
    assert_eq!(drive.status().trip, None);
}

#[test]
fn a_message_of_more_than_half_a_second_loses_the_reference() {
    // 9300 facts 2.5. Record 01 of the film feed sets it.
    let mut drive = ready();
    drive.set_aif(ENABLED.with_program_start(true));
    steps(&mut drive, 2000);
    assert!(drive.traverse_status().referenced);
    drive.inject(Fault::Lu, true);
    steps(&mut drive, 500);
    assert!(drive.traverse_status().referenced);
    steps(&mut drive, 10);
    assert!(!drive.traverse_status().referenced);
}

// ---- heat

/// A motor that holds more than it may: 1.05 Nm at C0022 = 1.35 A against I_0 = 0.90 A.
fn overloaded() -> Drive {
    let mut drive = ready();
    drive.set_load_torque(1.0);
    drive
}

#[test]
fn a_motor_that_holds_too_much_warns_and_then_trips() {
    // C0086 = 108 sets OH7 to warn and OH3 to trip (9300 facts 4.4). Current (1.0 ± 0.05) Nm / 0.778 Nm/A, and the losses grow with its
    // square: the winding would end at 25 + 100·(1.22…1.35/0.9)² = 209…250 °C.
    let mut drive = overloaded();
    drive.write_code(C0121, 0, 120_0000).unwrap();
    let mut warned_at = None;
    // Every 20 ms: without torque the load turns the shaft to NMAX within 60 ms, and that TRIP would be seen instead.
    let tripped_at = (0..100_000).find(|_| {
        steps(&mut drive, 20);
        if warned_at.is_none() && drive.status().warning {
            warned_at = Some(number(&mut drive, C0063, 0));
        }
        drive.status().trip.is_some()
    });
    assert_eq!(drive.status().trip, Some(Fault::Oh3));
    assert!(tripped_at.is_some());
    assert_eq!(warned_at, Some(120));
    // The TRIP came within the last 20 ms.
    assert!((149..=150).contains(&number(&mut drive, C0063, 0)));
    // It must cool before the TRIP can be reset.
    drive.write_code(C0043, 0, 0).unwrap();
    steps(&mut drive, 10);
    assert_eq!(drive.status().trip, Some(Fault::Oh3));
    // Without pulses the load has turned the motor.
    drive.set_load_torque(0.0);
    while number(&mut drive, C0063, 0) >= 145 || !drive.status().standstill {
        steps(&mut drive, 1000);
    }
    drive.write_code(C0043, 0, 0).unwrap();
    steps(&mut drive, 10);
    assert_eq!(drive.status().trip, None);
}

#[test]
fn the_film_feed_leaves_motor_and_drive_cool() {
    // 9300 facts 4.10: with C0022 = 1.35 A the drive never leaves its continuous range, OC5 cannot occur.
    let mut drive = overloaded();
    steps(&mut drive, 200_000);
    let load = number(&mut drive, C0064, 0);
    // 1.22…1.35 A of 1.05 · 2.5 A.
    assert!((46..=52).contains(&load), "{load} %");
    assert!((25..50).contains(&number(&mut drive, C0061, 0)));
}

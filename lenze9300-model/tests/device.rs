//! The drive behind its terminals and its bus command: enabling, quick stop, messages, TRIPs, displays.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use drivecom::AifControl;
use lenze9300_model::code::table::{CODE_TABLE, Writable, entry};
use lenze9300_model::code::{CodeError, CodeStore, Inhibit};
use lenze9300_model::device::{Drive, DriveConfig, Fault, Reaction};
use lenze9300_model::plant::Mains;
use lenze9300_model::traverse::{JogParameters, TraverseParameters};
use lenze9300_model::units::Rpm;
use lenze9300_model::{Pulses, TICKS_PER_MS};

/// Enabled, and nothing else.
const ENABLED: AifControl = AifControl(0);
const INHIBITED: AifControl = ENABLED.with_controller_inhibit(true);
const JOG: AifControl = ENABLED.with_manual(true).with_manual_positive(true);

/// Something that is done to a drive.
type Act = fn(&mut Drive);

fn steps(drive: &mut Drive, milliseconds: u32) {
    for _ in 0..milliseconds {
        for _ in 0..TICKS_PER_MS {
            drive.tick();
        }
    }
}

/// Milliseconds until the condition holds; at most ten seconds.
fn until(drive: &mut Drive, mut done: impl FnMut(&Drive) -> bool) -> u32 {
    for ms in 0..10_000 {
        if done(drive) {
            return ms;
        }
        steps(drive, 1);
    }
    panic!("not reached in ten seconds");
}

fn ready_with(config: DriveConfig, codes: &[(u16, u8, i32)]) -> Drive {
    let mut config = config;
    for &(code, subcode, value) in codes {
        config.codes.write(code, subcode, value, Inhibit::Active).unwrap();
    }
    let mut drive = Drive::new(config);
    // After the self test, because with C0142 = 0 an enable that stands at power-up is not obeyed.
    steps(&mut drive, 150);
    drive.set_aif(ENABLED);
    steps(&mut drive, 50);
    assert_eq!(drive.diagnosis(), 0);
    drive
}

fn ready() -> Drive {
    ready_with(DriveConfig::default(), &[])
}

/// Manual traversing at `percent` of 1200 mm/s, acceleration 2400 mm/s².
fn jog_config(percent: i32) -> DriveConfig {
    DriveConfig {
        traverse: TraverseParameters {
            jog: JogParameters {
                velocity_percent_e4: percent * 10_000,
                ..JogParameters::default()
            },
            ..TraverseParameters::default()
        },
        ..DriveConfig::default()
    }
}

fn rpm(drive: &Drive) -> f64 {
    Rpm::from_rad_s(drive.axis().sample().omega_true).0
}

/// C0067 and C0183 as the bus reads them.
fn displays(drive: &mut Drive) -> (i32, i32) {
    (
        drive.read_code(67, 0).unwrap() / 10_000,
        drive.read_code(183, 0).unwrap() / 10_000,
    )
}

// ---- power-up

#[test]
fn during_the_self_test_nothing_is_enabled() {
    let mut drive = Drive::new(DriveConfig::default());
    drive.set_aif(ENABLED);
    // 100 ms, assumed.
    steps(&mut drive, 100);
    assert!(!drive.status().initialised);
    assert_eq!(displays(&mut drive), (0, 101));
    assert_eq!(drive.axis().sample().pulses, Pulses::Inhibited);
    steps(&mut drive, 2);
    assert!(drive.status().initialised);
    assert_eq!(displays(&mut drive), (0, 0));
    assert_eq!(drive.axis().sample().pulses, Pulses::Enabled);
}

#[test]
fn before_the_first_command_of_a_module_the_drive_is_inhibited() {
    let mut drive = Drive::new(DriveConfig::default());
    steps(&mut drive, 200);
    assert!(drive.inhibited());
    assert_eq!(displays(&mut drive), (0, 125));
}

// ---- terminal 28

#[test]
fn terminal_28_takes_the_torque_within_a_millisecond_and_gives_it_back() {
    let mut drive = ready();
    // Holds against a load above the static friction.
    drive.set_load_torque(0.3);
    steps(&mut drive, 100);
    assert!((drive.axis().sample().torque - 0.3).abs() < 0.06);
    drive.set_terminal_28(false);
    steps(&mut drive, 1);
    let sample = drive.axis().sample();
    assert_eq!((sample.pulses, sample.torque), (Pulses::Inhibited, 0.0));
    assert_eq!(displays(&mut drive), (0, 121));
    assert!(!drive.status().released);
    drive.set_load_torque(0.0);
    drive.set_terminal_28(true);
    steps(&mut drive, 2);
    assert_eq!(drive.axis().sample().pulses, Pulses::Enabled);
    assert!(drive.status().released);
}

#[test]
fn the_falling_edge_at_terminal_28_resets_a_trip_and_the_rising_edge_does_not() {
    let mut drive = ready();
    let trip = |drive: &mut Drive| {
        drive.inject(Fault::Oc2, true);
        steps(drive, 2);
        drive.inject(Fault::Oc2, false);
        steps(drive, 2);
        assert_eq!(drive.status().trip, Some(Fault::Oc2));
    };
    trip(&mut drive);
    drive.set_terminal_28(false);
    steps(&mut drive, 1);
    assert_eq!(drive.status().trip, None);
    // A TRIP that comes while the terminal is low stays: low is no edge, and rising is none that counts.
    trip(&mut drive);
    steps(&mut drive, 100);
    assert_eq!(drive.status().trip, Some(Fault::Oc2));
    drive.set_terminal_28(true);
    steps(&mut drive, 100);
    assert_eq!(drive.status().trip, Some(Fault::Oc2));
}

// ---- quick stop

#[test]
fn quick_stop_follows_the_ramp_of_c0105_and_holds_the_axis_afterwards() {
    // C0105 = 1 s from C0011 = 3000 rpm: 3000 rpm/s (9300 facts 2.5). 60 % of 1200 mm/s are 1688.7 rpm.
    let mut drive = ready_with(jog_config(60), &[(105, 0, 1_0000)]);
    drive.set_aif(JOG);
    steps(&mut drive, 1000);
    let start = rpm(&drive);
    assert!((start - 1688.7).abs() < 5.0, "{start}");
    drive.set_aif(ENABLED.with_quick_stop(true));
    for ms in 1..=600 {
        steps(&mut drive, 1);
        let expected = (start - 3.0 * f64::from(ms)).max(0.0);
        // Two-sided: neither faster nor slower than the ramp, but for the lag of the speed controller.
        assert!(
            (rpm(&drive) - expected).abs() < 40.0,
            "{ms} ms: {} for {expected}",
            rpm(&drive)
        );
    }
    steps(&mut drive, 100);
    assert!(drive.status().standstill);
    assert_eq!(displays(&mut drive), (0, 153));
    // Torque stays on.
    drive.set_load_torque(0.3);
    steps(&mut drive, 300);
    assert!((drive.axis().sample().torque - 0.3).abs() < 0.06);
    assert!(rpm(&drive).abs() < 1.0);
}

#[test]
fn with_c0105_zero_quick_stop_brakes_at_the_torque_limit() {
    let mut drive = ready_with(jog_config(60), &[(105, 0, 0)]);
    drive.set_aif(JOG);
    steps(&mut drive, 1000);
    drive.set_aif(ENABLED.with_quick_stop(true));
    steps(&mut drive, 3);
    // C0022 = 1.35 A: 1.05 Nm (9300 facts 6).
    assert!((drive.axis().sample().torque + 1.05).abs() < 0.03);
    let stands = 3 + until(&mut drive, |drive| drive.status().standstill);
    // 176.8 rad/s and 0.914e-4 kg m² against 1.05 and 0.05 Nm of friction down to 1.05 Nm/K_p = 62.8 rad/s: 9.5 ms.
    // The rest dies out along exp(−t K_p/J), 5.5 ms, and friction: 29 ms without it to 0.314 rad/s.
    assert!((12..=40).contains(&stands), "{stands} ms");
    steps(&mut drive, 200);
    assert!(drive.status().standstill);
}

#[test]
fn after_a_quick_stop_the_set_value_starts_where_the_axis_is() {
    let mut drive = ready_with(jog_config(60), &[(105, 0, 5000)]);
    drive.set_aif(JOG);
    steps(&mut drive, 500);
    drive.set_aif(ENABLED.with_quick_stop(true));
    steps(&mut drive, 600);
    let stopped = drive.position();
    drive.set_aif(ENABLED);
    for _ in 0..200 {
        steps(&mut drive, 1);
        assert!((drive.position() - stopped).abs() < 64, "a jump of the set-value");
        assert!(drive.following_error().abs() < 64);
    }
}

// ---- messages

#[test]
fn without_mains_lu_is_a_message_that_goes_by_itself() {
    let mut drive = ready();
    drive.set_mains(Mains::Off);
    until(&mut drive, |drive| drive.status().message);
    // Below 285 V (9300 facts 4.8).
    let u_dc = drive.axis().sample().u_dc;
    assert!((275.0..285.0).contains(&u_dc), "{u_dc}");
    assert!(drive.status().undervoltage && drive.inhibited());
    assert_eq!(drive.status().trip, None);
    assert_eq!(displays(&mut drive), (1030, 104));
    drive.set_mains(Mains::On);
    until(&mut drive, |drive| !drive.status().message);
    steps(&mut drive, 2);
    assert_eq!(displays(&mut drive), (0, 0));
    assert_eq!(drive.axis().sample().pulses, Pulses::Enabled);
}

#[test]
fn braking_a_heavy_load_without_a_brake_module_is_ou_a_message_that_goes_by_itself() {
    let mut config = jog_config(100);
    config.axis.mechanics.j_load_kg_m2 = 2.0e-3;
    // The heavy load cannot follow 2400 mm/s²: the following error is not the subject.
    let mut drive = ready_with(config, &[(1218, 1, 2_000_000_000), (255, 0, 180_000_000)]);
    drive.set_aif(JOG);
    until(&mut drive, |drive| rpm(drive) > 2800.0);
    drive.set_aif(ENABLED.with_quick_stop(true));
    until(&mut drive, |drive| drive.status().message);
    // Above 770 V (9300 facts 4.8).
    assert!(drive.axis().sample().u_dc > 755.0);
    assert!(!drive.status().undervoltage && drive.inhibited());
    assert_eq!(displays(&mut drive), (1020, 104));
    until(&mut drive, |drive| !drive.status().message);
    assert!(drive.axis().sample().u_dc <= 755.0);
    assert_eq!(drive.status().trip, None);
}

/// The drive after an LU message of so many milliseconds.
fn after_message(milliseconds: u32, c0142: i32) -> Drive {
    let mut drive = ready_with(DriveConfig::default(), &[(142, 0, c0142)]);
    drive.inject(Fault::Lu, true);
    steps(&mut drive, milliseconds);
    assert!(drive.inhibited());
    drive.inject(Fault::Lu, false);
    steps(&mut drive, 2);
    drive
}

#[test]
fn after_a_message_of_half_a_second_the_drive_goes_on_whatever_c0142_says() {
    for c0142 in [0, 1_0000] {
        let mut drive = after_message(500, c0142);
        assert_eq!(displays(&mut drive), (0, 0), "C0142 = {c0142}");
        assert!(!drive.inhibited());
    }
}

#[test]
fn after_a_longer_message_c0142_decides_between_restart_and_restart_protection() {
    // 1: automatic, as delivered.
    let mut drive = after_message(501, 1_0000);
    assert_eq!(displays(&mut drive), (0, 0));
    assert!(!drive.inhibited());
    // 0: C0183 = 141 until the enable was taken away and given again.
    for take_away in [
        |drive: &mut Drive, away: bool| drive.set_terminal_28(!away),
        |drive: &mut Drive, away: bool| drive.set_aif(if away { INHIBITED } else { ENABLED }),
    ] {
        let mut drive = after_message(501, 0);
        assert_eq!(displays(&mut drive), (0, 141));
        steps(&mut drive, 2000);
        assert!(drive.inhibited());
        take_away(&mut drive, true);
        steps(&mut drive, 2);
        assert!(drive.inhibited());
        take_away(&mut drive, false);
        steps(&mut drive, 2);
        assert_eq!(displays(&mut drive), (0, 0));
        assert!(!drive.inhibited());
    }
}

#[test]
fn two_short_messages_are_no_long_one() {
    let mut drive = after_message(400, 0);
    drive.inject(Fault::Lu, true);
    steps(&mut drive, 400);
    drive.inject(Fault::Lu, false);
    steps(&mut drive, 2);
    assert!(!drive.inhibited());
}

// ---- TRIP

/// Every way to reset a TRIP.
const RESETS: [(&str, Act); 3] = [
    ("AIF", |drive| {
        drive.set_aif(ENABLED.with_trip_reset(true));
        steps(drive, 1);
        drive.set_aif(ENABLED);
        steps(drive, 1);
    }),
    ("terminal 28", |drive| {
        drive.set_terminal_28(false);
        steps(drive, 1);
        drive.set_terminal_28(true);
        steps(drive, 1);
    }),
    ("C0043 = 0", |drive| {
        drive.write_code(43, 0, 0).unwrap();
        steps(drive, 1);
    }),
];

#[test]
fn a_reset_is_refused_while_the_cause_is_present_and_does_not_wait_for_it_to_go() {
    for (name, reset) in RESETS {
        let mut drive = ready();
        drive.inject(Fault::Sd2, true);
        steps(&mut drive, 2);
        reset(&mut drive);
        assert_eq!(drive.status().trip, Some(Fault::Sd2), "{name}");
        assert!(drive.status().trip_cause_present);
        drive.inject(Fault::Sd2, false);
        steps(&mut drive, 100);
        assert_eq!(drive.status().trip, Some(Fault::Sd2), "{name}: the used-up reset acted");
        assert!(!drive.status().trip_cause_present);
        reset(&mut drive);
        assert_eq!(drive.status().trip, None, "{name}");
        steps(&mut drive, 2);
        assert!(!drive.inhibited(), "{name}");
    }
}

#[test]
fn a_reset_command_that_stands_resets_once() {
    let mut drive = ready();
    drive.set_aif(ENABLED.with_trip_reset(true));
    steps(&mut drive, 10);
    drive.inject(Fault::Sd2, true);
    steps(&mut drive, 2);
    drive.inject(Fault::Sd2, false);
    steps(&mut drive, 100);
    assert_eq!(drive.status().trip, Some(Fault::Sd2));
}

#[test]
fn a_trip_takes_the_torque_and_ends_the_motion() {
    let mut drive = ready_with(jog_config(20), &[]);
    drive.set_aif(JOG);
    steps(&mut drive, 500);
    drive.inject(Fault::Oc2, true);
    steps(&mut drive, 1);
    let sample = drive.axis().sample();
    assert_eq!((sample.pulses, sample.torque), (Pulses::Inhibited, 0.0));
    assert_eq!(displays(&mut drive), (12, 102));
}

/// What a blocked shaft trips with, and after how many milliseconds of manual traversing at 120 mm/s.
fn blocked(codes: &[(u16, u8, i32)]) -> (Option<Fault>, u32) {
    let mut drive = ready_with(jog_config(10), codes);
    // The motor gives 1.05 Nm, the friction holds 0.05 Nm: 1.08 Nm are held, but no more than that.
    for share in 1..=500 {
        drive.set_load_torque(1.08 * f64::from(share) / 500.0);
        steps(&mut drive, 2);
    }
    assert_eq!(drive.status().trip, None, "held at rest");
    assert!(drive.axis().sample().torque > 1.02);
    let start = drive.position();
    drive.set_aif(JOG);
    let ms = until(&mut drive, |drive| {
        drive.status().trip.is_some() || drive.following_error() > 1_000_000
    });
    // 0.1 mm.
    assert!((drive.position() - start).abs() < 256, "it moved");
    (drive.status().trip, ms)
}

#[test]
fn a_blocked_shaft_trips_with_p14_at_the_tolerance_of_c1218() {
    // 5 mm behind a set-value that reaches 120 mm/s in 50 ms and 3 mm: 50 + 2/0.12 = 66.7 ms.
    let (trip, ms) = blocked(&[]);
    assert_eq!(trip, Some(Fault::P14));
    assert!((58..=70).contains(&ms), "{ms} ms");
    // Half of it earlier.
    let (trip, ms) = blocked(&[(1218, 1, 2_0000)]);
    assert_eq!(trip, Some(Fault::P14));
    assert!((30..=46).contains(&ms), "{ms} ms");
}

#[test]
fn a_blocked_shaft_trips_with_p03_at_c0255_when_that_is_nearer() {
    // 5124 inc are 2 mm (9300 facts 11).
    let (trip, ms) = blocked(&[(255, 0, 5124)]);
    assert_eq!(trip, Some(Fault::P03));
    assert!((30..=46).contains(&ms), "{ms} ms");
    // Both far away: no TRIP.
    let (trip, _) = blocked(&[(255, 0, 180_000_000), (1218, 1, 2_000_000_000)]);
    assert_eq!(trip, None);
}

#[test]
fn a_free_shaft_does_not_trip() {
    let mut drive = ready_with(jog_config(100), &[]);
    drive.set_aif(JOG);
    steps(&mut drive, 2000);
    drive.set_aif(ENABLED);
    steps(&mut drive, 1000);
    assert_eq!(drive.status().trip, None);
}

#[test]
fn a_motor_driven_faster_than_c0596_trips_with_nmax() {
    let mut drive = ready();
    drive.set_aif(INHIBITED);
    // Nothing but the friction holds it.
    drive.set_load_torque(-0.4);
    until(&mut drive, |drive| drive.status().trip.is_some());
    assert_eq!(drive.status().trip, Some(Fault::Nmax));
    assert!((5500.0..5700.0).contains(&rpm(&drive)), "{}", rpm(&drive));
}

// ---- displays

#[test]
fn c0183_shows_why_the_drive_does_not_move_and_c0067_the_fault() {
    // 9300 facts 4.4 (C0183) and 4.9 (LECOM numbers: n TRIP, 1000 + n message).
    let rows: [(&str, Act, (i32, i32)); 12] = [
        ("nothing", |_| {}, (0, 0)),
        (
            "AIF disable",
            |drive| drive.set_aif(ENABLED.with_disable(true)),
            (0, 112),
        ),
        ("terminal 28", |drive| drive.set_terminal_28(false), (0, 121)),
        ("AIF inhibit", |drive| drive.set_aif(INHIBITED), (0, 125)),
        (
            "AIF QSP",
            |drive| drive.set_aif(ENABLED.with_quick_stop(true)),
            (0, 153),
        ),
        ("LU", |drive| drive.inject(Fault::Lu, true), (1030, 104)),
        ("OU", |drive| drive.inject(Fault::Ou, true), (1020, 104)),
        ("EEr", |drive| drive.set_aif(ENABLED.with_trip_set(true)), (91, 102)),
        ("CE0", |drive| drive.inject(Fault::Ce0, true), (61, 102)),
        ("OC2", |drive| drive.inject(Fault::Oc2, true), (12, 102)),
        ("Sd2", |drive| drive.inject(Fault::Sd2, true), (82, 102)),
        ("NMAX", |drive| drive.inject(Fault::Nmax, true), (200, 102)),
    ];
    for (name, cause, expected) in rows {
        let mut drive = ready();
        cause(&mut drive);
        steps(&mut drive, 3);
        assert_eq!(displays(&mut drive), expected, "{name}");
    }
}

#[test]
fn of_several_reasons_c0183_shows_the_lowest_number_and_c0067_the_highest_reaction() {
    let mut drive = ready();
    drive.set_terminal_28(false);
    drive.set_aif(INHIBITED.with_quick_stop(true).with_disable(true));
    steps(&mut drive, 2);
    assert_eq!(displays(&mut drive), (0, 112));
    drive.inject(Fault::Lu, true);
    steps(&mut drive, 2);
    assert_eq!(displays(&mut drive), (1030, 104));
    drive.inject(Fault::Sd2, true);
    steps(&mut drive, 2);
    assert_eq!(displays(&mut drive), (82, 102));
}

#[test]
fn a_message_and_a_trip_have_the_error_codes_of_the_profile() {
    // 9300 facts 1.4.
    for (fault, code) in [
        (Fault::Lu, 0x3220),
        (Fault::Ou, 0x3210),
        (Fault::Oc2, 0x2330),
        (Fault::Sd2, 0x7303),
        (Fault::P03, 0x8611),
        (Fault::Eer, 0x9000),
        (Fault::Ce0, 0x8100),
        (Fault::Nmax, 0x1000),
    ] {
        let mut drive = ready();
        assert_eq!(drive.drivecom_error_code(), 0);
        drive.inject(fault, true);
        steps(&mut drive, 2);
        assert_eq!(drive.drivecom_error_code(), code, "{fault}");
        let stays = fault.reaction(drive.codes()) == Reaction::Trip;
        drive.inject(fault, false);
        steps(&mut drive, 2);
        assert_eq!(drive.drivecom_error_code() != 0, stays, "{fault}");
    }
}

// ---- codes

#[test]
fn codes_in_brackets_are_refused_while_enabled_and_accepted_under_any_inhibit() {
    // 9300 facts 3.4; those of the list that the table has.
    let bracketed = [5, 6, 81, 84, 85, 86, 87, 88, 89, 90, 91, 173, 1202, 1203, 1204];
    let in_table: Vec<u16> = CODE_TABLE
        .iter()
        .filter(|entry| entry.writable == Writable::OnlyInhibited)
        .map(|entry| entry.number)
        .collect();
    assert!(bracketed.iter().all(|code| in_table.contains(code)), "{in_table:?}");
    let inhibits: [Act; 5] = [
        |drive| drive.set_terminal_28(false),
        |drive| drive.set_aif(INHIBITED),
        |drive| drive.set_aif(ENABLED.with_disable(true)),
        |drive| drive.inject(Fault::Lu, true),
        |drive| drive.inject(Fault::Oc2, true),
    ];
    for &code in &in_table {
        let mut drive = ready();
        let subcode = entry(code).unwrap().first_subcode;
        let value = drive.read_code(code, subcode).unwrap();
        assert_eq!(
            drive.write_code(code, subcode, value),
            Err(CodeError::OnlyWhileInhibited { code, subcode })
        );
        for inhibit in inhibits {
            let mut drive = ready();
            inhibit(&mut drive);
            steps(&mut drive, 1);
            assert_eq!(drive.write_code(code, subcode, value), Ok(()), "C{code:04}");
        }
    }
}

#[test]
fn quick_stop_is_no_inhibit() {
    let mut drive = ready();
    drive.set_aif(ENABLED.with_quick_stop(true));
    steps(&mut drive, 100);
    assert_eq!(
        drive.write_code(86, 0, 108_0000),
        Err(CodeError::OnlyWhileInhibited { code: 86, subcode: 0 })
    );
    // Gains and the variables of the program are writable at any time.
    for (code, subcode) in [(70, 0), (71, 0), (105, 0), (254, 0), (1301, 1), (1302, 1), (1303, 1)] {
        let value = CodeStore::thesis().read(code, subcode).unwrap();
        assert_eq!(drive.write_code(code, subcode, value), Ok(()));
    }
}

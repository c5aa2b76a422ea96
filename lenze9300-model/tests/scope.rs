//! The oscilloscope: memory, trigger, pre-trigger, files.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use drivecom::AifControl;
use lenze9300_model::TICKS_PER_MS;
use lenze9300_model::code::Inhibit;
use lenze9300_model::device::{Drive, DriveConfig, Fault};
use lenze9300_model::scope::{Depth, Edge, Scope, ScopeConfig, ScopeError, ScopeState, Trigger};
use lenze9300_model::signal::Signal;

const ENABLED: AifControl = AifControl(0);

fn millisecond(drive: &mut Drive, scope: &mut Scope) {
    for _ in 0..TICKS_PER_MS {
        drive.tick();
    }
    scope.sample(drive);
}

/// A drive of the film feed, ready for 1200 mm at full speed.
fn ready() -> Drive {
    let mut config = DriveConfig::default();
    for (code, value) in [(1301, 1200_0000), (1302, 100_0000), (1303, 100_0000)] {
        config.codes.write(code, 1, value, Inhibit::Active).unwrap();
    }
    let mut drive = Drive::new(config);
    drive.set_aif(ENABLED);
    for _ in 0..200 * TICKS_PER_MS {
        drive.tick();
    }
    drive
}

fn on_speed(pre_trigger_percent: u8) -> ScopeConfig {
    ScopeConfig {
        trigger: Some(Trigger {
            signal: Signal::PosNout,
            level: 1.0,
            edge: Edge::Rising,
        }),
        pre_trigger_percent,
        ..ScopeConfig::original([Signal::PosNout, Signal::MctrlNact])
    }
}

#[test]
fn the_picture_of_the_thesis_can_be_taken() {
    // Fig. 73: POS-NOUT and MCTRL-NACT over a feed of 1.5 s; the motor follows within about 2 % (film-feed specification, 9).
    let mut drive = ready();
    let mut scope = Scope::new(on_speed(10)).unwrap();
    for ms in 0..4000 {
        drive.set_aif(ENABLED.with_program_start(ms >= 500));
        millisecond(&mut drive, &mut scope);
    }
    assert_eq!(scope.state(), ScopeState::Done);
    let rows: Vec<_> = scope.recording().rows().collect();
    assert_eq!(rows.len(), 2048);
    // 204 samples before the trigger.
    assert_eq!(rows.first().map(|row| row.0), Some(-0.204));
    let (time_s, values) = &rows[204];
    assert_eq!(*time_s, 0.0);
    assert!(values[0] >= 1.0 && rows[203].1[0] < 1.0, "{values:?}");
    // 1200 mm/s are 93.82 % of C0011 (9300 facts 11), from 0.5 s to 1.0 s of the feed.
    let (_, plateau) = &rows[204 + 750];
    assert!((plateau[0] - 93.82).abs() < 0.01, "{plateau:?}");
    for (time_s, values) in &rows {
        assert!((values[0] - values[1]).abs() < 2.0, "{time_s} s: {values:?}");
    }
}

#[test]
fn without_a_trigger_the_memory_fills_at_once() {
    let mut drive = ready();
    let mut scope = Scope::new(ScopeConfig {
        depth: Depth::Samples(10),
        interval_ms: 3,
        ..ScopeConfig::original([Signal::DcLink])
    })
    .unwrap();
    for _ in 0..27 {
        millisecond(&mut drive, &mut scope);
        assert_eq!(scope.state(), ScopeState::Running);
    }
    millisecond(&mut drive, &mut scope);
    assert_eq!(scope.state(), ScopeState::Done);
    let times: Vec<f64> = scope.recording().rows().map(|row| row.0).collect();
    assert_eq!((times.len(), times[0], times[9]), (10, 0.0, 0.027));
}

#[test]
fn a_trigger_that_comes_before_the_pre_trigger_is_full_is_not_taken() {
    let mut drive = ready();
    let mut scope = Scope::new(on_speed(50)).unwrap();
    drive.set_aif(ENABLED.with_program_start(true));
    for _ in 0..1000 {
        millisecond(&mut drive, &mut scope);
        assert_eq!(scope.state(), ScopeState::Filling);
    }
    for _ in 0..1100 {
        millisecond(&mut drive, &mut scope);
    }
    assert_eq!(scope.state(), ScopeState::Armed);
}

#[test]
fn a_trigger_between_two_samples_is_not_lost() {
    let mut drive = ready();
    let mut scope = Scope::new(ScopeConfig {
        interval_ms: 100,
        trigger: Some(Trigger {
            signal: Signal::Fault,
            level: 1.0,
            edge: Edge::Rising,
        }),
        pre_trigger_percent: 0,
        ..ScopeConfig::original([Signal::Fault])
    })
    .unwrap();
    for ms in 0..150 {
        // A warning of 20 ms, over before the next sample.
        drive.inject(Fault::Oh4, (110..130).contains(&ms));
        millisecond(&mut drive, &mut scope);
    }
    assert_eq!(scope.state(), ScopeState::Running);
}

#[test]
fn unlimited_memory_records_until_it_is_stopped() {
    let mut drive = ready();
    let mut scope = Scope::new(ScopeConfig {
        depth: Depth::Unlimited,
        ..ScopeConfig::original([Signal::PosAct])
    })
    .unwrap();
    for _ in 0..5000 {
        millisecond(&mut drive, &mut scope);
    }
    assert_eq!(scope.state(), ScopeState::Running);
    scope.stop();
    millisecond(&mut drive, &mut scope);
    assert_eq!(scope.recording().rows().count(), 5000);
}

#[test]
fn a_recording_is_written_as_csv() {
    let mut drive = ready();
    let mut scope = Scope::new(ScopeConfig {
        depth: Depth::Samples(2),
        ..ScopeConfig::original([Signal::StatusWord, Signal::DcLink])
    })
    .unwrap();
    for _ in 0..2 {
        millisecond(&mut drive, &mut scope);
    }
    let mut text = Vec::new();
    scope.recording().table().write_csv(&mut text).unwrap();
    let text = String::from_utf8(text).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "time_s,C0150,U-DC V");
    // Enabled, at standstill: 0x0640 = 1600.
    assert!(lines[1].starts_with("0,1600,56"), "{text}");
    assert!(lines[2].starts_with("0.001,1600,56"), "{text}");
    assert_eq!(lines.len(), 3);
}

#[test]
fn what_cannot_be_recorded_is_told() {
    let config = ScopeConfig::original([Signal::Torque]);
    let error = |config: ScopeConfig| Scope::new(config).map(|_| ()).unwrap_err();
    assert_eq!(error(ScopeConfig::original([])), ScopeError::NoChannel);
    let none = ScopeConfig {
        interval_ms: 0,
        ..config.clone()
    };
    assert_eq!(error(none), ScopeError::NoInterval);
    let empty = ScopeConfig {
        depth: Depth::Samples(0),
        ..config.clone()
    };
    assert_eq!(error(empty), ScopeError::NoMemory);
    let beyond = ScopeConfig {
        pre_trigger_percent: 101,
        ..config
    };
    assert_eq!(error(beyond), ScopeError::PreTrigger { got: 101 });
}

#[test]
fn every_signal_is_found_by_its_name_and_none_by_another() {
    for signal in Signal::ALL {
        assert_eq!(signal.name().to_lowercase().parse(), Ok(signal));
        assert!(!signal.meaning().is_empty());
        assert!(signal.read(&ready()).is_finite());
    }
    let error = "N-SOLL".parse::<Signal>().unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("`N-SOLL` is no signal; there are POS-SETP,"),
        "{error}"
    );
}

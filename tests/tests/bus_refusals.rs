//! Slaves that do not fit the project: told by the master, by the report, and without a movement.

use dp_master::dp::{MasterEvent, SlaveState};
use film_feed::operator::FeedPlan;
use film_feed::report::FeedMode;
use film_feed::rig::{Rig, RigConfig};
use system_tests::{SECOND, powered_up, run, series};

/// Two seconds of machine time with everything the master tells.
fn events(rig: &mut Rig) -> Vec<MasterEvent> {
    let mut told = Vec::new();
    while rig.now_ns() < 2 * SECOND {
        rig.cycle(&mut ());
        while let Some(event) = rig.master_mut().poll_event() {
            told.push(event);
        }
    }
    told
}

fn short_wait() -> FeedPlan {
    FeedPlan {
        start_up_limit_ns: 2 * SECOND,
        ..series(FeedMode::Length, 1)
    }
}

#[test]
fn a_drive_with_another_ident_number_is_refused_and_the_master_names_its_number() {
    let mut config = RigConfig::default();
    config.module.ident = 0x1234;
    let mut rig = powered_up(&config);
    rig.inputs_mut().enable = true;
    let told = events(&mut rig);
    let refusals: Vec<u16> = told
        .iter()
        .filter_map(|event| match event {
            MasterEvent::ParametersRefused { diagnosis, .. } => Some(diagnosis.ident),
            _ => None,
        })
        .collect();
    assert!(
        !refusals.is_empty() && refusals.iter().all(|ident| *ident == 0x1234),
        "{told:?}"
    );
    assert!(
        !told
            .iter()
            .any(|event| matches!(event, MasterEvent::DataExchange { .. })),
        "{told:?}"
    );
    assert_ne!(rig.slave_state(), SlaveState::DataExchange);

    let report = run(&config, short_wait());
    assert!(!report.ok && report.feeds.is_empty(), "{report}");
    let reason = report.aborted.expect("it says why");
    assert!(
        reason.contains("did not become ready") && reason.contains("0x1234"),
        "{reason}"
    );
}

#[test]
fn a_configuration_the_module_does_not_have_is_refused_and_told() {
    // Fact sheet, section 1.2: F3 and F0 + (n−1) or 70 + (n−1); anything else is Cfg_Fault. B7 B7 are 8 octets in and out,
    // twice: the same lengths as F3 F3, but bytes where the module has words.
    let config = RigConfig {
        identifiers: &[0xB7, 0xB7],
        ..RigConfig::default()
    };
    let mut rig = powered_up(&config);
    rig.inputs_mut().enable = true;
    let told = events(&mut rig);
    assert!(
        told.iter()
            .any(|event| matches!(event, MasterEvent::ConfigurationRefused { .. })),
        "{told:?}"
    );
    assert!(
        !told
            .iter()
            .any(|event| matches!(event, MasterEvent::DataExchange { .. })),
        "{told:?}"
    );
    assert_eq!(rig.film().position_mm(), 0.0);

    let report = run(&config, short_wait());
    assert!(!report.ok && report.feeds.is_empty(), "{report}");
    let reason = report.aborted.expect("it says why");
    assert!(reason.contains("refused its configuration"), "{reason}");
}

#[test]
fn with_a_configuration_of_other_lengths_the_block_finds_no_periphery() {
    // PAR and two words: the module takes it (fact sheet, section 1.2), but SFC 14 and 15 refuse 8 octets of process data.
    let config = RigConfig {
        identifiers: &[0xF3, 0xF1],
        ..RigConfig::default()
    };
    let mut rig = powered_up(&config);
    rig.inputs_mut().enable = true;
    let told = events(&mut rig);
    assert!(
        told.iter()
            .any(|event| matches!(event, MasterEvent::DataExchange { .. })),
        "{told:?}"
    );
    assert!(!rig.outputs().drive_ready && !rig.outputs().switched_on);
    assert_eq!(rig.parameter_watch().rounds(), 0);
}

#[test]
fn a_module_that_is_not_on_the_line_is_asked_for_again_and_again_and_told() {
    let mut rig = powered_up(&RigConfig::default());
    rig.disconnect_module();
    let told = events(&mut rig);
    assert!(
        !told
            .iter()
            .any(|event| matches!(event, MasterEvent::DataExchange { .. })),
        "{told:?}"
    );
    assert!(rig.master().statistics().timeouts > 0);
    rig.reconnect_module();
    assert!(rig.run_until(SECOND, |rig| rig.slave_state() == SlaveState::DataExchange));
}

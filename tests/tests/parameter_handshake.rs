//! The parameter channel through the whole chain: late, silent, refusing drives, and one that starts with handshake 1.

use dp_master::dp::SlaveState;
use drivecom::param::{AnswerStyle, Handshake, ServerOptions};
use film_feed::report::FeedMode;
use film_feed::rig::{Rig, RigConfig};
use system_tests::{MILLISECOND, SECOND, powered_up, ready, run, run_for, series};

/// Codes the watch named, with what it said.
fn told(rig: &Rig) -> Vec<(String, String)> {
    rig.parameter_watch()
        .troubles()
        .iter()
        .map(|trouble| (trouble.code.clone(), trouble.what.clone()))
        .collect()
}

/// The seven telegrams in the order they are sent (film-feed specification, section 8, step 11).
const SEVEN: [&str; 7] = [
    "C1302/1", "C1302/2", "C1303/1", "C1301/1", "C1204/0", "C1202/0", "C1203/0",
];

fn with_delay(parameter_delay_ms: u32) -> RigConfig {
    let mut config = RigConfig::default();
    config.module.parameter_delay_ms = parameter_delay_ms;
    config.module.parameter_jitter_ms = 0;
    config
}

#[test]
fn a_drive_in_time_gives_no_trouble() {
    let mut rig = ready(&RigConfig::default());
    run_for(&mut rig, 10 * SECOND);
    assert_eq!(told(&rig), []);
    // Fact sheet, section 1.6: a job takes 30 to 50 ms, then PLC cycles and the bus: seven jobs in at most 0.5 s.
    assert!(
        rig.parameter_watch().rounds() > 20,
        "{}",
        rig.parameter_watch().rounds()
    );
}

#[test]
fn a_late_drive_is_waited_for_and_no_trouble_below_a_second() {
    let mut rig = powered_up(&with_delay(900));
    rig.inputs_mut().distance = 12_000;
    run_for(&mut rig, 15 * SECOND);
    assert_eq!(told(&rig), []);
    assert!(rig.parameter_watch().rounds() >= 2);
    assert_eq!(rig.drive().codes().read(1301, 1), Ok(1200_0000));
}

#[test]
fn a_drive_that_takes_seconds_is_told_for_every_parameter_and_still_gets_them_all() {
    let mut rig = powered_up(&with_delay(2_500));
    rig.inputs_mut().distance = 12_000;
    rig.inputs_mut().velocity = 10_000;
    run_for(&mut rig, 40 * SECOND);
    let told = told(&rig);
    let codes: Vec<&str> = told.iter().map(|(code, _)| code.as_str()).collect();
    assert_eq!(codes, SEVEN);
    assert!(
        told.iter()
            .all(|(_, what)| what == "the drive did not answer within 1000 ms"),
        "{told:?}"
    );
    assert_eq!(rig.drive().codes().read(1301, 1), Ok(1200_0000));
    assert_eq!(rig.drive().codes().read(1302, 1), Ok(100_0000));
    // And the constants came back: POS_ACT is a number, 0 at the reference.
    assert!(rig.outputs().position_mm.is_finite());
}

#[test]
fn a_feed_lands_with_a_drive_whose_parameters_take_seconds() {
    let report = run(&with_delay(1_500), series(FeedMode::Length, 1));
    assert!(report.ok, "{report}");
    assert_eq!(report.parameters.len(), 7, "{report}");
}

#[test]
fn a_drive_that_falls_silent_is_told_with_the_parameter_that_waits() {
    let mut rig = ready(&RigConfig::default());
    rig.disconnect_module();
    let waiting = SEVEN[usize::from(rig.block().telegram_counter())];
    run_for(&mut rig, 900 * MILLISECOND);
    assert_eq!(told(&rig), [], "not before a second has passed");
    run_for(&mut rig, 300 * MILLISECOND);
    let told_then = told(&rig);
    assert_eq!(told_then.len(), 1, "{told_then:?}");
    assert_eq!(told_then[0].1, "the drive did not answer within 1000 ms");
    // The exchange under way when the cable was cut may just have been completed.
    let next = SEVEN[(usize::from(rig.block().telegram_counter())) % 7];
    assert!(told_then[0].0 == waiting || told_then[0].0 == next, "{told_then:?}");

    // Film-feed specification, section 8.1 point 8: the block itself hangs as long as nobody answers, Error_RESET or not.
    let rounds = rig.parameter_watch().rounds();
    rig.inputs_mut().error_reset = true;
    run_for(&mut rig, 100 * MILLISECOND);
    rig.inputs_mut().error_reset = false;
    run_for(&mut rig, 5 * SECOND);
    assert_eq!(rig.parameter_watch().rounds(), rounds);
    let places: Vec<u8> = (1..=11).filter(|place| rig.block().marking().holds(*place)).collect();
    // Point 17: it rests in {5, 6} or {6, 7}, with 10 of the exchange.
    assert!([vec![5, 6, 10], vec![6, 7, 10]].contains(&places), "{places:?}");

    rig.reconnect_module();
    assert!(
        rig.run_until(5 * SECOND, |rig| rig.slave_state() == SlaveState::DataExchange
            && rig.parameter_watch().rounds() > rounds + 1)
    );
}

#[test]
fn a_drive_that_refuses_is_told_for_every_parameter_with_the_reason() {
    // Fact sheet, section 3.3: while a parameter set is transferred every job is refused with 08 00 0000.
    let mut config = RigConfig::default();
    config.drive.parameter_transfer_ms = 2500;
    let mut rig = ready(&config);
    assert_eq!(rig.block().constants().feed_constant, 179.0708);
    rig.inputs_mut().distance = 15_000;
    // C0003 = 2 saves the set that works; the length of the block is the old one then.
    rig.drive_mut().write_code(3, 0, 2_0000).expect("set 2 can be saved");
    run_for(&mut rig, 2 * SECOND);
    let told_then = told(&rig);
    let mut codes: Vec<&str> = told_then.iter().map(|(code, _)| code.as_str()).collect();
    codes.sort_unstable();
    let mut seven = SEVEN;
    seven.sort_unstable();
    assert_eq!(codes, seven);
    assert!(
        told_then
            .iter()
            .all(|(_, what)| what.starts_with("the drive refused it: ")),
        "{told_then:?}"
    );

    // Fact sheet, section 9.1: the block takes the error for the constant: 0x08000000 / 10000 = 13 421.7728.
    assert_eq!(rig.block().constants().feed_constant, 134_217_728_f32 / 10_000.0);
    // Rejected writes go unnoticed by the block: the drive still has the old length.
    assert_eq!(rig.drive().codes().read(1301, 1), Ok(1200_0000));
    assert!(!rig.outputs().error);

    // The rest of the transfer, and a second more.
    run_for(&mut rig, 1500 * MILLISECOND);
    assert_eq!(rig.block().constants().feed_constant, 179.0708);
    assert_eq!(rig.drive().codes().read(1301, 1), Ok(1500_0000));
    assert_eq!(told(&rig).len(), 7, "nothing new");
}

#[test]
fn a_report_names_refused_parameters() {
    let mut config = RigConfig::default();
    config.module.server = ServerOptions {
        initial_handshake: Handshake::Set,
        ..ServerOptions::default()
    };
    let report = run(&config, series(FeedMode::Length, 1));
    assert!(report.ok, "{report}");
    assert_eq!(report.parameters.len(), 1, "{report}");
    assert!(
        report
            .to_string()
            .contains("parameter C1302/1: it never reached the drive"),
        "{report}"
    );
}

#[test]
fn a_drive_that_starts_with_handshake_1_never_gets_the_first_telegram_and_that_is_told() {
    // Film-feed specification, section 8.1 point 8: telegram 0 counts as done without having been delivered.
    let mut config = RigConfig::default();
    config.module.server = ServerOptions {
        initial_handshake: Handshake::Set,
        ..ServerOptions::default()
    };
    let mut rig = powered_up(&config);
    rig.inputs_mut().velocity = 9_000;
    let factory = rig.drive().codes().read(1302, 1).unwrap();
    assert!(rig.run_until(5 * SECOND, |rig| rig.parameter_watch().rounds() == 1));
    // Velocity is telegram 0, all others have arrived in the first round.
    assert_eq!(rig.drive().codes().read(1302, 1), Ok(factory));
    assert_eq!(rig.drive().codes().read(1301, 1), Ok(200_0000));
    assert_eq!(
        told(&rig),
        [(
            "C1302/1".to_string(),
            "it never reached the drive: the handshake already stood as the block awaited it".to_string()
        )]
    );
    // The next round carries it.
    assert!(rig.run_until(5 * SECOND, |rig| rig.parameter_watch().rounds() == 2));
    assert_eq!(rig.drive().codes().read(1302, 1), Ok(90_0000));
    run_for(&mut rig, 5 * SECOND);
    assert_eq!(told(&rig).len(), 1);
}

#[test]
fn the_block_works_with_every_style_of_answer_and_nobody_is_accused() {
    // Fact sheet, section 9, row 22.
    for style in [
        AnswerStyle::Cleared,
        AnswerStyle::RequestCopied,
        AnswerStyle::HandshakeOnly,
    ] {
        let mut config = RigConfig::default();
        config.module.server.style = style;
        let report = run(&config, series(FeedMode::Length, 1));
        assert!(report.ok, "{style:?}: {report}");
        assert_eq!(report.parameters, [], "{style:?}");
    }
}

#[test]
fn an_error_reset_in_the_middle_of_a_handshake_loses_a_telegram_and_that_is_told() {
    // Film-feed specification, section 8.1 point 7.
    let mut rig = ready(&with_delay(100));
    assert!(rig.run_until(SECOND, |rig| rig.block().telegram_counter() == 2));
    run_for(&mut rig, 20 * MILLISECOND);
    rig.inputs_mut().error_reset = true;
    run_for(&mut rig, 10 * MILLISECOND);
    rig.inputs_mut().error_reset = false;
    run_for(&mut rig, 200 * MILLISECOND);
    assert_eq!(
        told(&rig),
        [(
            "C1302/1".to_string(),
            "its answer never came, the block took an older one for it".to_string()
        )]
    );
    run_for(&mut rig, 5 * SECOND);
    assert_eq!(told(&rig).len(), 1);
}

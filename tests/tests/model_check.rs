//! The models of start-up and parameter handshake, searched to the end; and wrong machines, which the search must catch.
//!
//! The longer ones run with `cargo run --release -p system-tests --bin model_check`, and here with `--ignored`.

use system_tests::model_check::{
    Case, DriveFlaw, Handshake, Limits, MODELS, Model, Report, SlaveFlaw, StartUp, Trouble, Verdict, WatchdogChoice,
    search,
};

fn run(name: &str) -> Report {
    let model = MODELS.iter().find(|model| model.name == name).expect("it is listed");
    (model.run)(&mut |_| {})
}

/// Every rule holds but for these, all of which the original is documented to break.
fn assert_only(report: &Report, documented: &[(&str, &str)]) {
    assert_eq!(report.verdict(), Verdict::Holds, "{report}");
    assert!(report.exhausted && report.goals > 0, "{report}");
    let mut found: Vec<_> = report.documented().map(|case| (case.what, case.documented)).collect();
    found.sort_unstable();
    let expected = documented.iter();
    let mut expected: Vec<_> = expected.map(|(what, source)| (*what, Some(*source))).collect();
    expected.sort_unstable();
    assert_eq!(found, expected, "{report}");
}

/// What a wrong machine is caught with. The search need not go on to the end for that.
fn caught(model: &impl Model, states: usize) -> Vec<Case> {
    let report = search(model, Limits { states }, &mut |_| {});
    assert_eq!(report.verdict(), Verdict::Violated, "{report}");
    report.violations().cloned().collect()
}

fn case<'a>(cases: &'a [Case], what: &str) -> &'a Case {
    let case = cases.iter().find(|case| case.what.starts_with(what));
    case.unwrap_or_else(|| panic!("expected \"{what}\" among {cases:?}"))
}

const LOST: &str = "a telegram counts as done that the drive never got";
const DEAD_END: &str = "dead end: undisturbed, it never works again";

// What is documented: film-feed specification, section 8.1; 9300 fact sheet, section 9.1.

#[test]
fn a_bus_that_loses_images_loses_no_job_and_a_refusal_goes_unnoticed() {
    const FACTS: &str = "fact sheet 9.1: errors taken as data, rejected writes unnoticed";
    assert_only(
        &run("handshake-bus"),
        &[
            ("a refused parameter goes unnoticed", FACTS),
            ("an error code is taken for a constant", FACTS),
        ],
    );
}

#[test]
fn without_refusals_nothing_at_all_is_found() {
    let model = Handshake::new("lossy", &[Trouble::LostImage, Trouble::NewLength]);
    assert_only(&search(&model, Limits::default(), &mut |_| {}), &[]);
}

#[test]
fn an_error_reset_loses_a_telegram_and_nothing_hangs() {
    assert_only(
        &run("handshake-reset"),
        &[(
            LOST,
            "8.1 point 7: a reset during a handshake loses a telegram of that round",
        )],
    );
}

#[test]
fn a_drive_that_begins_with_1_loses_the_first_telegram_by_the_path_of_the_specification() {
    let report = run("handshake-set");
    assert_only(
        &report,
        &[(
            LOST,
            "8.1 point 8: a drive that begins with handshake 1 makes telegram 0 count as done",
        )],
    );
    let path = &case(&report.findings, LOST).path;
    // Power-up, the cycle that sends telegram 0, the cycle that takes the standing 1 for its answer.
    assert_eq!(path.len(), 3, "{path:?}");
    assert!(path[2].starts_with("T2 T9 T11 T12 T13"), "{path:?}");
}

#[test]
fn a_swallowed_request_is_the_only_dead_end_and_error_reset_is_no_way_out() {
    let report = run("handshake-swallowed");
    assert_only(
        &report,
        &[
            (
                LOST,
                "8.1 point 7: a reset during a handshake loses a telegram of that round",
            ),
            (DEAD_END, "8.1 point 8: a swallowed request hangs for ever"),
        ],
    );
    assert_eq!(report.dead_ends.len(), 1, "{report}");
    assert!(
        report.dead_ends[0]
            .path
            .iter()
            .any(|step| step.contains("drive swallows the job")),
        "{report}"
    );
}

#[test]
#[ignore = "a minute; the program model_check and CI run it"]
fn a_restart_or_cleared_outputs_confuse_both_and_then_they_go_on() {
    for name in ["handshake-power", "handshake-cleared"] {
        const ZEROS: &str = "8.1 point 9: an image that falls to 0 while handshake 0 is awaited is taken as data 0";
        const AGAIN: &str = "spec notes: a request that still stands after a restart or cleared outputs is taken again";
        assert_only(
            &run(name),
            &[
                (LOST, ZEROS),
                ("what the block stored is not what the drive answered", ZEROS),
                ("the drive carried a telegram out twice", AGAIN),
                ("the drive was given another job than the one in work", AGAIN),
            ],
        );
    }
}

#[test]
fn a_start_up_goes_wrong_nowhere_and_always_ends_in_data_exchange() {
    let report = run("start-up-short");
    assert_only(&report, &[]);
    // Diagnosis, Set_Prm, Chk_Cfg, diagnosis and exchange are ten telegrams; a wrong start and its diagnosis come before.
    assert!((10..=20).contains(&report.longest_way_back), "{report}");
}

#[test]
#[ignore = "a minute; the program model_check and CI run it"]
fn a_start_up_goes_wrong_nowhere_with_a_long_watchdog_or_none() {
    assert_only(&run("start-up"), &[]);
    assert_only(&run("start-up-long"), &[]);
}

#[test]
fn a_drive_that_repeats_a_job_is_caught() {
    let model = Handshake::new("wrong", &[Trouble::LostImage]).with_flaw(DriveFlaw::RepeatsJobs);
    let cases = caught(&model, 2_000);
    let path = &case(&cases, "the drive carried a telegram out twice").path;
    assert!(path.len() <= 4, "the shortest path: {path:?}");
}

#[test]
fn a_drive_that_answers_before_the_job_is_done_is_caught() {
    let model = Handshake::new("wrong", &[]).with_flaw(DriveFlaw::AnswersEarly);
    case(&caught(&model, 2_000), LOST);
}

#[test]
fn a_drive_that_forgets_what_it_refuses_is_caught_as_a_dead_end() {
    let model = Handshake::new("wrong", &[Trouble::Refusal]).with_flaw(DriveFlaw::ForgetsRefused);
    let cases = caught(&model, 2_000);
    let path = &case(&cases, DEAD_END).path;
    assert!(path.iter().any(|step| step.contains("drive refuses")), "{path:?}");
}

#[test]
fn a_slave_that_takes_repetitions_for_new_is_caught() {
    let model = StartUp::new(WatchdogChoice::Short).with_flaw(SlaveFlaw::TakesRepetitionsForNew);
    let cases = caught(&model, 1_000);
    for what in ["Set_Prm carried out twice", "an exchange was carried out twice"] {
        let path = &case(&cases, what).path;
        let disturbed = path
            .iter()
            .any(|step| !step.starts_with("delivered") && !step.starts_with("power-up"));
        assert!(disturbed, "{path:?}");
    }
}

#[test]
fn a_slave_that_keeps_its_parameters_in_data_exchange_is_caught_as_a_dead_end() {
    let model = StartUp::new(WatchdogChoice::Off).with_flaw(SlaveFlaw::KeepsItsParameters);
    let cases = caught(&model, 2_500);
    let path = &case(&cases, DEAD_END).path;
    assert!(path.iter().any(|step| step.starts_with("master restarted")), "{path:?}");
}

#[test]
fn a_search_that_is_cut_off_proves_nothing() {
    let report = search(&StartUp::new(WatchdogChoice::Off), Limits { states: 100 }, &mut |_| {});
    assert_eq!(report.verdict(), Verdict::Incomplete);
    assert!(!report.exhausted && report.dead_ends.is_empty(), "{report}");
}

#[test]
fn the_report_for_machines_has_the_agreed_keys() {
    let json = serde_json::to_value(run("handshake-set")).expect("it serialises");
    assert_eq!(json["model"], "handshake-set");
    assert_eq!(json["result"], "holds");
    assert_eq!((&json["dead_ends"], &json["exhausted"]), (&0.into(), &true.into()));
    assert!(json["states"].as_u64() > Some(100) && json["transitions"].as_u64() > json["states"].as_u64());
    assert_eq!(json["documented"][0]["what"], LOST);
}

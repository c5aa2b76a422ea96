//! Many machines at once: the same result whatever the way, and what the results say.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use film_feed::run::{Observation, simulated};
use film_feed::sweep::{self, MergeError, ResultTable, Setting, Shard, SweepSpec};

/// 12 machines with 2 feeds each.
const GRID: &str = r#"
layout = "grid"
feeds = 2
[set]
feed.mode = "mark"
[[parameter]]
name = "feed.mark_speed_mm_s"
from = 180
to = 520
steps = 3
[[parameter]]
name = "positioning.latch"
values = ["exact", "sampled"]
[[parameter]]
name = "codes.C0070"
values = [4, 6.5]
"#;

fn spec(text: &str) -> SweepSpec {
    SweepSpec::read(text, |_| Err("not to be read".to_owned())).unwrap_or_else(|error| panic!("{error}"))
}

fn run(spec: &SweepSpec, shard: Shard, threads: usize) -> ResultTable {
    let mut table = ResultTable::new(spec);
    let points: Vec<u64> = (1..=spec.points()).filter(|point| shard.has(*point)).collect();
    sweep::check(spec, &points).unwrap_or_else(|error| panic!("{error}"));
    sweep::run(spec, &points, threads, |row| {
        table.rows.push(row);
        Ok(())
    })
    .expect("every point was checked");
    table.sort();
    table
}

fn octets(table: &ResultTable) -> (Vec<u8>, Vec<u8>) {
    let (mut csv, mut parquet) = (Vec::new(), Vec::new());
    table.write_csv(&mut csv).expect("a vector takes everything");
    table.write_parquet(&mut parquet).expect("a vector takes everything");
    (csv, parquet)
}

#[test]
fn threads_shards_and_file_formats_leave_every_bit_as_it_is() {
    let spec = spec(GRID);
    assert_eq!(spec.points(), 12);
    let whole = run(&spec, Shard::WHOLE, 1);
    let expected = octets(&whole);
    assert_eq!(octets(&run(&spec, Shard::WHOLE, 2)), expected);

    let parts: Vec<ResultTable> = (1..=3).map(|part| run(&spec, Shard { part, of: 3 }, 2)).collect();
    assert_eq!(parts.iter().map(|part| part.rows.len()).collect::<Vec<_>>(), [4, 4, 4]);
    // Each part goes through a file, of either kind.
    let through_files: Vec<ResultTable> = parts
        .iter()
        .enumerate()
        .map(|(n, part)| {
            let (csv, parquet) = octets(part);
            match n {
                1 => ResultTable::read_csv(csv.as_slice()).unwrap(),
                _ => ResultTable::read_parquet(bytes::Bytes::from(parquet)).unwrap(),
            }
        })
        .collect();
    let merged = sweep::merge(through_files).unwrap();
    assert_eq!(octets(&merged), expected);

    let missing = sweep::merge(parts[..2].to_vec());
    assert_eq!(
        missing.unwrap_err(),
        MergeError::Missing {
            missing: 4,
            points: 12,
            first: 3
        }
    );
    let mut other = parts.clone();
    other[1].sweep = "0123456789abcdef".to_owned();
    assert!(matches!(
        sweep::merge(other),
        Err(MergeError::OtherSweep { part: 2, .. })
    ));
    let mut changed = parts.clone();
    changed[2].rows[0].outcome.values[5] += 1.0;
    let changed = [parts, changed].concat();
    assert_eq!(sweep::merge(changed), Err(MergeError::Contradiction { point: 3 }));
}

#[test]
fn a_row_is_what_a_run_of_its_machine_reports() {
    let spec = spec(GRID);
    let machine = spec.machine(6).unwrap();
    // In a grid the last parameter goes fastest: point 6 is the second speed, the first latch, the second gain.
    let expected = [
        Setting::Number(350.0),
        Setting::Word("exact".to_owned()),
        Setting::Number(6.5),
    ];
    assert_eq!(machine.settings, expected);
    let (report, _) = simulated(&machine.rig, machine.plan.clone(), Observation::FeedsOnly, || {}).unwrap();
    let row = machine.run().unwrap();
    assert_eq!(row.outcome.value("feeds"), 2.0);
    let largest = |value: &dyn Fn(&film_feed::report::FeedReport) -> Option<f64>| {
        report.feeds.iter().filter_map(value).fold(f64::NEG_INFINITY, f64::max)
    };
    for (name, expected) in [
        (
            "abs_error_max_um",
            largest(&|feed| feed.error_mm.map(|mm| mm.abs() * 1000.0)),
        ),
        ("in_position_max_s", largest(&|feed| feed.in_position_s)),
        ("job_max_s", largest(&|feed| feed.job_s)),
        ("peak_current_a", largest(&|feed| feed.peak_current_a)),
        ("mains_j", report.energy.as_ref().unwrap().mains_j),
    ] {
        assert_eq!(row.outcome.value(name), expected, "{name}");
    }
}

/// 9300 facts 4.2: the film runs backwards above √(2·a·50 mm), 489.9 mm/s at 2400 mm/s².
#[test]
fn the_film_runs_backwards_on_machines_above_the_formulas_speed_and_on_no_other() {
    let table = run(
        &spec(
            r#"
            feeds = 3
            [set]
            feed.mode = "mark"
            [[parameter]]
            name = "feed.mark_speed_mm_s"
            values = [240, 450, 485, 495, 530]
            "#,
        ),
        Shard::WHOLE,
        0,
    );
    let limit = (2.0 * 2400.0 * 50.0_f64).sqrt();
    for (row, speed) in table.rows.iter().zip([240.0, 450.0, 485.0, 495.0, 530.0]) {
        let expected = if speed > limit { 3.0 } else { 0.0 };
        assert_eq!(row.outcome.value("reversed"), expected, "{speed}");
    }
}

/// A mark that is seen late is taken for one that lies further on by the way of the delay: v · t.
#[test]
fn a_late_reader_makes_the_feed_too_long_by_speed_times_delay() {
    let table = run(
        &spec(
            r#"
            feeds = 5
            seeds = "same"
            [set]
            feed.mode = "mark"
            feed.mark_speed_mm_s = 240
            [[parameter]]
            name = "marks.reader_delay_us"
            values = [0, 200, 1000]
            "#,
        ),
        Shard::WHOLE,
        0,
    );
    let error_um = |place: usize| table.rows[place].outcome.value("error_p50_um");
    for (place, delay_us) in [(1, 200.0), (2, 1000.0)] {
        let expected_um = 240.0e3 * delay_us * 1e-6;
        let found_um = error_um(place) - error_um(0);
        // Three increments of 0.39 µm: latch, target and rest are whole ones.
        assert!((found_um - expected_um).abs() < 1.2, "{delay_us} µs: {found_um} µm");
    }
}

#[test]
fn mistakes_of_a_spec_are_told_once_each_with_line_and_remedy() {
    let text = r#"layout = "grid"
feeds = 0
count = 5
sped = 1
[set]
run.fidelty = "f2"
[[parameter]]
name = "feed.speed_mm_s"
from = 1
steps = 1
scale = "cubic"
[[parameter]]
values = []
"#;
    let error = SweepSpec::read(text, |_| Err(String::new())).unwrap_err().to_string();
    for expected in [
        "line 2: feeds: expected 1 to 1000, got 0",
        "line 3: count: only a random layout has one; leave it out",
        "line 4: `sped` is unknown here; allowed are machine, catalogue, layout, count, feeds, seed, seeds, set, parameter",
        "line 6: set: `run.fidelty` is unknown; beside the keys of a MACHINE.toml there are run.fidelity, run.bit_error_rate,",
        "line 7: parameter.to is missing; expected is a number from",
        "line 10: parameter.steps: expected 2 to 1000000, got 1",
        "line 11: parameter.scale: expected linear or log, got cubic",
        "line 12: parameter.name is missing",
        "line 13: parameter.values: expected a list of numbers or texts with at least one",
    ] {
        assert!(error.contains(expected), "{expected}\nis not in\n{error}");
    }
    assert_eq!(error.matches("line ").count(), 9, "{error}");
    let missing = SweepSpec::read("machine = \"x.toml\"\n", |path| Err(format!("{path} cannot be read")));
    let missing = missing.unwrap_err().to_string();
    assert_eq!(
        missing,
        "line 1: machine: x.toml cannot be read; line 1: there is no [[parameter]]; name at least one that is varied"
    );
}

#[test]
fn points_that_are_no_machine_are_told_before_anything_runs() {
    let spec = spec(
        r#"
        [[parameter]]
        name = "feed.mark_speed_mm_s"
        values = [200, 1300, 1400]
        [[parameter]]
        name = "noise.resolver_inc"
        values = [1, 5000]
        "#,
    );
    let all: Vec<u64> = (1..=spec.points()).collect();
    let error = sweep::check(&spec, &all).unwrap_err().to_string();
    assert!(error.starts_with("6 of 6 points cannot run: "), "{error}");
    for expected in [
        "point 1 (feed.mark_speed_mm_s = 200, noise.resolver_inc = 1): noise.resolver_inc acts from fidelity f2 on, this is f1; set run.fidelity",
        "point 2 (feed.mark_speed_mm_s = 200, noise.resolver_inc = 5000): noise.resolver_inc: expected 0 to 1000",
        "point 3 (feed.mark_speed_mm_s = 1300, noise.resolver_inc = 1): feed.mark_speed_mm_s: expected 120.0000 to 1200.0000",
    ] {
        assert!(error.contains(expected), "{expected}\nis not in\n{error}");
    }
    assert_eq!(error.matches("point ").count(), 3, "{error}");
}

/// Every name of the example and of the documentation acts.
#[test]
fn the_example_of_the_documentation_can_run() {
    let text = include_str!("../../../docs/examples/sweep.toml");
    let machine = |_: &str| Ok(super::THESIS.to_owned());
    let spec = SweepSpec::read(text, machine).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(spec.points() * u64::from(spec.feeds()), 10_000);
    let some: Vec<u64> = (1..=spec.points()).step_by(50).collect();
    sweep::check(&spec, &some).unwrap_or_else(|error| panic!("{error}"));
    // The chain knows all of them: with the word of `run.fidelity` as its value each is refused by its own range, or taken.
    for (name, _, allowed) in sweep::run_parameters().skip(1) {
        let value = allowed.split(' ').next_back().unwrap();
        let text =
            format!("[set]\nrun.fidelity = \"f2\"\n[[parameter]]\nname = \"{name}\"\nvalues = [{value}, 1e13]\n");
        let spec = SweepSpec::read(&text, |_| Err(String::new())).unwrap_or_else(|error| panic!("{error}"));
        assert!(spec.machine(1).is_ok(), "{name}");
        assert!(
            spec.machine(2)
                .unwrap_err()
                .what
                .starts_with(&format!("{name}: expected "))
        );
    }
}

/// Hooke: a film of half the modulus has half the stiffness, so the stretch under the same brake doubles, and a stiff one hardly stretches.
#[test]
fn a_softer_film_and_a_noisier_resolver_show_in_the_rows() {
    let table = run(
        &spec(
            r#"
            feeds = 2
            seeds = "same"
            layout = "list"
            [set]
            run.fidelity = "f2"
            [[parameter]]
            name = "web.modulus_pa"
            values = [1e9, 1e11, 1e11]
            [[parameter]]
            name = "noise.resolver_inc"
            values = [1, 1, 40]
            "#,
        ),
        Shard::WHOLE,
        0,
    );
    let value = |row: usize, name: &str| table.rows[row].outcome.value(name);
    // Strain F/(E·b·t) with 12.5 N, 400 mm and 30 µm: 1.04e-3 at 1 GPa, 1.25 mm of 1200 mm; a hundredth of that at 100 GPa.
    let stretch_um = value(0, "abs_error_max_um");
    assert!((1100.0..1300.0).contains(&stretch_um), "{:?}", table.rows[0]);
    assert!(
        value(1, "abs_error_max_um") < 0.1 * value(0, "abs_error_max_um"),
        "{:?}",
        table.rows[1]
    );
    // Noise of the position comes back as torque of the speed controller.
    assert!(
        value(2, "peak_torque_nm") > 1.2 * value(1, "peak_torque_nm"),
        "{:?}",
        table.rows[2]
    );
}

#[test]
fn the_documentation_names_every_parameter_and_column() {
    let text = include_str!("../../../docs/sweeps.md");
    let outputs = sweep::OUTPUTS.iter().map(|output| output.name);
    for name in sweep::run_parameters().map(|(name, ..)| name).chain(outputs) {
        assert!(text.contains(&format!("| `{name}` |")), "{name}");
    }
}

/// Codes take values of their own step, whatever the Sobol point says.
#[test]
fn codes_are_varied_in_their_own_steps_and_motors_come_from_a_catalogue() {
    let text = r#"
        layout = "random"
        count = 64
        catalogue = "motors.toml"
        [set]
        motor.name = "mine"
        [[parameter]]
        name = "codes.C0254"
        from = 0.2
        to = 0.8
    "#;
    let mine = include_str!("../../catalogue/motors.toml").replace("\"MDSKS036-13\"", "\"mine\"");
    let spec = SweepSpec::read(text, |path| match path {
        "motors.toml" => Ok(mine.clone()),
        other => Err(format!("{other} is not there")),
    })
    .unwrap_or_else(|error| panic!("{error}"));
    let all: Vec<u64> = (1..=64).collect();
    sweep::check(&spec, &all).unwrap_or_else(|error| panic!("{error}"));
    for point in all {
        let machine = spec.machine(point).unwrap();
        let Setting::Number(wanted) = machine.settings[0] else {
            panic!("{:?}", machine.settings)
        };
        // What the row says is what the drive has.
        assert_eq!(machine.rig.drive.codes.number(254, 0), wanted);
    }
    let error = SweepSpec::read(text, |_| Err("it is not there".to_owned()))
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("line 4: catalogue: it is not there"), "{error}");
}

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("film-feed-sweep-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).expect("a scratch directory");
        Scratch(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("a path in UTF-8").to_owned()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn film_feed(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_film-feed"))
        .args(args)
        .output()
        .expect("the program is built")
}

fn told(output: &Output, code: i32) -> String {
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{error}");
    error
}

#[test]
fn a_stopped_sweep_goes_on_where_it_was_and_ends_the_same() {
    let scratch = Scratch::new("resume");
    let (spec, out, rows) = (
        scratch.path("grid.toml"),
        scratch.path("r.csv"),
        scratch.path("r.csv.rows"),
    );
    fs::write(&spec, GRID).unwrap();
    let plot = scratch.path("r.svg");
    told(&film_feed(&["sweep", &spec, "--out", &out, "--plot", &plot]), 0);
    let expected = fs::read_to_string(&out).unwrap();
    assert_eq!(expected.lines().count(), 13);
    let svg = fs::read_to_string(&plot).unwrap();
    assert!(svg.contains("feed.mark_speed_mm_s") && svg.contains("largest error in µm"));
    assert!(!fs::exists(&rows).unwrap());

    // Stopped after five machines, in the middle of the line of the sixth. The third row is marked, to see that it is not run again.
    let mut left: String = expected.lines().take(6).map(|line| format!("{line}\n")).collect();
    let third = left.lines().nth(3).unwrap().to_owned();
    left = left.replace(&third, &format!("{third}kept"));
    left.push_str(&expected.lines().nth(6).unwrap()[..40]);
    fs::write(&rows, &left).unwrap();
    let refused = told(&film_feed(&["sweep", &spec, "--out", &out]), 2);
    assert!(refused.contains("go on with --resume, or delete it"), "{refused}");
    let output = film_feed(&["sweep", &spec, "--out", &out, "--resume", "--json"]);
    told(&output, 0);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&report["machines"], &report["effort"]["machines_run"]),
        (&12.into(), &7.into())
    );
    let resumed = fs::read_to_string(&out).unwrap();
    assert!(resumed.contains(&format!("{third}kept\n")));
    assert_eq!(resumed.replace(&format!("{third}kept"), &third), expected);

    fs::write(&spec, format!("{GRID}\n# another\n")).unwrap();
    let other = told(&film_feed(&["sweep", &spec, "--out", &out, "--resume"]), 2);
    assert!(other.contains("is of another sweep"), "{other}");
}

#[test]
fn shards_of_the_command_line_merge_to_the_whole() {
    let scratch = Scratch::new("merge");
    let spec = scratch.path("grid.toml");
    fs::write(&spec, GRID).unwrap();
    let (whole, one, two, merged) = (
        scratch.path("whole.parquet"),
        scratch.path("1.csv"),
        scratch.path("2.parquet"),
        scratch.path("merged.parquet"),
    );
    told(&film_feed(&["sweep", &spec, "--out", &whole, "--threads", "1"]), 0);
    told(&film_feed(&["sweep", &spec, "--out", &one, "--shard", "1/2"]), 0);
    let early = told(&film_feed(&["sweep", "merge", &one, "--out", &merged]), 2);
    assert!(
        early.contains("6 of 12 points are missing, the first is point 2"),
        "{early}"
    );
    assert!(!fs::exists(&merged).unwrap());
    told(&film_feed(&["sweep", &spec, "--out", &two, "--shard", "2/2"]), 0);
    told(&film_feed(&["sweep", "merge", &two, &one, "--out", &merged]), 0);
    assert!(fs::read(&merged).unwrap() == fs::read(&whole).unwrap());

    for (args, expected) in [
        (
            vec!["sweep", &spec, "--shard", "3/2", "--out", &one],
            "expected I/N with I from 1 to N",
        ),
        (
            vec!["sweep", &spec, "--out", "r.txt"],
            "the name of a result ends in .csv or .parquet",
        ),
        (vec!["sweep", &spec, "--resume"], "--out"),
        (vec!["sweep", "/nonexistent.toml"], "/nonexistent.toml cannot be read"),
    ] {
        let told = told(&film_feed(&args), 2);
        assert!(told.contains(expected), "{told}");
        assert_eq!(told.trim_end().lines().count(), 1, "{told}");
    }
}

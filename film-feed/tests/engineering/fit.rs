//! What a recorded feed tells of its axis, against what the axis was made of.

use std::fs;
use std::process::Command;

use film_feed::fit::{FitOptions, FitReport, GainSource, References, Trace, TraceError, fit};
use film_feed::operator::FeedPlan;
use film_feed::report::FeedMode;
use film_feed::rig::RigConfig;
use film_feed::run::{Observation, simulated};
use film_feed::scope::Sample;
use lenze9300_model::noise;

/// Two feeds by length of an axis with these mechanics at the motor, once a millisecond.
fn feeds(j_load_kg_m2: f64, coulomb_nm: f64, viscous_nm_s: f64) -> Vec<Sample> {
    let mut config = RigConfig::default();
    let mechanics = &mut config.drive.axis.mechanics;
    (mechanics.j_load_kg_m2, mechanics.coulomb_nm, mechanics.viscous_nm_s) = (j_load_kg_m2, coulomb_nm, viscous_nm_s);
    let plan = FeedPlan {
        series: vec![(FeedMode::Length, 2)],
        ..FeedPlan::default()
    };
    simulated(&config, plan, Observation::Samples, || {})
        .expect("the configuration of the thesis")
        .1
}

/// Seeded noise: ±2 rpm on speeds, ±0.02 Nm on torques, ±5 µm on positions.
fn noisy(mut samples: Vec<Sample>) -> Vec<Sample> {
    for (n, sample) in samples.iter_mut().enumerate() {
        let noise = |channel| noise::symmetric(11, channel, n as u64);
        sample.speed_act_rpm += 2.0 * noise(1);
        sample.torque_nm += 0.02 * noise(2);
        sample.torque_mean_nm += 0.02 * noise(3);
        sample.position_act_mm += 0.005 * noise(4);
    }
    samples
}

fn fitted(csv: &[u8]) -> FitReport {
    let trace = Trace::read(csv, &References::default()).unwrap_or_else(|error| panic!("{error}"));
    fit(&trace, &FitOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn csv(samples: &[Sample]) -> Vec<u8> {
    let mut out = Vec::new();
    film_feed::scope::write_csv(samples, &mut out).expect("a vector takes everything");
    out
}

#[test]
fn a_noisy_trace_gives_inertia_within_2_percent_and_friction_and_k_v() {
    const ROTOR: f64 = 0.25e-4;
    for (j_load, coulomb, viscous) in [(0.664e-4, 0.05, 0.0), (0.2e-4, 0.03, 1e-4), (1.4e-4, 0.1, 5e-5)] {
        let report = fitted(&csv(&noisy(feeds(j_load, coulomb, viscous))));
        let inertia = report.inertia_kg_m2;
        assert!((inertia.value / (ROTOR + j_load) - 1.0).abs() < 0.02, "{report:?}");
        // The standard error is an honest one: small, and the truth lies within a few of it.
        assert!(inertia.standard_error < 0.01 * inertia.value, "{report:?}");
        assert!(
            (inertia.value - ROTOR - j_load).abs() < 4.0 * inertia.standard_error,
            "{report:?}"
        );
        assert!((report.coulomb_nm.value - coulomb).abs() < 0.002, "{report:?}");
        assert!((report.viscous_nm_s.value - viscous).abs() < 1e-5, "{report:?}");
        assert!(report.r_squared > 0.95, "{report:?}");
        // k_v = 125 1/s · C0254, C0254 = 0.4 (9300 facts 4.6). Noise on the following error makes a slope too small: ±5 µm of
        // some 100 µm.
        let k_v = report.k_v.unwrap();
        assert_eq!(k_v.from, GainSource::SpeedSetValue);
        assert!((k_v.per_s.value / 50.0 - 1.0).abs() < 0.02, "{report:?}");
        assert!((k_v.c0254 / 0.4 - 1.0).abs() < 0.02, "{report:?}");
        // 179.0708 mm a turn of the roller behind 7:1.
        let per_turn = k_v.length_per_rad.unwrap() * std::f64::consts::TAU;
        assert!((per_turn / (179.0708 / 7.0) - 1.0).abs() < 1e-3, "{report:?}");
        assert_eq!(report.notes, Vec::<String>::new());
    }
}

/// A heading with units in brackets, semicolons, decimal commas, Latin-1, lines before the heading: as programs on German computers
/// write. Four channels as the original's oscilloscope has (9300 facts 4.11), speeds in % of C0011 = 3000 1/min, torque in % of 1.05 Nm.
#[test]
fn an_export_with_semicolons_and_decimal_commas_is_read_as_well() {
    let heading = "Zeit [ms];MCTRL-NACT [%];MCTRL-MSET2 [%];POS-NOUT [%];POS-ERR [inc];T\u{e4}nzer [V]";
    let mut text = format!("Oszilloskop;Antrieb 1\r\nDatum;26.11.2026\r\n\r\n{heading}\r\n");
    let samples = feeds(0.664e-4, 0.05, 0.0);
    let mut position_before_mm = 0.0;
    for sample in noisy(samples) {
        let error_mm = sample.position_set_mm - position_before_mm;
        position_before_mm = sample.position_act_mm;
        // The drive forms no following error across a new reference.
        let error_inc = if error_mm.abs() < 5.0 {
            error_mm * 65_536.0 * 7.0 / 179.0708
        } else {
            0.0
        };
        let line = format!(
            "{:.1};{:.4};{:.4};{:.4};{error_inc:.0};0.1\r\n",
            sample.time_s * 1000.0,
            sample.speed_act_rpm / 30.0,
            sample.torque_nm / 0.0105,
            sample.speed_set_rpm / 30.0,
        );
        text += &line.replace('.', ",");
    }
    let latin_1: Vec<u8> = text.chars().map(|letter| letter as u8).collect();
    let report = fitted(&latin_1);
    // Samples of 1 ms meet the torque's ripple of 1 ms always at the same place: 3 % low, and the report says so.
    let ratio = report.inertia_kg_m2.value / 0.914e-4;
    assert!((0.95..0.99).contains(&ratio), "{report:?}");
    assert!(report.notes[0].contains("inertia may read some 3 % low"), "{report:?}");
    assert!((report.coulomb_nm.value - 0.05).abs() < 0.002, "{report:?}");
    // Without the speed set-value k_v comes from the torque, and is told to be rougher: 50 1/s (C0254 = 0.4) within a tenth.
    let k_v = report.k_v.unwrap();
    assert_eq!(k_v.from, GainSource::Torque);
    assert!((k_v.per_s.value / 50.0 - 1.0).abs() < 0.1, "{report:?}");
    assert!(
        report.notes[1].starts_with("k_v was reckoned from the torque, with T_n = 20 ms (C0071)"),
        "{report:?}"
    );

    let without_error = String::from_utf8(latin_1.iter().map(|octet| octet & 0x7F).collect())
        .unwrap()
        .replace("POS-ERR", "OTHER");
    let report = fitted(without_error.as_bytes());
    assert!(report.k_v.is_none());
    assert!(
        report.notes[1].starts_with("k_v: the trace has no following error; record MCTRL-NSET2, POS-NOUT and POS-ERR"),
        "{report:?}"
    );
}

#[test]
fn a_file_that_is_no_trace_is_refused_with_its_line_and_column() {
    let read = |text: &str| Trace::read(text.as_bytes(), &References::default());
    assert_eq!(read("a,b\n1,2\n"), Err(TraceError::NoHeading));
    assert!(matches!(
        read("time_s,n_act_rpm\n0,1\n0.001,1\n0.002,1\n"),
        Err(TraceError::Missing { what: "torque", .. })
    ));
    let number = read("time_s,n_act_rpm,torque_nm\n0,1,0\n0.001,x,0\n").unwrap_err();
    assert_eq!(number.to_string(), "line 3, column `n_act_rpm`: `x` is no number");
    let unit = read("Time [h];N-ACT [rpm];M-ACT [Nm]\n0;1;1\n1;1;1\n2;1;1\n").unwrap_err();
    assert!(
        unit.to_string()
            .contains("the unit `h` is unknown here; known are s, ms, µs"),
        "{unit}"
    );
    let gap = read("time_s,n_act_rpm,torque_nm\n0,1,0\n0.001,1,0\n0.003,1,0\n0.004,1,0\n").unwrap_err();
    assert!(
        gap.to_string().starts_with("line 3: the time steps by 0.001 s"),
        "{gap}"
    );
    assert_eq!(
        read("time_s,n_act_rpm,torque_nm\n0,1,0\n"),
        Err(TraceError::TooShort { rows: 1 })
    );
}

#[test]
fn the_command_fits_what_run_has_recorded() {
    let scratch = std::env::temp_dir().join(format!("film-feed-fit-{}", std::process::id()));
    fs::create_dir_all(&scratch).unwrap();
    let path = |name: &str| scratch.join(name).to_str().unwrap().to_owned();
    let film_feed = |args: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_film-feed"))
            .args(args)
            .output()
            .unwrap()
    };
    let (ours, signals, rest) = (path("ours.csv"), path("signals.csv"), path("rest.csv"));
    assert!(
        film_feed(&["run", "--series", "length", "--feeds", "2", "--trace", &ours])
            .status
            .success()
    );
    let names = "N-ACT,M-ACT,POS-NOUT,MCTRL-NSET2,POS-ERR";
    let args = [
        "run",
        "--series",
        "length",
        "--feeds",
        "2",
        "--trace",
        &signals,
        "--signals",
        names,
    ];
    assert!(film_feed(&args).status.success());

    // The same as Parquet gives the same: units in the names, or in the metadata.
    let parquet = path("signals.parquet");
    let mut args = args;
    args[6] = &parquet;
    assert!(film_feed(&args).status.success());
    assert_eq!(
        film_feed(&["fit", &parquet, "--json"]).stdout,
        film_feed(&["fit", &signals, "--json"]).stdout
    );

    for (trace, tolerance) in [(&ours, 0.01), (&signals, 0.04)] {
        let output = film_feed(&["fit", trace, "--json"]);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let inertia = report["inertia_kg_m2"]["value"].as_f64().unwrap();
        assert!((inertia / 0.914e-4 - 1.0).abs() < tolerance, "{report}");
        let k_v = report["k_v"]["per_s"]["value"].as_f64().unwrap();
        assert!((k_v / 50.0 - 1.0).abs() < 0.001, "{report}");
    }
    let text = String::from_utf8(film_feed(&["fit", &ours]).stdout).unwrap();
    assert!(
        text.contains("inertia") && text.contains("10⁻⁴ kg m² at the motor"),
        "{text}"
    );

    // A trace of a standing axis ran and does not tell; a file that is none is bad input.
    let lines: Vec<String> = fs::read_to_string(&ours)
        .unwrap()
        .lines()
        .take(800)
        .map(str::to_owned)
        .collect();
    fs::write(&rest, lines.join("\n")).unwrap();
    for (trace, code, told) in [
        (&rest, 1, "at least 8 are needed"),
        (&path("none.csv"), 2, "cannot be read"),
    ] {
        let output = film_feed(&["fit", trace]);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{error}");
        assert!(error.contains(told) && error.trim_end().lines().count() == 1, "{error}");
    }
    fs::remove_dir_all(&scratch).unwrap();
}

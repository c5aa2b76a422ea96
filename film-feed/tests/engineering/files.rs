//! Files from outside: whatever octets they hold, their readers say what is wrong and do not panic.

use film_feed::fit::{FitOptions, References, Trace, fit};
use film_feed::sweep::{ResultTable, SweepSpec};
use lenze9300_model::noise;

const SPEC: &str = include_str!("../../../docs/examples/sweep.toml");

/// The octets with up to eight of them changed, and sometimes the end cut off; the same for the same seed.
fn spoilt(octets: &[u8], seed: u64) -> Vec<u8> {
    let mut octets = octets.to_vec();
    let place = |channel| noise::below(seed, channel, 0, octets.len() as u32) as usize;
    let places: Vec<usize> = (0..1 + seed % 8).map(place).collect();
    for (n, place) in places.iter().enumerate() {
        octets[*place] = noise::bits(seed, 99, n as u64) as u8;
    }
    if seed.is_multiple_of(5) {
        octets.truncate(noise::below(seed, 98, 0, octets.len() as u32) as usize);
    }
    octets
}

fn spec(text: &str) -> Result<SweepSpec, lenze9300_model::FileError> {
    SweepSpec::read(text, |_| Ok(super::THESIS.to_owned()))
}

#[test]
fn spoilt_specs_and_machines_are_refused_or_read() {
    let mut refused = 0;
    for seed in 0..400 {
        let text = String::from_utf8_lossy(&spoilt(SPEC.as_bytes(), seed)).into_owned();
        match spec(&text) {
            Ok(spec) => {
                let _ = spec.machine(1);
                let _ = spec.machine(spec.points());
            }
            Err(error) => {
                refused += 1;
                assert!(error.mistakes.iter().all(|mistake| !mistake.what.is_empty()));
            }
        }
    }
    assert!(refused > 100, "{refused} of 400");
}

#[test]
fn spoilt_results_and_traces_are_refused_or_read() {
    let text = "feeds = 1\n[[parameter]]\nname = \"feed.speed_mm_s\"\nvalues = [900, 1200]\n";
    let spec = spec(text).unwrap_or_else(|error| panic!("{error}"));
    let mut table = ResultTable::new(&spec);
    for point in [1, 2] {
        table.rows.push(
            spec.machine(point)
                .and_then(film_feed::sweep::SweptMachine::run)
                .unwrap(),
        );
    }
    let (mut csv, mut parquet) = (Vec::new(), Vec::new());
    table.write_csv(&mut csv).unwrap();
    table.write_parquet(&mut parquet).unwrap();
    assert_eq!(ResultTable::read_csv(csv.as_slice()).unwrap(), table);

    let mut trace = "time_s,n_act_rpm,torque_nm,mctrl_nset2_rpm,pos_nout_rpm,pos_err_inc\n".to_owned();
    for ms in 0..300 {
        trace += &format!(
            "{},{},0.1,{},{},{}\n",
            f64::from(ms) * 1e-3,
            ms + 9,
            ms + 10,
            ms + 8,
            ms % 7
        );
    }
    assert!(Trace::read(trace.as_bytes(), &References::default()).is_ok());
    for seed in 0..400 {
        let _ = ResultTable::read_csv(spoilt(&csv, seed).as_slice()).map(|table| film_feed::sweep::merge(vec![table]));
        let _ = ResultTable::read_parquet(bytes::Bytes::from(spoilt(&parquet, seed)));
        let _ = Trace::read_parquet(bytes::Bytes::from(spoilt(&parquet, seed)), &References::default());
        if let Ok(trace) = Trace::read(&spoilt(trace.as_bytes(), seed), &References::default()) {
            let _ = fit(&trace, &FitOptions::default());
        }
    }
}

//! Faults of the stations: master and slave restarted, a second master.

use film_feed::rig::RigConfig;

use super::bench::Bench;
use super::line::{in_feed, must_land};
use super::{Draw, Family};

/// The master dies.
pub(super) const MASTER_KILLED: Family = Family {
    name: "master-killed",
    fault: "master killed in every phase of a feed, restarted from power-up after 1 to 1000 ms",
    rule: "JOB_FIN comes only for a feed that landed; 3 s after the restart data exchange, and the next feed lands",
    case: master_killed,
};

fn master_killed(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    bench.rig.kill_master();
    bench.run_ms(draw.between(1, 1_000));
    bench.rig.restart_master();
    bench.finish()?;
    bench.end_well(3_000)
}

/// The bus module loses its supply.
pub(super) const SLAVE_CYCLED: Family = Family {
    name: "slave-cycled",
    fault: "bus module switched off and on at every moment of the first second (start-up) and once more",
    rule: "nothing moves; 3 s later data exchange, the parameters arrive and a feed lands",
    case: slave_cycled,
};

fn slave_cycled(draw: &mut Draw) -> Result<(), String> {
    let mut bench = Bench::powered_up(&RigConfig::default())?;
    for limit in [1_000, 300] {
        bench.run_ms(draw.between(0, limit));
        bench.rig.power_cycle_module().map_err(|error| error.to_string())?;
    }
    bench.end_well(3_000)
}

/// Somebody plugs in a second master.
pub(super) const SECOND_MASTER: Family = Family {
    name: "second-master",
    fault: "a second master enters in every phase of a feed and is pulled after 1 to 1000 ms",
    rule: "the feed lands, and so does the next one",
    case: second_master,
};

fn second_master(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    bench.rig.set_second_master(true).map_err(|error| error.to_string())?;
    bench.run_ms(draw.between(1, 1_000));
    bench.rig.set_second_master(false).map_err(|error| error.to_string())?;
    must_land(&mut bench)?;
    bench.end_well(3_000)
}

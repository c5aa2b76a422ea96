//! Faults of the drive and what hangs on it: mains, guard, following error, encoder.

use drivecom::State;
use lenze9300_model::device::Fault;
use lenze9300_model::plant::Mains;

use super::bench::Bench;
use super::line::in_feed;
use super::{Draw, Family};

/// The mains go away for a while.
pub(super) const MAINS: Family = Family {
    name: "mains-dip",
    fault: "mains away in every phase of a feed for 5 to 2000 ms",
    rule: "JOB_FIN comes only for a feed that landed; 3 s after the mains are back and acknowledged the next feed lands",
    case: mains,
};

fn mains(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    bench.rig.drive_mut().set_mains(Mains::Off);
    bench.run_ms(draw.between(5, 2_000));
    bench.rig.drive_mut().set_mains(Mains::On);
    bench.finish()?;
    bench.end_well(3_000)
}

/// The guard is opened.
pub(super) const GUARD: Family = Family {
    name: "guard",
    fault: "guard opened in every phase of a feed for 20 to 2000 ms: terminal 28 low, or the block's enable taken away",
    rule: "no torque while it is open, nothing moves when it is shut, JOB_FIN stays low; the next feed lands",
    case: guard,
};

fn guard(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    let terminal = draw.in_turn(&[true, false]);
    let open = |bench: &mut Bench, open: bool| {
        if terminal {
            bench.rig.drive_mut().set_terminal_28(!open);
        } else {
            bench.rig.inputs_mut().enable = !open;
        }
    };
    open(&mut bench, true);
    bench.run_ms(20);
    if bench.rig.drive().axis().sample().torque != 0.0 {
        return Err("torque 20 ms after the guard was opened".to_string());
    }
    bench.run_ms(draw.between(1_000, 2_000));
    let (starts, before_mm) = (bench.monitor.starts(), bench.moved_mm());
    open(&mut bench, false);
    bench.run_ms(1_000);
    let moved_mm = bench.moved_mm() - before_mm;
    if bench.monitor.starts() != starts || moved_mm.abs() > 0.01 {
        return Err(format!("{moved_mm} mm when the guard was shut"));
    }
    bench.finish()?;
    bench.end_well(3_000)
}

/// The axis does not follow.
pub(super) const FOLLOWING: Family = Family {
    name: "following-error",
    fault: "film jams in every phase of a feed: 0.8 to 3 Nm against its movement, for 20 to 300 ms",
    rule: "JOB_FIN comes only for a feed that landed; without the load, acknowledged, the next feed lands",
    case: following,
};

/// Below this a jammed axis counts as standing: 4 mm/s of film.
const SLOW_RAD_S: f64 = 1.0;

fn following(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    bench.monitor.pushed = true;
    let jam_nm = draw.between(80, 300) as f64 / 100.0;
    // In steps of a PLC cycle: what jams brakes, and pushes nothing back.
    for _ in 0..draw.between(20, 300) / 5 {
        let forwards = bench.rig.drive().axis().sample().omega_true > SLOW_RAD_S;
        bench
            .rig
            .drive_mut()
            .set_load_torque(if forwards { jam_nm } else { 0.0 });
        bench.run_ms(5);
    }
    bench.rig.drive_mut().set_load_torque(0.0);
    bench.finish()?;
    bench.end_well(3_000)
}

/// The encoder fails.
pub(super) const ENCODER: Family = Family {
    name: "encoder",
    fault: "resolver wire broken (Sd2) in every phase of a feed for 20 to 1000 ms",
    rule: "fault within 20 ms and no torque until acknowledged; JOB_FIN stays low; the next feed lands",
    case: encoder,
};

fn encoder(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    bench.rig.drive_mut().inject(Fault::Sd2, true);
    bench.run_ms(20);
    if bench.rig.module().state() != State::Fault || bench.rig.drive().axis().sample().torque != 0.0 {
        return Err(format!("{:?} 20 ms after the wire broke", bench.rig.module().state()));
    }
    bench.run_ms(draw.between(20, 1_000));
    bench.rig.drive_mut().inject(Fault::Sd2, false);
    bench.finish()?;
    bench.end_well(3_000)
}

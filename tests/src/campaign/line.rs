//! Faults of the line: bit errors, telegrams lost, doubled and late, a babbling station, the cable.

use std::sync::{Arc, Mutex};

use dp_master::phy::{Disturbance, Script};
use dp_master::time::Instant;
use film_feed::rig::RigConfig;

use super::bench::{Bench, FeedEnd};
use super::{Draw, Family};
use crate::MILLISECOND;

/// Bit errors by chance.
pub(super) const BIT_ERRORS: Family = Family {
    name: "bit-errors",
    fault: "bit errors at 1e-7, 1e-6, 1e-5, 1e-4 and 1e-3 during three feeds",
    rule: "up to 1e-4 every feed lands within ±0.01 mm; at 1e-3 JOB_FIN comes only for one that landed; without errors the next one lands",
    case: bit_errors,
};

fn bit_errors(draw: &mut Draw) -> Result<(), String> {
    let rate = draw.in_turn(&[1e-7, 1e-6, 1e-5, 1e-4, 1e-3]);
    let mut bench = Bench::ready(&RigConfig::default())?;
    let disturbance = Disturbance::new(draw.between(0, u64::MAX - 1), rate).map_err(|error| error.to_string())?;
    bench.rig.line_mut().set_disturbance(Some(disturbance));
    for feed in 1..=3 {
        let end = if bench.start() {
            bench.finish()?
        } else {
            FeedEnd::NotFinished
        };
        if end == FeedEnd::NotFinished {
            if rate <= 1e-4 {
                return Err(format!(
                    "feed {feed} at {rate:e} did not finish: {:?}",
                    bench.rig.outputs()
                ));
            }
            break;
        }
    }
    bench.rig.line_mut().set_disturbance(None);
    bench.end_well(3_000)
}

/// Bursts of noise.
pub(super) const BURSTS: Family = Family {
    name: "bursts",
    fault: "noise that spoils one bit in ten, for 1 to 300 ms in mid feed",
    rule: "JOB_FIN comes only for a feed that landed; 3 s after the noise data exchange, and the next feed lands",
    case: bursts,
};

fn bursts(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    let noise = Disturbance::new(draw.between(0, u64::MAX - 1), 0.1).map_err(|error| error.to_string())?;
    bench.rig.line_mut().set_disturbance(Some(noise));
    bench.run_ms(draw.between(1, 300));
    bench.rig.line_mut().set_disturbance(None);
    bench.finish()?;
    bench.end_well(3_000)
}

/// Telegrams that nobody hears.
pub(super) const LOST: Family = Family {
    name: "lost",
    fault: "up to 40 telegrams lost among the next 400, in mid feed",
    rule: "the feed lands, the drive stays ready: retries and the watchdog of 100 ms bridge it",
    case: lost,
};

fn lost(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    for _ in 0..draw.between(1, 40) {
        let burst = bench.rig.line().bursts() + draw.between(0, 399);
        bench.rig.line_mut().script(Script::Drop { burst });
    }
    must_land(&mut bench)?;
    bench.end_well(3_000)
}

/// Telegrams that come a second time.
pub(super) const DOUBLED: Family = Family {
    name: "doubled",
    fault: "requests of the master said again by a stranger, at any moment, 20 times in a feed",
    rule: "the feed lands, nothing starts twice",
    case: doubled,
};

fn doubled(draw: &mut Draw) -> Result<(), String> {
    replayed(draw, |octets| octets.get(5).is_some_and(|source| source & 0x7F != 3))
}

/// Answers that come too late.
pub(super) const LATE: Family = Family {
    name: "late",
    fault: "answers of the slave said again long after their slot, at any moment, 20 times in a feed",
    rule: "the feed lands, nothing starts twice",
    case: late,
};

fn late(draw: &mut Draw) -> Result<(), String> {
    replayed(draw, |octets| octets.get(5).is_some_and(|source| source & 0x7F == 3))
}

/// A stranger repeats telegrams that he has heard.
fn replayed(draw: &mut Draw, wanted: impl Fn(&[u8]) -> bool + Send + 'static) -> Result<(), String> {
    let config = RigConfig {
        // So that the moments do not lie at one phase of the DP cycle.
        plc_cycle_ns: 5 * MILLISECOND + draw.between(0, 999_999),
        ..RigConfig::default()
    };
    let mut bench = Bench::ready(&config)?;
    let heard = Arc::new(Mutex::new(Vec::new()));
    let memory = Arc::clone(&heard);
    bench.rig.listen(Box::new(move |trace| {
        // SD2: telegrams with data.
        if trace.octets.first() == Some(&0x68)
            && wanted(trace.octets)
            && let Ok(mut last) = memory.lock()
        {
            last.clear();
            last.extend_from_slice(trace.octets);
        }
    }));
    let stranger = bench.rig.line_mut().attach();
    if !bench.start() {
        return Err("the start was not taken".to_string());
    }
    let starts = bench.monitor.starts();
    for _ in 0..20 {
        bench.monitor.cycle(&mut bench.rig);
        let octets = heard.lock().map(|last| last.clone()).unwrap_or_default();
        if octets.is_empty() {
            return Err("nothing was heard to be repeated".to_string());
        }
        let now = Instant::from_nanos(bench.rig.now_ns());
        bench.rig.line_mut().transmit(now, stranger, &octets);
    }
    must_land(&mut bench)?;
    if bench.monitor.starts() != starts {
        return Err(format!("{} starts instead of {starts}", bench.monitor.starts()));
    }
    bench.end_well(3_000)
}

/// A station that does not stop sending.
pub(super) const BABBLING: Family = Family {
    name: "babbling",
    fault: "a station that sends octets by chance without a pause, for 5 to 500 ms in mid feed",
    rule: "JOB_FIN comes only for a feed that landed; 3 s after it is silent data exchange, and the next feed lands",
    case: babbling,
};

fn babbling(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    let stranger = bench.rig.line_mut().attach();
    // 5 ms of 12 Mbit/s are 5454 characters of 11 bits.
    for _ in 0..draw.between(1, 100) {
        let octets: Vec<u8> = (0..5_450).map(|_| draw.between(0, 255) as u8).collect();
        let now = Instant::from_nanos(bench.rig.now_ns());
        bench.rig.line_mut().transmit(now, stranger, &octets);
        bench.monitor.cycle(&mut bench.rig);
    }
    bench.finish()?;
    bench.end_well(3_000)
}

/// The cable, without a reaction of the drive.
pub(super) const CABLE: Family = Family {
    name: "cable",
    fault: "cable pulled in every phase of a feed for 1 to 1000 ms, C1882 = none",
    rule: "the drive finishes the feed with its last data: it lands, and JOB_FIN comes when the bus is back",
    case: cable,
};

fn cable(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    bench.rig.disconnect_module();
    bench.run_ms(draw.between(1, 1_000));
    bench.rig.reconnect_module();
    must_land(&mut bench)?;
    bench.end_well(3_000)
}

/// The cable, with a reaction of the drive.
pub(super) const CABLE_WITH_REACTION: Family = Family {
    name: "cable-reaction",
    fault: "cable pulled in every phase of a feed for 700 to 1000 ms, C1882 = quick stop, C1883 off or 50 to 200 ms",
    rule: "the axis stands within watchdog 100 ms + C1883 + 300 ms of ramp, swinging back by 1 mm at most (C0105 = 0 s); JOB_FIN comes only for a feed that landed; the next one lands",
    case: cable_with_reaction,
};

fn cable_with_reaction(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    // 3 = quick stop (coding assumed), 65 535 ms = off.
    let extra_ms = draw.in_turn(&[65_535, 50, 200]);
    for (code, value) in [(1882, 3), (1883, extra_ms)] {
        bench
            .rig
            .drive_mut()
            .write_code(code, 0, value * 10_000)
            .map_err(|error| error.to_string())?;
    }
    bench.monitor.swing_mm = 1.0;
    let extra_ms = if extra_ms == 65_535 { 0 } else { extra_ms as u64 };
    bench.rig.disconnect_module();
    bench
        .monitor
        .must_stand_by(bench.rig.now_ns() + (100 + extra_ms + 300) * MILLISECOND);
    bench.run_ms(draw.between(700, 1_000));
    bench.monitor.may_move_again();
    bench.rig.reconnect_module();
    bench.finish()?;
    bench.end_well(3_000)
}

/// A feed under way, at any moment of its 0.6 s.
pub(super) fn in_feed(draw: &mut Draw) -> Result<Bench, String> {
    in_feed_of(&RigConfig::default(), draw)
}

/// The same with another machine.
pub(super) fn in_feed_of(config: &RigConfig, draw: &mut Draw) -> Result<Bench, String> {
    let mut bench = Bench::ready(config)?;
    if !bench.start() {
        return Err("the start was not taken".to_string());
    }
    bench.run_ms(draw.between(0, 600));
    Ok(bench)
}

/// The feed under way lands.
pub(super) fn must_land(bench: &mut Bench) -> Result<(), String> {
    match bench.finish()? {
        FeedEnd::Landed => Ok(()),
        FeedEnd::NotFinished => Err(format!("the feed did not finish: {:?}", bench.rig.outputs())),
    }
}

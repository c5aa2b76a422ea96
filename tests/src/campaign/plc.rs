//! Faults around the PLC: it stops in the middle of something, its parameters are refused.

use dp_master::dp::Mode;
use film_feed::rig::RigConfig;

use super::bench::Bench;
use super::line::in_feed;
use super::{Draw, Family};

/// The PLC goes to STOP.
pub(super) const STOPPED: Family = Family {
    name: "plc-stopped",
    fault: "PLC stopped at any moment of a feed and of a parameter exchange for 1 to 1000 ms, with and without Clear on the bus",
    rule: "JOB_FIN comes only for a feed that landed; after the restart the parameter rounds go on and the next feed lands",
    case: stopped,
};

fn stopped(draw: &mut Draw) -> Result<(), String> {
    let mut bench = in_feed(draw)?;
    let clear = draw.in_turn(&[true, false]);
    if clear {
        bench.rig.master_mut().set_mode(Mode::Clear);
    }
    for _ in 0..draw.between(1, 200) {
        bench.rig.advance_to_plc_cycle(&mut bench.monitor);
        bench.rig.skip_plc_cycle();
    }
    bench.rig.master_mut().set_mode(Mode::Operate);
    bench.finish()?;
    bench.end_well(3_000)
}

/// The drive refuses what the block writes.
pub(super) const REFUSED: Family = Family {
    name: "parameters-refused",
    fault: "drive refuses every parameter while a parameter set is saved, 0.5 to 2.5 s",
    rule: "every refusal is reported, the seven codes within 2 s; afterwards the new length is the drive's and the next feed lands",
    case: refused,
};

fn refused(draw: &mut Draw) -> Result<(), String> {
    let mut config = RigConfig::default();
    let transfer_ms = draw.between(1_000, 2_500) as u32;
    config.drive.parameter_transfer_ms = transfer_ms;
    let mut bench = Bench::ready(&config)?;
    // C0003 = 2 saves the set that works (fact sheet, section 3.3: every job is refused meanwhile).
    bench
        .rig
        .drive_mut()
        .write_code(3, 0, 2_0000)
        .map_err(|error| error.to_string())?;
    bench.run_ms(u64::from(transfer_ms));
    let told = bench.rig.parameter_watch().troubles().len();
    if told != 7 {
        return Err(format!("{told} of 7 refusals were reported in {transfer_ms} ms"));
    }
    bench.end_well(3_000)
}

//! The bus as the thesis configures it: CPU at address 2, one drive with PAR(Cons.) + PZD(4W Cons.) (thesis ch. 8.2).

use dp_master::address::Address;
use dp_master::dp::{DpMaster, MasterConfig, Mode, SlaveConfig, SlaveIndex, Watchdog};
use dp_master::fdl::BusParams;
use dp_master::time::{Baud, Duration};
use lenze9300_model::bus::dp::{IDENT, PAR_AND_FOUR_WORDS};

use crate::rig::RigError;

/// Address of the PLC's master (film-feed specification, section 1).
const MASTER_ADDRESS: u8 = 2;

/// Min_Slave_Intervall of the module's GSD file: 1 × 100 µs (9300 fact sheet, section 1.1).
const MIN_SLAVE_INTERVAL: Duration = Duration::from_micros(100);

/// The master with its one slave, in Operate.
///
/// `min_cycle` is the shortest DP cycle; `latency` what an operating system may add to every answer.
///
/// # Errors
/// When `slave` is the master's own address or a parameter is out of its range.
pub fn master(
    baud: Baud,
    slave: Address,
    min_cycle: Duration,
    latency: Duration,
) -> Result<(DpMaster<1>, SlaveIndex), RigError> {
    let params = BusParams::standard(baud).with_latency_allowance(latency);
    let mut master = DpMaster::new(MasterConfig {
        min_cycle,
        ..MasterConfig::new(Address::new(MASTER_ADDRESS)?, params)
    })?;
    let config = SlaveConfig {
        watchdog: Some(watchdog(baud, min_cycle, latency)?),
        min_slave_interval: MIN_SLAVE_INTERVAL,
        ..SlaveConfig::new(slave, IDENT, PAR_AND_FOUR_WORDS)?
    };
    let index = master.add_slave(config)?;
    master.set_mode(Mode::Operate);
    Ok((master, index))
}

/// Longer than any exchange with all its retries: ten DP cycles, at least 100 ms.
///
/// A DP cycle has about 655 tBIT at 16 octets each way (9300 fact sheet, section 1.6); the longest slot time at low baud
/// rates adds 640 tBIT.
fn watchdog(baud: Baud, min_cycle: Duration, latency: Duration) -> Result<Watchdog, RigError> {
    const CYCLE_BITS: u64 = 1300;
    const CYCLES: u64 = 10;
    let cycle_ns = CYCLE_BITS * 1_000_000_000 / u64::from(baud.bits_per_second());
    let ns = CYCLES * (cycle_ns + min_cycle.as_nanos() + latency.as_nanos());
    Ok(Watchdog::at_least(Duration::from_nanos(ns.max(100_000_000)))?)
}

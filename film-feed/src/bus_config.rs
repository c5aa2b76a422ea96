//! The bus as the thesis configures it: CPU at address 2, one drive with PAR(Cons.) + PZD(4W Cons.) (thesis ch. 8.2).

use dp_master::address::Address;
use dp_master::dp::{DpMaster, MasterConfig, MasterEvent, Mode, SlaveConfig, SlaveIndex, Watchdog};
use dp_master::fdl::{BusParams, RingEvent};
use dp_master::time::{Baud, Duration};
use lenze9300_model::bus::dp::IDENT;

use crate::rig::RigError;

/// Address of the PLC's master (film-feed specification, section 1).
const MASTER_ADDRESS: u8 = 2;

/// Min_Slave_Intervall of the module's GSD file: 1 × 100 µs (9300 fact sheet, section 1.1).
const MIN_SLAVE_INTERVAL: Duration = Duration::from_micros(100);

/// The master with its one slave, in Operate.
///
/// `identifiers` is the slave's configuration; `min_cycle` the shortest DP cycle; `latency` what an operating system may
/// add to every answer.
///
/// # Errors
/// When `slave` is the master's own address, `identifiers` are none or a parameter is out of its range.
pub fn master(
    baud: Baud,
    slave: Address,
    identifiers: &[u8],
    min_cycle: Duration,
    latency: Duration,
) -> Result<(DpMaster<1>, SlaveIndex), RigError> {
    let address = Address::new(MASTER_ADDRESS)?;
    let standard = BusParams::standard(baud).with_latency_allowance(latency);
    // The PLC is the only master of its project (film-feed specification, section 1). Looking for others up to the usual HSA costs
    // nothing on a real line; behind an operating system each address costs a cycle of 50 ms, so there nobody is looked for.
    let params = BusParams {
        hsa: if latency == Duration::ZERO {
            standard.hsa
        } else {
            address
        },
        ..standard
    };
    let mut master = DpMaster::new(MasterConfig {
        min_cycle,
        ..MasterConfig::new(address, params)
    })?;
    let config = SlaveConfig {
        watchdog: Some(watchdog(baud, min_cycle, latency)?),
        min_slave_interval: MIN_SLAVE_INTERVAL,
        ..SlaveConfig::new(slave, IDENT, identifiers)?
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

/// Why a slave is not in data exchange, in one sentence.
pub fn trouble(event: &MasterEvent) -> Option<String> {
    match event {
        MasterEvent::Ring(event) => ring_trouble(*event),
        MasterEvent::ParametersRefused { diagnosis, .. } => Some(format!(
            "the slave refused its parameters; its ident number is 0x{:04X}",
            diagnosis.ident
        )),
        MasterEvent::ConfigurationRefused { .. } => Some("the slave refused its configuration".to_string()),
        MasterEvent::OwnedByOther { .. } => Some("the slave belongs to another master".to_string()),
        MasterEvent::SlaveLost { .. } => Some("the slave stopped answering".to_string()),
        _ => None,
    }
}

fn ring_trouble(event: RingEvent) -> Option<String> {
    match event {
        RingEvent::SecondToken(master) => Some(format!("the master at address {master} spoke out of turn")),
        RingEvent::DuplicateAddress => Some(format!(
            "another master has address {MASTER_ADDRESS}, ours; give it another one"
        )),
        RingEvent::TokenLost => Some("the token was lost".to_string()),
        RingEvent::Left(_) => Some("the other masters left ours out of the ring".to_string()),
        _ => None,
    }
}

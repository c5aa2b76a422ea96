//! The rules of a network, and which of them one breaks.
//!
//! | rule | limit | source |
//! |---|---|---|
//! | segment length | 9.6…187.5 kbit/s 1000 m, 500 400 m, 1500 200 m, 3000…12000 100 m (cable type A) | film-feed specification, section 2; 3 and 6 Mbit/s: manuals of RS485 repeaters |
//! | stations of a segment | 32, repeaters and optical modules counted | film-feed specification, section 2 |
//! | repeaters in series | 3 | same |
//! | stub lines | none above 1.5 Mbit/s, 6 m in all at 1.5 Mbit/s | same |
//! | profile Universal | up to 1.5 Mbit/s | same |
//! | stations in all | 126 | 9300 facts 1.1 |
//! | max Tsdr | at least Tsyn + Tsm (35 + 2·Tset + Tqui) | "PROFIBUS with STEP 7 V13", table 3-2 |
//! | min Tsdr | below that, at most 255 | same; Set_Prm has one octet for it |
//! | Tsl | Tsl1 and Tsl2 with the way of the signals | EN 50170-2, part 4, 4.1.7 |
//! | ranges of and rules between the other parameters | [`BusParams::validate`] | |

use super::bus_plan::{
    BusPlan, CYCLE_ROTATIONS, Network, OpticalTopology, Profile, RING_RETRIES, least_slot_time, repeated,
};
use super::params::{BusParams, BusParamsError, T_SYN};
use crate::address::Address;
use crate::time::{Baud, BitTimes, Duration};

/// A rule that a network breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Violation {
    /// Nobody may speak.
    #[error("the network has no master")]
    NoMaster,
    /// A segment is too long for the baud rate.
    #[error("segment {segment} is {}.{:02} m long, at {baud} at most {most_m} m are allowed", got_cm / 100, got_cm % 100)]
    SegmentLength {
        /// Number of the segment, from 1.
        segment: usize,
        /// Baud rate.
        baud: Baud,
        /// Its length in centimetres.
        got_cm: u32,
        /// The limit in metres.
        most_m: u32,
    },
    /// A segment has too many stations.
    #[error("segment {segment} has {got} stations, at most {most} are allowed, repeaters counted")]
    SegmentStations {
        /// Number of the segment, from 1.
        segment: usize,
        /// Stations.
        got: u32,
        /// The limit.
        most: u32,
    },
    /// Stub lines that the baud rate does not allow.
    #[error("segment {segment} has {}.{:02} m of stub lines, at {baud} at most {most_m} m are allowed", got_cm / 100, got_cm % 100)]
    Stubs {
        /// Number of the segment, from 1.
        segment: usize,
        /// Baud rate.
        baud: Baud,
        /// All its stubs in centimetres.
        got_cm: u32,
        /// The limit in metres.
        most_m: u32,
    },
    /// Too many repeaters between two stations.
    #[error("{got} repeaters in series, at most {most} are allowed")]
    Repeaters {
        /// Repeaters.
        got: u32,
        /// The limit.
        most: u32,
    },
    /// Repeaters join segments, so there are more segments than repeaters.
    #[error("{repeaters} repeaters in series need {} segments, there are {segments}", repeaters.saturating_add(1))]
    SegmentsMissing {
        /// Repeaters in series.
        repeaters: u32,
        /// Segments.
        segments: usize,
    },
    /// More stations than addresses.
    #[error("{got} stations, at most {most} have an address")]
    Stations {
        /// Stations named and others.
        got: u32,
        /// The limit.
        most: u32,
    },
    /// Two stations with one address.
    #[error("address {address} is given twice")]
    AddressTwice {
        /// The address.
        address: Address,
    },
    /// A master that the others never look for.
    #[error("master {address} lies above HSA {hsa}")]
    AboveHsa {
        /// Its address.
        address: Address,
        /// Highest address of a master.
        hsa: Address,
    },
    /// A slave with more data than a telegram carries.
    #[error("slave {address} has {got} octets in one direction, at most {most} fit into a telegram")]
    TooMuchData {
        /// Its address.
        address: Address,
        /// Octets in the larger direction.
        got: usize,
        /// The limit.
        most: usize,
    },
    /// Universal (DP/FMS) exists up to 1.5 Mbit/s.
    #[error("profile Universal (DP/FMS) ends at 1500 kbit/s, the network has {baud}")]
    UniversalTooFast {
        /// Baud rate.
        baud: Baud,
    },
    /// The parameters are for another baud rate than the network.
    #[error("the parameters are for {params}, the network has {network}")]
    OtherBaud {
        /// Of the parameters.
        params: Baud,
        /// Of the network.
        network: Baud,
    },
    /// A station that may answer later than the parameters allow.
    #[error("slave {address} may take {got} to answer, max Tsdr is {most}")]
    SlowSlave {
        /// Its address.
        address: Address,
        /// Its max Tsdr.
        got: BitTimes,
        /// The parameter.
        most: BitTimes,
    },
    /// max Tsdr below the shortest idle time.
    #[error("max Tsdr must be at least Tsyn + Tsm = {least}, got {got}")]
    MaxTsdrBelowIdle {
        /// 35 + 2·Tset + Tqui.
        least: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// min Tsdr that Set_Prm cannot say or that reaches the idle time.
    #[error("min Tsdr must be at most {most}: it must be below Tsyn + Tsm and fit into one octet, got {got}")]
    MinTsdrTooLong {
        /// The limit.
        most: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// A slot time that ends before the answer can arrive.
    #[error("Tsl must be at least {least} with the delay of the line, got {got}")]
    SlotTime {
        /// The larger of Tsl1 and Tsl2, or that of the optical ring.
        least: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// A redundant optical ring needs repetitions to heal.
    #[error("a redundant optical ring needs a retry limit of at least {least}, got {got}")]
    RingRetries {
        /// The limit.
        least: u8,
        /// The value.
        got: u8,
    },
    /// A redundant optical ring finds that it is whole again in the silence after a request to nobody.
    #[error("a redundant optical ring needs an address up to HSA {hsa} that no station has")]
    RingAddress {
        /// Highest address of a master.
        hsa: Address,
    },
    /// A target rotation time that the load exceeds.
    #[error("Ttr must be at least {least} for this load, got {got}")]
    TargetRotation {
        /// What the load needs.
        least: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// A watchdog that a busy line sets off, or that the factors of Set_Prm cannot say.
    #[error(
        "the watchdog must be {} ms to 650250 ms with this Ttr, got {} ms", least.as_nanos().div_ceil(1_000_000),
        got.as_nanos() / 1_000_000
    )]
    Watchdog {
        /// 3·Ttr, 10 ms at least.
        least: Duration,
        /// The wish.
        got: Duration,
    },
    /// A constant bus cycle with several masters.
    #[error("a constant bus cycle needs exactly one master, there are {masters}")]
    ConstantCycleMasters {
        /// Masters.
        masters: u32,
    },
    /// A constant bus cycle that the load exceeds.
    #[error("the constant bus cycle must be at least {least}, got {got}")]
    ConstantCycle {
        /// What the load needs.
        least: Duration,
        /// The wish.
        got: Duration,
    },
    /// A range of a parameter or a rule between parameters.
    #[error(transparent)]
    Params(#[from] BusParamsError),
}

/// Longest segment of cable type A, in metres.
#[must_use]
pub const fn longest_segment_m(baud: Baud) -> u32 {
    match baud {
        Baud::B9600 | Baud::B19200 | Baud::B45450 | Baud::B93750 | Baud::B187500 => 1000,
        Baud::B500000 => 400,
        Baud::B1500000 => 200,
        Baud::B3000000 | Baud::B6000000 | Baud::B12000000 => 100,
    }
}

/// Longest stub lines of a segment together, in metres; `None` where there is no rule.
#[must_use]
pub const fn longest_stubs_m(baud: Baud) -> Option<u32> {
    match baud {
        Baud::B1500000 => Some(6),
        Baud::B3000000 | Baud::B6000000 | Baud::B12000000 => Some(0),
        _ => None,
    }
}

impl Network<'_> {
    /// Checks every rule and reports each violation.
    ///
    /// Where one value breaks a rule, rules that depend on it are judged as if it were the nearest allowed one.
    pub fn check(&self, plan: &BusPlan, mut report: impl FnMut(Violation)) {
        self.check_cables(&mut report);
        self.check_stations(&plan.params, &mut report);
        self.check_times(plan, &mut report);
        // A slot time too short was reported with the delay of the line; only its upper limit is left.
        let t_sl = plan.params.t_sl.max(plan.params.least_t_sl());
        check_params(BusParams { t_sl, ..plan.params }, &mut report);
    }

    fn check_cables(&self, report: &mut impl FnMut(Violation)) {
        let baud = self.baud;
        for (index, segment) in self.segments.iter().enumerate() {
            let number = index + 1;
            let most_m = longest_segment_m(baud);
            if segment.length_cm > most_m * 100 {
                report(Violation::SegmentLength {
                    segment: number,
                    baud,
                    got_cm: segment.length_cm,
                    most_m,
                });
            }
            if segment.stations > STATIONS_OF_A_SEGMENT {
                report(Violation::SegmentStations {
                    segment: number,
                    got: segment.stations,
                    most: STATIONS_OF_A_SEGMENT,
                });
            }
            if let Some(most_m) = longest_stubs_m(baud)
                && segment.stubs_cm > most_m * 100
            {
                report(Violation::Stubs {
                    segment: number,
                    baud,
                    got_cm: segment.stubs_cm,
                    most_m,
                });
            }
        }
        if self.repeaters > REPEATERS_IN_SERIES {
            report(Violation::Repeaters {
                got: self.repeaters,
                most: REPEATERS_IN_SERIES,
            });
        }
        if !self.segments.is_empty() && u32::try_from(self.segments.len()).is_ok_and(|count| count <= self.repeaters) {
            report(Violation::SegmentsMissing {
                repeaters: self.repeaters,
                segments: self.segments.len(),
            });
        }
    }

    fn check_stations(&self, params: &BusParams, report: &mut impl FnMut(Violation)) {
        if self.master_count() == 0 {
            report(Violation::NoMaster);
        }
        let addresses = || {
            let masters = self.masters.iter().map(|master| master.address);
            masters.chain(self.slaves().map(|slave| slave.address))
        };
        let others = self.others();
        let got = u32::try_from(addresses().count())
            .unwrap_or(u32::MAX)
            .saturating_add(others.masters)
            .saturating_add(others.slaves);
        if got > STATIONS_IN_ALL {
            report(Violation::Stations {
                got,
                most: STATIONS_IN_ALL,
            });
        }
        for address in (0..=Address::MAX_STATION.value()).filter_map(Address::from_wire) {
            if addresses().filter(|other| *other == address).count() > 1 {
                report(Violation::AddressTwice { address });
            }
        }
        for master in self.masters.iter().filter(|master| master.address > params.hsa) {
            report(Violation::AboveHsa {
                address: master.address,
                hsa: params.hsa,
            });
        }
        for slave in self.slaves() {
            let got = slave.outputs.max(slave.inputs);
            if got > MOST_DATA {
                report(Violation::TooMuchData {
                    address: slave.address,
                    got,
                    most: MOST_DATA,
                });
            }
            if let Some(got) = slave.t_sdr_max
                && got > params.t_sdr_max
            {
                report(Violation::SlowSlave {
                    address: slave.address,
                    got,
                    most: params.t_sdr_max,
                });
            }
        }
    }

    fn check_times(&self, plan: &BusPlan, report: &mut impl FnMut(Violation)) {
        let params = &plan.params;
        if self.profile == Profile::Universal && self.baud > Baud::B1500000 {
            report(Violation::UniversalTooFast { baud: self.baud });
        }
        if params.baud != self.baud {
            report(Violation::OtherBaud {
                params: params.baud,
                network: self.baud,
            });
        }
        let idle = T_SYN + params.t_sm();
        if params.t_sdr_max < idle {
            report(Violation::MaxTsdrBelowIdle {
                least: idle,
                got: params.t_sdr_max,
            });
        }
        let most = BitTimes(idle.0.saturating_sub(1).min(255));
        if params.t_sdr_min > most {
            report(Violation::MinTsdrTooLong {
                most,
                got: params.t_sdr_min,
            });
        }
        let mut least = least_slot_time(params, plan.round_trip);
        if let Some(optical) = self
            .optical
            .filter(|optical| optical.topology == OpticalTopology::RedundantRing)
        {
            least = least.max(self.ring_slot_time(&optical, params.t_sdr_max));
            if params.retry_limit < RING_RETRIES {
                report(Violation::RingRetries {
                    least: RING_RETRIES,
                    got: params.retry_limit,
                });
            }
            let taken = |address| {
                self.slaves().any(|slave| slave.address == address)
                    || self.masters.iter().any(|master| master.address == address)
            };
            if (0..=params.hsa.value()).filter_map(Address::from_wire).all(taken) {
                report(Violation::RingAddress { hsa: params.hsa });
            }
        }
        if params.t_sl < least {
            report(Violation::SlotTime {
                least,
                got: params.t_sl,
            });
        }
        if params.t_tr < plan.t_tr_least {
            report(Violation::TargetRotation {
                least: plan.t_tr_least,
                got: params.t_tr,
            });
        }
        if let Some(got) = self.watchdog {
            let least = self
                .baud
                .duration(repeated(params.t_tr, CYCLE_ROTATIONS))
                .max(Duration::from_millis(10));
            if got < least || got > LONGEST_WATCHDOG {
                report(Violation::Watchdog { least, got });
            }
        }
        if let Some(got) = self.constant_cycle {
            if self.master_count() != 1 {
                report(Violation::ConstantCycleMasters {
                    masters: self.master_count(),
                });
            }
            let least = self.baud.duration(plan.least_constant_cycle);
            if got < least {
                report(Violation::ConstantCycle { least, got });
            }
        }
    }
}

/// Reports what [`BusParams::validate`] finds, one after the other, setting each wrong value right to find the next.
fn check_params(mut params: BusParams, report: &mut impl FnMut(Violation)) {
    /// As many as there are rules.
    const RULES: usize = 13;
    for _ in 0..RULES {
        let Err(error) = params.validate() else {
            return;
        };
        report(error.into());
        match error {
            BusParamsError::RetryLimit { .. } => params.retry_limit = params.retry_limit.min(8),
            BusParamsError::GapFactor { .. } => params.gap_factor = params.gap_factor.clamp(1, 100),
            BusParamsError::MinTsdr { .. } => params.t_sdr_min = BitTimes(11),
            BusParamsError::MaxTsdr { min, .. } if min.0 < 1023 => {
                params.t_sdr_max = BitTimes(params.t_sdr_max.0.clamp(min.0 + 1, 1023));
            }
            BusParamsError::Tset { .. } => params.t_set = BitTimes(params.t_set.0.clamp(1, 255)),
            BusParamsError::Trdy { min_tsdr, .. } => params.t_rdy = min_tsdr,
            BusParamsError::Tqui { t_rdy, .. } => params.t_qui = BitTimes(t_rdy.0.saturating_sub(1)),
            BusParamsError::Tid1 { least, .. } => params.t_id1 = least,
            BusParamsError::Tid2 { least, .. } => params.t_id2 = least,
            BusParamsError::Tsl { least, .. } if least.0 <= 16_383 => {
                params.t_sl = BitTimes(params.t_sl.0.clamp(least.0, 16_383));
            }
            BusParamsError::Ttr { .. } => params.t_tr = BitTimes(params.t_tr.0.clamp(1, 0x00FF_FFFF)),
            BusParamsError::Hsa { .. } => params.hsa = Address::MAX_STATION,
            // A rule that cannot be kept by changing this value alone ends the search.
            _ => return,
        }
    }
}

/// Stations of a segment, repeaters counted.
const STATIONS_OF_A_SEGMENT: u32 = 32;
/// Repeaters between two stations.
const REPEATERS_IN_SERIES: u32 = 3;
/// Addresses 0…125; 126 is for slaves that wait for an address.
const STATIONS_IN_ALL: u32 = 126;
/// Octets of data of one telegram in DP.
const MOST_DATA: usize = 244;
/// 10 ms · 255 · 255.
const LONGEST_WATCHDOG: Duration = Duration::from_millis(10 * 255 * 255);

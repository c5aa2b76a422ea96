//! Bus parameters from the network: what a configuration tool calculates.
//!
//! | result | formula | source |
//! |---|---|---|
//! | max Tsdr | profile, or the slowest station if that is slower | IEC 61784-1 CPF 3; GSD `MaxTsdr_…` |
//! | Tsm | 2 + 2·Tset + Tqui | EN 50170-2, part 4, 4.1.7 |
//! | Tid1 | max(Tsyn + Tsm, min Tsdr) | same |
//! | Tid2 | max(Tsyn + Tsm, max Tsdr) | same |
//! | Trdy | min Tsdr | function manual "PROFIBUS with STEP 7 V13", table 3-2 |
//! | Tsl | max(profile + 2·Ttd, max Tsdr + 11 + Tsm + 2·Ttd, Tid1 + 11 + Tsm + 2·Ttd) | EN 50170-2, part 4, 4.1.7: Tsl1, Tsl2 |
//! | Ttr | Σ masters (Ttc + Σ Data_Exchange + Global_Control + GAP + acyclic + repetitions) | EN 50170-2, part 4, 4.2.3 |
//! | watchdog | 6·Ttr, in units of 10 ms | see [`BusPlan::watchdog`] |
//!
//! # The target rotation time
//!
//! EN 50170 says: Ttr ≥ na·(Ttc + Tmc high) + k·Tmc low + mt·Tmc repeated. Filled in, each master has in one rotation
//!
//! ```text
//! token              33 + Tid1 + 2·Ttd
//! each of its slaves Data_Exchange with max Tsdr
//! Global_Control     11 · 13 + Tid2
//! GAP                one request of the FDL status that nobody answers: 11 · 6 + Tsl + Tid1
//! acyclic            k message cycles of 255 + 255 octets (diagnosis, DP-V1, a programming device)
//! repetitions        retry limit · (longest request + Tsl + Tid1): one station that is dead
//! ```
//!
//! The thesis (ch. 8.2) has one master and one slave with 16 + 16 octets at 12 Mbit/s over 3 m; its configuration tool computes 6.5 ms, that is
//! 78 000 tBIT. This calculation gives about 25 600 tBIT, 2.1 ms. What the tool adds is not published; the difference is what eight more
//! acyclic cycles of full length take, so a tool that reserves room for programming devices and controllers as partners gets there: with
//! `acyclic: 9` this gives 6.5 ms as well. The exchange itself takes about 656 tBIT, 55 µs, in both.

use super::bus_time::{MessageCycle, TOKEN_BITS, TYPICAL_TSDR, Way, octet_bits, telegram_octets};
use super::params::BusParams;
use crate::address::Address;
use crate::time::{Baud, BitTimes, Duration};

/// How bus parameters are chosen.
#[doc(alias = "Busprofil")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Only the stations named exist.
    Dp,
    /// As DP; besides the stations named there are [`Others`].
    ///
    /// Interpretation: the station times are those of DP, only the target rotation time has room for the others.
    Standard,
    /// Universal (DP/FMS): with stations that answer slowly, at most 1.5 Mbit/s. See [`Profile::station_times`].
    Universal,
    /// These, checked.
    User(BusParams),
}

impl Profile {
    /// Baud rate dependent parameters of stations, without cables and load.
    ///
    /// DP and Standard: [`BusParams::standard`]. Universal:
    ///
    /// | kbit/s | 9.6 | 19.2 | 45.45 | 93.75 | 187.5 | 500 | 1500 |
    /// |---|---|---|---|---|---|---|---|
    /// | max Tsdr | 60 | 65 | 400 | 200 | 360 | 360 | 980 |
    /// | Tset | 2 | 4 | 95 | 15 | 30 | 80 | 240 |
    /// | min Tsdr | 11 | 11 | 11 | 11 | 19 | 50 | 150 |
    ///
    /// max Tsdr: derived from the slot times that the manual of the SIMATIC NET optical link modules gives for this profile in a redundant ring:
    /// they are 2·max Tsdr + 51, which holds for all ten rates of profile DP too. Tset and min Tsdr: assumption, 160 µs and 100 µs, the values
    /// in use at 1.5 Mbit/s, never below those of DP. Tsl is 2·max Tsdr, the proportion of profile DP at 500 and 1500 kbit/s. Above
    /// 1.5 Mbit/s there is no such profile; the values of DP stand in and [`Network::check`] says so.
    #[must_use]
    pub const fn station_times(&self, baud: Baud) -> BusParams {
        let standard = BusParams::standard(baud);
        let (t_sdr_max, t_set, t_sdr_min) = match (self, baud) {
            (Self::User(params), _) => return *params,
            (Self::Dp | Self::Standard, _) => return standard,
            (Self::Universal, Baud::B9600) => (60, 2, 11),
            (Self::Universal, Baud::B19200) => (65, 4, 11),
            (Self::Universal, Baud::B45450) => (400, 95, 11),
            (Self::Universal, Baud::B93750) => (200, 15, 11),
            (Self::Universal, Baud::B187500) => (360, 30, 19),
            (Self::Universal, Baud::B500000) => (360, 80, 50),
            (Self::Universal, Baud::B1500000) => (980, 240, 150),
            (Self::Universal, _) => return standard,
        };
        BusParams {
            t_sl: BitTimes(2 * t_sdr_max),
            t_sdr_min: BitTimes(t_sdr_min),
            t_sdr_max: BitTimes(t_sdr_max),
            t_set: BitTimes(t_set),
            t_rdy: BitTimes(t_sdr_min),
            ..standard
        }
    }
}

/// A piece of cable between terminators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Length in centimetres.
    pub length_cm: u32,
    /// Everything that is connected to it: masters, slaves, repeaters, optical modules.
    pub stations: u32,
    /// All its stub lines together, in centimetres.
    pub stubs_cm: u32,
}

/// How optical modules are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpticalTopology {
    /// A line or star: signals pass the modules and the glass once.
    Line,
    /// A ring that heals itself when it is cut.
    ///
    /// The slot time is then at least a + b · km + c · modules, with a = 2·max Tsdr + 51, b = 20 µs in bit times and c = 24 (28 at 12 Mbit/s):
    /// twice that of a line, with 6 (7) tBIT a module and 5 µs a kilometre each way. The retry limit is at least 3, and one address up to
    /// HSA must stay free.
    ///
    /// Source: manual of the SIMATIC NET optical link modules, section "configuration of redundant optical rings", tables 3a and 3b.
    RedundantRing,
}

/// The optical part of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Optical {
    /// Number of modules.
    pub modules: u32,
    /// All glass together, in metres.
    pub fibre_m: u32,
    /// How they are connected.
    pub topology: OpticalTopology,
}

/// A slave of a master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlaveLoad {
    /// Its address.
    pub address: Address,
    /// Octets to the slave, 0…244.
    pub outputs: usize,
    /// Octets to the master, 0…244.
    pub inputs: usize,
    /// Its max Tsdr at this baud rate, from its GSD file; `None` is that of the profile.
    pub t_sdr_max: Option<BitTimes>,
}

/// A master and what it exchanges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MasterLoad<'a> {
    /// Its address.
    pub address: Address,
    /// Its slaves.
    pub slaves: &'a [SlaveLoad],
}

/// Stations that exist without being named; only for [`Profile::Standard`] and [`Profile::Universal`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Others {
    /// Masters.
    pub masters: u32,
    /// Slaves.
    pub slaves: u32,
    /// Octets that each of these slaves gets.
    pub outputs: usize,
    /// Octets that each of these slaves sends.
    pub inputs: usize,
}

/// A network to calculate bus parameters for; plain values, as the data sheets and the drawing name them.
///
/// # Example
///
/// ```
/// use dp_master::address::Address;
/// use dp_master::fdl::{MasterLoad, Network, Profile, Segment, SlaveLoad};
/// use dp_master::time::{Baud, BitTimes};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let drive = SlaveLoad { address: Address::new(3)?, outputs: 16, inputs: 16, t_sdr_max: None };
/// let slaves = [drive];
/// let plc = MasterLoad { address: Address::new(2)?, slaves: &slaves };
/// let cable = Segment { length_cm: 300, stations: 2, stubs_cm: 0 };
/// let (cables, masters) = ([cable], [plc]);
/// let network = Network { segments: &cables, ..Network::new(Baud::B12000000, Profile::Dp, &masters) };
/// let plan = network.plan();
/// assert_eq!((plan.params.t_id1, plan.params.t_sl), (BitTimes(76), BitTimes(1001)));
/// network.check(&plan, |violation| panic!("{violation}"));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Network<'a> {
    /// Baud rate.
    pub baud: Baud,
    /// How parameters are chosen.
    pub profile: Profile,
    /// The copper. The longest way goes through all of it.
    pub segments: &'a [Segment],
    /// Most repeaters in series between two stations.
    pub repeaters: u32,
    /// The glass.
    pub optical: Option<Optical>,
    /// The masters.
    pub masters: &'a [MasterLoad<'a>],
    /// Stations not named.
    pub others: Others,
    /// Highest address of a master; `None` is the highest named with [`Profile::Dp`], 126 otherwise.
    pub hsa: Option<Address>,
    /// Acyclic message cycles of full length that each master may have in one rotation; 1 by default.
    pub acyclic: u32,
    /// The watchdog time wished for, to be checked.
    pub watchdog: Option<Duration>,
    /// The constant bus cycle wished for, to be checked.
    #[doc(alias = "Äquidistanz")]
    pub constant_cycle: Option<Duration>,
}

impl<'a> Network<'a> {
    /// Masters on a line without length, with one acyclic cycle in each rotation.
    #[must_use]
    pub const fn new(baud: Baud, profile: Profile, masters: &'a [MasterLoad<'a>]) -> Self {
        Self {
            baud,
            profile,
            segments: &[],
            repeaters: 0,
            optical: None,
            masters,
            others: Others {
                masters: 0,
                slaves: 0,
                outputs: 0,
                inputs: 0,
            },
            hsa: None,
            acyclic: 1,
            watchdog: None,
            constant_cycle: None,
        }
    }

    /// Calculates the bus parameters. Whether the network keeps the rules, [`check`](Self::check) says.
    #[must_use]
    pub fn plan(&self) -> BusPlan {
        let round_trip = self.way().round_trip(self.baud);
        let params = match self.profile {
            Profile::User(params) => params,
            _ => self.params(round_trip),
        };
        let t_tr_least = self.rotation(&params, round_trip);
        let params = match self.profile {
            Profile::User(_) => params,
            // 256 is the least that configuration tools take (STEP 7 V13, table 3-2).
            _ => BusParams {
                t_tr: BitTimes(t_tr_least.0.max(256)),
                ..params
            },
        };
        let cycles = |t_sdr| {
            self.slaves().fold(BitTimes(0), |sum, slave| {
                sum + MessageCycle::data_exchange(slave.outputs, slave.inputs).bits(t_sdr, params.t_id1, round_trip)
            })
        };
        let tokens = repeated(self.token_cycle(&params, round_trip), self.master_count());
        BusPlan {
            params,
            round_trip,
            t_tr_least,
            least_cycle: tokens + cycles(params.t_sdr_min),
            // Not clamp: parameters of the user may have min Tsdr above max Tsdr.
            typical_cycle: tokens + cycles(TYPICAL_TSDR.min(params.t_sdr_max).max(params.t_sdr_min)),
            longest_cycle: repeated(params.t_tr, CYCLE_ROTATIONS),
            watchdog: in_units(self.baud.duration(repeated(params.t_tr, WATCHDOG_ROTATIONS))),
            least_constant_cycle: t_tr_least,
        }
    }

    /// What a telegram passes between the two stations farthest from each other.
    #[must_use]
    pub fn way(&self) -> Way {
        let copper = self
            .segments
            .iter()
            .fold(0_u32, |sum, segment| sum.saturating_add(segment.length_cm));
        let (glass_m, optical_modules) = self
            .optical
            .map_or((0, 0), |optical| (optical.fibre_m, optical.modules));
        Way {
            cable_cm: copper.saturating_add(glass_m.saturating_mul(100)),
            repeaters: self.repeaters,
            optical_modules,
        }
    }

    /// All slaves named.
    pub(super) fn slaves(&self) -> impl Iterator<Item = &SlaveLoad> {
        self.masters.iter().flat_map(|master| master.slaves)
    }

    /// Masters named and others.
    pub(super) fn master_count(&self) -> u32 {
        u32::try_from(self.masters.len())
            .unwrap_or(u32::MAX)
            .saturating_add(self.others().masters)
    }

    /// The others, if the profile knows any.
    pub(super) fn others(&self) -> Others {
        match self.profile {
            Profile::Dp => Others::default(),
            _ => self.others,
        }
    }

    fn params(&self, round_trip: BitTimes) -> BusParams {
        let profile = self.profile.station_times(self.baud);
        let t_sdr_max = self
            .slaves()
            .filter_map(|slave| slave.t_sdr_max)
            .fold(profile.t_sdr_max, BitTimes::max);
        let hsa = match (self.hsa, self.profile) {
            (Some(hsa), _) => hsa,
            (None, Profile::Dp) => self
                .masters
                .iter()
                .map(|master| master.address)
                .max()
                .unwrap_or(Address::MAX_STATION),
            (None, _) => Address::MAX_STATION,
        };
        let params = BusParams {
            t_sdr_max,
            hsa,
            ..profile
        }
        .with_least_idle_times();
        let (t_sl, retry_limit) = match self.optical {
            Some(optical) if optical.topology == OpticalTopology::RedundantRing => {
                let ring = self.ring_slot_time(&optical, params.t_sdr_max);
                (profile.t_sl.max(ring), profile.retry_limit.max(RING_RETRIES))
            }
            _ => (profile.t_sl + round_trip, profile.retry_limit),
        };
        BusParams {
            t_sl: t_sl.max(least_slot_time(&params, round_trip)),
            retry_limit,
            ..params
        }
    }

    /// a + b · km + c · modules of a redundant ring; its copper counts as glass.
    pub(super) fn ring_slot_time(&self, optical: &Optical, t_sdr_max: BitTimes) -> BitTimes {
        let way = Way {
            cable_cm: self.way().cable_cm,
            repeaters: 0,
            optical_modules: optical.modules,
        };
        repeated(t_sdr_max, 2) + BitTimes(51) + repeated(way.round_trip(self.baud), 2)
    }

    /// Ttc with the way of the token and that of the first request after it.
    fn token_cycle(&self, params: &BusParams, round_trip: BitTimes) -> BitTimes {
        TOKEN_BITS + params.t_id1 + round_trip
    }

    /// The longest rotation of the token: see the text of this module.
    fn rotation(&self, params: &BusParams, round_trip: BitTimes) -> BitTimes {
        let exchange = |outputs, inputs| {
            MessageCycle::data_exchange(outputs, inputs).bits(params.t_sdr_max, params.t_id1, round_trip)
        };
        let acyclic = repeated(
            MessageCycle::LONGEST.bits(params.t_sdr_max, params.t_id1, round_trip),
            self.acyclic,
        );
        let each = self.token_cycle(params, round_trip)
            + octet_bits(telegram_octets(GLOBAL_CONTROL_DATA))
            + params.t_id2
            + STATUS_REQUEST.unanswered_bits(params.t_sl, params.t_id1)
            + acyclic;
        let repetitions = |longest: MessageCycle| {
            let longest = if self.acyclic > 0 {
                MessageCycle::LONGEST
            } else {
                longest
            };
            repeated(
                longest.unanswered_bits(params.t_sl, params.t_id1),
                params.retry_limit.into(),
            )
        };
        let named = self.masters.iter().fold(BitTimes(0), |sum, master| {
            let outputs = master.slaves.iter().map(|slave| slave.outputs).max().unwrap_or(0);
            let load = master
                .slaves
                .iter()
                .fold(each, |load, slave| load + exchange(slave.outputs, slave.inputs));
            sum + load + repetitions(MessageCycle::data_exchange(outputs, 0))
        });
        let others = self.others();
        let longest = MessageCycle::data_exchange(others.outputs, others.inputs);
        named
            + repeated(each + repetitions(longest), others.masters)
            + repeated(exchange(others.outputs, others.inputs), others.slaves)
    }
}

/// What a network comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusPlan {
    /// The bus parameters.
    pub params: BusParams,
    /// 2·Ttd of the longest way.
    pub round_trip: BitTimes,
    /// The least Ttr that leaves room for everything.
    pub t_tr_least: BitTimes,
    /// One exchange with every slave, each answering after min Tsdr; tokens included, nothing else.
    pub least_cycle: BitTimes,
    /// The same with [`TYPICAL_TSDR`].
    pub typical_cycle: BitTimes,
    /// 3·Ttr: the longest time between two exchanges with a slave.
    ///
    /// Source: configuration sheets of COM PROFIBUS, whose maximum data cycle is three times Ttr (1.5 Mbit/s: 27 201 tBIT and 54.4 ms).
    pub longest_cycle: BitTimes,
    /// A proposal for the watchdog: 6·Ttr, twice the longest cycle, in units of 10 ms; 10 ms at least, 650 s at most.
    #[doc(alias = "Ansprechüberwachung")]
    pub watchdog: Duration,
    /// The least constant bus cycle of a lone master: the longest rotation.
    #[doc(alias = "Äquidistanz")]
    pub least_constant_cycle: BitTimes,
}

/// The larger of Tsl1, the wait for a response, and Tsl2, the wait for the next holder of the token.
pub(super) fn least_slot_time(params: &BusParams, round_trip: BitTimes) -> BitTimes {
    let wait = params.t_sdr_max.max(params.t_id1);
    wait + BitTimes(11) + params.t_sm() + round_trip
}

pub(super) const fn repeated(bits: BitTimes, times: u32) -> BitTimes {
    BitTimes(bits.0.saturating_mul(times))
}

/// Rounded up to the unit of the watchdog, inside its range.
fn in_units(time: Duration) -> Duration {
    const UNIT_NANOS: u64 = 10_000_000;
    const MOST_UNITS: u64 = 255 * 255;
    let units = time.as_nanos().div_ceil(UNIT_NANOS).clamp(1, MOST_UNITS);
    Duration::from_nanos(units * UNIT_NANOS)
}

/// Request of the FDL status; the response has the same length.
const STATUS_REQUEST: MessageCycle = MessageCycle {
    request: 6,
    response: 6,
};
/// Two access points and two octets.
const GLOBAL_CONTROL_DATA: usize = 4;
/// Rotations between two exchanges with a slave, at worst.
pub(super) const CYCLE_ROTATIONS: u32 = 3;
const WATCHDOG_ROTATIONS: u32 = 6;
/// Least retry limit of a redundant optical ring.
pub(super) const RING_RETRIES: u8 = 3;

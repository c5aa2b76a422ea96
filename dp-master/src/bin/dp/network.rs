//! A network for `dp busparam`: owned, from a file or from arguments.
//!
//! ```toml
//! baud = 1500000
//! profile = "dp"            # "dp", "standard", "universal" or "user"
//! repeaters = 0             # in series between the two stations farthest from each other
//! watchdog_ms = 50          # wishes, to be checked
//! constant_cycle_ms = 2.0
//!
//! [[segment]]
//! length_m = 120.0
//! stations = 12             # repeaters counted
//! stubs_m = 0.0
//!
//! [optical]
//! modules = 4
//! fibre_m = 2000
//! topology = "line"         # or "ring", the redundant one
//!
//! [[master]]
//! address = 2
//! [[master.slave]]
//! address = 3
//! outputs = 16
//! inputs = 16
//! max_tsdr = 150            # from its GSD file
//!
//! [others]                  # stations not named, for "standard" and "universal"
//! masters = 0
//! slaves = 5
//! outputs = 2
//! inputs = 2
//!
//! [user]                    # with profile = "user"; what is left out is that of "dp"
//! t_sl = 300
//! ```

use std::path::Path;

use dp_master::address::Address;
use dp_master::fdl::{BusParams, MasterLoad, Network, Optical, OpticalTopology, Others, Profile, Segment, SlaveLoad};
use dp_master::time::{Baud, BitTimes, Duration};

use crate::config_text::{Section, read_config};
use crate::output::Trouble;

/// [`Network`] with everything in it.
#[derive(Debug)]
pub(crate) struct NetworkFile {
    pub(crate) baud: Baud,
    pub(crate) profile: Profile,
    pub(crate) segments: Vec<Segment>,
    pub(crate) repeaters: u32,
    pub(crate) optical: Option<Optical>,
    pub(crate) masters: Vec<(Address, Vec<SlaveLoad>)>,
    pub(crate) others: Others,
    pub(crate) hsa: Option<Address>,
    pub(crate) acyclic: u32,
    pub(crate) watchdog: Option<Duration>,
    pub(crate) constant_cycle: Option<Duration>,
}

impl NetworkFile {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// One sentence for each mistake.
    pub(crate) fn read(path: &Path) -> Result<Self, Trouble> {
        read_config(path, |top| {
            let baud = read_baud(top);
            let profile = read_profile(top, baud.unwrap_or(Baud::B1500000));
            let file = Self {
                baud: baud.unwrap_or(Baud::B1500000),
                profile: profile.unwrap_or(Profile::Dp),
                segments: top.sections("segment").iter().filter_map(read_segment).collect(),
                repeaters: top.number("repeaters", 0..=100).unwrap_or(0),
                optical: top.section("optical").and_then(|section| read_optical(&section)),
                masters: top.sections("master").iter().filter_map(read_master).collect(),
                others: top
                    .section("others")
                    .map_or(Others::default(), |section| read_others(&section)),
                hsa: read_address(top, "hsa", 126),
                acyclic: top.number("acyclic", 0..=1000).unwrap_or(1),
                watchdog: top.decimal("watchdog_ms", 0.0..=1e6).map(millis),
                constant_cycle: top.decimal("constant_cycle_ms", 0.0..=1e6).map(millis),
            };
            baud.map(|_| file)
        })
    }

    /// Lets `job` see it as a [`Network`].
    pub(crate) fn with<T>(&self, job: impl FnOnce(&Network<'_>) -> T) -> T {
        let masters: Vec<MasterLoad<'_>> = self
            .masters
            .iter()
            .map(|(address, slaves)| MasterLoad {
                address: *address,
                slaves,
            })
            .collect();
        job(&Network {
            segments: &self.segments,
            repeaters: self.repeaters,
            optical: self.optical,
            others: self.others,
            hsa: self.hsa,
            acyclic: self.acyclic,
            watchdog: self.watchdog,
            constant_cycle: self.constant_cycle,
            ..Network::new(self.baud, self.profile, &masters)
        })
    }
}

/// `baud = 1500000`, needed.
pub(crate) fn read_baud(top: &Section<'_>) -> Option<Baud> {
    let found = top.parsed("baud", |value| {
        value
            .as_integer()
            .and_then(|number| number.as_str().parse().ok())
            .and_then(Baud::from_bits_per_second)
            .ok_or_else(|| dp_master::time::ParseBaudError.to_string())
    });
    top.needed("baud", found)
}

fn read_profile(top: &Section<'_>, baud: Baud) -> Option<Profile> {
    let standard = BusParams::standard(baud);
    let user = top.section("user").map(|section| read_params(&section, standard));
    let profile = top.word(
        "profile",
        &[
            ("dp", Profile::Dp),
            ("standard", Profile::Standard),
            ("universal", Profile::Universal),
            ("user", Profile::User(user.unwrap_or(standard))),
        ],
    )?;
    match (profile, user) {
        (Profile::User(_), None) => top.mistake("profile", "profile \"user\" needs its values in [user]"),
        (Profile::User(_), Some(_)) | (_, None) => {}
        (_, Some(_)) => top.mistake("user", "[user] is for profile = \"user\""),
    }
    Some(profile)
}

/// Values in bit times, checked by the rules of the network and not here.
fn read_params(section: &Section<'_>, standard: BusParams) -> BusParams {
    let bits = |key, standard: BitTimes| section.number(key, 0..=u32::MAX).map_or(standard, BitTimes);
    let params = BusParams {
        t_sl: bits("t_sl", standard.t_sl),
        t_sdr_min: bits("t_sdr_min", standard.t_sdr_min),
        t_sdr_max: bits("t_sdr_max", standard.t_sdr_max),
        t_set: bits("t_set", standard.t_set),
        t_qui: bits("t_qui", standard.t_qui),
        t_rdy: bits("t_rdy", standard.t_rdy),
        t_tr: bits("t_tr", standard.t_tr),
        gap_factor: section.number("gap_factor", 0..=u8::MAX).unwrap_or(standard.gap_factor),
        retry_limit: section
            .number("retry_limit", 0..=u8::MAX)
            .unwrap_or(standard.retry_limit),
        hsa: read_address(section, "hsa", 126).unwrap_or(standard.hsa),
        ..standard
    }
    .with_least_idle_times();
    let params = BusParams {
        t_id1: bits("t_id1", params.t_id1),
        t_id2: bits("t_id2", params.t_id2),
        ..params
    };
    section.finish();
    params
}

fn read_segment(section: &Section<'_>) -> Option<Segment> {
    let length = section.needed("length_m", section.decimal("length_m", 0.0..=100_000.0));
    let stations = section.number("stations", 0..=1000);
    let stubs = section.decimal("stubs_m", 0.0..=100_000.0);
    section.finish();
    Some(Segment {
        length_cm: centimetres(length?),
        stations: stations.unwrap_or(0),
        stubs_cm: centimetres(stubs.unwrap_or(0.0)),
    })
}

fn read_optical(section: &Section<'_>) -> Option<Optical> {
    let modules = section.needed("modules", section.number("modules", 1..=1000));
    let fibre = section.needed("fibre_m", section.decimal("fibre_m", 0.0..=1e6));
    let topology = section.word(
        "topology",
        &[
            ("line", OpticalTopology::Line),
            ("ring", OpticalTopology::RedundantRing),
        ],
    );
    section.finish();
    Some(Optical {
        modules: modules?,
        fibre_m: fibre?.ceil() as u32,
        topology: topology.unwrap_or(OpticalTopology::Line),
    })
}

fn read_master(section: &Section<'_>) -> Option<(Address, Vec<SlaveLoad>)> {
    let address = section.needed("address", read_address(section, "address", 126));
    let slaves = section.sections("slave").iter().filter_map(read_slave).collect();
    section.finish();
    Some((address?, slaves))
}

fn read_slave(section: &Section<'_>) -> Option<SlaveLoad> {
    let address = section.needed("address", read_address(section, "address", 126));
    let outputs = section.needed("outputs", section.number("outputs", 0_u32..=1000));
    let inputs = section.needed("inputs", section.number("inputs", 0_u32..=1000));
    let t_sdr_max = section.number("max_tsdr", 0..=65_535).map(BitTimes);
    section.finish();
    Some(SlaveLoad {
        address: address?,
        outputs: outputs? as usize,
        inputs: inputs? as usize,
        t_sdr_max,
    })
}

fn read_others(section: &Section<'_>) -> Others {
    let number = |key| section.number(key, 0_u32..=1000).unwrap_or(0);
    let others = Others {
        masters: number("masters"),
        slaves: number("slaves"),
        outputs: number("outputs") as usize,
        inputs: number("inputs") as usize,
    };
    section.finish();
    others
}

/// A station address up to `most`.
pub(crate) fn read_address(section: &Section<'_>, key: &'static str, most: u8) -> Option<Address> {
    section.number(key, 0..=most).and_then(|value| Address::new(value).ok())
}

/// Rounded up.
pub(crate) fn centimetres(metres: f64) -> u32 {
    // The cast saturates. A length is given in decimal, so a millionth more is none.
    (metres * 100.0 - 1e-6).ceil() as u32
}

/// Milliseconds with a fraction.
pub(crate) fn millis(millis: f64) -> Duration {
    Duration::from_nanos((millis * 1e6).round() as u64)
}

//! The file of `dp run`: a line, a master and its slaves.
//!
//! ```toml
//! port = "/dev/ttyUSB0"         # or tcp://host:port; --port comes before it
//! baud = 1500000
//! address = 2                   # our own
//! latency_ms = 50               # what adapter and system may add to an answer
//! hsa = 126                     # highest address of a master; a lower one shortens the search for others at the start
//! cycle_ms = 2.0                # least time from cycle to cycle; 0 is as fast as the bus allows
//! mode = "operate"              # at the start: "stop", "clear" or "operate"
//!
//! [[slave]]
//! name = "drive"                # for `set drive 8 0x0076`
//! address = 3
//! gsd = "lenz00da.gsd"          # beside this file
//! modules = ["PAR + 4 words"]   # in the order of the slots; names or references
//! watchdog_ms = 200
//! [slave.parameters]            # of the station, by name or reference
//! "Filter" = "on"
//!
//! [[slave]]                     # without a GSD file
//! name = "lamp"
//! address = 7
//! ident = 0x0BAD
//! identifiers = "20"
//! user_prm = "00 00 00"
//! outputs = "FF"                # at the start, zeros if not given
//! ```

use std::path::Path;

use dp_master::address::Address;
use dp_master::dp::{Demand, Mode, SlaveConfig, Watchdog};
use dp_master::gsd::{ModuleKey, ParameterKey, PrmValue, parse};
use dp_master::phy::PortName;
use dp_master::time::{Baud, Duration};
use toml::de::DeValue;

use crate::config_text::{Section, read_config};
use crate::decode::octets_of_words;
use crate::network::{millis, read_address, read_baud};
use crate::output::{Trouble, note};

/// A line, a master and its slaves, checked.
#[derive(Debug)]
pub(crate) struct RunConfig {
    pub(crate) port: Option<PortName>,
    pub(crate) baud: Baud,
    pub(crate) address: Address,
    pub(crate) latency: Duration,
    pub(crate) hsa: Option<Address>,
    pub(crate) cycle: Duration,
    pub(crate) mode: Mode,
    pub(crate) slaves: Vec<SlaveEntry>,
}

/// A slave of the file.
#[derive(Debug)]
pub(crate) struct SlaveEntry {
    pub(crate) name: String,
    pub(crate) config: SlaveConfig,
    /// Outputs at the start, in full length.
    pub(crate) outputs: Vec<u8>,
}

impl RunConfig {
    /// Reads a file; GSD files are looked for beside it.
    ///
    /// # Errors
    ///
    /// One sentence for each mistake.
    pub(crate) fn read(path: &Path) -> Result<Self, Trouble> {
        let folder = path.parent().unwrap_or(Path::new(""));
        read_config(path, |top| {
            let baud = read_baud(top);
            let own = top.needed("address", read_address(top, "address", 126));
            let port = top.parsed("port", |value| {
                let text = value.as_str().ok_or("a port is a text such as \"/dev/ttyUSB0\"")?;
                text.parse()
                    .map_err(|error: dp_master::phy::ParsePortNameError| error.to_string())
            });
            let config = Self {
                port,
                baud: baud.unwrap_or(Baud::B1500000),
                address: own.unwrap_or(Address::MAX_STATION),
                latency: millis(top.decimal("latency_ms", 0.0..=1000.0).unwrap_or(50.0)),
                hsa: read_address(top, "hsa", 126),
                cycle: millis(top.decimal("cycle_ms", 0.0..=10_000.0).unwrap_or(1.0)),
                mode: top
                    .word(
                        "mode",
                        &[("stop", Mode::Stop), ("clear", Mode::Clear), ("operate", Mode::Operate)],
                    )
                    .unwrap_or(Mode::Operate),
                slaves: read_slaves(top, own, folder),
            };
            Some(config)
        })
    }
}

fn read_slaves(top: &Section<'_>, own: Option<Address>, folder: &Path) -> Vec<SlaveEntry> {
    let sections = top.sections("slave");
    if sections.is_empty() {
        top.needed::<()>("slave", None);
    }
    let mut slaves: Vec<SlaveEntry> = Vec::new();
    for section in &sections {
        let Some(slave) = read_slave(section, folder) else {
            continue;
        };
        let address = slave.config.address;
        if own == Some(address) {
            section.mistake(
                "address",
                format_args!("address {address} is our own, a slave needs another one"),
            );
        }
        if let Some(other) = slaves.iter().find(|other| other.config.address == address) {
            section.mistake(
                "address",
                format_args!("address {address} is that of slave `{}` already", other.name),
            );
        }
        if slaves.iter().any(|other| other.name == slave.name) {
            section.mistake("name", format_args!("there is a slave `{}` already", slave.name));
        }
        slaves.push(slave);
    }
    slaves
}

fn read_slave(section: &Section<'_>, folder: &Path) -> Option<SlaveEntry> {
    let address = section.needed("address", read_address(section, "address", 125));
    let name = section.parsed("name", |value| {
        value
            .as_str()
            .filter(|name| !name.is_empty() && !name.contains(char::is_whitespace))
            .map(ToOwned::to_owned)
            .ok_or_else(|| "a name is a text without spaces".to_owned())
    });
    let watchdog = section.decimal("watchdog_ms", 0.0..=650_000.0).map(millis);
    let group = section.number("group", 0..=u8::MAX);
    let sync = section.flag("sync").unwrap_or(false);
    let freeze = section.flag("freeze").unwrap_or(false);
    let gsd = section.parsed("gsd", |value| {
        let file = value.as_str().ok_or("a GSD file is named by its path")?;
        let path = folder.join(file);
        let octets = std::fs::read(&path).map_err(|error| format!("which cannot be read: {error}"))?;
        let reading = parse(&octets);
        // Many files in use have mistakes. What the slave needs of it is checked when it is set up.
        if let Some(error) = reading.errors().next() {
            note(format_args!(
                "{}: error in {error}; `dp info` tells more",
                path.display()
            ));
        }
        Ok(reading.gsd)
    });
    let config = if section.has("gsd") {
        for key in ["ident", "identifiers", "user_prm"] {
            if section.has(key) {
                section.mistake(
                    key,
                    format_args!("`{key}` comes from the GSD file, leave one of them out"),
                );
            }
        }
        section.ignore(&["ident", "identifiers", "user_prm"]);
        let config = gsd.as_ref().and_then(|gsd| from_gsd(section, address?, gsd, watchdog));
        section.ignore(&["modules", "parameters"]);
        config
    } else {
        from_octets(section, address, watchdog)
    };
    let outputs = section.parsed("outputs", octets);
    section.finish();
    let mut config = config?;
    config.group = group.unwrap_or(0);
    for (wanted, demand) in [(sync, &mut config.sync), (freeze, &mut config.freeze)] {
        if wanted {
            *demand = Demand::Yes;
        }
    }
    let length = config.configuration.lengths().outputs;
    if let Some(outputs) = &outputs
        && outputs.len() != length
    {
        section.mistake(
            "outputs",
            format_args!("`outputs` has {} octets, the slave has {length}", outputs.len()),
        );
    }
    Some(SlaveEntry {
        name: name.unwrap_or_else(|| config.address.to_string()),
        config,
        outputs: outputs.unwrap_or_else(|| vec![0; length]),
    })
}

fn from_octets(section: &Section<'_>, address: Option<Address>, watchdog: Option<Duration>) -> Option<SlaveConfig> {
    let ident = section.needed("ident", section.number("ident", 0_u16..=0xFFFF));
    let identifiers = section.needed("identifiers", section.parsed("identifiers", octets));
    let user_prm = section.parsed("user_prm", octets).unwrap_or_default();
    let config = match SlaveConfig::new(address?, ident?, &identifiers?) {
        Ok(config) => config,
        Err(error) => {
            section.mistake("identifiers", error);
            return None;
        }
    };
    let mut config = match config.with_user_prm(&user_prm) {
        Ok(config) => config,
        Err(error) => {
            section.mistake("user_prm", error);
            return None;
        }
    };
    if let Some(time) = watchdog.filter(|time| *time > Duration::ZERO) {
        match Watchdog::at_least(time) {
            Ok(watchdog) => config.watchdog = Some(watchdog),
            Err(error) => section.mistake("watchdog_ms", error),
        }
    }
    Some(config)
}

fn from_gsd(
    section: &Section<'_>,
    address: Address,
    gsd: &dp_master::gsd::Gsd,
    watchdog: Option<Duration>,
) -> Option<SlaveConfig> {
    let mut setup = gsd.configure();
    let modules = section.parsed("modules", |value| {
        value
            .as_array()
            .and_then(|list| {
                list.iter()
                    .map(|value| Name::of(value.get_ref()))
                    .collect::<Option<Vec<_>>>()
            })
            .ok_or_else(|| "modules are a list of names or references".to_owned())
    });
    let mut plugged = true;
    for module in modules.iter().flatten() {
        if let Err(error) = setup.plug(module.module()) {
            section.mistake("modules", error);
            plugged = false;
        }
    }
    for parameters in section.sections("parameters") {
        for (key, value) in parameters.pairs() {
            let name = key.parse().map_or(ParameterKey::Name(key), ParameterKey::Reference);
            let set = match Name::of(value) {
                Some(Name::Text(text)) => setup.set(name, PrmValue::Text(&text)),
                Some(Name::Number(number)) => setup.set(name, PrmValue::Number(number)),
                None => {
                    parameters.mistake(
                        key,
                        format_args!("parameter `{key}`: allowed is a number or one of its texts"),
                    );
                    continue;
                }
            };
            if let Err(error) = set {
                parameters.mistake(key, error);
            }
        }
    }
    if let Some(time) = watchdog.filter(|time| *time > Duration::ZERO) {
        setup.watchdog(time);
    }
    match setup.slave_config(address) {
        Ok(config) => Some(config),
        // What is missing for want of a module was told already.
        Err(_) if !plugged => None,
        Err(error) => {
            section.mistake("gsd", error);
            None
        }
    }
}

/// A name, or a number that stands for one.
enum Name {
    Text(String),
    Number(i64),
}

impl Name {
    fn of(value: &DeValue<'_>) -> Option<Self> {
        match value {
            DeValue::String(text) => Some(Self::Text(text.to_string())),
            DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix())
                .ok()
                .map(Self::Number),
            _ => None,
        }
    }

    fn module(&self) -> ModuleKey<'_> {
        match self {
            Self::Text(name) => ModuleKey::Name(name),
            Self::Number(number) => ModuleKey::Reference(u16::try_from(*number).unwrap_or(u16::MAX)),
        }
    }
}

/// Octets as a text of hexadecimal pairs, or as a list of numbers.
fn octets(value: &DeValue<'_>) -> Result<Vec<u8>, String> {
    let allowed = || "allowed are octets such as \"F3 0A\" or [0xF3, 10]".to_owned();
    match value {
        DeValue::String(text) => octets_of_words(text).map_err(|_| allowed()),
        DeValue::Array(list) => list
            .iter()
            .map(|value| match value.get_ref() {
                DeValue::Integer(number) => u8::from_str_radix(number.as_str(), number.radix()).map_err(|_| allowed()),
                _ => Err(allowed()),
            })
            .collect(),
        _ => Err(allowed()),
    }
}

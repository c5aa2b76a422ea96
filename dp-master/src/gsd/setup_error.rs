//! Why a choice of modules and values is none.

use core::fmt;

use crate::dp::{CfgError, SetPrmError};
use crate::time::Duration;

/// Whose parameters are meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The station's.
    Station,
    /// Those of the module in this slot.
    Slot(u8),
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Station => f.write_str("station"),
            Self::Slot(slot) => write!(f, "slot {slot}"),
        }
    }
}

/// Why a slave cannot be set up this way.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SetupError {
    /// The file has no ident number.
    #[error("the GSD file has no `Ident_Number`")]
    NoIdent,
    /// No module is plugged.
    #[error("no module is plugged, so the slave has no configuration")]
    NoModules,
    /// The file has no such module.
    #[error("there is no module {key}; modules are {known}")]
    NoSuchModule {
        /// Name or reference.
        key: String,
        /// Modules there are.
        known: String,
    },
    /// There is no such slot.
    #[error("there is no slot {slot}; slots are {slots}")]
    NoSuchSlot {
        /// Number.
        slot: u8,
        /// Slots there are.
        slots: String,
    },
    /// All slots where the module may be are taken.
    #[error("there is no free slot for module `{module}`; modules plugged: {taken}")]
    NoFreeSlot {
        /// Its name.
        module: String,
        /// Modules plugged.
        taken: usize,
    },
    /// The module may not be in this slot.
    #[error("slot {slot}: module `{module}` may not be here; allowed are {allowed}")]
    ModuleNotAllowed {
        /// Number.
        slot: u8,
        /// Name of the module.
        module: String,
        /// Modules that may be there.
        allowed: String,
    },
    /// The slot is empty, but something is asked of its module or a later slot is used.
    #[error("slot {slot}: no module is plugged")]
    Empty {
        /// Number.
        slot: u8,
    },
    /// A preset module that must stay.
    #[error("slot {slot}: module `{module}` is fixed")]
    Fixed {
        /// Number.
        slot: u8,
        /// Name of the module.
        module: String,
    },
    /// There is no such parameter.
    #[error("{part}: there is no parameter {key}; parameters are {known}")]
    NoSuchParameter {
        /// Where.
        part: Part,
        /// Name, reference or place.
        key: String,
        /// Parameters there are.
        known: String,
    },
    /// Several parameters have this name or reference.
    #[error("{part}: there are several parameters {key}, name one by reference or place: {places}")]
    Ambiguous {
        /// Where.
        part: Part,
        /// Name or reference.
        key: String,
        /// References and octets.
        places: String,
    },
    /// The parameter is there to be seen only.
    #[error("{part}: parameter `{name}` cannot be changed")]
    NotChangeable {
        /// Where.
        part: Part,
        /// Its name.
        name: String,
    },
    /// The value is out of range.
    #[error("{part}: parameter `{name}`: {value} is not allowed; allowed are {allowed}")]
    ValueNotAllowed {
        /// Where.
        part: Part,
        /// Its name.
        name: String,
        /// The value.
        value: i64,
        /// Allowed values.
        allowed: String,
    },
    /// The parameter has no such text.
    #[error("{part}: parameter `{name}` has no text `{text}`; texts are {allowed}")]
    NoSuchText {
        /// Where.
        part: Part,
        /// Its name.
        name: String,
        /// The text.
        text: String,
        /// Texts of allowed values.
        allowed: String,
    },
    /// More than the slave takes.
    #[error("{got} {what}; `{keyword}` allows {max}")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many.
        got: usize,
        /// Most.
        max: usize,
        /// Keyword of the limit.
        keyword: &'static str,
    },
    /// The slave does not have it.
    #[error("the slave does not support it: `{keyword}` is not set in the GSD file")]
    NotSupported {
        /// Keyword that would say so.
        keyword: String,
    },
    /// The slave does not work without.
    #[error("the slave does not work without: `{keyword}` is set in the GSD file")]
    Required {
        /// Keyword that says so.
        keyword: &'static str,
    },
    /// The module needs PROFIsafe parameters, which are not made here.
    #[error("module `{module}` needs PROFIsafe parameters with their checksum, which this tool does not make")]
    Failsafe {
        /// Its name.
        module: String,
    },
    /// The description contradicts itself, as the reader has reported.
    #[error("{part}: the GSD file contradicts itself: {what}")]
    Broken {
        /// Where.
        part: Part,
        /// How.
        what: String,
    },
    /// The identifiers are no configuration.
    #[error(transparent)]
    Configuration(#[from] CfgError),
    /// The user parameters do not fit.
    #[error(transparent)]
    SetPrm(#[from] SetPrmError),
    /// The watchdog time cannot be told to the slave.
    #[error("a watchdog of {} ms is too long for the slave", time.as_nanos() / 1_000_000)]
    Watchdog {
        /// The time.
        time: Duration,
    },
}

/// Names for a message: the first few, and how many more there are.
pub(super) fn listed(names: impl Iterator<Item = String>) -> String {
    let mut all: Vec<String> = names.collect();
    let left_out = all.len().saturating_sub(SHOWN);
    all.truncate(SHOWN);
    match (all.is_empty(), left_out) {
        (true, _) => "none".to_owned(),
        (false, 0) => all.join(", "),
        (false, more) => format!("{} and {more} more", all.join(", ")),
    }
}

/// Names in a list.
const SHOWN: usize = 12;

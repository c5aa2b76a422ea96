//! What a drive keeps while its supply is off.

use thiserror::Error;

use super::memory::FaultMemory;
use crate::code::CodeStore;

/// Number of a parameter set, 1…4.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SetNumber(u8);

impl SetNumber {
    /// The set that is loaded at every power-up.
    pub const FIRST: Self = Self(1);

    /// All of them, with their names in files.
    pub(super) const ALL_WITH_KEYS: [(&'static str, Self); 4] = [
        ("set_1", Self(1)),
        ("set_2", Self(2)),
        ("set_3", Self(3)),
        ("set_4", Self(4)),
    ];

    /// A set number.
    ///
    /// # Errors
    ///
    /// [`SetNumberError`] outside 1…4.
    pub const fn new(number: u8) -> Result<Self, SetNumberError> {
        match number {
            1..=4 => Ok(Self(number)),
            got => Err(SetNumberError { got }),
        }
    }

    /// The number itself.
    pub const fn number(self) -> u8 {
        self.0
    }

    const fn place(self) -> usize {
        self.0 as usize - 1
    }
}

/// No such parameter set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("parameter set: expected 1 to 4, got {got}")]
pub struct SetNumberError {
    /// The number given.
    pub got: u8,
}

/// Four parameter sets, the fault memory and the counters of hours.
///
/// What was written and not saved by C0003 is lost when the supply goes off. Source: 9300 facts 3.2, 4.4.
///
/// # Example
///
/// ```
/// use lenze9300_model::code::{CodeStore, Inhibit};
/// use lenze9300_model::device::{NonVolatile, SetNumber};
///
/// let mut memory = NonVolatile::new(CodeStore::thesis());
/// let mut codes = memory.set(SetNumber::FIRST).clone();
/// codes.write(1301, 1, 987_5000, Inhibit::Inactive)?;
/// memory.save(SetNumber::new(2)?, &codes);
/// assert_eq!(memory.set(SetNumber::FIRST).read(1301, 1)?, 0);
/// assert_eq!(memory.set(SetNumber::new(2)?).read(1301, 1)?, 987_5000);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NonVolatile {
    sets: [CodeStore; 4],
    /// C0168 to C0170.
    pub faults: FaultMemory,
    /// C0178, s.
    pub enabled_s: u32,
    /// C0179, s.
    pub on_mains_s: u32,
}

impl NonVolatile {
    /// A commissioned drive: set 1 holds `codes`, the others the factory setting.
    pub fn new(codes: CodeStore) -> Self {
        let factory = CodeStore::factory();
        Self {
            sets: [codes, factory.clone(), factory.clone(), factory],
            faults: FaultMemory::default(),
            enabled_s: 0,
            on_mains_s: 0,
        }
    }

    /// A parameter set.
    pub fn set(&self, number: SetNumber) -> &CodeStore {
        &self.sets[number.place()]
    }

    /// Whether everything but the hours is the same.
    pub fn is_same_but_for_hours(&self, other: &Self) -> bool {
        self.sets == other.sets && self.faults == other.faults
    }

    /// Saves a parameter set, as C0003 does.
    pub fn save(&mut self, number: SetNumber, codes: &CodeStore) {
        self.sets[number.place()] = codes.clone();
    }
}

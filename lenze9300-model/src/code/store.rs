//! The values of the codes.

use super::error::CodeError;
use super::motor_list::MOTOR_LIST;
use super::table::{
    CODE_TABLE, CodeEntry, Concern, Domain, Kind, PLACE_COUNT, PLACES, POSITION_COUNT, Writable, line_of, number::*,
};
use crate::traverse::Resolution;

/// Whether the controller is inhibited while a code is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Inhibit {
    /// The controller is inhibited, by whatever source.
    Active,
    /// The controller is enabled.
    Inactive,
}

/// What an accepted write did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriteEffect {
    /// The code already had the value.
    Unchanged,
    /// The code has a new value; this part of the drive has to look again.
    Changed(Concern),
    /// The code triggers something: the drive is to do it.
    Command {
        /// Code number.
        code: u16,
        /// What was written, raw.
        value: i32,
    },
}

/// A target position that function blocks of the drive form: a stored position plus a constant.
///
/// Both are converted to whole increments first and added then, which is why thesis fig. 68 shows 1099.9999 for
/// 1200 mm − 100 mm. Source: 9300 facts 4.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WiredPosition {
    /// Number of the variable (subcode of C1301).
    pub number: u8,
    /// Number of the stored position.
    pub base: u8,
    /// Constant, units ×10000.
    pub offset_e4: i32,
}

/// First position variable that cannot be written.
pub(crate) const FIRST_WIRED: u8 = 61;

/// The wired variables of the film feed, with which a store begins.
///
/// 061 is named by thesis fig. 68. Interpretation: 062 stands for the target of record 04, "tolerance + one whole feed
/// length", with the tolerance read as the whole band of ±50 mm; its number is assumed.
#[doc(alias = "VTPOS")]
pub const WIRED_POSITIONS: [WiredPosition; 2] = [
    WiredPosition {
        number: 61,
        base: 1,
        offset_e4: -100_0000,
    },
    WiredPosition {
        number: 62,
        base: 1,
        offset_e4: 100_0000,
    },
];

/// The values of all codes of one drive.
///
/// Every access is a look-up by index. Values are raw: ×10000 unless the table says otherwise.
///
/// # Example
///
/// ```
/// use lenze9300_model::code::{CodeStore, Inhibit};
///
/// let mut codes = CodeStore::thesis();
/// codes.write(1301, 1, 1200_0000, Inhibit::Inactive)?;
/// assert_eq!(codes.read(1301, 1)?, 0x00B7_1B00);
/// assert_eq!(codes.read(1204, 0)?, 179_0708);
/// # Ok::<(), lenze9300_model::code::CodeError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CodeStore {
    values: [i32; PLACE_COUNT],
    wired: Vec<WiredPosition>,
    generation: u32,
}

impl CodeStore {
    /// All codes at their factory values.
    pub fn factory() -> Self {
        let mut values = [0; PLACE_COUNT];
        for (line, entry) in CODE_TABLE.iter().enumerate() {
            let first = usize::from(PLACES[line]);
            for (place, subcode) in (entry.first_subcode..=entry.last_subcode).enumerate() {
                values[first + place] = entry.factory_of(subcode);
            }
        }
        let mut store = Self {
            values,
            wired: WIRED_POSITIONS.to_vec(),
            generation: 0,
        };
        store.refresh_derived();
        store
    }

    /// The commissioning values of the film feed.
    ///
    /// The variables the PLC writes (C1301/1, C1302/1, C1302/2, C1303/1) stay at their factory values. The feed
    /// constant π·57 mm = 179.0707813 mm is kept with four decimals. Source: film-feed specification, section 5.
    pub fn thesis() -> Self {
        let mut store = Self::factory();
        for (code, value) in THESIS {
            let accepted = store.write(code, 0, value, Inhibit::Active);
            debug_assert!(accepted.is_ok(), "the preset lies inside the ranges: {accepted:?}");
        }
        store
    }

    /// The value of a code.
    ///
    /// # Errors
    ///
    /// [`CodeError::UnknownCode`] or [`CodeError::UnknownSubcode`].
    pub fn read(&self, code: u16, subcode: u8) -> Result<i32, CodeError> {
        let (_, place) = locate(code, subcode)?;
        Ok(self.values[place])
    }

    /// Writes a code as the bus, the keypad or the system bus does.
    ///
    /// A value between two steps is cut to the step of lower magnitude (Interpretation). C0086 sets exactly its
    /// dependants; C0006 or a motor datum sets C0086 to 0. On an error nothing has changed.
    ///
    /// # Errors
    ///
    /// In this order: [`CodeError::UnknownCode`], [`CodeError::UnknownSubcode`], [`CodeError::ReadOnly`],
    /// [`CodeError::OnlyWhileInhibited`], [`CodeError::TooHigh`], [`CodeError::TooLow`],
    /// [`CodeError::OutsideSelection`].
    pub fn write(&mut self, code: u16, subcode: u8, value: i32, inhibit: Inhibit) -> Result<WriteEffect, CodeError> {
        let (entry, place) = locate(code, subcode)?;
        let wired = code == C1301 && subcode >= FIRST_WIRED;
        match entry.writable {
            Writable::Never => return Err(CodeError::ReadOnly { code, subcode }),
            _ if wired => return Err(CodeError::ReadOnly { code, subcode }),
            Writable::OnlyInhibited if inhibit == Inhibit::Inactive => {
                return Err(CodeError::OnlyWhileInhibited { code, subcode });
            }
            Writable::OnlyInhibited | Writable::Always => {}
        }
        let value = check(entry, subcode, value)?;
        if entry.kind == Kind::Action {
            return Ok(WriteEffect::Command { code, value });
        }
        let before = self.values[place];
        self.values[place] = value;
        let followers = match entry.concern {
            Concern::MotorList => self.load_motor(value),
            Concern::Motor => self.replace(C0086, 0),
            _ => false,
        };
        if before == value && !followers {
            return Ok(WriteEffect::Unchanged);
        }
        self.generation = self.generation.wrapping_add(1);
        let feeds_a_block = code == C1301 && self.wired.iter().any(|wired| wired.base == subcode);
        if matches!(entry.concern, Concern::Machine) || feeds_a_block {
            self.refresh_derived();
        }
        Ok(WriteEffect::Changed(entry.concern))
    }

    /// Takes over every stored code of another store, as when a parameter set is loaded; displays stay.
    pub fn load(&mut self, set: &CodeStore) {
        for (line, entry) in CODE_TABLE.iter().enumerate() {
            if entry.kind == Kind::Stored {
                let places = usize::from(PLACES[line])..usize::from(PLACES[line + 1]);
                self.values[places.clone()].copy_from_slice(&set.values[places]);
            }
        }
        self.generation = self.generation.wrapping_add(1);
        self.refresh_derived();
    }

    /// The stored codes whose value differs from that in another store, with both values, in ascending order.
    ///
    /// Against [`factory`](Self::factory) these are the codes that were set. Variables formed in the drive are left out.
    ///
    /// # Example
    ///
    /// ```
    /// use lenze9300_model::code::{CodeStore, Inhibit};
    ///
    /// let factory = CodeStore::factory();
    /// let mut codes = CodeStore::factory();
    /// codes.write(1301, 2, 50_0000, Inhibit::Inactive)?;
    /// let set: Vec<_> = codes.differences(&factory).collect();
    /// assert_eq!((set.len(), set[0].code, set[0].subcode, set[0].here), (1, 1301, 2, 50_0000));
    /// # Ok::<(), lenze9300_model::code::CodeError>(())
    /// ```
    pub fn differences<'a>(&'a self, other: &'a CodeStore) -> impl Iterator<Item = Difference> + 'a {
        stored().filter_map(move |(entry, subcode)| {
            let (here, there) = (self.raw(entry.number, subcode), other.raw(entry.number, subcode));
            (here != there).then_some(Difference {
                code: entry.number,
                subcode,
                here,
                there,
            })
        })
    }

    /// Checks the number of data octets of a write job against the table.
    ///
    /// # Errors
    ///
    /// [`CodeError::UnknownCode`], [`CodeError::DataTooLong`] or [`CodeError::DataTooShort`].
    pub fn check_length(&self, code: u16, octets: u8) -> Result<(), CodeError> {
        let entry = super::table::entry(code).ok_or(CodeError::UnknownCode { code })?;
        let expected = entry.length;
        match octets.cmp(&expected.octets()) {
            std::cmp::Ordering::Less => Err(CodeError::DataTooShort {
                code,
                expected,
                got: octets,
            }),
            std::cmp::Ordering::Equal => Ok(()),
            std::cmp::Ordering::Greater => Err(CodeError::DataTooLong {
                code,
                expected,
                got: octets,
            }),
        }
    }

    /// Sets what a display or an action shows; the drive's own side of it, limited to the code's range.
    ///
    /// # Errors
    ///
    /// [`CodeError::UnknownCode`], [`CodeError::UnknownSubcode`], or [`CodeError::ReadOnly`] when the code is a stored
    /// parameter, which the drive itself never overwrites.
    pub fn publish(&mut self, code: u16, subcode: u8, value: i32) -> Result<(), CodeError> {
        let (entry, place) = locate(code, subcode)?;
        if entry.kind == Kind::Stored {
            return Err(CodeError::ReadOnly { code, subcode });
        }
        self.values[place] = value.clamp(entry.domain.min(), entry.domain.max());
        Ok(())
    }

    /// The position variables that function blocks of the drive form.
    pub fn wired_positions(&self) -> &[WiredPosition] {
        &self.wired
    }

    /// Wires the function blocks anew, as loading another program does. Variables from 61 that are not named read 0.
    pub fn set_wired_positions(&mut self, wired: impl IntoIterator<Item = WiredPosition>) {
        for number in FIRST_WIRED..=POSITION_COUNT {
            if let Ok((_, place)) = locate(C1301, number) {
                self.values[place] = 0;
            }
        }
        self.wired = wired.into_iter().collect();
        self.generation = self.generation.wrapping_add(1);
        self.refresh_derived();
    }

    /// Counts the changes of stored codes (wrapping), so that a reader can cache what it derived from them.
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// Value of a code of the table as a number: divided by 10000 unless the code is plain. 0 for an unknown code.
    pub fn number(&self, code: u16, subcode: u8) -> f64 {
        match locate(code, subcode) {
            Ok((entry, place)) => {
                let raw = f64::from(self.values[place]);
                match entry.form {
                    super::table::Form::FixedPoint4 => raw / 10_000.0,
                    super::table::Form::Plain => raw,
                }
            }
            Err(_) => 0.0,
        }
    }

    /// Raw value of a code that is known to be in the table; 0 otherwise.
    pub(crate) fn raw(&self, code: u16, subcode: u8) -> i32 {
        self.read(code, subcode).unwrap_or(0)
    }

    fn replace(&mut self, code: u16, value: i32) -> bool {
        match locate(code, 0) {
            Ok((_, place)) => std::mem::replace(&mut self.values[place], value) != value,
            Err(_) => false,
        }
    }

    fn load_motor(&mut self, value: i32) -> bool {
        let motor = MOTOR_LIST
            .iter()
            .find(|motor| i32::from(motor.number) * 10_000 == value);
        let mut changed = false;
        for &(code, value) in motor.map_or(&[][..], |motor| motor.values) {
            changed |= self.replace(code, value);
        }
        changed
    }

    /// Brings the displays that follow from other codes up to date: C1205 and the wired positions.
    fn refresh_derived(&mut self) {
        let resolution = Resolution::from_codes(self);
        let per_unit = resolution.increments_per_unit_e4();
        self.replace(C1205, per_unit);
        for place in 0..self.wired.len() {
            let wired = self.wired[place];
            let increments =
                resolution.whole_increments(self.raw(C1301, wired.base)) + resolution.whole_increments(wired.offset_e4);
            let shown = resolution.units_e4(increments);
            if let Ok((_, place)) = locate(C1301, wired.number) {
                self.values[place] = shown;
            }
        }
    }
}

/// Film-feed specification, section 5; without subcodes, in the order of commissioning.
const THESIS: [(u16, i32); 10] = [
    (C0005, 2_0213_0000),
    (C0173, 1_0000),
    (C0086, 108_0000),
    (C0011, 3000_0000),
    (C1202, 7_0000),
    (C1203, 1_0000),
    (C1204, 179_0708),
    (C1240, 1200_0000),
    (C1250, 2400_0000),
    (C1211, 1_0000),
];

/// A code that has one value here and another there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Code number.
    pub code: u16,
    /// Subcode, 0 for a code without subcodes.
    pub subcode: u8,
    /// Value in this store, raw.
    pub here: i32,
    /// Value in the other store, raw.
    pub there: i32,
}

/// Every value that can be written and is kept, in ascending order.
fn stored() -> impl Iterator<Item = (&'static CodeEntry, u8)> {
    CODE_TABLE
        .iter()
        .filter(|entry| entry.kind == Kind::Stored)
        .flat_map(|entry| (entry.first_subcode..=entry.last_subcode).map(move |subcode| (entry, subcode)))
        .filter(|(entry, subcode)| !(entry.number == C1301 && *subcode >= FIRST_WIRED))
}

fn locate(code: u16, subcode: u8) -> Result<(&'static CodeEntry, usize), CodeError> {
    let line = line_of(code).ok_or(CodeError::UnknownCode { code })?;
    let entry = &CODE_TABLE[line];
    if subcode < entry.first_subcode || subcode > entry.last_subcode {
        return Err(CodeError::UnknownSubcode {
            code,
            got: subcode,
            first: entry.first_subcode,
            last: entry.last_subcode,
        });
    }
    Ok((
        entry,
        usize::from(PLACES[line]) + usize::from(subcode - entry.first_subcode),
    ))
}

fn check(entry: &CodeEntry, subcode: u8, value: i32) -> Result<i32, CodeError> {
    let (code, min, max) = (entry.number, entry.domain.min(), entry.domain.max());
    if value > max {
        return Err(CodeError::TooHigh {
            code,
            subcode,
            max,
            got: value,
        });
    }
    if value < min {
        return Err(CodeError::TooLow {
            code,
            subcode,
            min,
            got: value,
        });
    }
    match entry.domain {
        // The least value need not lie on the grid of the steps (C0076 starts at 0.5); cutting must not leave the range.
        Domain::Range { step, .. } => Ok((value - value % step).max(min)),
        Domain::Selection(selection) if !selection.contains(&value) => Err(CodeError::OutsideSelection {
            code,
            subcode,
            got: value,
            selection,
        }),
        Domain::Selection(_) => Ok(value),
    }
}

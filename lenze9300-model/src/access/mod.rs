//! The parameters of a drive from outside, whatever way leads to them: the system bus, PROFIBUS DP-V1 or a parameter file.

mod can;
mod dpv1;
mod file;
mod place;
mod record;

use thiserror::Error;

pub use can::CanAccess;
pub use dpv1::Dpv1Access;
pub use file::FileAccess;
pub use place::{CodePlace, ParsePlaceError, ParseValueError};
pub use record::CodeRecord;

/// Reads and writes codes, raw as the bus carries them.
pub trait ParameterAccess {
    /// Reads a code.
    ///
    /// # Errors
    ///
    /// [`AccessError`].
    fn read(&mut self, place: CodePlace) -> Result<i32, AccessError>;

    /// Writes a code.
    ///
    /// # Errors
    ///
    /// [`AccessError`].
    fn write(&mut self, place: CodePlace, raw: i32) -> Result<(), AccessError>;
}

impl<A: ParameterAccess + ?Sized> ParameterAccess for Box<A> {
    fn read(&mut self, place: CodePlace) -> Result<i32, AccessError> {
        (**self).read(place)
    }

    fn write(&mut self, place: CodePlace, raw: i32) -> Result<(), AccessError> {
        (**self).write(place, raw)
    }
}

/// Why a code could not be read or written.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AccessError {
    /// The drive answered and refused; others may go.
    #[error("{place}: {reason}")]
    Refused {
        /// The code.
        place: CodePlace,
        /// What the drive gave as reason, in words.
        reason: String,
    },
    /// The way is open, and the drive does not answer, or not so that it could be understood.
    #[error("{0}")]
    NoAnswer(String),
    /// There is no way to the drive, or none any more: a port, an interface, a file.
    #[error("{0}")]
    NoWay(String),
}

impl AccessError {
    /// Whether other codes may still be reached.
    #[must_use]
    pub const fn is_refusal(&self) -> bool {
        matches!(self, Self::Refused { .. })
    }
}

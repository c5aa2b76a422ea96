//! Loading and saving of parameter sets, C0002 and C0003.

use super::nonvolatile::{NonVolatile, SetNumber};
use crate::code::CodeStore;

/// A parameter set on its way between working and non-volatile memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Transfer {
    what: What,
    left_ms: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    LoadFactory,
    Load(SetNumber),
    Save(SetNumber),
}

impl Transfer {
    /// C0002: 0 loads the factory setting, 1…4 a saved set.
    pub(super) fn load(value: i32, ms: u32) -> Option<Self> {
        let what = match value {
            0 => What::LoadFactory,
            number => What::Load(set(number)?),
        };
        Some(Self { what, left_ms: ms })
    }

    /// C0003: 1…4 saves a set, 0 does nothing.
    pub(super) fn save(value: i32, ms: u32) -> Option<Self> {
        let what = What::Save(set(value)?);
        Some(Self { what, left_ms: ms })
    }

    /// A millisecond passes; `true` when it was the last.
    pub(super) fn pass_1ms(&mut self) -> bool {
        self.left_ms = self.left_ms.saturating_sub(1);
        self.left_ms == 0
    }

    pub(super) fn carry_out(self, codes: &mut CodeStore, memory: &mut NonVolatile) {
        match self.what {
            What::LoadFactory => codes.load(&CodeStore::factory()),
            What::Load(number) => codes.load(memory.set(number)),
            What::Save(number) => memory.save(number, codes),
        }
    }
}

fn set(number: i32) -> Option<SetNumber> {
    SetNumber::new(u8::try_from(number).ok()?).ok()
}

//! GSD files: what a device says about itself to those who configure it.
//!
//! ```text
//! octets ─► text (characters) ─► grammar (statements of tokens) ─► reader, block (description) ─► check (the whole)
//! ```
//!
//! [`parse`] reads the keywords of GSD revisions 1 to 5 into a [`Gsd`]. It takes any octets and never fails: what is wrong is told by line, what
//! is right is kept. Keywords it does not know are kept by name.
//!
//! # Example
//!
//! ```
//! use dp_master::gsd::{self, Severity};
//!
//! let file = br#"
//! #Profibus_DP
//! GSD_Revision = 1
//! Vendor_Name = "Smith & Sons"
//! Model_Name = "Lamp"
//! Ident_Number = 0x0BAD
//! Module = "8 lamps" 0x20
//! EndModul
//! "#;
//! let reading = gsd::parse(file);
//! assert_eq!(reading.gsd.general.ident_number, Some(0x0BAD));
//! assert_eq!(reading.gsd.modules[0].config, [0x20]);
//! let complaint = reading.diagnostics.iter().find(|remark| remark.line() == 8).unwrap();
//! assert_eq!(complaint.to_string(), "line 8: unknown keyword `EndModul` in `Module`");
//! assert_eq!(complaint.severity, Severity::Warning);
//! ```
//!
//! Source: guideline "Specification for PROFIBUS Device Description and Device Integration, Volume 1: GSD" of PROFIBUS International.

mod block;
mod check;
mod cursor;
mod device;
mod diag_text;
mod diagnostic;
mod entry;
mod grammar;
mod keyword_family;
mod keywords;
mod module;
mod prm;
mod reader;
mod setup;
mod setup_error;
mod setup_octets;
mod setup_values;
mod summary;
mod text;
mod unit_diag;

use check::Checks;
pub use device::{
    Dpv1Features, DxbFeatures, General, Gsd, IsochronFeatures, MainFamily, MasterFeatures, OtherKeyword,
    PhysicalInterface, Pins24V, ProtocolIdent, Rate, RateFeatures, RepeaterCtrlSig, Section, SlaveFamily,
    SlaveFeatures, StationType,
};
pub use diag_text::{DiagnosisText, Origin};
pub use diagnostic::{Diagnostic, Position, Severity};
pub use module::{AlarmKinds, DataArea, Module, Slot};
pub use prm::{Parameter, PrmConstant, PrmLayout, PrmPlace, PrmText, PrmType, ValueSet};
use reader::Reader;
use serde::Serialize;
pub use setup::{ModuleKey, Setup};
pub use setup_error::{Part, SetupError};
pub use setup_values::{ParameterKey, PrmValue, Setting};
pub use summary::Summary;
use text::{Lines, decode};
pub use unit_diag::{DiagText, UnitDiag, UnitDiagArea};

/// A file as it was read: the description, and what is wrong with it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Reading {
    /// The description, as far as it could be read.
    pub gsd: Gsd,
    /// Errors and warnings, by line; at most a thousand and one that says how many were left out.
    pub diagnostics: Vec<Diagnostic>,
}

impl Reading {
    /// The errors.
    pub fn errors(&self) -> impl Iterator<Item = &Diagnostic> {
        self.of(Severity::Error)
    }

    /// The warnings.
    pub fn warnings(&self) -> impl Iterator<Item = &Diagnostic> {
        self.of(Severity::Warning)
    }

    fn of(&self, severity: Severity) -> impl Iterator<Item = &Diagnostic> {
        self.diagnostics
            .iter()
            .filter(move |remark| remark.severity == severity)
    }
}

/// Reads a GSD file, in UTF-8 or Windows-1252, whatever its octets are.
pub fn parse(octets: &[u8]) -> Reading {
    let text = decode(octets);
    let lines = Lines::new(&text);
    let Reader {
        gsd,
        mut remarks,
        seen,
        start,
        ..
    } = Reader::read(&text, &lines);
    Checks {
        gsd: &gsd,
        seen: &seen,
        start,
        remarks: &mut remarks,
    }
    .run();
    Reading {
        gsd,
        diagnostics: remarks.into_sorted(),
    }
}

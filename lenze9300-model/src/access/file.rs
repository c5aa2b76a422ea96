use std::fs;
use std::path::{Path, PathBuf};

use super::{AccessError, CodePlace, ParameterAccess};
use crate::code::{CodeStore, Inhibit, read_parameter_file, write_parameter_file};

/// A parameter file as if it were a drive: what the file does not name has its factory value.
#[derive(Debug)]
pub struct FileAccess {
    path: PathBuf,
    codes: CodeStore,
}

impl FileAccess {
    /// Opens a parameter file; one that is not there yet is a drive at its factory setting.
    ///
    /// # Errors
    ///
    /// [`AccessError::NoWay`] with every mistake of the file.
    pub fn open(path: &Path) -> Result<Self, AccessError> {
        let no_way = |error: &dyn std::fmt::Display| AccessError::NoWay(format!("{}: {error}", path.display()));
        let mut codes = CodeStore::factory();
        if path.exists() {
            let text = fs::read_to_string(path).map_err(|error| no_way(&error))?;
            read_parameter_file(&text, &mut codes).map_err(|error| no_way(&error))?;
        }
        Ok(Self {
            path: path.to_path_buf(),
            codes,
        })
    }

    /// Replaces the file whole.
    fn keep(&self) -> Result<(), AccessError> {
        let no_way = |error: std::io::Error| AccessError::NoWay(format!("{}: {error}", self.path.display()));
        let fresh = self.path.with_extension("new");
        fs::write(&fresh, write_parameter_file(&self.codes, &CodeStore::factory())).map_err(no_way)?;
        fs::rename(&fresh, &self.path).map_err(no_way)
    }
}

impl ParameterAccess for FileAccess {
    fn read(&mut self, place: CodePlace) -> Result<i32, AccessError> {
        self.codes
            .read(place.code, place.subcode)
            .map_err(|error| refused(place, &error))
    }

    fn write(&mut self, place: CodePlace, raw: i32) -> Result<(), AccessError> {
        self.codes
            .write(place.code, place.subcode, raw, Inhibit::Active)
            .map_err(|error| refused(place, &error))?;
        self.keep()
    }
}

fn refused(place: CodePlace, error: &crate::code::CodeError) -> AccessError {
    // The sentence names the code already.
    let told = error.to_string();
    let code = format!("C{:04}", place.code);
    let subcode = format!("/{}", place.subcode);
    let rest = told.strip_prefix(&code).unwrap_or(&told);
    let rest = rest.strip_prefix(&subcode).unwrap_or(rest);
    let reason = rest.trim_start_matches([':', ' ']);
    AccessError::Refused {
        place,
        reason: reason.to_owned(),
    }
}

//! Keeps what the drive keeps: a file that follows its non-volatile memory.

use std::path::{Path, PathBuf};

use lenze9300_model::device::{NonVolatile, write_state_file};

/// Writes the file whenever a parameter set was saved or the fault memory changed; the hours go with them.
#[derive(Debug)]
pub(crate) struct StateKeeper {
    path: PathBuf,
    kept: NonVolatile,
}

impl StateKeeper {
    /// Keeps `memory` from now on; the file is written when it changes for the first time.
    pub(crate) fn new(path: &Path, memory: &NonVolatile) -> Self {
        Self {
            path: path.to_path_buf(),
            kept: memory.clone(),
        }
    }

    /// Writes the file if it is behind. It is replaced whole: a process that is killed leaves the old one or the new one.
    pub(crate) fn keep(&mut self, memory: &NonVolatile) -> Result<(), String> {
        if self.kept.is_same_but_for_hours(memory) {
            return Ok(());
        }
        let fresh = self.path.with_extension("new");
        let told = |error: std::io::Error| format!("{}: {error}", self.path.display());
        std::fs::write(&fresh, write_state_file(memory)).map_err(told)?;
        std::fs::rename(&fresh, &self.path).map_err(told)?;
        self.kept = memory.clone();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lenze9300_model::code::{CodeStore, Inhibit};
    use lenze9300_model::device::{SetNumber, read_state_file};

    #[test]
    fn a_saved_set_is_in_the_file_and_hours_alone_write_none() {
        let path = std::env::temp_dir().join(format!("lenze9300-state-{}.toml", std::process::id()));
        let mut memory = NonVolatile::new(CodeStore::thesis());
        let mut keeper = StateKeeper::new(&path, &memory);
        memory.on_mains_s = 5;
        keeper.keep(&memory).unwrap();
        assert!(!path.exists());
        let mut codes = CodeStore::thesis();
        codes.write(70, 0, 7_0000, Inhibit::Active).unwrap();
        memory.save(SetNumber::FIRST, &codes);
        keeper.keep(&memory).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(read_state_file(&text).unwrap(), memory);
    }
}

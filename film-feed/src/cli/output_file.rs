//! A result file that appears whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// A file under a provisional name beside its place; it takes its place when the result is complete.
#[derive(Debug)]
pub(super) struct OutputFile {
    target: PathBuf,
    provisional: PathBuf,
    committed: bool,
}

impl OutputFile {
    /// Makes the provisional file, so that a wrong path is found before the run and not after it.
    pub(super) fn create(target: &Path) -> Result<Self, String> {
        let mut name = target.file_name().unwrap_or_default().to_os_string();
        if name.is_empty() || target.is_dir() {
            return Err(format!(
                "{} cannot be written: it is a directory, a file name is needed",
                target.display()
            ));
        }
        name.push(".part");
        let provisional = target.with_file_name(name);
        File::create(&provisional).map_err(|error| format!("{} cannot be written: {error}", target.display()))?;
        Ok(OutputFile {
            target: target.to_path_buf(),
            provisional,
            committed: false,
        })
    }

    /// Lets `write` fill the file and puts it in its place.
    pub(super) fn commit(mut self, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), String> {
        let put = || -> io::Result<()> {
            let mut out = BufWriter::new(File::create(&self.provisional)?);
            write(&mut out)?;
            out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
            fs::rename(&self.provisional, &self.target)
        };
        put().map_err(|error| format!("{} cannot be written: {error}", self.target.display()))?;
        self.committed = true;
        Ok(())
    }
}

impl Drop for OutputFile {
    fn drop(&mut self) {
        if !self.committed {
            // Best effort: the run failed already, and says so.
            let _ = fs::remove_file(&self.provisional);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn scratch(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("film-feed-output-{}-{name}", std::process::id()))
    }

    #[test]
    fn an_abandoned_file_leaves_nothing_behind() {
        let target = scratch("abandoned");
        let file = OutputFile::create(&target).unwrap();
        let provisional = file.provisional.clone();
        assert!(provisional.exists());
        drop(file);
        assert!(!provisional.exists() && !target.exists());
    }

    #[test]
    fn a_committed_file_stands_in_its_place() {
        let target = scratch("committed");
        OutputFile::create(&target)
            .unwrap()
            .commit(|out| out.write_all(b"done"))
            .unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"done");
        fs::remove_file(&target).unwrap();
    }

    #[test]
    fn a_path_that_cannot_be_written_is_named_before_the_run() {
        let message = OutputFile::create(Path::new("/nonexistent-directory/x.csv")).unwrap_err();
        assert!(
            message.starts_with("/nonexistent-directory/x.csv cannot be written"),
            "{message}"
        );
    }
}

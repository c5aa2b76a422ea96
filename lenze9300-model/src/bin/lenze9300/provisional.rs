//! A file that gets its name when it is whole.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Written beside its place under a name of its own, so that it is known early whether it can be written, and an old file stays until
/// the new one is there.
#[derive(Debug)]
pub(crate) struct Provisional {
    path: PathBuf,
    part: PathBuf,
    file: File,
}

impl Provisional {
    /// Opens a file for `path`.
    ///
    /// # Errors
    ///
    /// One sentence when nothing can be written there.
    pub(crate) fn create(path: &Path) -> Result<Self, String> {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        if name.is_empty() || path.is_dir() {
            return Err(format!(
                "{} cannot be written: it is a directory, a file name is needed",
                path.display()
            ));
        }
        name.push(".part");
        let part = path.with_file_name(name);
        let file = File::create(&part).map_err(|error| cannot(path, &error))?;
        Ok(Self {
            path: path.to_path_buf(),
            part,
            file,
        })
    }

    /// Writes it and puts it into its place.
    ///
    /// # Errors
    ///
    /// One sentence; an old file is as it was then.
    pub(crate) fn keep(self, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<(), String> {
        let mut out = BufWriter::new(&self.file);
        write(&mut out)
            .and_then(|()| out.flush())
            .and_then(|()| fs::rename(&self.part, &self.path))
            .map_err(|error| cannot(&self.path, &error))
    }
}

impl Drop for Provisional {
    /// What was not kept leaves nothing behind.
    fn drop(&mut self) {
        // Kept, it is not there any more.
        let _ = fs::remove_file(&self.part);
    }
}

fn cannot(path: &Path, error: &io::Error) -> String {
    format!("{} cannot be written: {error}", path.display())
}

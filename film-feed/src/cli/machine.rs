//! What the commands that reckon from a MACHINE.toml have in common: reading it, with a catalogue.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::catalogue::Catalogue;
use crate::machine_file::MachineFile;

/// The machine of a command.
#[derive(Debug, Clone, Args)]
pub(super) struct MachineArgs {
    /// The machine, as in docs/examples/machine.toml.
    #[arg(value_name = "MACHINE.toml")]
    machine: PathBuf,
    /// Further motors and drives, as in film-feed/catalogue; may be given several times.
    #[arg(long, value_name = "FILE.toml")]
    catalogue: Vec<PathBuf>,
}

impl MachineArgs {
    /// Reads the machine and the catalogue, see [`read`].
    ///
    /// # Errors
    /// As [`read`].
    pub(super) fn read(&self) -> Result<(MachineFile, Catalogue), String> {
        read(&self.machine, &self.catalogue)
    }

    /// Reads another machine with the same catalogues.
    ///
    /// # Errors
    /// As [`read`].
    pub(super) fn read_another(&self, machine: &Path) -> Result<MachineFile, String> {
        Ok(read(machine, &self.catalogue)?.0)
    }
}

/// Reads a machine, and the catalogue that it was read with; its devices
/// may stand in the built-in one or in further ones.
///
/// # Errors
/// One sentence for a file that cannot be read, or one a line for each mistake in it.
pub(super) fn read(machine: &Path, catalogues: &[PathBuf]) -> Result<(MachineFile, Catalogue), String> {
    let mut catalogue = Catalogue::built_in();
    for path in catalogues {
        catalogue.add(Catalogue::read(&text(path)?).map_err(|error| told(path, &error))?);
    }
    let file = MachineFile::read(&text(machine)?, &catalogue).map_err(|error| told(machine, &error))?;
    Ok((file, catalogue))
}

fn text(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|error| format!("{} cannot be read: {error}", path.display()))
}

fn told(path: &Path, error: &lenze9300_model::FileError) -> String {
    let mistakes: Vec<String> = error
        .mistakes
        .iter()
        .map(|mistake| format!("{}: {mistake}", path.display()))
        .collect();
    mistakes.join("\n")
}

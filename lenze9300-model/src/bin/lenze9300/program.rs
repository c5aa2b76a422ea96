//! `lenze9300 program`: a traversing program checked, and its variables brought into a drive.

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use lenze9300_model::access::{CodePlace, ParameterAccess};
use lenze9300_model::code::CodeStore;
use lenze9300_model::traverse::ProgramFile;

use crate::param::{Done, say};
use crate::way::WayArgs;

/// What `lenze9300 program` takes.
#[derive(Debug, Args)]
pub(crate) struct ProgramArgs {
    #[command(subcommand)]
    command: ProgramCommand,
}

#[derive(Debug, Subcommand)]
enum ProgramCommand {
    /// Check a program file; every mistake is told with its line.
    Check {
        /// The file.
        #[arg(value_name = "FILE")]
        file: PathBuf,
    },
    /// Check a program file and write its codes, the variables of its records among them, into a drive.
    ///
    /// The records themselves have no codes in any source; a modelled drive takes them from `lenze9300 serve --program`.
    Load {
        /// The file.
        #[arg(value_name = "FILE")]
        from: PathBuf,
        #[command(flatten)]
        way: WayArgs,
    },
}

/// Runs the subcommand.
pub(crate) fn program(args: &ProgramArgs) -> Result<Done, String> {
    match &args.command {
        ProgramCommand::Check { file } => {
            let program = read(file)?;
            say(&format!(
                "{}: {} records and {} codes, no mistakes",
                file.display(),
                program.program.records().count(),
                program.settings.len()
            ))?;
            Ok(Done::Yes)
        }
        ProgramCommand::Load { from, way } => {
            let program = read(from)?;
            let mut access = way.open()?;
            for (code, subcode, raw) in &program.settings {
                match access.write(CodePlace::new(*code, *subcode), *raw) {
                    Ok(()) => {}
                    Err(error) if error.is_refusal() => {
                        eprintln!("lenze9300: {error}");
                        return Ok(Done::No);
                    }
                    Err(error) => return Err(error.to_string()),
                }
            }
            say(&format!(
                "{} codes written; the {} records have none and go to a modelled drive by `lenze9300 serve --program {}`",
                program.settings.len(),
                program.program.records().count(),
                from.display()
            ))?;
            Ok(Done::Yes)
        }
    }
}

fn read(path: &Path) -> Result<ProgramFile, String> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    ProgramFile::read(&text, &CodeStore::thesis()).map_err(|error| format!("{}: {error}", path.display()))
}

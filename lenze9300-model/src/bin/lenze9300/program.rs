//! `lenze9300 program`: a traversing program checked, and its variables brought into a drive.

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use lenze9300_model::access::{CodePlace, ParameterAccess};
use lenze9300_model::code::CodeStore;
use lenze9300_model::traverse::ProgramFile;
use serde::Serialize;

use crate::outcome::{Done, Failed, say};
use crate::param::count;
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
        /// One JSON object instead of the sentence.
        #[arg(long)]
        json: bool,
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
        /// One JSON object instead of the sentence.
        #[arg(long)]
        json: bool,
    },
}

/// What `--json` tells.
#[derive(Debug, Serialize)]
struct Told<'a> {
    file: &'a Path,
    records: usize,
    codes: usize,
}

impl<'a> Told<'a> {
    fn new(file: &'a Path, program: &ProgramFile) -> Self {
        Self {
            file,
            records: program.program.records().count(),
            codes: program.settings.len(),
        }
    }

    fn tell(&self, json: bool, sentence: &str) -> Result<(), String> {
        if json {
            say(&serde_json::to_string(self).map_err(|error| error.to_string())?)
        } else {
            say(sentence)
        }
    }
}

/// Runs the subcommand.
pub(crate) fn program(args: &ProgramArgs) -> Result<Done, Failed> {
    match &args.command {
        ProgramCommand::Check { file, json } => {
            let told = &Told::new(file, &read(file)?);
            let (records, codes) = (told.records, count(told.codes));
            let sentence = format!("{}: {records} records and {codes}, no mistakes", file.display());
            told.tell(*json, &sentence)?;
            Ok(Done::Yes)
        }
        ProgramCommand::Load { from, way, json } => {
            let program = read(from)?;
            let mut access = way.open()?;
            for (code, subcode, raw) in &program.settings {
                match access.write(CodePlace::new(*code, *subcode), *raw) {
                    Ok(()) => {}
                    Err(error) if error.is_refusal() => {
                        eprintln!("lenze9300: {error}");
                        return Ok(Done::No);
                    }
                    Err(error) => return Err(error.into()),
                }
            }
            let told = Told::new(from, &program);
            let (records, codes) = (told.records, count(told.codes));
            let sentence = format!(
                "{codes} written; the {records} records have none and go to a modelled drive by `lenze9300 serve --program {}`",
                from.display()
            );
            told.tell(*json, &sentence)?;
            Ok(Done::Yes)
        }
    }
}

fn read(path: &Path) -> Result<ProgramFile, String> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    ProgramFile::read(&text, &CodeStore::thesis()).map_err(|error| format!("{}: {error}", path.display()))
}

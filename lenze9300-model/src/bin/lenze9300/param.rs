//! `lenze9300 param`: codes of a drive read, written, listed, saved, loaded and compared.

use std::fs;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use lenze9300_model::access::{AccessError, CodePlace, ParameterAccess};
use lenze9300_model::code::{
    CODE_TABLE, CodeStore, Inhibit, Kind, read_parameter_file, read_parameter_settings, write_parameter_file,
};
use serde::Serialize;

use crate::way::WayArgs;

/// What `lenze9300 param` takes.
#[derive(Debug, Args)]
pub(crate) struct ParamArgs {
    #[command(subcommand)]
    command: ParamCommand,
}

#[derive(Debug, Subcommand)]
enum ParamCommand {
    /// Read codes.
    Read {
        /// Codes such as C0061 or C1301/1.
        #[arg(required = true, value_name = "CODE")]
        codes: Vec<CodePlace>,
        #[command(flatten)]
        common: Common,
    },
    /// Write codes, one after the other; the first that is refused ends it.
    Write {
        /// Codes with their values in their own unit, such as C0012=20 or C1301/1=987.5.
        #[arg(required = true, value_name = "CODE=VALUE", value_parser = parse_setting)]
        settings: Vec<Setting>,
        /// Save them in parameter set 1 of the drive afterwards (C0003 := 1).
        #[arg(long)]
        store: bool,
        #[command(flatten)]
        common: Common,
    },
    /// List the codes of the drive with their values.
    List {
        /// Displays and commands too, not only what is stored.
        #[arg(long)]
        all: bool,
        #[command(flatten)]
        common: Common,
    },
    /// Save what differs from the factory setting as a parameter file.
    Save {
        /// The file.
        #[arg(value_name = "FILE")]
        into: PathBuf,
        #[command(flatten)]
        common: Common,
    },
    /// Load a parameter file into the drive.
    Load {
        /// The file.
        #[arg(value_name = "FILE")]
        from: PathBuf,
        /// Save the codes in parameter set 1 of the drive afterwards (C0003 := 1).
        #[arg(long)]
        store: bool,
        #[command(flatten)]
        common: Common,
    },
    /// Tell what of the drive differs from a parameter file, or from the factory setting; exit code 1 when something does.
    Compare {
        /// The file; the factory setting if there is none.
        #[arg(value_name = "FILE")]
        with: Option<PathBuf>,
        #[command(flatten)]
        common: Common,
    },
}

#[derive(Debug, Args)]
struct Common {
    #[command(flatten)]
    way: WayArgs,
    /// One JSON array instead of the table.
    #[arg(long)]
    json: bool,
}

/// A code and its raw value.
#[derive(Debug, Clone, Copy)]
struct Setting {
    place: CodePlace,
    raw: i32,
}

/// How a command that ran came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Done {
    Yes,
    /// It ran and failed: a code was refused, something differs.
    No,
}

/// A code as it is told.
#[derive(Debug, Serialize)]
struct Row {
    code: u16,
    subcode: u8,
    raw: Option<i32>,
    value: Option<String>,
    unit: &'static str,
    meaning: &'static str,
    error: Option<String>,
}

impl Row {
    fn new(place: CodePlace, outcome: &Result<i32, AccessError>) -> Self {
        let entry = place.entry();
        let raw = outcome.as_ref().ok().copied();
        Self {
            code: place.code,
            subcode: place.subcode,
            raw,
            value: raw.map(|raw| place.decimal(raw)),
            unit: entry.map_or("", |entry| entry.unit),
            meaning: entry.map_or("", |entry| entry.name),
            error: outcome.as_ref().err().map(|error| match error {
                AccessError::Refused { reason, .. } => reason.clone(),
                other => other.to_string(),
            }),
        }
    }

    fn line(&self) -> String {
        let place = CodePlace::new(self.code, self.subcode);
        match (&self.value, &self.error) {
            (Some(value), _) => format!("{place:<10} {value:>14} {:<10} {}", self.unit, self.meaning),
            (None, error) => format!("{place:<10} {}", error.as_deref().unwrap_or("–")),
        }
    }
}

/// Runs the subcommand.
pub(crate) fn param(args: &ParamArgs) -> Result<Done, String> {
    match &args.command {
        ParamCommand::Read { codes, common } => read(&mut common.way.open()?, codes, common.json),
        ParamCommand::Write {
            settings,
            store,
            common,
        } => {
            let access = &mut common.way.open()?;
            write(access, settings, *store, common.json)
        }
        ParamCommand::List { all, common } => list(&mut common.way.open()?, *all, common.json),
        ParamCommand::Save { into, common } => save(&mut common.way.open()?, into),
        ParamCommand::Load { from, store, common } => {
            // The file first: a mistake in it is found before anything is written.
            let settings = settings_of(from)?;
            let access = &mut common.way.open()?;
            write(access, &settings, *store, common.json)
        }
        ParamCommand::Compare { with, common } => {
            let expected = store_of(with.as_deref())?;
            compare(&mut common.way.open()?, &expected, common.json)
        }
    }
}

fn read(access: &mut impl ParameterAccess, codes: &[CodePlace], json: bool) -> Result<Done, String> {
    let rows = rows(access, codes)?;
    let done = if rows.iter().all(|row| row.error.is_none()) {
        Done::Yes
    } else {
        Done::No
    };
    print(&rows, json)?;
    Ok(done)
}

/// Reads codes; a refusal becomes part of the row.
fn rows(access: &mut impl ParameterAccess, codes: &[CodePlace]) -> Result<Vec<Row>, String> {
    let bar = progress(codes.len());
    let mut rows = Vec::with_capacity(codes.len());
    for place in codes {
        let outcome = access.read(*place);
        if let Err(error) = &outcome
            && !error.is_refusal()
        {
            bar.finish_and_clear();
            return Err(error.to_string());
        }
        rows.push(Row::new(*place, &outcome));
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(rows)
}

fn write(access: &mut impl ParameterAccess, settings: &[Setting], store: bool, json: bool) -> Result<Done, String> {
    let bar = progress(settings.len());
    let mut rows = Vec::new();
    let mut done = Done::Yes;
    for Setting { place, raw } in settings {
        let outcome = access.write(*place, *raw).map(|()| *raw);
        match &outcome {
            Err(error) if !error.is_refusal() => {
                bar.finish_and_clear();
                return Err(error.to_string());
            }
            Err(_) => done = Done::No,
            Ok(_) => {}
        }
        rows.push(Row::new(*place, &outcome));
        bar.inc(1);
        if done == Done::No {
            break;
        }
    }
    bar.finish_and_clear();
    if done == Done::Yes && store {
        let place = CodePlace::new(3, 0);
        access.write(place, 1_0000).map_err(|error| error.to_string())?;
    }
    print(&rows, json)?;
    if done == Done::No {
        let left = settings.len() - rows.len();
        eprintln!(
            "lenze9300: {} of {} codes written, {left} not tried",
            rows.len() - 1,
            settings.len()
        );
    }
    Ok(done)
}

fn list(access: &mut impl ParameterAccess, all: bool, json: bool) -> Result<Done, String> {
    let places: Vec<_> = places(|kind| all || kind == Kind::Stored).collect();
    let rows = rows(access, &places)?;
    print(&rows, json)?;
    Ok(Done::Yes)
}

fn save(access: &mut impl ParameterAccess, into: &Path) -> Result<Done, String> {
    let codes = read_store(access)?;
    let factory = CodeStore::factory();
    let text = write_parameter_file(&codes, &factory);
    fs::write(into, text).map_err(|error| format!("{} cannot be written: {error}", into.display()))?;
    say(&format!(
        "{} codes that differ from the factory setting in {}",
        codes.differences(&factory).count(),
        into.display()
    ))?;
    Ok(Done::Yes)
}

#[derive(Debug, Serialize)]
struct DifferenceRow {
    code: u16,
    subcode: u8,
    drive: String,
    expected: String,
    unit: &'static str,
    meaning: &'static str,
}

fn compare(access: &mut impl ParameterAccess, expected: &CodeStore, json: bool) -> Result<Done, String> {
    let codes = read_store(access)?;
    let rows: Vec<_> = codes
        .differences(expected)
        .map(|difference| {
            let place = CodePlace::new(difference.code, difference.subcode);
            DifferenceRow {
                code: difference.code,
                subcode: difference.subcode,
                drive: place.decimal(difference.here),
                expected: place.decimal(difference.there),
                unit: place.entry().map_or("", |entry| entry.unit),
                meaning: place.entry().map_or("", |entry| entry.name),
            }
        })
        .collect();
    if json {
        print_json(&rows)?;
    } else {
        let mut text = String::new();
        for row in &rows {
            let place = CodePlace::new(row.code, row.subcode);
            text.push_str(&format!(
                "{place:<10} drive {:>14} expected {:>14} {:<10} {}\n",
                row.drive, row.expected, row.unit, row.meaning
            ));
        }
        text.push_str(&format!("{} codes differ", rows.len()));
        say(&text)?;
    }
    Ok(if rows.is_empty() { Done::Yes } else { Done::No })
}

/// The stored codes of a drive as a store, so that files and differences come out as everywhere else.
fn read_store(access: &mut impl ParameterAccess) -> Result<CodeStore, String> {
    let places: Vec<_> = places(|kind| kind == Kind::Stored).collect();
    let mut store = CodeStore::factory();
    let rows = rows(access, &places)?;
    // The motor list first, for it resets other codes.
    let motor_first = |row: &&Row| u8::from(row.code != 86);
    let mut rows: Vec<_> = rows.iter().collect();
    rows.sort_by_key(motor_first);
    for row in rows {
        let Some(raw) = row.raw else { continue };
        if store.read(row.code, row.subcode) == Ok(raw) {
            continue;
        }
        // What the drive forms itself cannot be written and need not be.
        let _ = store.write(row.code, row.subcode, raw, Inhibit::Active);
    }
    Ok(store)
}

fn places(wanted: impl Fn(Kind) -> bool) -> impl Iterator<Item = CodePlace> {
    CODE_TABLE
        .iter()
        .filter(move |entry| wanted(entry.kind))
        .flat_map(|entry| {
            (entry.first_subcode..=entry.last_subcode).map(|subcode| CodePlace::new(entry.number, subcode))
        })
}

fn settings_of(path: &Path) -> Result<Vec<Setting>, String> {
    let settings = read_parameter_settings(&text_of(path)?).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(settings
        .into_iter()
        .map(|(code, subcode, raw)| Setting {
            place: CodePlace::new(code, subcode),
            raw,
        })
        .collect())
}

fn store_of(path: Option<&Path>) -> Result<CodeStore, String> {
    let mut codes = CodeStore::factory();
    if let Some(path) = path {
        read_parameter_file(&text_of(path)?, &mut codes).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(codes)
}

fn text_of(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}

fn parse_setting(text: &str) -> Result<Setting, String> {
    let (code, value) = text
        .split_once('=')
        .ok_or_else(|| format!("`{text}` is no setting; one is written as C0012=20"))?;
    let place: CodePlace = code.trim().parse().map_err(|error| format!("{error}"))?;
    let raw = place.parse_value(value).map_err(|error| error.to_string())?;
    Ok(Setting { place, raw })
}

fn print(rows: &[Row], json: bool) -> Result<(), String> {
    if json {
        return print_json(rows);
    }
    let lines: Vec<_> = rows.iter().map(Row::line).collect();
    say(&lines.join("\n"))
}

fn print_json<T: Serialize + ?Sized>(rows: &T) -> Result<(), String> {
    let text = serde_json::to_string(rows).map_err(|error| error.to_string())?;
    say(&text)
}

/// Lines on standard output. Whoever closed the pipe has read enough.
pub(crate) fn say(text: &str) -> Result<(), String> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(format!("standard output: {error}")),
        _ => Ok(()),
    }
}

/// A bar on a terminal for what lasts.
fn progress(codes: usize) -> ProgressBar {
    if codes < 20 || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(codes as u64);
    bar.set_style(
        ProgressStyle::with_template("{bar:40} {pos}/{len} codes, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar
}

//! `lenze9300 param`: codes of a drive read, written, listed, saved, loaded and compared.

use std::fs;
use std::io::{self, IsTerminal, Write as _};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use lenze9300_model::access::{AccessError, CodePlace, ParameterAccess};
use lenze9300_model::code::{
    CODE_TABLE, CodeEntry, CodeStore, Domain, Inhibit, Kind, read_parameter_file, read_parameter_settings,
    write_parameter_file,
};
use serde::Serialize;

use crate::outcome::{Done, Failed, say};
use crate::provisional::Provisional;
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
    /// JSON instead of the table: an array of codes, or one object.
    #[arg(long)]
    json: bool,
}

/// Codes that could not be read and are told one by one; of the others there is the number.
const UNREAD_TOLD: usize = 10;

/// A code and its raw value.
#[derive(Debug, Clone, Copy)]
struct Setting {
    place: CodePlace,
    raw: i32,
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

    /// A line of the table; a refusal is none, it is told on standard error.
    fn line(&self) -> Option<String> {
        let place = CodePlace::new(self.code, self.subcode);
        let value = self.value.as_ref()?;
        Some(format!("{place:<10} {value:>14} {:<10} {}", self.unit, self.meaning))
    }
}

/// Runs the subcommand.
pub(crate) fn param(args: &ParamArgs) -> Result<Done, Failed> {
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
        ParamCommand::Save { into, common } => {
            // The file first: nobody waits for hundreds of codes to learn that they cannot be kept.
            let file = Provisional::create(into)?;
            save(&mut common.way.open()?, into, file, common.json)
        }
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

fn read(access: &mut impl ParameterAccess, codes: &[CodePlace], json: bool) -> Result<Done, Failed> {
    let rows = rows(access, codes)?;
    print(&rows, json)?;
    Ok(tell_unread(&rows))
}

/// Reads codes; a refusal becomes part of the row.
fn rows(access: &mut impl ParameterAccess, codes: &[CodePlace]) -> Result<Vec<Row>, Failed> {
    let bar = progress(codes.len());
    let mut rows = Vec::with_capacity(codes.len());
    for place in codes {
        let outcome = access.read(*place);
        if let Err(error) = &outcome
            && !error.is_refusal()
        {
            bar.finish_and_clear();
            return Err(error.clone().into());
        }
        rows.push(Row::new(*place, &outcome));
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(rows)
}

fn write(access: &mut impl ParameterAccess, settings: &[Setting], store: bool, json: bool) -> Result<Done, Failed> {
    let bar = progress(settings.len());
    let mut rows = Vec::new();
    let mut done = Done::Yes;
    for Setting { place, raw } in settings {
        let outcome = access.write(*place, *raw).map(|()| *raw);
        match &outcome {
            Err(error) if !error.is_refusal() => {
                bar.finish_and_clear();
                return Err(error.clone().into());
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
        access.write(place, 1_0000)?;
    }
    print(&rows, json)?;
    if done == Done::No {
        let left = settings.len() - rows.len();
        if let Some((Setting { place, raw }, row)) = settings.iter().zip(&rows).next_back() {
            let allowed = place
                .entry()
                .filter(|entry| entry.kind != Kind::Display)
                .map_or(String::new(), |entry| format!("; allowed is {}", allowed(entry)));
            eprintln!(
                "lenze9300: {place} does not take {}: {}{allowed}",
                place.show(*raw),
                row.error.as_deref().unwrap_or_default()
            );
        }
        eprintln!(
            "lenze9300: {} of {} codes written, {left} not tried",
            rows.len() - 1,
            settings.len()
        );
    }
    Ok(done)
}

fn list(access: &mut impl ParameterAccess, all: bool, json: bool) -> Result<Done, Failed> {
    let places: Vec<_> = places(|kind| all || kind == Kind::Stored).collect();
    let rows = rows(access, &places)?;
    print(&rows, json)?;
    Ok(tell_unread(&rows))
}

fn save(access: &mut impl ParameterAccess, into: &Path, file: Provisional, json: bool) -> Result<Done, Failed> {
    let drive = DriveCodes::read(access)?;
    let factory = CodeStore::factory();
    let text = write_parameter_file(&drive.store, &factory);
    file.keep(|out| out.write_all(text.as_bytes()))?;
    let saved = Saved {
        file: into,
        codes: drive.store.differences(&factory).count(),
    };
    if json {
        print_json(&saved)?;
    } else {
        say(&format!(
            "{} that differ from the factory setting in {}",
            count(saved.codes),
            into.display()
        ))?;
    }
    Ok(drive.done())
}

/// What was written into a parameter file.
#[derive(Debug, Serialize)]
struct Saved<'a> {
    file: &'a Path,
    codes: usize,
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

fn compare(access: &mut impl ParameterAccess, expected: &CodeStore, json: bool) -> Result<Done, Failed> {
    let drive = DriveCodes::read(access)?;
    let rows = differences(&drive, expected);
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
        let verb = if rows.len() == 1 { "differs" } else { "differ" };
        text.push_str(&format!("{} {verb}", count(rows.len())));
        say(&text)?;
    }
    Ok(if rows.is_empty() { drive.done() } else { Done::No })
}

/// Of what is not known nobody can say that it differs; it has been told.
fn differences(drive: &DriveCodes, expected: &CodeStore) -> Vec<DifferenceRow> {
    let places = drive.store.differences(expected);
    let places = places.map(|difference| (CodePlace::new(difference.code, difference.subcode), difference));
    places
        .filter(|(place, _)| drive.is_known(*place))
        .map(|(place, difference)| DifferenceRow {
            code: difference.code,
            subcode: difference.subcode,
            drive: place.decimal(difference.here),
            expected: place.decimal(difference.there),
            unit: place.entry().map_or("", |entry| entry.unit),
            meaning: place.entry().map_or("", |entry| entry.name),
        })
        .collect()
}

/// The stored codes of a drive as a store, so that files and differences come out as everywhere else.
struct DriveCodes {
    /// What is not known keeps its factory value in it.
    store: CodeStore,
    /// Codes that could not be read, and those whose value is none that the code table knows.
    unknown: Vec<CodePlace>,
}

impl DriveCodes {
    /// Reads them; what cannot be known is told.
    fn read(access: &mut impl ParameterAccess) -> Result<Self, Failed> {
        let places: Vec<_> = places(|kind| kind == Kind::Stored).collect();
        let rows = rows(access, &places)?;
        tell_unread(&rows);
        let mut store = CodeStore::factory();
        let mut unknown = Vec::new();
        // The motor list first, for it resets other codes.
        let motor_first = |row: &&Row| u8::from(row.code != 86);
        let mut rows: Vec<_> = rows.iter().collect();
        rows.sort_by_key(motor_first);
        for row in rows {
            let place = CodePlace::new(row.code, row.subcode);
            let Some(raw) = row.raw else {
                unknown.push(place);
                continue;
            };
            if store.read(row.code, row.subcode) == Ok(raw) {
                continue;
            }
            if let Err(error) = store.write(row.code, row.subcode, raw, Inhibit::Active) {
                eprintln!(
                    "lenze9300: {place} of the drive is {}, which is left out: {error}",
                    place.show(raw)
                );
                unknown.push(place);
            }
        }
        Ok(Self { store, unknown })
    }

    fn is_known(&self, place: CodePlace) -> bool {
        !self.unknown.contains(&place)
    }

    fn done(&self) -> Done {
        if self.unknown.is_empty() { Done::Yes } else { Done::No }
    }
}

/// Tells which codes could not be read, with the drive's reason.
fn tell_unread(rows: &[Row]) -> Done {
    let unread = || rows.iter().filter(|row| row.error.is_some());
    if unread().next().is_none() {
        return Done::Yes;
    }
    for row in unread().take(UNREAD_TOLD) {
        let place = CodePlace::new(row.code, row.subcode);
        eprintln!(
            "lenze9300: {place} could not be read: {}",
            row.error.as_deref().unwrap_or_default()
        );
    }
    let total = unread().count();
    if total > UNREAD_TOLD {
        eprintln!("lenze9300: and {} more could not be read", total - UNREAD_TOLD);
    }
    Done::No
}

/// `1 code`, `2 codes`.
pub(crate) fn count(codes: usize) -> String {
    match codes {
        1 => "1 code".to_owned(),
        _ => format!("{codes} codes"),
    }
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
    let lines: Vec<_> = rows.iter().filter_map(Row::line).collect();
    if lines.is_empty() {
        return Ok(());
    }
    say(&lines.join("\n"))
}

/// What a code takes, in its own unit: `0.000…999.900 s`, `0 or 108`.
fn allowed(entry: &CodeEntry) -> String {
    match entry.domain {
        Domain::Range { min, max, .. } => format!("{}…{}", entry.decimal(min), entry.show(max)),
        Domain::Selection(values) => {
            let shown: Vec<_> = values.iter().map(|value| entry.decimal(*value)).collect();
            shown.join(" or ")
        }
    }
}

fn print_json<T: Serialize + ?Sized>(rows: &T) -> Result<(), String> {
    let text = serde_json::to_string(rows).map_err(|error| error.to_string())?;
    say(&text)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A drive that does not give one of its codes away.
    struct Reserved(CodeStore);

    const KEPT_BACK: CodePlace = CodePlace::new(11, 0);

    impl ParameterAccess for Reserved {
        fn read(&mut self, place: CodePlace) -> Result<i32, AccessError> {
            if place == KEPT_BACK {
                let reason = "not for you".to_owned();
                return Err(AccessError::Refused { place, reason });
            }
            Ok(self.0.read(place.code, place.subcode).expect("a code of the table"))
        }

        fn write(&mut self, _: CodePlace, _: i32) -> Result<(), AccessError> {
            unreachable!("nothing is written here")
        }
    }

    #[test]
    fn a_drive_that_is_not_read_completely_is_not_equal_and_not_saved_completely() {
        let mut drive = Reserved(CodeStore::factory());
        let codes = DriveCodes::read(&mut drive).expect("a refusal is no broken way");
        assert_eq!((codes.done(), codes.unknown.as_slice()), (Done::No, &[KEPT_BACK][..]));
        let done = compare(&mut drive, &CodeStore::factory(), true).expect("as above");
        assert_eq!(done, Done::No);
    }

    #[test]
    fn of_a_code_that_is_not_known_nobody_says_that_it_differs() {
        let codes = DriveCodes::read(&mut Reserved(CodeStore::factory())).expect("a refusal is no broken way");
        let mut expected = CodeStore::factory();
        for (code, raw) in [(KEPT_BACK.code, 4000_0000), (12, 20_0000)] {
            expected.write(code, 0, raw, Inhibit::Active).expect("within its range");
        }
        let told: Vec<_> = differences(&codes, &expected).iter().map(|row| row.code).collect();
        assert_eq!(told, [12]);
    }

    /// A drive whose acceleration time lies outside the table's range, 0 to 999.9 s (9300 fact sheet, section 4.4).
    struct Newer;

    const NEWER: CodePlace = CodePlace::new(12, 0);

    impl ParameterAccess for Newer {
        fn read(&mut self, place: CodePlace) -> Result<i32, AccessError> {
            if place == NEWER {
                return Ok(1000_0000);
            }
            Ok(CodeStore::factory()
                .read(place.code, place.subcode)
                .expect("a code of the table"))
        }

        fn write(&mut self, _: CodePlace, _: i32) -> Result<(), AccessError> {
            unreachable!("nothing is written here")
        }
    }

    #[test]
    fn a_value_that_the_table_does_not_know_is_not_lost_in_silence() {
        let codes = DriveCodes::read(&mut Newer).expect("all codes are read");
        assert_eq!((codes.done(), codes.unknown.as_slice()), (Done::No, &[NEWER][..]));
    }
}

//! A traversing program as a TOML file.
//!
//! ```toml
//! [[record]]
//! number = 1
//! mode = "set reference"
//! target = "zero"
//! branch_1 = { input = 1, level = "high", to = 3 }
//! jump = 2
//!
//! [[record]]
//! number = 2
//! mode = "relative"
//! target = "VTPOS 1"
//! velocity = "VTVEL 1"
//!
//! [[record]]
//! number = 3
//! mode = "relative"
//! touch_probe = { window = "travel range", residual = 50.0 }
//! target = "VTPOS 61"
//!
//! [[computed]]
//! variable = 61
//! base = 1
//! offset = 100.0
//!
//! [codes]
//! "C1301/1" = 1200.0
//! ```
//!
//! | key of a record | field | values | without it |
//! |---|---|---|---|
//! | `number` | | 1…32 | a mistake |
//! | `wait` | 1 | `{ input = 1…32, level = "low" or "high" }` | inactive |
//! | `switch_before` | 2 | `{ output = 1…16, level = … }` | inactive |
//! | `mode` | 3 | "absolute", "relative", "set reference", "homing" | a mistake |
//! | `target` | 4 | "zero", "VTPOS n" | zero |
//! | `velocity` | 5 | "v-max", "VTVEL n" | v-max |
//! | `acceleration`, `deceleration` | 6, 7 | "a-max", "VTACC n" | a-max |
//! | `final_velocity` | 8 | "standstill", "VTVEL n" | standstill |
//! | `touch_probe` | 9, 10 | `{ window = "travel range" or ["VTPOS n", "VTPOS m"], residual = "none", "VTPOS n" or a length }` | none |
//! | `homing` | 3 | `{ direction = "positive" or "negative", switch = 1…32, zero_pulse = true or false }`, with mode "homing" only | none |
//! | `without_touch` | 11 | a record number, "end" | end |
//! | `switch_after` | 12 | as `switch_before` | inactive |
//! | `dwell` | 13 | "VTTIME n" | inactive |
//! | `branch_1`, `branch_2` | 14, 15 | `{ input = …, level = …, to = … }` | inactive |
//! | `pieces` | 16 | `{ count = "VTPCS n", to = … }` | inactive |
//! | `jump` | 17 | a record number, "end" | end |
//!
//! Source of the fields and their order: 9300 facts 4.1.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::homing::{Direction, HomingReference, HomingRule};
use super::record::{
    Acceleration, Branch, FinalVelocity, InputLevel, Level, Mode, OutputLevel, Pieces, Program, ProgramInput, Record,
    RecordNumber, ResidualPath, Successor, Target, TouchRule, TouchWindow, Velocity,
};
use crate::code::table::{POSITION_COUNT, VARIABLE_COUNT};
use crate::code::{CodeStore, FIRST_WIRED, WiredPosition, read_code_table};
use crate::toml_file::{Fields, FileError, Reader};

/// What a program file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramFile {
    /// The records.
    pub program: Program,
    /// The variables that function blocks form.
    pub computed: Vec<WiredPosition>,
    /// The codes as the file leaves them: those given to the reader, with the file's own on top.
    pub codes: CodeStore,
    /// The file's own codes in the order in which a drive must be given them: code, subcode, raw. A drive may hold anything, so that
    /// those belong to it that `codes` had before, too.
    pub settings: Vec<(u16, u8, i32)>,
}

impl ProgramFile {
    /// Reads a program file for a drive whose codes are `codes`.
    ///
    /// # Errors
    ///
    /// [`FileError`] with every mistake of the file: syntax, unknown keys, values, jumps that lead nowhere.
    ///
    /// # Example
    ///
    /// ```
    /// use lenze9300_model::code::CodeStore;
    /// use lenze9300_model::traverse::ProgramFile;
    ///
    /// let text = r#"
    /// [[record]]
    /// number = 1
    /// mode = "relative"
    /// target = "VTPOS 1"
    /// "#;
    /// let file = ProgramFile::read(text, &CodeStore::thesis())?;
    /// let wrong = ProgramFile::read(&text.replace("VTPOS 1", "VTPOS 111"), &CodeStore::thesis()).unwrap_err();
    /// assert_eq!(wrong.to_string(), "line 5: target: expected VTPOS 1 to 110, got VTPOS 111");
    /// # Ok::<(), lenze9300_model::FileError>(())
    /// ```
    pub fn read(text: &str, codes: &CodeStore) -> Result<Self, FileError> {
        Reader::read(text, |reader, file| {
            let mut fields = Fields::of(file);
            let records = records(reader, fields.take("record"));
            let computed = computed(reader, fields.take("computed"));
            let mut codes = codes.clone();
            codes.set_wired_positions(computed.iter().copied());
            let table = fields.take("codes").and_then(|value| reader.table(value, "codes"));
            let settings = table.map_or_else(Vec::new, |table| read_code_table(reader, table, &mut codes));
            fields.finish(reader);
            Some(Self {
                program: program(reader, records)?,
                computed,
                codes,
                settings,
            })
        })
    }
}

/// A record with the place of its number and of everything that leads elsewhere.
struct Read {
    number: u8,
    record: Record,
    at: std::ops::Range<usize>,
}

fn records<'a>(reader: &mut Reader<'a>, value: Option<&Spanned<DeValue<'a>>>) -> Vec<Read> {
    let Some(value) = value else {
        reader.mistake(0..0, "there is no [[record]]; a program has at least one");
        return Vec::new();
    };
    let mut records: Vec<Read> = Vec::new();
    for value in reader.tables(value, "record") {
        if let Some(read) = record(reader, value) {
            if records.iter().any(|other| other.number == read.number) {
                reader.mistake(read.at.clone(), format!("record {} is given twice", read.number));
            }
            records.push(read);
        }
    }
    records
}

fn record<'a>(reader: &mut Reader<'a>, (value, table): (&Spanned<DeValue<'a>>, &DeTable<'a>)) -> Option<Read> {
    let mut fields = Fields::of(table);
    let number = match fields.take("number") {
        Some(number) => reader.number(number, "number", 1..=RecordNumber::MAX),
        None => {
            reader.mistake(value.span(), "the record has no `number`; expected 1 to 32");
            None
        }
    };
    let at = fields_span(table, "number").unwrap_or(value.span());
    let touch = fields.take("touch_probe").and_then(|value| touch_rule(reader, value));
    let homing = fields.take("homing").and_then(|value| homing_rule(reader, value));
    let mode = match fields.take("mode") {
        Some(value) => mode(reader, value, touch, homing),
        None => {
            reader.mistake(
                value.span(),
                "the record has no `mode`; expected absolute, relative, set reference or homing",
            );
            None
        }
    };
    let mut record = Record::new(Mode::Relative, Target::Zero);
    record.wait = fields.take("wait").and_then(|value| input_level(reader, value, "wait"));
    record.switch_before = fields
        .take("switch_before")
        .and_then(|value| output_level(reader, value, "switch_before"));
    if let Some(mode) = mode {
        record.mode = mode;
    }
    if let Some(value) = fields.take("target") {
        let number = word_or_variable(reader, value, "target", "zero", POSITIONS);
        record.target = number.map_or(record.target, |number| number.map_or(Target::Zero, Target::Variable));
    }
    if let Some(value) = fields.take("velocity") {
        let number = word_or_variable(reader, value, "velocity", "v-max", VELOCITIES);
        record.velocity = number.map_or(record.velocity, |number| {
            number.map_or(Velocity::Max, Velocity::Variable)
        });
    }
    for (key, rate) in [
        ("acceleration", &mut record.acceleration),
        ("deceleration", &mut record.deceleration),
    ] {
        if let Some(value) = fields.take(key) {
            let number = word_or_variable(reader, value, key, "a-max", ACCELERATIONS);
            *rate = number.map_or(*rate, |number| number.map_or(Acceleration::Max, Acceleration::Variable));
        }
    }
    let mut dwells_at = None;
    if let Some(value) = fields.take("final_velocity") {
        let number = word_or_variable(reader, value, "final_velocity", "standstill", VELOCITIES);
        record.final_velocity = number.map_or(record.final_velocity, |number| {
            number.map_or(FinalVelocity::Standstill, FinalVelocity::Variable)
        });
    }
    if let Some(value) = fields.take("without_touch") {
        record.without_touch = successor(reader, value, "without_touch").unwrap_or(Successor::End);
    }
    record.switch_after = fields
        .take("switch_after")
        .and_then(|value| output_level(reader, value, "switch_after"));
    if let Some(value) = fields.take("dwell") {
        record.dwell = variable(reader, value, "dwell", TIMES);
        dwells_at = Some(value.span());
    }
    record.branch_1 = fields
        .take("branch_1")
        .and_then(|value| branch(reader, value, "branch_1"));
    record.branch_2 = fields
        .take("branch_2")
        .and_then(|value| branch(reader, value, "branch_2"));
    record.pieces = fields.take("pieces").and_then(|value| pieces(reader, value));
    if let Some(value) = fields.take("jump") {
        record.jump = successor(reader, value, "jump").unwrap_or(Successor::End);
    }
    fields.finish(reader);
    if matches!(record.mode, Mode::Homing(_)) && record.final_velocity != FinalVelocity::Standstill {
        reader.mistake(
            at.clone(),
            "the record homes and must end at standstill, without `final_velocity`",
        );
    }
    if let Some(at) = dwells_at
        && record.final_velocity != FinalVelocity::Standstill
    {
        reader.mistake(
            at,
            "dwell: a record that dwells must end at standstill, without `final_velocity`",
        );
    }
    Some(Read {
        number: number?,
        record,
        at,
    })
}

/// Where a key stands.
fn fields_span(table: &DeTable<'_>, key: &str) -> Option<std::ops::Range<usize>> {
    table
        .iter()
        .find(|(name, _)| name.get_ref() == key)
        .map(|(name, _)| name.span())
}

/// Builds the program and tells the jumps that lead nowhere.
fn program(reader: &mut Reader<'_>, records: Vec<Read>) -> Option<Program> {
    let programmed: Vec<u8> = records.iter().map(|read| read.number).collect();
    let mut lost = false;
    for Read { number, record, at } in &records {
        for to in record.successors() {
            if let Successor::Record(to) = to
                && !programmed.contains(&to.get())
            {
                let what = format!(
                    "record {number} goes on at record {}, which is not programmed",
                    to.get()
                );
                reader.mistake(at.clone(), what);
                lost = true;
            }
        }
    }
    if lost {
        return None;
    }
    let program = Program::new(records.into_iter().map(|read| (read.number, read.record)));
    // Whatever the program refuses was told above, with its line.
    program.map_err(|error| reader.mistake(0..0, error.to_string())).ok()
}

fn mode<'a>(
    reader: &mut Reader<'a>,
    value: &Spanned<DeValue<'a>>,
    touch: Option<TouchRule>,
    homing: Option<HomingRule>,
) -> Option<Mode> {
    let what = match (reader.text(value, "mode")?, touch, homing) {
        ("relative", None, None) => return Some(Mode::Relative),
        ("relative", Some(rule), None) => return Some(Mode::RelativeWithTouchProbe(rule)),
        ("absolute", None, None) => return Some(Mode::Absolute),
        ("absolute", Some(rule), None) => return Some(Mode::AbsoluteWithTouchProbe(rule)),
        ("set reference", None, None) => return Some(Mode::SetReference),
        ("homing", None, Some(rule)) => return Some(Mode::Homing(rule)),
        ("homing", _, None) => {
            "mode: homing needs `homing`, such as { direction = \"negative\", switch = 2 }".to_owned()
        }
        ("homing", Some(_), _) => "mode: homing has no touch probe".to_owned(),
        ("set reference", Some(_), _) => {
            "mode: a record that sets the reference does not move and has no touch probe".to_owned()
        }
        ("relative" | "absolute" | "set reference", _, Some(_)) => {
            "mode: `homing` belongs to a record of mode homing".to_owned()
        }
        (other, ..) => format!("mode: expected absolute, relative, set reference or homing, got {other}"),
    };
    reader.mistake(value.span(), what);
    None
}

fn homing_rule<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>) -> Option<HomingRule> {
    let mut fields = Fields::of(reader.table(value, "homing")?);
    let direction = match fields.take("direction") {
        None => missing(reader, value, "homing", "direction"),
        Some(value) => match reader.text(value, "direction")? {
            "positive" => Some(Direction::Positive),
            "negative" => Some(Direction::Negative),
            other => {
                reader.mistake(
                    value.span(),
                    format!("direction: expected positive or negative, got {other}"),
                );
                None
            }
        },
    };
    let switch = fields.take("switch").map(|value| {
        reader
            .number(value, "switch", 1..=ProgramInput::MAX)
            .and_then(ProgramInput::new)
    });
    let zero_pulse = match fields.take("zero_pulse") {
        None => Some(false),
        Some(value) => {
            let used = value.get_ref().as_bool();
            if used.is_none() {
                reader.wrong_type(value, "zero_pulse", "true or false");
            }
            used
        }
    };
    fields.finish(reader);
    let reference = match (switch, zero_pulse?) {
        (None, true) => HomingReference::ZeroPulse,
        (Some(switch), true) => HomingReference::SwitchAndZeroPulse(switch?),
        (Some(switch), false) => HomingReference::Switch(switch?),
        (None, false) => {
            reader.mistake(
                value.span(),
                "homing: expected a `switch`, `zero_pulse = true`, or both",
            );
            return None;
        }
    };
    Some(HomingRule {
        direction: direction?,
        reference,
    })
}

fn touch_rule<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>) -> Option<TouchRule> {
    let mut fields = Fields::of(reader.table(value, "touch_probe")?);
    let window = match fields.take("window") {
        None => Some(TouchWindow::TravelRange),
        Some(value) => window(reader, value),
    };
    let residual = match fields.take("residual") {
        None => Some(ResidualPath::None),
        Some(value) if value.get_ref().is_str() => word_or_variable(reader, value, "residual", "none", POSITIONS)
            .map(|number| number.map_or(ResidualPath::None, ResidualPath::Variable)),
        Some(value) => length(reader, value, "residual").map(ResidualPath::Fixed),
    };
    fields.finish(reader);
    Some(TouchRule {
        window: window?,
        residual: residual?,
    })
}

fn window<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>) -> Option<TouchWindow> {
    if value.get_ref().as_str() == Some("travel range") {
        return Some(TouchWindow::TravelRange);
    }
    if let Some([first, second]) = value.get_ref().as_array().map(|ends| ends.as_ref()) {
        return Some(TouchWindow::Between {
            first: variable(reader, first, "window", POSITIONS)?,
            second: variable(reader, second, "window", POSITIONS)?,
        });
    }
    reader.mistake(
        value.span(),
        "window: expected \"travel range\" or two positions such as [\"VTPOS 3\", \"VTPOS 4\"]",
    );
    None
}

fn input_level<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>, what: &str) -> Option<InputLevel> {
    let mut fields = Fields::of(reader.table(value, what)?);
    let condition = condition(reader, &mut fields, value, what);
    fields.finish(reader);
    condition
}

fn condition<'a>(
    reader: &mut Reader<'a>,
    fields: &mut Fields<'_, 'a>,
    value: &Spanned<DeValue<'a>>,
    what: &str,
) -> Option<InputLevel> {
    let number = match fields.take("input") {
        Some(value) => reader.number(value, "input", 1..=ProgramInput::MAX),
        None => missing(reader, value, what, "input"),
    };
    let level = level(reader, fields, value, what);
    Some(InputLevel {
        input: ProgramInput::new(number?)?,
        level: level?,
    })
}

fn output_level<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>, what: &str) -> Option<OutputLevel> {
    let mut fields = Fields::of(reader.table(value, what)?);
    let output = match fields.take("output") {
        Some(value) => reader.number(value, "output", 1..=OUTPUTS),
        None => missing(reader, value, what, "output"),
    };
    let level = level(reader, &mut fields, value, what);
    fields.finish(reader);
    Some(OutputLevel {
        output: output?,
        level: level?,
    })
}

fn level<'a>(
    reader: &mut Reader<'a>,
    fields: &mut Fields<'_, 'a>,
    value: &Spanned<DeValue<'a>>,
    what: &str,
) -> Option<Level> {
    let Some(level) = fields.take("level") else {
        return missing(reader, value, what, "level");
    };
    match reader.text(level, "level")? {
        "low" => Some(Level::Low),
        "high" => Some(Level::High),
        other => {
            reader.mistake(level.span(), format!("level: expected low or high, got {other}"));
            None
        }
    }
}

fn branch<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>, what: &str) -> Option<Branch> {
    let mut fields = Fields::of(reader.table(value, what)?);
    let when = condition(reader, &mut fields, value, what);
    let to = to(reader, &mut fields, value, what);
    fields.finish(reader);
    Some(Branch { when: when?, to: to? })
}

fn pieces<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>) -> Option<Pieces> {
    let mut fields = Fields::of(reader.table(value, "pieces")?);
    let count = match fields.take("count") {
        Some(value) => variable(reader, value, "count", PIECES),
        None => missing(reader, value, "pieces", "count"),
    };
    let to = to(reader, &mut fields, value, "pieces");
    fields.finish(reader);
    Some(Pieces { count: count?, to: to? })
}

fn to<'a>(
    reader: &mut Reader<'a>,
    fields: &mut Fields<'_, 'a>,
    value: &Spanned<DeValue<'a>>,
    what: &str,
) -> Option<Successor> {
    match fields.take("to") {
        Some(value) => successor(reader, value, "to"),
        None => missing(reader, value, what, "to"),
    }
}

fn successor<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>, what: &str) -> Option<Successor> {
    if value.get_ref().as_str() == Some("end") {
        return Some(Successor::End);
    }
    if value.get_ref().is_integer() {
        let number = reader.number(value, what, 1..=RecordNumber::MAX)?;
        return RecordNumber::new(number).map(Successor::Record);
    }
    reader.mistake(value.span(), format!("{what}: expected a record number or \"end\""));
    None
}

fn computed<'a>(reader: &mut Reader<'a>, value: Option<&Spanned<DeValue<'a>>>) -> Vec<WiredPosition> {
    let Some(value) = value else {
        return Vec::new();
    };
    let mut computed: Vec<WiredPosition> = Vec::new();
    for (value, table) in reader.tables(value, "computed") {
        let mut fields = Fields::of(table);
        let number = match fields.take("variable") {
            Some(value) => reader.number(value, "variable", FIRST_WIRED..=POSITION_COUNT),
            None => missing(reader, value, "computed", "variable"),
        };
        let base = match fields.take("base") {
            Some(value) => reader.number(value, "base", 1..=FIRST_WIRED - 1),
            None => missing(reader, value, "computed", "base"),
        };
        let offset_e4 = fields
            .take("offset")
            .map_or(Some(0), |value| length(reader, value, "offset"));
        fields.finish(reader);
        if let (Some(number), Some(base), Some(offset_e4)) = (number, base, offset_e4) {
            if computed.iter().any(|other| other.number == number) {
                reader.mistake(value.span(), format!("variable {number} is computed twice"));
            }
            computed.push(WiredPosition {
                number,
                base,
                offset_e4,
            });
        }
    }
    computed
}

/// A length in units ×10000.
fn length<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>, what: &str) -> Option<i32> {
    let scaled = reader.decimal(value, what, 4)?;
    let fitting = i32::try_from(scaled)
        .ok()
        .filter(|raw| raw.unsigned_abs() <= FARTHEST_E4);
    if fitting.is_none() {
        reader.mistake(value.span(), format!("{what}: expected -214000 to 214000 units"));
    }
    fitting
}

/// A table of variables: its name and how many there are.
#[derive(Clone, Copy)]
struct Table {
    name: &'static str,
    last: u8,
}

const POSITIONS: Table = Table {
    name: "VTPOS",
    last: POSITION_COUNT,
};
const VELOCITIES: Table = Table {
    name: "VTVEL",
    last: VARIABLE_COUNT,
};
const ACCELERATIONS: Table = Table {
    name: "VTACC",
    last: VARIABLE_COUNT,
};
const TIMES: Table = Table {
    name: "VTTIME",
    last: VARIABLE_COUNT,
};
const PIECES: Table = Table {
    name: "VTPCS",
    last: VARIABLE_COUNT,
};

/// Program function outputs.
const OUTPUTS: u8 = 16;
/// The 32-bit limit of lengths, ×10000 (9300 facts 4.1).
const FARTHEST_E4: u32 = 2_140_000_000;

/// `Some(None)` for the word, `Some(Some(n))` for a variable.
fn word_or_variable<'a>(
    reader: &mut Reader<'a>,
    value: &Spanned<DeValue<'a>>,
    what: &str,
    word: &str,
    table: Table,
) -> Option<Option<u8>> {
    match value.get_ref().as_str() {
        Some(text) if text == word => Some(None),
        Some(text) if text.starts_with(table.name) => variable(reader, value, what, table).map(Some),
        _ => {
            let got = shown(value);
            reader.mistake(
                value.span(),
                format!("{what}: expected \"{word}\" or \"{} n\", got {got}", table.name),
            );
            None
        }
    }
}

/// `VTPOS 1`, also written `VTPOS 001` as in the drive's dialog.
fn variable<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>, what: &str, table: Table) -> Option<u8> {
    let digits = value
        .get_ref()
        .as_str()
        .and_then(|text| text.strip_prefix(table.name))
        .map(str::trim_start);
    let number = digits
        .filter(|digits| digits.bytes().all(|octet| octet.is_ascii_digit()))
        .and_then(|digits| digits.parse::<u8>().ok())
        .filter(|number| (1..=table.last).contains(number));
    if number.is_none() {
        let Table { name, last } = table;
        let got = shown(value);
        reader.mistake(value.span(), format!("{what}: expected {name} 1 to {last}, got {got}"));
    }
    number
}

fn missing<T>(reader: &mut Reader<'_>, value: &Spanned<DeValue<'_>>, what: &str, key: &str) -> Option<T> {
    reader.mistake(value.span(), format!("{what}: `{key}` is missing"));
    None
}

/// A text as it stands, anything else by its type.
fn shown<'t>(value: &'t Spanned<DeValue<'_>>) -> &'t str {
    value.get_ref().as_str().unwrap_or(value.get_ref().type_str())
}

//! The block alone, cycle by cycle: recorded inputs and bus images in, outputs and images out, one JSON line each.
//!
//! # Input
//!
//! | line | meaning |
//! |---|---|
//! | `{"reset":…,"pzd_adr":280,"module_adr":280}` | power-up; the value of `reset` is free, both addresses default to 280; no answer |
//! | `{"c":7,"i":[…12…],"pi":"…","qi":"…"}` | one PLC cycle; `c` any integer, `i` the inputs behind `PZD_Adr` in the block's order (null: not written in this cycle), `pi` and `qi` 16 hexadecimal digits of process and parameter data from the drive |
//!
//! Other keys are ignored, and so are blank lines. Cycles before the first `reset` run from an implicit power-up.
//! The module has its process data at `module_adr` and its parameter channel 8 below (wrapping at 16 bits). Elsewhere there
//! is nothing: what the block reads there stays as it was, what it writes there is lost.
//!
//! # Output
//!
//! One line per cycle: `c`; `o` the seven outputs, BOOL as 0/1, REAL as its bit pattern in decimal; `po` and `qo` process and
//! parameter data to the drive; `m` the marking of the places 1…11; `at` the telegram counter; `ci` Geschw, Geschw_DM,
//! Beschl_Verz and Strecke after clamping.
//!
//! ```
//! use film_feed::replay::Replay;
//!
//! let mut replay = Replay::new();
//! let mut answer = String::new();
//! let line = br#"{"c":1,"i":[0,0,0,0,0,0,0,1,null,null,null,null],"pi":"0001000000000000","qi":"0000000000000000"}"#;
//! replay.step(&Replay::parse(line)?, &mut answer);
//! assert_eq!(
//!     answer,
//!     concat!(
//!         r#"{"c":1,"o":[0,0,0,0,0,0,4294967295],"po":"007f000000000000","qo":"72015ae9000186a0","#,
//!         r#""m":"00000110010","at":0,"ci":[1000,1000,1000,2000]}"#,
//!         "\n"
//!     )
//! );
//! # Ok::<(), film_feed::replay::LineError>(())
//! ```

use std::fmt::{self, Write as _};

use serde::de::{self, Deserialize, Deserializer, IgnoredAny, Unexpected, Visitor};
use serde_json::{Map, Number, Value};

use crate::block::{FilmFeedBlock, Inputs, Periphery};

/// Address of the process data in the thesis' test, and the default here.
pub const DEFAULT_ADDRESS: u16 = 280;

/// Octets from the module's process data down to its parameter channel.
const PAR_OFFSET: u16 = 8;

/// The names of the twelve inputs of a cycle line, in order: eight BOOL, then four INT.
const INPUT_NAMES: [&str; 12] = [
    "Druckmarke_lesen",
    "Handfahren",
    "Handfahren_pos",
    "Handfahren_neg",
    "POS_START",
    "POS_Stop",
    "Error_RESET",
    "Freigabe",
    "Geschw",
    "Geschw_DM",
    "Beschl_Verz",
    "Strecke",
];

/// Why a line was not understood. Each message says what is allowed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LineError {
    /// Not JSON at all.
    #[error(
        "not JSON ({cause}); allowed is one object per line, with \"reset\" or with \"c\", \"i\", \"pi\" and \"qi\""
    )]
    Json {
        /// What the JSON reader said.
        cause: String,
    },
    /// JSON, but neither of the two kinds of line.
    #[error(
        "neither a power-up nor a cycle; allowed is an object with \"reset\" or with \"c\", \"i\", \"pi\" and \"qi\""
    )]
    Kind,
    /// A key of a cycle line is missing.
    #[error("key \"{key}\" is missing; a cycle has \"c\", \"i\", \"pi\" and \"qi\"")]
    Missing {
        /// The key.
        key: &'static str,
    },
    /// `c` is not an integer.
    #[error("\"c\" is {got}; allowed is an integer")]
    CycleNumber {
        /// The value as it stood in the line, shortened.
        got: String,
    },
    /// An address does not fit 16 bits.
    #[error("\"{key}\" is {got}; allowed is an integer from 0 to 65535")]
    Address {
        /// The key.
        key: &'static str,
        /// The value as it stood in the line, shortened.
        got: String,
    },
    /// `i` is not a list of twelve.
    #[error("\"i\" is {got}; allowed is a list of 12 values, 8 BOOL and 4 INT, null for an input not written")]
    Inputs {
        /// The value or its length.
        got: String,
    },
    /// One of the eight BOOL is none.
    #[error("input {name} is {got}; allowed is 0, 1, false, true or null")]
    Bool {
        /// Name of the input in the original.
        name: &'static str,
        /// The value as it stood in the line, shortened.
        got: String,
    },
    /// One of the four INT is none.
    #[error("input {name} is {got}; allowed is an integer from -32768 to 32767 or null")]
    Int {
        /// Name of the input in the original.
        name: &'static str,
        /// The value as it stood in the line, shortened.
        got: String,
    },
    /// An image is not 8 octets in hexadecimal.
    #[error("\"{key}\" is {got}; allowed are 16 hexadecimal digits")]
    Image {
        /// The key.
        key: &'static str,
        /// The value as it stood in the line, shortened.
        got: String,
    },
}

/// One understood line.
#[derive(Debug, Clone, PartialEq)]
pub enum Line {
    /// A blank line.
    Blank,
    /// Power-up of block and module.
    PowerUp {
        /// The block's input PZD_Adr.
        pzd_adr: u16,
        /// Where the module has its process data.
        module_adr: u16,
    },
    /// One PLC cycle.
    Cycle(Cycle),
}

/// What happens in one PLC cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    /// Echoed in the answer.
    number: Number,
    /// The BOOL inputs written in this cycle.
    bools: [Option<bool>; 8],
    /// The INT inputs written in this cycle.
    ints: [Option<i16>; 4],
    /// Process data from the drive.
    pzd: [u8; 8],
    /// Parameter data from the drive.
    par: [u8; 8],
}

/// The block with its inputs and the module's images.
#[derive(Debug, Clone)]
pub struct Replay {
    block: FilmFeedBlock,
    inputs: Inputs,
    module: Module,
}

impl Default for Replay {
    fn default() -> Self {
        Self::new()
    }
}

impl Replay {
    /// Block and module after power-up at the default address.
    pub fn new() -> Self {
        Self::powered_up(DEFAULT_ADDRESS, DEFAULT_ADDRESS)
    }

    fn powered_up(pzd_adr: u16, module_adr: u16) -> Self {
        Self {
            block: FilmFeedBlock::new(),
            inputs: Inputs {
                pzd_adr,
                ..Inputs::default()
            },
            module: Module {
                address: module_adr,
                ..Module::default()
            },
        }
    }

    /// Reads one line, with or without its end.
    ///
    /// # Errors
    ///
    /// [`LineError`], if it is neither blank nor one of the two kinds of line.
    pub fn parse(line: &[u8]) -> Result<Line, LineError> {
        let line = line.trim_ascii();
        if line.is_empty() {
            return Ok(Line::Blank);
        }
        if let Some(cycle) = PlainCycle::read(line) {
            return Ok(Line::Cycle(cycle));
        }
        match serde_json::from_slice(line) {
            Ok(Value::Object(object)) => parse_object(&object),
            Ok(_) => Err(LineError::Kind),
            Err(error) => Err(LineError::Json { cause: reason(&error) }),
        }
    }

    /// Performs one line. A cycle appends its answer, with a line feed, to `answer`.
    pub fn step(&mut self, line: &Line, answer: &mut String) {
        match line {
            Line::Blank => {}
            Line::PowerUp { pzd_adr, module_adr } => *self = Self::powered_up(*pzd_adr, *module_adr),
            Line::Cycle(cycle) => {
                cycle.write_inputs(&mut self.inputs);
                self.module.pzd_in = cycle.pzd;
                self.module.par_in = cycle.par;
                self.block.cycle(&mut self.inputs, &mut self.module);
                self.answer(&cycle.number, answer);
            }
        }
    }

    fn answer(&self, number: &Number, out: &mut String) {
        let outputs = self.block.outputs();
        let bit = u8::from;
        // Writing to a String cannot fail.
        let _ = write!(
            out,
            "{{\"c\":{number},\"o\":[{},{},{},{},{},{},{}],\"po\":\"",
            bit(outputs.switched_on),
            bit(outputs.drive_ready),
            bit(outputs.error),
            bit(outputs.running),
            bit(outputs.job_finished),
            outputs.speed_percent.to_bits(),
            outputs.position_mm.to_bits(),
        );
        push_hex(out, &self.module.pzd_out);
        out.push_str("\",\"qo\":\"");
        push_hex(out, &self.module.par_out);
        out.push_str("\",\"m\":\"");
        let _ = writeln!(
            out,
            "{}\",\"at\":{},\"ci\":[{},{},{},{}]}}",
            self.block.marking(),
            self.block.telegram_counter(),
            self.inputs.velocity,
            self.inputs.mark_velocity,
            self.inputs.acceleration,
            self.inputs.distance,
        );
    }
}

impl Cycle {
    fn write_inputs(&self, inputs: &mut Inputs) {
        let bools = [
            &mut inputs.read_mark,
            &mut inputs.manual,
            &mut inputs.manual_pos,
            &mut inputs.manual_neg,
            &mut inputs.pos_start,
            &mut inputs.pos_stop,
            &mut inputs.error_reset,
            &mut inputs.enable,
        ];
        for (input, value) in bools.into_iter().zip(self.bools) {
            *input = value.unwrap_or(*input);
        }
        let ints = [
            &mut inputs.velocity,
            &mut inputs.mark_velocity,
            &mut inputs.acceleration,
            &mut inputs.distance,
        ];
        for (input, value) in ints.into_iter().zip(self.ints) {
            *input = value.unwrap_or(*input);
        }
    }
}

/// The bus module's images in the PLC's periphery.
#[derive(Debug, Clone, Copy, Default)]
struct Module {
    address: u16,
    pzd_in: [u8; 8],
    par_in: [u8; 8],
    pzd_out: [u8; 8],
    par_out: [u8; 8],
}

impl Periphery for Module {
    fn dprd_dat(&mut self, laddr: u16, record: &mut [u8; 8]) -> bool {
        let image = if laddr == self.address {
            self.pzd_in
        } else if laddr == self.address.wrapping_sub(PAR_OFFSET) {
            self.par_in
        } else {
            return false;
        };
        *record = image;
        true
    }

    fn dpwr_dat(&mut self, laddr: u16, record: &[u8; 8]) -> bool {
        let image = if laddr == self.address {
            &mut self.pzd_out
        } else if laddr == self.address.wrapping_sub(PAR_OFFSET) {
            &mut self.par_out
        } else {
            return false;
        };
        *image = *record;
        true
    }
}

/// A cycle line as nearly all are, read without building a JSON tree: five times as fast. Whatever does not fit, right or
/// wrong, goes the long way, which knows how to explain.
#[derive(serde::Deserialize)]
struct PlainCycle<'a> {
    c: i64,
    i: PlainInputs,
    pi: &'a str,
    qi: &'a str,
    #[serde(default, deserialize_with = "present")]
    reset: bool,
}

type Flag = Option<PlainBool>;
type PlainInputs = (
    Flag,
    Flag,
    Flag,
    Flag,
    Flag,
    Flag,
    Flag,
    Flag,
    Option<i16>,
    Option<i16>,
    Option<i16>,
    Option<i16>,
);

impl PlainCycle<'_> {
    fn read(line: &[u8]) -> Option<Cycle> {
        let plain: PlainCycle<'_> = serde_json::from_slice(line)
            .ok()
            .filter(|plain: &PlainCycle<'_>| !plain.reset)?;
        let (b0, b1, b2, b3, b4, b5, b6, b7, n0, n1, n2, n3) = plain.i;
        Some(Cycle {
            number: plain.c.into(),
            bools: [b0, b1, b2, b3, b4, b5, b6, b7].map(|flag| flag.map(|PlainBool(bool)| bool)),
            ints: [n0, n1, n2, n3],
            pzd: hex_octets(plain.pi)?,
            par: hex_octets(plain.qi)?,
        })
    }
}

/// True for any value, null included: the key is there.
fn present<'de, D: Deserializer<'de>>(deserializer: D) -> Result<bool, D::Error> {
    IgnoredAny::deserialize(deserializer).map(|_| true)
}

/// 0, 1, false or true.
struct PlainBool(bool);

impl<'de> Deserialize<'de> for PlainBool {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct BoolVisitor;
        impl Visitor<'_> for BoolVisitor {
            type Value = PlainBool;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("0, 1, false or true")
            }

            fn visit_bool<E: de::Error>(self, bool: bool) -> Result<PlainBool, E> {
                Ok(PlainBool(bool))
            }

            fn visit_u64<E: de::Error>(self, number: u64) -> Result<PlainBool, E> {
                match number {
                    0 => Ok(PlainBool(false)),
                    1 => Ok(PlainBool(true)),
                    _ => Err(E::invalid_value(Unexpected::Unsigned(number), &self)),
                }
            }
        }
        deserializer.deserialize_any(BoolVisitor)
    }
}

fn parse_object(object: &Map<String, Value>) -> Result<Line, LineError> {
    if object.contains_key("reset") {
        return Ok(Line::PowerUp {
            pzd_adr: parse_address(object, "pzd_adr")?,
            module_adr: parse_address(object, "module_adr")?,
        });
    }
    if !["c", "i", "pi", "qi"].iter().any(|key| object.contains_key(*key)) {
        return Err(LineError::Kind);
    }
    let number = match required(object, "c")? {
        Value::Number(number) if number.is_i64() || number.is_u64() => number.clone(),
        other => {
            return Err(LineError::CycleNumber { got: shortened(other) });
        }
    };
    let (bools, ints) = parse_inputs(required(object, "i")?)?;
    Ok(Line::Cycle(Cycle {
        number,
        bools,
        ints,
        pzd: parse_image(object, "pi")?,
        par: parse_image(object, "qi")?,
    }))
}

fn required<'a>(object: &'a Map<String, Value>, key: &'static str) -> Result<&'a Value, LineError> {
    object.get(key).ok_or(LineError::Missing { key })
}

fn parse_address(object: &Map<String, Value>, key: &'static str) -> Result<u16, LineError> {
    match object.get(key) {
        None => Ok(DEFAULT_ADDRESS),
        Some(value) => value
            .as_u64()
            .and_then(|address| u16::try_from(address).ok())
            .ok_or_else(|| LineError::Address {
                key,
                got: shortened(value),
            }),
    }
}

type ParsedInputs = ([Option<bool>; 8], [Option<i16>; 4]);

fn parse_inputs(value: &Value) -> Result<ParsedInputs, LineError> {
    let Value::Array(list) = value else {
        return Err(LineError::Inputs { got: shortened(value) });
    };
    if list.len() != INPUT_NAMES.len() {
        return Err(LineError::Inputs {
            got: format!("a list of {}", list.len()),
        });
    }
    let (mut bools, mut ints) = ([None; 8], [None; 4]);
    let named = list.iter().zip(INPUT_NAMES);
    for (slot, (value, name)) in bools.iter_mut().zip(named.clone()) {
        *slot = match value {
            Value::Null => None,
            Value::Bool(bool) => Some(*bool),
            _ => match value.as_u64() {
                Some(0) => Some(false),
                Some(1) => Some(true),
                _ => {
                    return Err(LineError::Bool {
                        name,
                        got: shortened(value),
                    });
                }
            },
        };
    }
    for (slot, (value, name)) in ints.iter_mut().zip(named.skip(8)) {
        *slot = match value {
            Value::Null => None,
            _ => match value.as_i64().map(i16::try_from) {
                Some(Ok(int)) => Some(int),
                _ => {
                    return Err(LineError::Int {
                        name,
                        got: shortened(value),
                    });
                }
            },
        };
    }
    Ok((bools, ints))
}

fn parse_image(object: &Map<String, Value>, key: &'static str) -> Result<[u8; 8], LineError> {
    let value = required(object, key)?;
    value.as_str().and_then(hex_octets).ok_or_else(|| LineError::Image {
        key,
        got: shortened(value),
    })
}

/// Exactly 16 hexadecimal digits of either case. (`from_str_radix` alone would take a sign.)
fn hex_octets(text: &str) -> Option<[u8; 8]> {
    let is_hex = text.len() == 16 && text.bytes().all(|digit| digit.is_ascii_hexdigit());
    is_hex
        .then(|| u64::from_str_radix(text, 16).ok())
        .flatten()
        .map(u64::to_be_bytes)
}

fn push_hex(out: &mut String, octets: &[u8; 8]) {
    let _ = write!(out, "{:016x}", u64::from_be_bytes(*octets));
}

/// The value as JSON, cut so that the sentence stays one line.
fn shortened(value: &Value) -> String {
    const LIMIT: usize = 40;
    let text = value.to_string();
    match text.char_indices().nth(LIMIT) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// The JSON reader's message without its "line 1", which would contradict the line number of the file.
fn reason(error: &serde_json::Error) -> String {
    let text = error.to_string();
    match text.rsplit_once(" at line ") {
        Some((cause, _)) => format!("{cause} at column {}", error.column()),
        None => text,
    }
}

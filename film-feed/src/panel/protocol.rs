//! What page and program say to each other: JSON texts over the WebSocket.
//!
//! The page sends one [`Order`] a message, `{"do": "set", "input": "enable", "value": 1}`. The program sends [`Told`]: a frame twenty
//! times a second, and answers to what one client asked.

use lenze9300_model::access::CodePlace;
use serde::{Deserialize, Serialize};

/// Longest message that is taken from a page, octets.
pub const MAX_ORDER: usize = 4096;
/// Orders a client may send in a second; more end the connection.
pub const MAX_ORDERS_PER_S: u32 = 100;
/// Pages that may be connected at once.
pub const MAX_CLIENTS: usize = 16;
/// Channels of the oscilloscope.
pub const MAX_CHANNELS: usize = 8;

/// What a page asks for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Order {
    /// Become the one who may change things; refused while another page is.
    TakeControl,
    /// Give that up.
    ReleaseControl,
    /// Machine seconds for a second: 0 pauses, up to 100.
    Speed {
        /// The factor.
        factor: f64,
    },
    /// While paused: so many milliseconds on, 1…1000.
    Step {
        /// Milliseconds.
        ms: u32,
    },
    /// Set an input of the block, in its own unit.
    Set {
        /// Name as in [`INPUTS`].
        input: String,
        /// Value; 0 and 1 for a bit.
        value: i32,
    },
    /// A start edge: POS_START up until RUNNING comes, 500 ms at the most.
    Start,
    /// Thread the film anew, with print or without.
    Rethread {
        /// Whether the reader sees the marks.
        printed: bool,
    },
    /// The print of the next mark fails.
    BlankMark,
    /// Ask every address who is there.
    LiveList,
    /// Disturb the line: probability that a bit is wrong, 0…0.001.
    Noise {
        /// The probability.
        bit_error_rate: f64,
    },
    /// Plug the module in or out.
    Cable {
        /// Whether it is plugged in.
        plugged: bool,
    },
    /// Another master in the ring.
    SecondMaster {
        /// Whether it is there.
        present: bool,
    },
    /// Mains on or off.
    Mains {
        /// Whether they are on.
        on: bool,
    },
    /// Terminal 28, which the guard opens.
    Terminal28 {
        /// Its level.
        high: bool,
    },
    /// Torque against the motor, −3…3 Nm.
    Load {
        /// The torque.
        nm: f64,
    },
    /// The cause of a fault.
    Fault {
        /// As the keypad shows it, such as OC2.
        name: String,
        /// Whether it is there.
        present: bool,
    },
    /// Read a code.
    ReadCode {
        /// Such as C0061 or C1301/1.
        code: String,
    },
    /// Write a code, in its own unit.
    WriteCode {
        /// Such as C1301/1.
        code: String,
        /// Such as 987.5.
        value: String,
    },
    /// Signals of the oscilloscope, up to [`MAX_CHANNELS`], by name.
    Channels {
        /// The names.
        names: Vec<String>,
    },
}

impl Order {
    /// Whether it changes nothing that others see.
    #[must_use]
    pub const fn only_looks(&self) -> bool {
        matches!(self, Self::TakeControl | Self::ReleaseControl | Self::ReadCode { .. })
    }
}

/// An input of the block as the panel shows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct InputInfo {
    /// Name in orders and frames.
    pub name: &'static str,
    /// Name in the original.
    pub original: &'static str,
    /// Unit of a step of the value, for people; empty for a bit.
    pub unit: &'static str,
    /// Decimals that the value is shown with.
    pub decimals: u8,
    /// Least value.
    pub min: i32,
    /// Greatest value.
    pub max: i32,
}

const fn bit(name: &'static str, original: &'static str) -> InputInfo {
    InputInfo {
        name,
        original,
        unit: "",
        decimals: 0,
        min: 0,
        max: 1,
    }
}

const fn number(
    name: &'static str,
    original: &'static str,
    unit: &'static str,
    decimals: u8,
    min: i32,
    max: i32,
) -> InputInfo {
    InputInfo {
        name,
        original,
        unit,
        decimals,
        min,
        max,
    }
}

/// The inputs of the block that can be set. Ranges: film-feed specification, section 8.
pub const INPUTS: [InputInfo; 12] = [
    bit("enable", "Freigabe"),
    bit("pos_start", "POS_START"),
    bit("pos_stop", "POS_Stop"),
    bit("error_reset", "Error_RESET"),
    bit("read_mark", "Druckmarke_lesen"),
    bit("manual", "Handfahren"),
    bit("manual_pos", "Handfahren_pos"),
    bit("manual_neg", "Handfahren_neg"),
    number("velocity", "Geschw", "%", 2, 1000, 10_000),
    number("mark_velocity", "Geschw_DM", "%", 2, 1000, 10_000),
    number("acceleration", "Beschl_Verz", "%", 2, 1000, 10_000),
    number("distance", "Strecke", "mm", 1, 2000, 20_000),
];

/// What the program tells.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "t", rename_all = "snake_case")]
pub enum Told {
    /// First message: what does not change.
    Hello(Box<Hello>),
    /// The present state, and what was recorded since the frame before.
    Frame(Box<Frame>),
    /// A code that was asked for.
    Code {
        /// The code.
        code: String,
        /// Its value with unit.
        shown: String,
        /// Its value alone.
        value: String,
        /// What it means.
        meaning: &'static str,
    },
    /// An order was carried out.
    Done {
        /// What.
        what: String,
    },
    /// An order was not carried out.
    Refused {
        /// One sentence.
        why: String,
    },
    /// Whether this page may change things.
    Control {
        /// It may.
        yours: bool,
        /// Somebody may.
        taken: bool,
    },
}

impl Told {
    /// A code and its raw value, in the code's own unit.
    #[must_use]
    pub fn code_read(place: CodePlace, raw: i32) -> Self {
        Self::Code {
            code: place.to_string(),
            shown: place.show(raw),
            value: place.decimal(raw),
            meaning: place.entry().map_or("", |entry| entry.name),
        }
    }

    /// That a code has been written.
    #[must_use]
    pub fn code_written(place: CodePlace, raw: i32) -> Self {
        Self::Done {
            what: format!("{place} = {}", place.show(raw)),
        }
    }
}

/// What does not change while the program runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hello {
    /// Version of the program.
    pub version: &'static str,
    /// Whether what is shown is a real line, where nothing can be slowed down or disturbed.
    pub is_real: bool,
    /// Inputs of the block.
    pub inputs: Vec<InputInfo>,
    /// Signals of the oscilloscope: name, unit, meaning.
    pub signals: Vec<[&'static str; 3]>,
    /// Tolerance of a feed, mm.
    pub tolerance_mm: f64,
    /// Faults that can be caused, by name.
    pub faults: Vec<&'static str>,
    /// States of the profile, by name.
    pub states: Vec<&'static str>,
    /// Codes that can be read: name, unit, meaning.
    pub codes: Vec<[String; 3]>,
    /// Transitions of the profile, and the drive's own moves.
    pub transitions: Vec<TransitionInfo>,
    /// Transitions of the net of the parameter channel.
    pub net: Vec<NetRow>,
}

/// A transition of the profile.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TransitionInfo {
    /// Number or name.
    pub id: String,
    /// States it leaves.
    pub from: Vec<&'static str>,
    /// State it enters.
    pub to: &'static str,
    /// What sets it off: commands of the control word, events.
    pub trigger: String,
    /// What holds it back although it is set off.
    pub held: Option<&'static str>,
}

/// A transition of the net.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct NetRow {
    /// Its number, 1…13.
    pub n: u8,
    /// Places it takes a token from.
    pub takes: Vec<u8>,
    /// Places it puts one into; of a choice, all that may get one.
    pub puts: Vec<u8>,
}

/// The present state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Frame {
    /// Number of the frame, one more each time.
    pub seq: u64,
    /// Machine time, s.
    pub time_s: f64,
    /// Machine seconds for a second.
    pub factor: f64,
    /// Samples since the frame before.
    pub samples: Samples,
    /// Film, roller, reader.
    pub machine: MachineView,
    /// Inputs of the block in the order of [`INPUTS`].
    pub inputs: Vec<i32>,
    /// Outputs of the block.
    pub outputs: OutputView,
    /// The drive.
    pub drive: DriveView,
    /// The parameter channel.
    pub parameters: ParameterView,
    /// The bus.
    pub bus: BusView,
    /// What goes wrong with the present inputs, and what to do.
    pub advice: Vec<AdviceView>,
}

/// A finding of [`crate::advise`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AdviceView {
    /// Its short name.
    pub id: &'static str,
    /// Whether it goes wrong by these values alone; otherwise only when something else happens.
    pub fails: bool,
    /// What happens, and why.
    pub cause: String,
    /// What to do.
    pub remedy: String,
}

/// Samples of the oscilloscope.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Samples {
    /// Number of the first one, counted since the channels were chosen.
    pub first: u64,
    /// Milliseconds from one to the next.
    pub interval_ms: u32,
    /// Names of the channels.
    pub channels: Vec<&'static str>,
    /// Their units.
    pub units: Vec<&'static str>,
    /// A row each; the time in s comes first.
    pub rows: Vec<Vec<f64>>,
}

/// Film, roller, reader.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MachineView {
    /// Position of the film, mm.
    pub film_mm: f64,
    /// Angle of the roller, rad.
    pub roller_rad: f64,
    /// Speed of the film, mm/s.
    pub speed_mm_s: f64,
    /// Marks near the reader: how far each is before it, mm, and whether it is printed.
    pub marks: Vec<(f64, bool)>,
    /// Whether the reader sees a mark.
    pub reader: bool,
    /// Feeds that ended since the frame before.
    pub feeds: Vec<FeedView>,
}

/// A feed that ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeedView {
    /// Its number.
    pub n: u32,
    /// `length` or `mark`.
    pub mode: &'static str,
    /// What it should have moved, mm, where that is known.
    pub commanded_mm: Option<f64>,
    /// Error, µm, where that is known.
    pub error_um: Option<f64>,
    /// Time to the end, s.
    pub seconds: f64,
    /// Whether JOB_FIN came.
    pub finished: bool,
}

/// Outputs of the block, with the names of the original.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutputView {
    /// Eingeschaltet.
    pub switched_on: bool,
    /// DRIVE_RDY.
    pub drive_ready: bool,
    /// ERROR.
    pub error: bool,
    /// RUNNING.
    pub running: bool,
    /// JOB_FIN.
    pub job_finished: bool,
    /// MCTRL_NACT, %.
    pub speed_percent: f64,
    /// POS_ACT, mm; none while it is no number.
    pub position_mm: Option<f64>,
}

/// The drive.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DriveView {
    /// State of the profile, by name.
    pub state: &'static str,
    /// Control word that the module works with.
    pub control_word: u16,
    /// Commands that it gives, by name.
    pub commands: Vec<&'static str>,
    /// Status word.
    pub status_word: u16,
    /// C0183, where the inside of the drive can be seen; so are those below.
    pub diagnosis: Option<u16>,
    /// The present fault: number and name as shown, cause, remedy.
    pub fault: Option<FaultView>,
    /// Fault memory, newest first.
    pub history: Vec<FaultView>,
    /// Record at work.
    pub record: Option<u8>,
    /// DC link, V.
    pub dc_link_v: Option<f64>,
    /// Motor current, A rms.
    pub current_a: Option<f64>,
    /// Temperature of the heat sink as C0061 shows it, °C.
    pub heat_sink_c: Option<f64>,
    /// Level of terminal 28.
    pub terminal_28: Option<bool>,
}

/// A fault.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FaultView {
    /// Number as C0067 shows it.
    pub number: u16,
    /// Name as the keypad shows it.
    pub name: &'static str,
    /// What causes it.
    pub cause: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

/// The parameter channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterView {
    /// Places that hold a token, 1…
    pub marked: Vec<u8>,
    /// Number of the telegram at work, 0…6.
    pub telegram: u16,
    /// Octets sent last.
    pub sent: String,
    /// Octets received last.
    pub received: String,
    /// Complete rounds.
    pub rounds: u64,
    /// Time of the last round, ms.
    pub round_ms: f64,
    /// What was refused or not answered.
    pub troubles: Vec<String>,
}

/// The bus.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BusView {
    /// Baud rate, bit/s.
    pub baud: u32,
    /// State of the drive's slave, in words.
    pub slave: String,
    /// Mean DP cycle, µs.
    pub cycle_us: f64,
    /// Telegrams sent and received.
    pub telegrams: u64,
    /// Repetitions.
    pub retries: u64,
    /// Whether the module is plugged in.
    pub plugged: bool,
    /// Probability that a bit is wrong.
    pub bit_error_rate: f64,
    /// Whether another master is in the ring.
    pub second_master: bool,
    /// Whether the addresses are being asked who is there.
    pub asking: bool,
    /// Who is there, as far as they have been asked: address and kind.
    pub stations: Vec<(u8, &'static str)>,
    /// Some telegrams since the frame before, newest last: time in s, what it is, its octets.
    pub heard: Vec<(f64, String, String)>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_read_and_everything_else_is_refused() {
        let order: Order = serde_json::from_str(r#"{"do":"set","input":"enable","value":1}"#).expect("an order");
        assert_eq!(
            order,
            Order::Set {
                input: "enable".to_owned(),
                value: 1
            }
        );
        assert!(!order.only_looks());
        for text in [
            "",
            "{}",
            "[]",
            r#"{"do":"format_disk"}"#,
            r#"{"do":"set","input":"enable"}"#,
            r#"{"do":"set","input":"enable","value":1,"more":2}"#,
            r#"{"do":"set","input":"enable","value":1.5}"#,
            r#"{"do":"step","ms":-1}"#,
        ] {
            assert!(serde_json::from_str::<Order>(text).is_err(), "{text}");
        }
    }
}

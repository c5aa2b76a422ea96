//! What goes into and comes out of the positioning program each millisecond.

use super::record::RecordNumber;
use super::touch_probe::TouchEvent;

/// The inputs of one 1 ms tick. Levels as inside the drive: all high active.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TraverseInputs {
    /// POS-PRG-START: a rising edge starts.
    pub start: bool,
    /// POS-PRG-STOP: interrupts; dominates `start`.
    pub stop: bool,
    /// POS-PRG-RESET: ends the program.
    pub reset: bool,
    /// MANUAL: jog mode.
    pub manual: bool,
    /// MANUAL-POS.
    pub manual_pos: bool,
    /// MANUAL-NEG.
    pub manual_neg: bool,
    /// POS-PS-CANCEL: a rising edge ends the record being worked off; the program goes on at its field 11.
    #[doc(alias = "Restweg löschen")]
    pub cancel: bool,
    /// Program function inputs, bit 0 = PFI 01.
    pub program_inputs: u32,
    /// Share of the programmed velocities.
    pub velocity_override: Override,
    /// Operation enabled, no quick stop, no fault.
    pub enabled: bool,
    /// Actual position in inc, counted from the present reference.
    pub pos_act: i64,
    /// Position of the resolver in inc; its zero pulses lie at multiples of 65 536.
    pub resolver: i64,
    /// The reference is lost: a message lasted too long.
    pub reference_lost: bool,
    /// Actual speed in inc/ms; used when operation is enabled while the axis moves.
    pub omega_act_inc_per_ms: f64,
    /// Touch latched since the last tick; the position counts from the same reference as `pos_act`.
    pub touch: Option<TouchEvent>,
}

/// Share of the programmed velocities that is driven, 0 to 100 %.
///
/// Assumed: the drive has an override (thesis ch. 5.4); its range is not known. It never raises a velocity above what was
/// programmed, so that C1240 stays the limit. At 0 the axis stands and the record waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Override(i32);

impl Override {
    /// Everything as programmed.
    pub const FULL: Self = Self(100_0000);

    /// From percent ×10000, cut to 0 to 100 %.
    pub const fn from_percent_e4(percent_e4: i32) -> Self {
        Self(if percent_e4 < 0 {
            0
        } else if percent_e4 > 100_0000 {
            100_0000
        } else {
            percent_e4
        })
    }

    /// As a factor, 0 to 1.
    pub fn factor(self) -> f64 {
        f64::from(self.0) / 1_000_000.0
    }
}

impl Default for Override {
    fn default() -> Self {
        Self::FULL
    }
}

/// The set-values of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Setpoint {
    /// Position set-value in whole inc (floor), counted from the reference *after* this tick.
    pub position: i64,
    /// Speed feed-forward in inc/ms.
    #[doc(alias = "POS-NOUT")]
    pub velocity: f64,
    /// Acceleration feed-forward in inc/ms².
    pub acceleration: f64,
    /// Whether a motion is under way.
    pub moving: bool,
    /// By how much positions grew in this tick through a record "set reference": `new = old + reference_shift`.
    ///
    /// The drive adds it to its actual position (and to everything else it counts from the reference) before it
    /// compares that with `position`; the following error then stays what it was. 0 in all other ticks.
    pub reference_shift: i64,
}

/// State of the positioning program after a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraverseStatus {
    /// POS-RUNNING: from the start until program end or reset; stays during an interruption.
    pub running: bool,
    /// The program is interrupted by STOP or by the loss of the enable; the next start continues it.
    pub interrupted: bool,
    /// POS-ENDED: program end reached regularly; cleared by the next start, by RESET and by STOP.
    pub ended: bool,
    /// POS-IN-TARGET: set-value at the target and following error within the window.
    pub in_target: bool,
    /// Record being worked off, 1 to 32; the last one after the end; 0 before the first start.
    pub record: u8,
    /// A start edge would be taken (after one tick of low level in this state).
    pub ready_to_start: bool,
    /// A record with touch probe ended at its target without a touch; cleared by the next start and by RESET.
    pub no_mark_found: bool,
    /// A record waits for a touch.
    pub touch_armed: bool,
    /// A reference was set or found and has not been lost.
    pub referenced: bool,
    /// Why a record was not begun in this tick; the program is interrupted.
    pub fault: Option<RecordFault>,
    /// The set-value moves.
    pub moving: bool,
    /// Program function outputs, bit 0 = output 1.
    #[doc(alias = "PFO")]
    pub outputs: u16,
    /// Target in inc, counted from the reference.
    #[doc(alias = "POS-SETP")]
    pub target: i64,
}

/// Why a record cannot be worked off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RecordFault {
    /// The target lies below the negative position limit (P04).
    BelowLimit,
    /// The target lies above the positive position limit (P05).
    AboveLimit,
    /// An absolute target without a reference (P06).
    NoReference,
}

/// Something worth telling, in the order it happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TraverseEvent {
    /// A start edge was taken.
    ProgramStarted,
    /// A start edge continued an interrupted program.
    ProgramContinued,
    /// A start edge was not taken: not ready, not armed by a low level, or stop or reset present.
    StartRefused(StartRefusal),
    /// A record begins.
    RecordStarted(RecordNumber),
    /// C1211 names a record that is not programmed; the program did not start.
    NoSuchRecord(RecordNumber),
    /// Positions count from another reference: `new = old + shift` inc.
    SetReference {
        /// Shift in inc.
        shift: i64,
    },
    /// A record was not begun.
    RecordRefused {
        /// The record.
        record: RecordNumber,
        /// Why.
        fault: RecordFault,
    },
    /// Homing went its longest way and found no switch; the program goes on at field 11.
    HomingFailed {
        /// The record.
        record: RecordNumber,
    },
    /// A touch was taken and made the new target.
    MarkLatched {
        /// Latched position in inc.
        position: i64,
        /// New target in inc.
        target: i64,
    },
    /// The way to the new target is too short to brake: the axis will pass it and run backwards.
    ReversalPlanned {
        /// Record whose motion turns round.
        record: RecordNumber,
    },
    /// A record with touch probe ended at its target without a touch.
    NoMarkFound {
        /// The record.
        record: RecordNumber,
    },
    /// POS-PS-CANCEL ended a record before its target.
    RecordCancelled {
        /// The record.
        record: RecordNumber,
    },
    /// STOP interrupted the program.
    Stopped,
    /// The enable was lost while the program ran.
    EnableLost,
    /// RESET ended the program.
    Reset,
    /// Program end reached regularly.
    ProgramEnded,
}

/// Why a start edge was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartRefusal {
    /// Not in the state "ready to start" (not enabled, running, MANUAL, or still braking).
    NotReady,
    /// Ready, but the level had not been low for a tick in this state: the lost start of 9300 facts 4.3.
    NotArmed,
    /// STOP or RESET present at the edge.
    Dominated,
}

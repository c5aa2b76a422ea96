//! Process data channel: status word and three words from the drive, control word and three words to it.
//!
//! Words are big-endian in the image: the PLC's structure begins with the bits 8…15 of the control and status word.
//! Source: film-feed specification, section 7.

use super::{inputs::Inputs, outputs::Outputs, real, telegrams::Constants};

/// Bits of the status word which the block reads.
mod status {
    pub(super) const READY_TO_SWITCH_ON: u16 = 1;
    pub(super) const SWITCHED_ON: u16 = 1 << 1;
    pub(super) const OPERATION_ENABLED: u16 = 1 << 2;
    pub(super) const FAULT: u16 = 1 << 3;
    pub(super) const WARNING: u16 = 1 << 7;
    pub(super) const MESSAGE: u16 = 1 << 8;
    /// DCTRL fail or quick stop.
    pub(super) const DCTRL_FAIL_QSP: u16 = 1 << 12;
    pub(super) const RUNNING: u16 = 1 << 14;
    pub(super) const POS_ENDED_AND_IN_TARGET: u16 = 1 << 15;
}

/// Bits of the control word which the block writes. Bits 8, 9 and 10 stay 0.
mod control {
    pub(super) const SWITCH_ON: u16 = 1;
    /// Active low.
    pub(super) const INHIBIT_VOLTAGE_N: u16 = 1 << 1;
    /// Active low.
    pub(super) const QUICK_STOP_N: u16 = 1 << 2;
    pub(super) const ENABLE_OPERATION: u16 = 1 << 3;
    /// /QSP, active low.
    pub(super) const QSP_N: u16 = 1 << 4;
    /// A falling edge starts the program.
    pub(super) const POS_START_N: u16 = 1 << 5;
    /// Active low.
    pub(super) const POS_STOP_N: u16 = 1 << 6;
    pub(super) const RESET_FAULT: u16 = 1 << 7;
    pub(super) const POS_RESET: u16 = 1 << 11;
    pub(super) const MANUAL: u16 = 1 << 12;
    pub(super) const MANUAL_NEG: u16 = 1 << 13;
    pub(super) const MANUAL_POS: u16 = 1 << 14;
    pub(super) const READ_MARK: u16 = 1 << 15;
}

/// Number that stands for 100 % of C0011 in process data word 1.
const SPEED_100_PERCENT: f32 = 16_384.0;
/// Increments per motor revolution.
const INCREMENTS_PER_REVOLUTION: i32 = 65_536;

/// Process data from the drive, as last read: it keeps its value when a read fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[doc(alias = "PZD_receive")]
pub(crate) struct ProcessDataIn {
    /// The 8 octets as they came.
    pub(crate) image: [u8; 8],
}

impl ProcessDataIn {
    fn word(&self, index: usize) -> u16 {
        let [a, b, c, d, e, f, g, h] = self.image;
        u16::from_be_bytes(match index {
            0 => [a, b],
            1 => [c, d],
            2 => [e, f],
            _ => [g, h],
        })
    }

    fn status(&self, bit: u16) -> bool {
        self.word(0) & bit != 0
    }

    /// Networks "Statuswort auswerten", "Drehzahl berechnen" and "Lageistwert berechnen".
    pub(crate) fn evaluate(&self, constants: &Constants) -> Outputs {
        use status::*;
        Outputs {
            switched_on: self.status(SWITCHED_ON),
            drive_ready: self.status(OPERATION_ENABLED),
            error: self.status(MESSAGE | FAULT | WARNING | DCTRL_FAIL_QSP),
            running: self.status(RUNNING),
            job_finished: self.status(POS_ENDED_AND_IN_TARGET),
            speed_percent: self.speed_percent(),
            position_mm: self.position_mm(constants),
        }
    }

    /// `ITD` extends the sign of word 1, so the range is −200.0…+199.99 % (specification 8.1 point 12).
    fn speed_percent(&self) -> f32 {
        real::mul(real::div(real::word_to_real(self.word(1)), SPEED_100_PERCENT), 100.0)
    }

    /// The low word comes first. The order of the operations is the original's: each is rounded.
    fn position_mm(&self, constants: &Constants) -> f32 {
        let increments = (u32::from(self.word(3)) << 16) | u32::from(self.word(2));
        let revolutions = real::div(real::dtr(increments as i32), real::dtr(INCREMENTS_PER_REVOLUTION));
        let travel = real::mul(revolutions, constants.feed_constant);
        let position = real::mul(real::div(travel, constants.gear_numerator), constants.gear_denominator);
        // Before the constants were read it is 0/0.
        real::stored(position)
    }
}

/// Process data to the drive. Only the control word is used; words 1 to 3 stay 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[doc(alias = "PZD_send")]
pub(crate) struct ProcessDataOut {
    /// The control word.
    pub(crate) control: u16,
}

impl ProcessDataOut {
    /// Networks "Modus Druckmarke" to "DRIVECOM Einschaltsperr->Einschaltbereit->Eingeschaltet". Every bit is assigned in
    /// each cycle, so nothing of the previous word survives.
    pub(crate) fn build(inputs: &Inputs, outputs: &Outputs, received: &ProcessDataIn) -> Self {
        use control::*;
        let fault = received.status(status::FAULT);
        // RUNNING alone keeps the reset away, and a fault overrules it: the comment in the original promises more.
        let reset_fault = (fault || !outputs.running) && inputs.error_reset;
        // Walks the drive from "switch-on inhibited" (both low) over "shutdown" to "switched on".
        let switch_on = received.status(status::READY_TO_SWITCH_ON) || fault;

        let mut word = INHIBIT_VOLTAGE_N | QUICK_STOP_N | QSP_N;
        let mut set = |bit: u16, on: bool| word |= if on { bit } else { 0 };
        set(READ_MARK, inputs.read_mark);
        // No interlock between manual and program, whatever the comment says (specification 8.1 point 16).
        set(MANUAL, inputs.manual);
        set(MANUAL_POS, inputs.manual_pos);
        set(MANUAL_NEG, inputs.manual_neg);
        // An error that appears while POS_START is 0 makes the falling edge too (specification 8.1 point 14).
        set(POS_START_N, !inputs.pos_start && !outputs.error);
        set(POS_STOP_N, !inputs.pos_stop);
        set(RESET_FAULT, reset_fault);
        set(POS_RESET, inputs.pos_stop || reset_fault);
        set(ENABLE_OPERATION, inputs.enable);
        set(SWITCH_ON, switch_on);
        Self { control: word }
    }

    /// The 8 octets for the drive.
    pub(crate) fn image(self) -> [u8; 8] {
        let [high, low] = self.control.to_be_bytes();
        [high, low, 0, 0, 0, 0, 0, 0]
    }
}

//! The block's `VAR_OUTPUT`, in the order of the original.

/// Outputs of the block, computed in each cycle from the status word and process data words just read.
///
/// Source: thesis A.2, `VAR_OUTPUT`; film-feed specification, section 8.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outputs {
    /// The drive reports "switched on" (status bit 1).
    #[doc(alias = "Eingeschaltet")]
    pub switched_on: bool,
    /// The drive reports "operation enabled" (status bit 2).
    #[doc(alias = "DRIVE_RDY")]
    pub drive_ready: bool,
    /// Message, fault, warning, or status bit 12 (DCTRL fail or quick stop).
    #[doc(alias = "ERROR")]
    pub error: bool,
    /// The positioning program runs (status bit 14).
    #[doc(alias = "RUNNING")]
    pub running: bool,
    /// The positioning program ended in its target (status bit 15).
    #[doc(alias = "JOB_FIN")]
    pub job_finished: bool,
    /// Motor speed in % of C0011, −200.0…+199.99.
    #[doc(alias = "MCTRL_NACT")]
    pub speed_percent: f32,
    /// Position in mm. Not a number (`0xFFFF_FFFF`) until the gear numerator C1202 was read from the drive, then 0 until the
    /// gear denominator C1203, the last of the three constants, was.
    #[doc(alias = "POS_ACT")]
    pub position_mm: f32,
}

//! The block's `VAR_INPUT`, in the order of the original.

/// Inputs of the block. They live in its instance data: the block clamps the four numbers in place, and an input the
/// caller does not write keeps its value (also a clamped one).
///
/// Everything is 0 at power-up, so minimum values go to the drive until the caller has written the numbers.
///
/// Source: thesis A.2, `VAR_INPUT`; film-feed specification, section 8.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Inputs {
    /// Periphery address of the process data; the parameter channel lies 8 octets below it (wrapping at 16 bits).
    #[doc(alias = "PZD_Adr")]
    pub pzd_adr: u16,
    /// True: feed to the next print mark.
    #[doc(alias = "Druckmarke_lesen")]
    pub read_mark: bool,
    /// True: jog mode.
    #[doc(alias = "Handfahren")]
    pub manual: bool,
    /// True: jog in the positive direction. Not interlocked with [`manual`](Self::manual) by the block.
    #[doc(alias = "Handfahren_pos")]
    pub manual_pos: bool,
    /// True: jog in the negative direction. Not interlocked with [`manual`](Self::manual) by the block.
    #[doc(alias = "Handfahren_neg")]
    pub manual_neg: bool,
    /// A rising edge starts the positioning program (bit 5 of the control word falls).
    #[doc(alias = "POS_START")]
    pub pos_start: bool,
    /// True: stop the positioning program and put it back to its start.
    #[doc(alias = "POS_Stop")]
    pub pos_stop: bool,
    /// True: acknowledge a fault. While true, the parameter net is held at its start.
    #[doc(alias = "Error_RESET")]
    pub error_reset: bool,
    /// True: enable the controller.
    #[doc(alias = "Freigabe")]
    pub enable: bool,
    /// Travel velocity in 1/100 % of v_max; clamped to 1000…10000.
    #[doc(alias = "Geschw")]
    pub velocity: i16,
    /// Velocity while reading the mark in 1/100 % of v_max; clamped to 1000…[`velocity`](Self::velocity).
    #[doc(alias = "Geschw_DM")]
    pub mark_velocity: i16,
    /// Acceleration and deceleration in 1/100 % of a_max; clamped to 1000…10000.
    #[doc(alias = "Beschl_Verz")]
    pub acceleration: i16,
    /// Feed length (tool length) in 1/10 mm; clamped to 2000…20000.
    #[doc(alias = "Strecke")]
    pub distance: i16,
}

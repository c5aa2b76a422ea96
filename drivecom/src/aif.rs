//! The control word the bus module hands to the drive over its automation interface.

use crate::bits::named_bits;

/// AIF-CTRL: what the DRIVECOM machine makes of a control word, every bit **high** active.
///
/// | bit | function | from |
/// |---|---|---|
/// | 3 | QSP, quick stop | state *quick stop active*, or control bit 4 = 0 |
/// | 4 | program start | ¬ control bit 5 |
/// | 5 | program stop | ¬ control bit 6 |
/// | 6 | program reset | control bit 11, moved: AIF bit 11 would reset trips |
/// | 8 | DISABLE, operation inhibit | state *switched on* |
/// | 9 | CINH, controller inhibit | every state but *switched on*, *operation enabled*, *quick stop active* |
/// | 10 | TRIP-SET | never |
/// | 11 | TRIP-RESET | 1 for the one cycle in which control bit 7 rose |
/// | 12–15 | manual, negative, positive, PFI 01 | control bits 12–15 |
///
/// An all-zero control word (master in Clear, or nothing received yet) shows program start **and** stop, because both
/// are inverted. Letting stop dominate is the business of the drive's program control, not of this word.
///
/// Source: 9300 fact sheet, section 2.4 (numbers of the free bits assumed there) and section 9.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[doc(alias = "AIF-CTRL")]
pub struct AifControl(pub u16);

named_bits!(AifControl {
    /// Bit 3: quick stop, the speed is led to 0 along C0105.
    #[doc(alias = "QSP")]
    3 quick_stop with_quick_stop "qsp";
    /// Bit 4: start the positioning program; its rising edge counts.
    4 program_start with_program_start "program-start";
    /// Bit 5: stop and reset the positioning program; dominates the start.
    5 program_stop with_program_stop "program-stop";
    /// Bit 6: reset the positioning program.
    6 program_reset with_program_reset "program-reset";
    /// Bit 8: operation inhibit (C0183 = 112).
    8 disable with_disable "disable";
    /// Bit 9: controller inhibit (C0183 = 125).
    #[doc(alias = "CINH")]
    9 controller_inhibit with_controller_inhibit "cinh";
    /// Bit 10: set a trip.
    10 trip_set with_trip_set "trip-set";
    /// Bit 11: reset a trip; one cycle long, made from the edge of control bit 7.
    11 trip_reset with_trip_reset "trip-reset";
    /// Bit 12: manual (jog) mode.
    12 manual with_manual "manual";
    /// Bit 13: jog in negative direction.
    13 manual_negative with_manual_negative "manual-negative";
    /// Bit 14: jog in positive direction.
    14 manual_positive with_manual_positive "manual-positive";
    /// Bit 15: PFI 01, print-mark mode.
    15 pfi01 with_pfi01 "pfi01";
});

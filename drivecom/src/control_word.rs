//! The DRIVECOM control word, as the 9300 position controller uses it.

use crate::bits::named_bits;

/// Control word, master to drive: 16 bits, every value is legal and kept as it came.
///
/// Accessors are named by the meaning of the bit at **1**. The profile inverts some bits (quick stop, inhibit
/// voltage, the application's start and stop); their names carry a `not_` or are turned round (`enable_voltage`).
///
/// | bits | owner |
/// |---|---|
/// | 0–3, 7 | profile: switch on, enable voltage, not quick stop, enable operation, reset fault |
/// | 4–6 | mode dependent, low active: here quick stop in the drive, program start and stop |
/// | 8–10 | reserved, passed through |
/// | 11–15 | manufacturer: program reset, manual, manual negative and positive, print-mark mode |
///
/// Source: film-feed specification, sections 3 and 7; 9300 fact sheet, section 2.3.
///
/// # Example
///
/// ```
/// use drivecom::ControlWord;
///
/// let word = ControlWord(0x0076).with_switch_on(true);
/// assert_eq!(word, ControlWord(0x0077));
/// assert!(word.enable_voltage() && word.not_quick_stop() && !word.enable_operation());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[doc(alias = "Steuerwort")]
pub struct ControlWord(pub u16);

named_bits!(ControlWord {
    /// Bit 0: switch on.
    #[doc(alias = "Einschalten")]
    0 switch_on with_switch_on "switch-on";
    /// Bit 1: voltage is **not** inhibited; 0 is the command "disable voltage".
    #[doc(alias = "Spannung sperren")]
    #[doc(alias = "Spg_sperren")]
    1 enable_voltage with_enable_voltage "enable-voltage";
    /// Bit 2: **no** quick stop; 0 is the command "quick stop".
    #[doc(alias = "Schnellhalt")]
    2 not_quick_stop with_not_quick_stop "no-quick-stop";
    /// Bit 3: enable operation.
    #[doc(alias = "Betrieb_freigeben")]
    3 enable_operation with_enable_operation "enable-operation";
    /// Bit 4: **no** quick stop in the drive; 0 brakes without leaving *operation enabled*.
    ///
    /// The profile calls it "inhibit ramp generator", low active.
    #[doc(alias = "HLG_sperren")]
    4 not_drive_quick_stop with_not_drive_quick_stop "no-drive-quick-stop";
    /// Bit 5: **no** program start; its falling edge starts the positioning program.
    #[doc(alias = "POS_START")]
    5 not_program_start with_not_program_start "no-program-start";
    /// Bit 6: **no** program stop; 0 interrupts and resets the positioning program.
    #[doc(alias = "POS_STOP")]
    6 not_program_stop with_not_program_stop "no-program-stop";
    /// Bit 7: reset fault; acts with its rising edge.
    #[doc(alias = "Reset_Stoerung")]
    7 reset_fault with_reset_fault "reset-fault";
    /// Bit 11: reset the positioning program.
    #[doc(alias = "POS_RESET")]
    11 program_reset with_program_reset "program-reset";
    /// Bit 12: manual (jog) mode.
    #[doc(alias = "POS_MANUAL")]
    #[doc(alias = "Handfahren")]
    12 manual with_manual "manual";
    /// Bit 13: jog in negative direction.
    #[doc(alias = "POS_MANUAL_NEG")]
    13 manual_negative with_manual_negative "manual-negative";
    /// Bit 14: jog in positive direction.
    #[doc(alias = "POS_MANUAL_POS")]
    14 manual_positive with_manual_positive "manual-positive";
    /// Bit 15: print-mark mode, drives PFI 01.
    #[doc(alias = "Modus_DM")]
    #[doc(alias = "Druckmarke_lesen")]
    15 print_mark_mode with_print_mark_mode "print-mark-mode";
});

impl ControlWord {
    /// All profile bits 0: commands "disable voltage". Bits 4–6 are high, so nothing brakes, starts or stops.
    pub const REST: Self = Self(0x0070);

    /// The bits of the profile's commands: 0–3 and 7.
    pub const COMMAND_BITS: u16 = 0x008F;

    /// This word with the command bits (0–3 and 7) replaced by those of `command`; the others stay.
    #[must_use]
    pub const fn with_command_bits(self, command: Self) -> Self {
        Self((self.0 & !Self::COMMAND_BITS) | (command.0 & Self::COMMAND_BITS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_survives_the_round_trip() {
        for value in 0..=u16::MAX {
            assert_eq!(u16::from(ControlWord::from(value)), value);
        }
    }

    #[test]
    fn bits_sit_where_the_film_feed_specification_section_7_puts_them() {
        let zero = ControlWord(0);
        let expected = [
            (zero.with_switch_on(true), 0x0001),
            (zero.with_enable_voltage(true), 0x0002),
            (zero.with_not_quick_stop(true), 0x0004),
            (zero.with_enable_operation(true), 0x0008),
            (zero.with_not_drive_quick_stop(true), 0x0010),
            (zero.with_not_program_start(true), 0x0020),
            (zero.with_not_program_stop(true), 0x0040),
            (zero.with_reset_fault(true), 0x0080),
            (zero.with_program_reset(true), 0x0800),
            (zero.with_manual(true), 0x1000),
            (zero.with_manual_negative(true), 0x2000),
            (zero.with_manual_positive(true), 0x4000),
            (zero.with_print_mark_mode(true), 0x8000),
        ];
        for (word, value) in expected {
            assert_eq!(word.0, value);
        }
    }

    #[test]
    fn clearing_a_bit_leaves_the_reserved_bits_alone() {
        assert_eq!(ControlWord(0xFFFF).with_switch_on(false), ControlWord(0xFFFE));
        assert_eq!(
            ControlWord(0xFFFF).with_command_bits(ControlWord(0x0006)),
            ControlWord(0xFF76)
        );
    }

    #[test]
    fn the_print_out_shows_hex_and_names() {
        assert_eq!(ControlWord(0x0006).to_string(), "0x0006 enable-voltage no-quick-stop");
        assert_eq!(ControlWord(0x0100).to_string(), "0x0100 bit8");
        assert_eq!(ControlWord(0).to_string(), "0x0000");
    }
}

//! The DRIVECOM status word, as the bus module of the 9300 sends it.

use crate::bits::named_bits;
use crate::state::State;

/// Status word, drive to master: 16 bits, every value is legal and kept as it came.
///
/// Accessors are named by the meaning of the bit at **1**. Bits 4 and 5 mirror low-active commands: 0 says that
/// "disable voltage" or "quick stop" is active.
///
/// Source: film-feed specification, sections 3 and 7; 9300 fact sheet, section 2.1.
///
/// # Example
///
/// ```
/// use drivecom::{State, StatusWord};
///
/// let word = StatusWord(0x0237);
/// assert!(word.operation_enabled() && word.remote() && !word.fault());
/// assert_eq!(word.state(), Some(State::OperationEnabled));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[doc(alias = "Statuswort")]
pub struct StatusWord(pub u16);

named_bits!(StatusWord {
    /// Bit 0: at least *ready to switch on*.
    #[doc(alias = "Einschaltbereit")]
    0 ready_to_switch_on with_ready_to_switch_on "ready-to-switch-on";
    /// Bit 1: at least *switched on*.
    #[doc(alias = "Eingeschaltet")]
    1 switched_on with_switched_on "switched-on";
    /// Bit 2: operation enabled.
    #[doc(alias = "Betrieb_freigegeben")]
    2 operation_enabled with_operation_enabled "operation-enabled";
    /// Bit 3: fault, TRIP in the words of the drive.
    #[doc(alias = "Störung")]
    #[doc(alias = "Stoerung_TRIP")]
    3 fault with_fault "fault";
    /// Bit 4: the command "disable voltage" is **not** active.
    #[doc(alias = "Spannung_gesperrt")]
    4 voltage_not_disabled with_voltage_not_disabled "voltage-not-disabled";
    /// Bit 5: the command "quick stop" is **not** active.
    #[doc(alias = "Schnellhalt")]
    5 not_quick_stop with_not_quick_stop "no-quick-stop";
    /// Bit 6: switch-on inhibited.
    #[doc(alias = "Einschaltsperrung")]
    #[doc(alias = "Einschaltsperre")]
    6 switch_on_inhibited with_switch_on_inhibited "switch-on-inhibited";
    /// Bit 7: warning, the drive keeps running.
    #[doc(alias = "Warnung")]
    7 warning with_warning "warning";
    /// Bit 8: message, pulse inhibit by under- or overvoltage.
    #[doc(alias = "Meldung")]
    8 message with_message "message";
    /// Bit 9: controlled over the bus.
    9 remote with_remote "remote";
    /// Bit 10: set-value reached.
    #[doc(alias = "Sollwert_erreicht")]
    10 set_value_reached with_set_value_reached "set-value-reached";
    /// Bit 11: limit reached.
    #[doc(alias = "Grenzwert")]
    11 limit with_limit "limit";
    /// Bit 12: FAIL-QSP, the drive stops by quick stop because of a disturbance.
    #[doc(alias = "DCTRL_FAIL_QSP")]
    12 fail_qsp with_fail_qsp "fail-qsp";
    /// Bit 14: the positioning program runs.
    #[doc(alias = "RUNNING")]
    14 running with_running "running";
    /// Bit 15: the positioning program has ended **and** the axis is in its target window.
    #[doc(alias = "POS_ENDED_and_POS_IN_TAR")]
    15 ended_in_target with_ended_in_target "ended-in-target";
});

impl StatusWord {
    /// The profile state this word shows, or `None` when its pattern belongs to none. See [`State::decode`].
    #[must_use]
    pub const fn state(self) -> Option<State> {
        State::decode(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_survives_the_round_trip() {
        for value in 0..=u16::MAX {
            assert_eq!(u16::from(StatusWord::from(value)), value);
        }
    }

    #[test]
    fn bits_sit_where_the_9300_facts_2_1_put_them() {
        let zero = StatusWord(0);
        let expected = [
            (zero.with_ready_to_switch_on(true), 0x0001),
            (zero.with_switched_on(true), 0x0002),
            (zero.with_operation_enabled(true), 0x0004),
            (zero.with_fault(true), 0x0008),
            (zero.with_voltage_not_disabled(true), 0x0010),
            (zero.with_not_quick_stop(true), 0x0020),
            (zero.with_switch_on_inhibited(true), 0x0040),
            (zero.with_warning(true), 0x0080),
            (zero.with_message(true), 0x0100),
            (zero.with_remote(true), 0x0200),
            (zero.with_set_value_reached(true), 0x0400),
            (zero.with_limit(true), 0x0800),
            (zero.with_fail_qsp(true), 0x1000),
            (zero.with_running(true), 0x4000),
            (zero.with_ended_in_target(true), 0x8000),
        ];
        for (word, value) in expected {
            assert_eq!(word.0, value);
        }
    }

    #[test]
    fn the_print_out_shows_hex_and_names() {
        assert_eq!(
            StatusWord(0x0231).to_string(),
            "0x0231 ready-to-switch-on voltage-not-disabled no-quick-stop remote"
        );
    }
}

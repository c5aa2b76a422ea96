//! The mode of a master of class 1, and Auto_Clear: whether one failed slave stops them all.
//!
//! ```text
//!            set_mode(Clear)                  set_mode(Operate), Auto_Clear off
//!  Stop ◄──────────────────► Clear ◄──────────────────────────────────────────► Operate
//!                              │                                                  ▲  │
//!              set_mode(Operate), Auto_Clear on         every slave exchanges     │  │ a slave did not exchange
//!                              └────────────► AwaitSlaves ────────────────────────┘  │ within Data_Control_Time
//!                              ▲                  ▲                                  │
//!                              └── StayInClear ───┴── ReturnToOperate ───────────────┘
//! ```
//!
//! Source: IEC 61158-6-3 and EN 50170 part 8-2 (bus parameter Error_Action_Flag, also called Auto_Clear;
//! Data_Control_Time).

use super::control::{ControlCommand, GlobalControl};
use super::master::Mode;

/// What a master does when data cannot be exchanged with one of its slaves in Operate.
#[doc(alias = "Error_Action_Flag")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AutoClear {
    /// Nothing: the others go on.
    #[default]
    Off,
    /// All go to Clear and stay there until Operate is asked for again.
    StayInClear,
    /// All go to Clear and back to Operate by themselves once every slave exchanges data.
    ReturnToOperate,
}

/// Mode asked for and mode in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Operation {
    Stop,
    Clear,
    /// Clear; Operate as soon as every slave exchanges data.
    AwaitSlaves,
    Operate,
}

/// What [`Operation::judge`] found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Judgement {
    Unchanged,
    /// Operate has begun.
    Released,
    /// Operate has ended.
    Cleared,
}

impl Operation {
    /// The mode in force.
    pub(super) const fn mode(self) -> Mode {
        match self {
            Self::Stop => Mode::Stop,
            Self::Clear | Self::AwaitSlaves => Mode::Clear,
            Self::Operate => Mode::Operate,
        }
    }

    /// The mode that was asked for.
    pub(super) const fn requested(self) -> Mode {
        match self {
            Self::AwaitSlaves => Mode::Operate,
            _ => self.mode(),
        }
    }

    /// The user asks for a mode.
    pub(super) const fn request(self, mode: Mode, auto_clear: AutoClear) -> Self {
        match (mode, auto_clear, self) {
            (Mode::Stop, ..) => Self::Stop,
            (Mode::Clear, ..) => Self::Clear,
            (Mode::Operate, AutoClear::Off, _) | (Mode::Operate, _, Self::Operate) => Self::Operate,
            (Mode::Operate, ..) => Self::AwaitSlaves,
        }
    }

    /// Looks at the slaves: `all_exchange` says whether each one that counts exchanged data within Data_Control_Time.
    pub(super) fn judge(&mut self, auto_clear: AutoClear, all_exchange: bool) -> Judgement {
        let (next, judgement) = match (*self, auto_clear, all_exchange) {
            (Self::AwaitSlaves, _, true) => (Self::Operate, Judgement::Released),
            (Self::Operate, AutoClear::StayInClear, false) => (Self::Clear, Judgement::Cleared),
            (Self::Operate, AutoClear::ReturnToOperate, false) => (Self::AwaitSlaves, Judgement::Cleared),
            _ => return Judgement::Unchanged,
        };
        *self = next;
        judgement
    }

    /// The Global_Control that tells the mode to all slaves; none in Stop.
    pub(super) const fn announcement(self) -> Option<GlobalControl> {
        let command = match self.mode() {
            Mode::Stop => return None,
            Mode::Clear => ControlCommand::CLEAR_DATA,
            Mode::Operate => ControlCommand::OPERATE,
        };
        Some(GlobalControl {
            command,
            group_select: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_transition_is_the_one_of_the_figure() {
        use AutoClear::{Off, ReturnToOperate, StayInClear};
        use Operation::{AwaitSlaves, Clear, Operate, Stop};
        for state in [Stop, Clear, AwaitSlaves, Operate] {
            for auto_clear in [Off, StayInClear, ReturnToOperate] {
                assert_eq!(state.request(Mode::Stop, auto_clear), Stop);
                assert_eq!(state.request(Mode::Clear, auto_clear), Clear);
                let operate = state.request(Mode::Operate, auto_clear);
                assert_eq!(operate.requested(), Mode::Operate);
                let at_once = auto_clear == Off || state == Operate;
                assert_eq!(operate == Operate, at_once, "{state:?} {auto_clear:?}");
                for all_exchange in [false, true] {
                    let mut judged = state;
                    judged.judge(auto_clear, all_exchange);
                    let expected = match (state, auto_clear, all_exchange) {
                        (AwaitSlaves, _, true) => Operate,
                        (Operate, StayInClear, false) => Clear,
                        (Operate, ReturnToOperate, false) => AwaitSlaves,
                        _ => state,
                    };
                    assert_eq!(judged, expected);
                }
            }
        }
    }
}

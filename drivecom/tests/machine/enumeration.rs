//! Every command in every state, against a table typed from the fact sheet.

use drivecom::{Command, ControlWord, State, TransitionId};

use crate::{OK, conditions, machine_in, moves};

/// 9300 facts 2.3, second table, read by columns: what a drive without faults does with bits 3 2 1 0.
///
/// Returns the target and the number; the fact sheet's patterns are written out here once more, independently of the
/// crate's tables: `d` = bit 1 is 0, `q` = bits 2 1 are 0 1, `s` = bits 2 1 0 are 1 1 0, `on` = 1 1 1.
fn expected(state: State, low: u16, standstill: bool, edge: bool) -> (State, Option<u8>) {
    let d = low & 2 == 0;
    let q = low & 6 == 2;
    let s = low & 7 == 6;
    let on = low & 7 == 7;
    let enable = low & 8 == 8;
    let stay = (state, None);
    match state {
        State::NotReadyToSwitchOn => (State::SwitchOnDisabled, Some(1)),
        State::SwitchOnDisabled => {
            if s {
                (State::ReadyToSwitchOn, Some(2))
            } else {
                stay
            }
        }
        State::ReadyToSwitchOn => {
            if on {
                (State::SwitchedOn, Some(3))
            } else if q || d {
                (State::SwitchOnDisabled, Some(7))
            } else {
                stay
            }
        }
        State::SwitchedOn => {
            if on && enable {
                (State::OperationEnabled, Some(4))
            } else if s {
                (State::ReadyToSwitchOn, Some(6))
            } else if d || q {
                (State::SwitchOnDisabled, Some(10))
            } else {
                stay
            }
        }
        State::OperationEnabled => {
            if on && !enable {
                (State::SwitchedOn, Some(5))
            } else if s {
                (State::ReadyToSwitchOn, Some(8))
            } else if d {
                (State::SwitchOnDisabled, Some(9))
            } else if q {
                (State::QuickStopActive, Some(11))
            } else {
                stay
            }
        }
        State::QuickStopActive => {
            if standstill || d {
                (State::SwitchOnDisabled, Some(12))
            } else {
                stay
            }
        }
        State::FaultReactionActive => (State::Fault, Some(14)),
        State::Fault => {
            if edge {
                (State::SwitchOnDisabled, Some(15))
            } else {
                stay
            }
        }
    }
}

#[test]
fn every_control_word_in_every_state_does_what_the_fact_sheet_says_and_nothing_else() {
    for state in State::ALL {
        for standstill in [false, true] {
            for previous_bit_7 in [0x0000, 0x0080] {
                // The standing fault is resettable, so that only the command decides.
                let now = conditions(|c| {
                    c.fault = matches!(state, State::FaultReactionActive | State::Fault);
                    c.quick_stop_done = standstill;
                });
                let (template, standing) = machine_in(state);
                let mut prepared = template;
                if previous_bit_7 != 0 {
                    // Raise bit 7 while nothing else can happen: a hindered drive stays where it is.
                    let held = conditions(|c| {
                        c.self_test_done = false;
                        c.fault = now.fault;
                        c.fault_reaction_done = false;
                        c.fault_cause_gone = false;
                    });
                    prepared.step(ControlWord(standing.0 | previous_bit_7), held);
                    assert_eq!(prepared.state(), state);
                }
                for word in 0..=u16::MAX {
                    let edge = previous_bit_7 == 0 && word & 0x80 != 0;
                    let (to, number) = expected(state, word & 0x0F, standstill, edge);
                    let mut machine = prepared;
                    let step = machine.step(ControlWord(word), now);
                    assert_eq!(
                        (step.from, step.to, step.transition),
                        (state, to, number.map(TransitionId::Profile)),
                        "0x{word:04X} in {state}, standstill {standstill}, edge {edge}"
                    );
                }
            }
        }
    }
}

#[test]
fn every_refused_command_leaves_the_state_alone() {
    use Command::{DisableVoltage, EnableOperation, InhibitOperation, QuickStop, ResetFault, Shutdown, SwitchOn};
    // 9300 facts 2.3: for each state the commands that no transition answers. "Enable operation" carries "switch on"
    // with it, and "switch on" without bit 3 is "inhibit operation"; both follow from the patterns.
    let refused: [(State, &[Command]); 6] = [
        (
            State::SwitchOnDisabled,
            &[
                SwitchOn,
                EnableOperation,
                InhibitOperation,
                QuickStop,
                DisableVoltage,
                ResetFault,
            ],
        ),
        (State::ReadyToSwitchOn, &[Shutdown]),
        (State::SwitchedOn, &[SwitchOn, InhibitOperation]),
        (State::OperationEnabled, &[EnableOperation]),
        (
            State::QuickStopActive,
            &[Shutdown, SwitchOn, EnableOperation, InhibitOperation, QuickStop],
        ),
        (
            State::Fault,
            &[
                Shutdown,
                SwitchOn,
                EnableOperation,
                InhibitOperation,
                QuickStop,
                DisableVoltage,
            ],
        ),
    ];
    for (state, commands) in refused {
        for command in commands {
            let now = conditions(|c| c.fault = state == State::Fault);
            moves(state, command.control_word().0, now, (state, None));
        }
    }
}

#[test]
fn reset_fault_outside_fault_changes_nothing_but_what_the_other_bits_say() {
    for state in [
        State::SwitchOnDisabled,
        State::ReadyToSwitchOn,
        State::SwitchedOn,
        State::OperationEnabled,
    ] {
        let (mut machine, standing) = machine_in(state);
        let step = machine.step(ControlWord(standing.0 | 0x0080), OK);
        assert_eq!((step.to, step.transition), (state, None));
        assert!(step.aif.trip_reset(), "the edge still reaches the drive");
    }
}

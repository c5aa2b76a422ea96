//! Behaviour of the drive's machine, grouped by state.
//!
//! Expected values: 9300 fact sheet, sections 2.1 to 2.5 and 11; film-feed specification, sections 3 and 7.

mod behaviour;
mod enumeration;

use drivecom::{Conditions, ControlWord, Machine, State, StatusInputs, TransitionId};

const OK: Conditions = Conditions::HEALTHY;
const REMOTE: StatusInputs = StatusInputs {
    warning: false,
    message: false,
    remote: true,
    set_value_reached: false,
    limit: false,
    fail_qsp: false,
    running: false,
    ended_in_target: false,
};

fn conditions(change: impl FnOnce(&mut Conditions)) -> Conditions {
    let mut conditions = OK;
    change(&mut conditions);
    conditions
}

fn tripped() -> Conditions {
    conditions(|c| {
        c.fault = true;
        c.fault_cause_gone = false;
    })
}

/// A machine walked into `state` by a healthy drive, and the control word standing there.
fn machine_in(state: State) -> (Machine, ControlWord) {
    let walk: &[(u16, Conditions)] = match state {
        State::NotReadyToSwitchOn => &[],
        State::SwitchOnDisabled => &[(0x0070, OK)],
        State::ReadyToSwitchOn => &[(0x0076, OK), (0x0076, OK)],
        State::SwitchedOn => &[(0x0076, OK), (0x0076, OK), (0x0077, OK)],
        State::OperationEnabled => &[(0x0076, OK), (0x0076, OK), (0x007F, OK), (0x007F, OK)],
        State::QuickStopActive => &[(0x0076, OK), (0x0076, OK), (0x007F, OK), (0x007F, OK), (0x007B, OK)],
        State::FaultReactionActive => &[(0x0070, tripped())],
        State::Fault => &[(0x0070, tripped()), (0x0070, tripped())],
    };
    let mut machine = Machine::new();
    for (control, conditions) in walk {
        machine.step(ControlWord(*control), *conditions);
    }
    assert_eq!(machine.state(), state, "the constructor must arrive");
    (machine, machine.control_word())
}

fn moves(from: State, control: u16, conditions: Conditions, expected: (State, Option<u8>)) {
    let (mut machine, _) = machine_in(from);
    let step = machine.step(ControlWord(control), conditions);
    let number = expected.1.map(TransitionId::Profile);
    assert_eq!(
        (step.from, step.to, step.transition),
        (from, expected.0, number),
        "0x{control:04X} in {from}"
    );
    assert_eq!(machine.state(), expected.0);
}

//! The master's sequencer, composed with the drive's machine.

use drivecom::{Conditions, ControlWord, Machine, Progress, Sequencer, State, StatusInputs, StatusWord, Target};

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

const TARGETS: [Target; 4] = [Target::Off, Target::Ready, Target::SwitchedOn, Target::OperationEnabled];

/// Master and drive with one cycle of dead time for the status word.
struct Pair {
    master: Sequencer,
    drive: Machine,
    status: StatusWord,
    conditions: Conditions,
}

impl Pair {
    fn new() -> Self {
        Self {
            master: Sequencer::new(),
            drive: Machine::new(),
            status: StatusWord(0),
            conditions: Conditions::HEALTHY,
        }
    }

    fn cycle(&mut self, target: Target) -> ControlWord {
        let control = self.master.step(target, self.status);
        let step = self.drive.step(control, self.conditions);
        // The drive clears its trip when the reset edge comes and the cause has gone.
        if step.aif.trip_reset() && self.conditions.fault_cause_gone {
            self.conditions.fault = false;
        }
        self.status = self.drive.status_word(REMOTE);
        control
    }

    fn run(&mut self, target: Target, cycles: usize) -> State {
        for _ in 0..cycles {
            self.cycle(target);
        }
        self.drive.state()
    }

    fn trip(&mut self) {
        self.conditions.fault = true;
        self.conditions.fault_cause_gone = false;
    }
}

#[test]
fn every_target_is_reached_from_every_other_and_held() {
    for from in TARGETS {
        for to in TARGETS {
            let mut pair = Pair::new();
            assert_eq!(pair.run(from, 8), from.state());
            assert_eq!(pair.run(to, 8), to.state(), "{from:?} to {to:?}");
            assert_eq!(pair.master.progress(), Progress::Reached);
            assert_eq!(pair.run(to, 50), to.state());
        }
    }
}

#[test]
fn the_words_on_the_way_up_are_those_of_the_film_feed_block() {
    // 9300 facts 11: control words 0x0076 → 0x0077 → 0x007F.
    let mut pair = Pair::new();
    let mut words: Vec<u16> = (0..8).map(|_| pair.cycle(Target::OperationEnabled).0).collect();
    words.dedup();
    assert_eq!(words, [0x0076, 0x0077, 0x007F]);
}

#[test]
fn a_fault_is_reset_only_on_request() {
    let mut pair = Pair::new();
    pair.run(Target::OperationEnabled, 8);
    pair.trip();
    assert_eq!(pair.run(Target::OperationEnabled, 20), State::Fault);
    assert_eq!(pair.master.progress(), Progress::Faulted);
    pair.conditions.fault_cause_gone = true;
    assert_eq!(pair.run(Target::OperationEnabled, 20), State::Fault);
    pair.master.request_fault_reset();
    assert_eq!(pair.run(Target::OperationEnabled, 10), State::OperationEnabled);
    assert!(!pair.master.is_resetting());
    assert!(!pair.cycle(Target::OperationEnabled).reset_fault());
}

#[test]
fn a_reset_that_did_not_help_ends_and_a_second_one_makes_a_new_edge() {
    let mut pair = Pair::new();
    pair.master.set_reset_hold(3);
    pair.run(Target::Ready, 5);
    pair.trip();
    pair.run(Target::Ready, 5);
    pair.master.request_fault_reset();
    let bits =
        |pair: &mut Pair, n: usize| -> Vec<bool> { (0..n).map(|_| pair.cycle(Target::Ready).reset_fault()).collect() };
    assert_eq!(bits(&mut pair, 6), [false, true, true, true, false, false]);
    assert_eq!(pair.drive.state(), State::Fault);
    // Asked again while the bit is still high: it goes low first.
    pair.master.request_fault_reset();
    assert_eq!(bits(&mut pair, 2), [false, true]);
    assert!(pair.master.is_resetting());
    pair.master.request_fault_reset();
    pair.conditions.fault_cause_gone = true;
    assert_eq!(bits(&mut pair, 2), [false, true]);
    assert_eq!(pair.drive.state(), State::SwitchOnDisabled);
}

#[test]
fn a_reset_asked_for_during_the_fault_reaction_waits_for_fault() {
    let mut pair = Pair::new();
    pair.run(Target::OperationEnabled, 8);
    pair.conditions.fault = true;
    pair.conditions.fault_reaction_done = false;
    pair.run(Target::OperationEnabled, 3);
    pair.master.request_fault_reset();
    for _ in 0..5 {
        assert!(!pair.cycle(Target::OperationEnabled).reset_fault());
    }
    pair.conditions.fault_reaction_done = true;
    assert_eq!(pair.run(Target::OperationEnabled, 10), State::OperationEnabled);
}

#[test]
fn a_reset_without_a_fault_does_nothing() {
    let mut pair = Pair::new();
    pair.run(Target::OperationEnabled, 8);
    pair.master.request_fault_reset();
    assert!(!pair.cycle(Target::OperationEnabled).reset_fault());
    assert!(!pair.master.is_resetting());
    assert_eq!(pair.drive.state(), State::OperationEnabled);
}

#[test]
fn a_quick_stop_from_elsewhere_is_left_to_end_and_the_target_sought_again() {
    let mut pair = Pair::new();
    pair.run(Target::OperationEnabled, 8);
    pair.drive.step(ControlWord(0x007B), pair.conditions);
    pair.status = pair.drive.status_word(REMOTE);
    assert_eq!(pair.run(Target::OperationEnabled, 5), State::QuickStopActive);
    pair.conditions.quick_stop_done = true;
    assert_eq!(pair.run(Target::OperationEnabled, 8), State::OperationEnabled);
}

#[test]
fn application_bits_pass_and_command_bits_do_not() {
    let mut sequencer = Sequencer::new();
    sequencer.set_application(ControlWord(0xFFFF));
    assert_eq!(sequencer.step(Target::Off, StatusWord(0x0240)), ControlWord(0xFF70));
    sequencer.set_application(ControlWord(0x0000));
    assert_eq!(
        sequencer.step(Target::OperationEnabled, StatusWord(0x0237)),
        ControlWord(0x000F)
    );
}

#[test]
fn progress_tells_why_nothing_moves() {
    let mut sequencer = Sequencer::new();
    let mut progress = |status| {
        sequencer.step(Target::OperationEnabled, StatusWord(status));
        sequencer.progress()
    };
    assert_eq!(progress(0x0237), Progress::Reached);
    assert_eq!(progress(0x0233), Progress::Moving);
    assert_eq!(progress(0x0037), Progress::NotRemote);
    assert_eq!(progress(0x0208), Progress::Faulted);
    assert_eq!(progress(0x0205), Progress::UnknownState);
}

#[test]
fn switched_on_is_reached_from_above_without_going_lower() {
    // "Inhibit operation" leads there at once (transition 5, 9300 facts 2.3); "shutdown" would go one state lower.
    let mut pair = Pair::new();
    pair.run(Target::OperationEnabled, 8);
    for _ in 0..8 {
        pair.cycle(Target::SwitchedOn);
        assert_ne!(pair.drive.state(), State::ReadyToSwitchOn);
    }
    assert_eq!(pair.drive.state(), State::SwitchedOn);
}

#[test]
fn a_quick_stop_under_way_is_commanded_on() {
    // Bit 2 stays low (9300 facts 2.3): the status word shows the ramp as commanded until it has ended.
    let mut sequencer = Sequencer::new();
    for target in [Target::Ready, Target::SwitchedOn, Target::OperationEnabled] {
        let word = sequencer.step(target, StatusWord(0x0217));
        assert_eq!(StatusWord(0x0217).state(), Some(State::QuickStopActive));
        assert!(word.enable_voltage() && !word.not_quick_stop(), "{target:?}: {word:?}");
    }
}

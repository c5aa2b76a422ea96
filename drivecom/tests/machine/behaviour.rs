//! Each transition by name, then edges, words, sequences and the drive's own moves.

use drivecom::{AifControl, ControlWord, DriveMove, Machine, State, StatusInputs, StatusWord, TransitionId};

use crate::{OK, REMOTE, conditions, machine_in, moves, tripped};

// ---- the sixteen transitions ----

#[test]
fn transition_0_power_on_starts_in_not_ready() {
    assert_eq!(Machine::new().state(), State::NotReadyToSwitchOn);
    assert_eq!(Machine::default(), Machine::new());
}

#[test]
fn transition_1_the_self_test_ends_in_switch_on_disabled_whatever_is_commanded() {
    for control in [0x0000, 0x0076, 0x007F, 0x00FF] {
        moves(
            State::NotReadyToSwitchOn,
            control,
            OK,
            (State::SwitchOnDisabled, Some(1)),
        );
        let testing = conditions(|c| c.self_test_done = false);
        moves(
            State::NotReadyToSwitchOn,
            control,
            testing,
            (State::NotReadyToSwitchOn, None),
        );
    }
}

#[test]
fn transition_2_shutdown_makes_ready() {
    moves(State::SwitchOnDisabled, 0x0006, OK, (State::ReadyToSwitchOn, Some(2)));
}

#[test]
fn transition_3_switch_on() {
    moves(State::ReadyToSwitchOn, 0x0007, OK, (State::SwitchedOn, Some(3)));
}

#[test]
fn transition_4_enable_operation() {
    moves(State::SwitchedOn, 0x000F, OK, (State::OperationEnabled, Some(4)));
}

#[test]
fn transition_5_inhibit_operation() {
    moves(State::OperationEnabled, 0x0007, OK, (State::SwitchedOn, Some(5)));
}

#[test]
fn transition_6_shutdown_from_switched_on() {
    moves(State::SwitchedOn, 0x0006, OK, (State::ReadyToSwitchOn, Some(6)));
}

#[test]
fn transition_7_quick_stop_or_disable_voltage_from_ready() {
    moves(State::ReadyToSwitchOn, 0x0002, OK, (State::SwitchOnDisabled, Some(7)));
    moves(State::ReadyToSwitchOn, 0x0004, OK, (State::SwitchOnDisabled, Some(7)));
}

#[test]
fn transition_8_shutdown_from_operation_enabled() {
    moves(State::OperationEnabled, 0x000E, OK, (State::ReadyToSwitchOn, Some(8)));
}

#[test]
fn transition_9_disable_voltage_from_operation_enabled() {
    moves(State::OperationEnabled, 0x000D, OK, (State::SwitchOnDisabled, Some(9)));
}

#[test]
fn transition_10_disable_voltage_or_quick_stop_from_switched_on() {
    moves(State::SwitchedOn, 0x0005, OK, (State::SwitchOnDisabled, Some(10)));
    moves(State::SwitchedOn, 0x0003, OK, (State::SwitchOnDisabled, Some(10)));
}

#[test]
fn transition_11_quick_stop_from_operation_enabled() {
    moves(State::OperationEnabled, 0x000B, OK, (State::QuickStopActive, Some(11)));
}

#[test]
fn transition_12_standstill_or_disable_voltage_ends_the_quick_stop() {
    let standing = conditions(|c| c.quick_stop_done = true);
    moves(
        State::QuickStopActive,
        0x000B,
        standing,
        (State::SwitchOnDisabled, Some(12)),
    );
    moves(State::QuickStopActive, 0x0009, OK, (State::SwitchOnDisabled, Some(12)));
}

#[test]
fn transition_13_a_fault_is_answered_in_every_state_below_it() {
    for state in State::ALL {
        match state {
            State::FaultReactionActive | State::Fault => {}
            _ => moves(state, 0x000F, tripped(), (State::FaultReactionActive, Some(13))),
        }
    }
}

#[test]
fn transition_14_the_finished_reaction_ends_in_fault() {
    moves(State::FaultReactionActive, 0x000F, tripped(), (State::Fault, Some(14)));
    let ramping = conditions(|c| {
        c.fault = true;
        c.fault_reaction_done = false;
    });
    moves(
        State::FaultReactionActive,
        0x00FF,
        ramping,
        (State::FaultReactionActive, None),
    );
}

#[test]
fn transition_15_reset_fault_with_the_cause_gone() {
    let resettable = conditions(|c| c.fault = true);
    moves(State::Fault, 0x0080, resettable, (State::SwitchOnDisabled, Some(15)));
}

// ---- edges of the fault reset ----

#[test]
fn a_standing_bit_7_resets_nothing() {
    let mut machine = Machine::new();
    machine.step(ControlWord(0x0080), tripped());
    machine.step(ControlWord(0x0080), tripped());
    assert_eq!(machine.state(), State::Fault);
    let resettable = conditions(|c| c.fault = true);
    for _ in 0..3 {
        assert_eq!(machine.step(ControlWord(0x0080), resettable).to, State::Fault);
    }
}

#[test]
fn a_second_fault_reset_needs_a_new_rising_edge() {
    let (mut machine, _) = machine_in(State::Fault);
    let resettable = conditions(|c| c.fault = true);
    assert_eq!(
        machine.step(ControlWord(0x0080), tripped()).to,
        State::Fault,
        "cause present: the edge is used up"
    );
    assert_eq!(machine.step(ControlWord(0x0080), resettable).to, State::Fault);
    assert_eq!(machine.step(ControlWord(0x0000), resettable).to, State::Fault);
    assert_eq!(
        machine.step(ControlWord(0x0080), resettable).to,
        State::SwitchOnDisabled
    );
}

#[test]
fn with_the_cause_still_present_the_drive_falls_back_to_fault() {
    let (mut machine, _) = machine_in(State::Fault);
    // The module lets the reset through; the drive finds its cause again and keeps the trip.
    assert_eq!(
        machine.step(ControlWord(0x0080), conditions(|c| c.fault = true)).to,
        State::SwitchOnDisabled
    );
    assert_eq!(
        machine.step(ControlWord(0x0080), tripped()).to,
        State::FaultReactionActive
    );
    assert_eq!(machine.step(ControlWord(0x0080), tripped()).to, State::Fault);
    assert_eq!(machine.step(ControlWord(0x0080), tripped()).to, State::Fault);
}

#[test]
fn the_trip_reset_to_the_drive_is_one_cycle_long() {
    let (mut machine, _) = machine_in(State::Fault);
    let pulses: Vec<bool> = [0x00F6, 0x00F6, 0x0076, 0x00F6]
        .into_iter()
        .map(|word| machine.step(ControlWord(word), tripped()).aif.trip_reset())
        .collect();
    assert_eq!(pulses, [true, false, false, true]);
}

#[test]
fn a_trip_reset_by_another_way_leaves_fault_without_a_command() {
    let (mut machine, standing) = machine_in(State::Fault);
    let step = machine.step(standing, OK);
    assert_eq!(
        (step.to, step.transition),
        (State::SwitchOnDisabled, Some(TransitionId::Drive(DriveMove::TripGone)))
    );
}

// ---- status words ----

#[test]
fn the_status_words_of_the_fact_sheet_come_out() {
    for (state, word) in [
        (State::ReadyToSwitchOn, 0x0231),
        (State::SwitchedOn, 0x0233),
        (State::OperationEnabled, 0x0237),
    ] {
        assert_eq!(machine_in(state).0.status_word(REMOTE), StatusWord(word), "{state}");
    }
}

#[test]
fn every_status_word_decodes_to_the_state_it_was_made_from_after_any_control_word() {
    for state in State::ALL {
        let (template, _) = machine_in(state);
        for word in 0..=0xFF_u16 {
            for conditions in [OK, tripped()] {
                let mut machine = template;
                machine.step(ControlWord(word), conditions);
                assert_eq!(
                    machine.status_word(REMOTE).state(),
                    Some(machine.state()),
                    "0x{word:04X} from {state}"
                );
            }
        }
    }
}

#[test]
fn bits_4_and_5_are_0_while_their_command_is_active() {
    // 9300 facts 2.1, rows 4 and 5.
    let (mut machine, _) = machine_in(State::SwitchOnDisabled);
    let mut bits = |word| {
        machine.step(ControlWord(word), OK);
        let status = machine.status_word(REMOTE);
        (status.voltage_not_disabled(), status.not_quick_stop())
    };
    assert_eq!(bits(0x0000), (false, false));
    assert_eq!(bits(0x0002), (true, false));
    assert_eq!(bits(0x0004), (false, true));
    assert_eq!(bits(0x0007), (true, true));
}

#[test]
fn a_quick_stop_under_way_shows_0_in_bit_5_even_when_the_command_is_taken_back() {
    let (mut machine, _) = machine_in(State::QuickStopActive);
    assert_eq!(machine.status_word(REMOTE), StatusWord(0x0217));
    machine.step(ControlWord(0x007F), OK);
    assert_eq!(machine.status_word(REMOTE), StatusWord(0x0217));
}

#[test]
fn inputs_of_the_status_word_sit_at_their_bits() {
    let (machine, _) = machine_in(State::OperationEnabled);
    let base = machine.status_word(StatusInputs::default()).0;
    assert_eq!(base, 0x0037);
    type Set = fn(&mut StatusInputs);
    let table: [(Set, u16); 8] = [
        (|i| i.warning = true, 0x0080),
        (|i| i.message = true, 0x0100),
        (|i| i.remote = true, 0x0200),
        (|i| i.set_value_reached = true, 0x0400),
        (|i| i.limit = true, 0x0800),
        (|i| i.fail_qsp = true, 0x1000),
        (|i| i.running = true, 0x4000),
        (|i| i.ended_in_target = true, 0x8000),
    ];
    for (set, bit) in table {
        let mut inputs = StatusInputs::default();
        set(&mut inputs);
        assert_eq!(machine.status_word(inputs), StatusWord(base | bit));
    }
}

// ---- sequences ----

#[test]
fn the_block_of_the_film_feed_walks_to_operation_enabled() {
    let (mut machine, _) = machine_in(State::SwitchOnDisabled);
    let mut step = |word| machine.step(ControlWord(word), OK).to;
    // Without release first: 0x0076 ready, 0x0077 switched on, and there it rests.
    assert_eq!(step(0x0076), State::ReadyToSwitchOn);
    assert_eq!(step(0x0077), State::SwitchedOn);
    assert_eq!(step(0x0077), State::SwitchedOn);
    // Release: one more cycle.
    assert_eq!(step(0x007F), State::OperationEnabled);
}

#[test]
fn switch_on_with_bit_3_passes_on_in_the_next_cycle() {
    let (mut machine, _) = machine_in(State::SwitchOnDisabled);
    let mut step = |word| machine.step(ControlWord(word), OK).to;
    assert_eq!(step(0x007E), State::ReadyToSwitchOn);
    assert_eq!(step(0x007F), State::SwitchedOn);
    assert_eq!(step(0x007F), State::OperationEnabled);
    assert_eq!(step(0x007F), State::OperationEnabled);
}

// ---- terminal 28 ----

#[test]
fn terminal_28_low_drops_to_switched_on_and_the_standing_word_takes_up_again() {
    let (mut machine, standing) = machine_in(State::OperationEnabled);
    let low = conditions(|c| c.release = false);
    let step = machine.step(standing, low);
    assert_eq!(
        (step.to, step.transition),
        (State::SwitchedOn, Some(TransitionId::Drive(DriveMove::TerminalLow)))
    );
    for _ in 0..3 {
        assert_eq!(machine.step(standing, low).to, State::SwitchedOn, "no higher while low");
    }
    assert_eq!(machine.step(standing, OK).to, State::OperationEnabled);
}

#[test]
fn terminal_28_low_stops_at_switched_on_on_the_way_up_and_lets_every_way_down_pass() {
    let low = conditions(|c| c.release = false);
    let (mut machine, _) = machine_in(State::SwitchOnDisabled);
    let mut step = |word| machine.step(ControlWord(word), low).to;
    assert_eq!(step(0x0076), State::ReadyToSwitchOn);
    assert_eq!(step(0x007F), State::SwitchedOn);
    assert_eq!(step(0x007F), State::SwitchedOn);
    assert_eq!(step(0x0076), State::ReadyToSwitchOn);
    assert_eq!(step(0x0070), State::SwitchOnDisabled);
}

#[test]
fn hardware_acts_before_commands() {
    let low = conditions(|c| c.release = false);
    let (mut machine, _) = machine_in(State::OperationEnabled);
    // A quick stop needs the power stage that terminal 28 has just taken away.
    assert_eq!(machine.step(ControlWord(0x007B), low).to, State::SwitchedOn);
    assert_eq!(machine.status_word(REMOTE).state(), Some(State::SwitchedOn));
    assert_eq!(machine.step(ControlWord(0x007B), low).to, State::SwitchOnDisabled);
}

// ---- LU ----

#[test]
fn undervoltage_reports_switch_on_disabled_and_holds_it() {
    let dark = conditions(|c| c.power_ok = false);
    for state in [
        State::ReadyToSwitchOn,
        State::SwitchedOn,
        State::OperationEnabled,
        State::QuickStopActive,
    ] {
        let (mut machine, standing) = machine_in(state);
        let step = machine.step(standing, dark);
        assert_eq!(
            (step.to, step.transition),
            (
                State::SwitchOnDisabled,
                Some(TransitionId::Drive(DriveMove::Undervoltage))
            ),
            "{state}"
        );
        assert_eq!(machine.step(ControlWord(0x0076), dark).to, State::SwitchOnDisabled);
        assert_eq!(machine.step(ControlWord(0x0076), OK).to, State::ReadyToSwitchOn);
    }
}

#[test]
fn a_trip_outranks_the_undervoltage_message() {
    // 9300 facts 2.5, priority: TRIP before message.
    let dark_trip = conditions(|c| {
        c.power_ok = false;
        c.fault = true;
    });
    let (mut machine, standing) = machine_in(State::OperationEnabled);
    assert_eq!(machine.step(standing, dark_trip).to, State::FaultReactionActive);
    assert_eq!(machine.step(standing, dark_trip).to, State::Fault);
    assert_eq!(machine.step(ControlWord(0x00FF), dark_trip).to, State::SwitchOnDisabled);
}

// ---- commands to the drive ----

#[test]
fn qsp_disable_and_cinh_follow_the_state() {
    // 9300 facts 2.4; control bits 4, 5, 6 = 1 so that nothing else is set.
    let table = [
        (State::SwitchOnDisabled, 0x0200),
        (State::ReadyToSwitchOn, 0x0200),
        (State::SwitchedOn, 0x0100),
        (State::OperationEnabled, 0x0000),
        (State::QuickStopActive, 0x0008),
        (State::FaultReactionActive, 0x0200),
        (State::Fault, 0x0200),
    ];
    for (state, aif) in table {
        let (mut machine, standing) = machine_in(state);
        let held = conditions(|c| {
            c.fault = matches!(state, State::FaultReactionActive | State::Fault);
            c.fault_reaction_done = false;
        });
        let step = machine.step(standing, held);
        assert_eq!((step.to, step.aif), (state, AifControl(aif)), "{state}");
    }
}

#[test]
fn control_bit_4_brakes_without_leaving_operation_enabled() {
    let (mut machine, standing) = machine_in(State::OperationEnabled);
    let step = machine.step(standing.with_not_drive_quick_stop(false), OK);
    assert_eq!((step.to, step.aif), (State::OperationEnabled, AifControl(0x0008)));
}

#[test]
fn start_and_stop_are_inverted_and_the_upper_bits_pass_through() {
    let (mut machine, _) = machine_in(State::OperationEnabled);
    let mut aif = |word: u16| machine.step(ControlWord(word), OK).aif;
    assert_eq!(aif(0x005F), AifControl(0x0010), "bit 5 = 0 starts");
    assert_eq!(aif(0x003F), AifControl(0x0020), "bit 6 = 0 stops");
    assert_eq!(
        aif(0x087F),
        AifControl(0x0040),
        "bit 11 resets the program, not the trip"
    );
    assert_eq!(aif(0x107F), AifControl(0x1000));
    assert_eq!(aif(0x207F), AifControl(0x2000));
    assert_eq!(aif(0x407F), AifControl(0x4000));
    assert_eq!(aif(0x807F), AifControl(0x8000));
}

#[test]
fn an_all_zero_control_word_shows_start_and_stop_together() {
    // 9300 facts 9.1: a master in Clear; stop must dominate in the drive.
    let (mut machine, _) = machine_in(State::OperationEnabled);
    let step = machine.step(ControlWord(0), OK);
    assert_eq!(step.to, State::SwitchOnDisabled);
    assert!(step.aif.program_start() && step.aif.program_stop() && step.aif.controller_inhibit());
}

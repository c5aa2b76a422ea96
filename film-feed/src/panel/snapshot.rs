//! What the page sees, read off the rig.

use std::f64::consts::TAU;
use std::sync::PoisonError;

use dp_master::dp::SlaveState;
use drivecom::petri::{PARAMETER_TRANSITIONS, Puts};
use drivecom::{CommandSet, ControlWord, Hold, ResetEdge, State, Transition};
use lenze9300_model::access::CodePlace;
use lenze9300_model::code::CODE_TABLE;
use lenze9300_model::device::Fault;
use lenze9300_model::plant::ShaftAngle;
use lenze9300_model::signal::Signal;
use lenze9300_model::units::INC_PER_REV;

use super::inputs::input_values;
use super::protocol::{
    AdviceView, BusView, DriveView, FaultView, Frame, Hello, INPUTS, MachineView, NetRow, OutputView, ParameterView,
    TransitionInfo,
};
use super::simulated::Plant;
use crate::advise::{Demands, Severity, advise};
use crate::block::{FilmFeedBlock, Outputs};
use crate::operator::FeedPlan;
use crate::parameter_watch::ParameterWatch;
use crate::report::{FeedMode, TOLERANCE_MM};

/// How far before and behind the reader the page shows the film, mm.
const SHOWN_MM: f64 = 1300.0;

pub(super) fn hello() -> Hello {
    Hello {
        version: env!("CARGO_PKG_VERSION"),
        is_real: false,
        inputs: INPUTS.to_vec(),
        signals: Signal::ALL
            .iter()
            .map(|signal| [signal.name(), signal.unit(), signal.meaning()])
            .collect(),
        tolerance_mm: TOLERANCE_MM,
        faults: Fault::ALL.iter().map(|fault| fault.display()).collect(),
        states: State::ALL.iter().map(|state| state.name()).collect(),
        codes: CODE_TABLE
            .iter()
            .map(|entry| {
                let place = CodePlace::new(entry.number, entry.first_subcode);
                [place.to_string(), entry.unit.to_owned(), entry.name.to_owned()]
            })
            .collect(),
        transitions: drivecom::TRANSITIONS
            .iter()
            .chain(&drivecom::DRIVE_MOVES)
            .map(|transition: &Transition| TransitionInfo {
                id: transition.id.to_string(),
                from: transition.from.iter().map(State::name).collect(),
                to: transition.to.name(),
                trigger: transition.trigger.to_string(),
                held: transition.hold.map(|hold| match hold {
                    Hold::Undervoltage => "undervoltage (LU)",
                    Hold::TerminalLow => "terminal 28 is low",
                    Hold::CausePresent => "the cause of the fault is still there",
                }),
            })
            .collect(),
        net: PARAMETER_TRANSITIONS
            .iter()
            .map(|transition| NetRow {
                n: transition.number,
                takes: transition.takes.iter().collect(),
                puts: match transition.puts {
                    Puts::Places(places) => places.iter().collect(),
                    Puts::Choice { then, otherwise, .. } => then.iter().chain(otherwise.iter()).collect(),
                },
            })
            .collect(),
    }
}

pub(super) fn frame(plant: &mut Plant, seq: u64) -> Frame {
    let samples = plant.recorder.take();
    let feeds = plant.recorder.judge.take();
    let inputs = input_values(plant.rig.inputs_mut());
    let advice = advice(plant);
    let rig = &plant.rig;
    let mut film = rig.film().clone();
    let sample = *rig.drive().axis().sample();
    let mm_per_rad = film.mm_per_increment() * INC_PER_REV as f64 / TAU;
    let turns = sample.angle.offset_from(ShaftAngle::default()) / INC_PER_REV as f64;
    let outputs = rig.outputs();
    let machine = MachineView {
        film_mm: film.position_mm(),
        roller_rad: turns / 7.0 * TAU,
        speed_mm_s: sample.omega_true * mm_per_rad,
        marks: film.marks_near(SHOWN_MM, SHOWN_MM),
        reader: film.reader_level(),
        feeds,
    };
    let mut heard = plant.heard.lock().unwrap_or_else(PoisonError::into_inner);
    let statistics = rig.master().statistics();
    Frame {
        seq,
        time_s: rig.now_ns() as f64 / 1e9,
        factor: plant.factor,
        samples,
        machine,
        inputs,
        outputs: output_view(outputs),
        drive: drive(plant),
        parameters: parameter_view(rig.block(), rig.parameter_watch(), plant.rounds.last_ms),
        bus: BusView {
            baud: rig.line().baud().bits_per_second(),
            slave: slave_name(rig.slave_state()),
            cycle_us: statistics.mean_cycle.as_nanos() as f64 / 1000.0,
            telegrams: statistics.sent + statistics.received,
            retries: statistics.retries,
            plugged: plant.plugged,
            bit_error_rate: plant.bit_error_rate,
            second_master: rig.has_second_master(),
            asking: plant.stations.are_asked(),
            stations: plant.stations.found(),
            heard: heard.drain(..).collect(),
        },
        advice,
    }
}

/// What goes wrong with the present inputs.
fn advice(plant: &mut Plant) -> Vec<AdviceView> {
    let inputs = *plant.rig.inputs_mut();
    let mode = if inputs.read_mark {
        FeedMode::Mark
    } else {
        FeedMode::Length
    };
    let plan = FeedPlan {
        series: vec![(mode, 1)],
        length_tenth_mm: inputs.distance,
        speed_hundredth_percent: inputs.velocity,
        mark_speed_hundredth_percent: inputs.mark_velocity,
        accel_hundredth_percent: inputs.acceleration,
        ..FeedPlan::default()
    };
    advise(&plant.config, &plan, &Demands::default())
        .findings
        .into_iter()
        .map(|finding| AdviceView {
            id: finding.id,
            fails: finding.severity == Severity::Fails,
            cause: finding.cause,
            remedy: finding.remedy,
        })
        .collect()
}

/// Commands that the levels of a control word give.
pub(super) fn commands(control: ControlWord) -> Vec<&'static str> {
    let given = CommandSet::decode(control, ResetEdge::None);
    given.iter().map(drivecom::Command::name).collect()
}

fn drive(plant: &Plant) -> DriveView {
    let (drive, module) = (plant.rig.drive(), plant.rig.module());
    let sample = drive.axis().sample();
    let view = |number: u16, fault: Fault| FaultView {
        number,
        name: fault.display(),
        cause: fault.cause(),
        remedy: fault.remedy(),
    };
    let number = drive.shown_fault();
    DriveView {
        state: module.state().name(),
        control_word: module.control_word().0,
        commands: commands(module.control_word()),
        status_word: module.status_word().0,
        diagnosis: Some(drive.diagnosis()),
        fault: Fault::from_lecom_number(number)
            .filter(|_| number != 0)
            .map(|(fault, _)| view(number, fault)),
        history: drive
            .fault_memory()
            .entries()
            .map(|entry| view(entry.lecom_number(), entry.fault))
            .collect(),
        record: Some(drive.traverse_status().record),
        dc_link_v: Some(sample.u_dc),
        current_a: Some(sample.current_rms()),
        heat_sink_c: Some(drive.heat_sink_c()),
        terminal_28: Some(drive.terminals().x5_28),
    }
}

pub(super) fn output_view(outputs: &Outputs) -> OutputView {
    OutputView {
        switched_on: outputs.switched_on,
        drive_ready: outputs.drive_ready,
        error: outputs.error,
        running: outputs.running,
        job_finished: outputs.job_finished,
        speed_percent: f64::from(outputs.speed_percent),
        position_mm: Some(f64::from(outputs.position_mm)).filter(|mm| mm.is_finite()),
    }
}

pub(super) fn parameter_view(block: &FilmFeedBlock, watch: &ParameterWatch, round_ms: f64) -> ParameterView {
    let hex = |octets: [u8; 8]| dp_master::wire::Hex(&octets).to_string();
    ParameterView {
        marked: block.marking().places().iter().collect(),
        telegram: block.telegram_counter(),
        sent: hex(block.parameter_sent().to_bytes()),
        received: hex(block.parameter_received().to_bytes()),
        rounds: watch.rounds(),
        round_ms,
        troubles: watch
            .troubles()
            .iter()
            .map(|trouble| format!("{}: {}", trouble.code, trouble.what))
            .collect(),
    }
}

pub(super) fn slave_name(state: SlaveState) -> String {
    match state {
        SlaveState::DataExchange => "data exchange".to_owned(),
        other => format!("{other:?}").to_lowercase(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn german_has_every_text_that_the_program_sends() {
        let german = include_str!("assets/german.js");
        let hello = hello();
        let mut texts: Vec<String> = hello.states.iter().map(|name| (*name).to_owned()).collect();
        for transition in &hello.transitions {
            texts.extend(transition.trigger.split(" | ").map(str::to_owned));
            texts.extend(transition.held.map(str::to_owned));
            if transition.id.parse::<u8>().is_err() {
                texts.push(transition.id.clone());
            }
        }
        texts.extend(hello.signals.iter().map(|[_, _, meaning]| (*meaning).to_owned()));
        for fault in Fault::ALL {
            texts.extend([fault.cause().to_owned(), fault.remedy().to_owned()]);
        }
        let slave_states = [
            SlaveState::Offline,
            SlaveState::WaitPrm,
            SlaveState::WaitCfg,
            SlaveState::WaitReady,
            SlaveState::DataExchange,
            SlaveState::Refused,
        ];
        texts.extend(slave_states.map(slave_name));
        let missing: Vec<_> = texts
            .iter()
            .filter(|text| !german.contains(&format!("\"{text}\": \"")))
            .collect();
        assert!(missing.is_empty(), "{missing:#?}");
        assert!(!german.contains("\"no such text\": \""));
    }
}

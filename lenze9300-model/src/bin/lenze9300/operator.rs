//! What an operator at the drive can do: terminals, mains, load, faults. One order a line on standard input.
//!
//! | order | does |
//! |---|---|
//! | `28 on`, `28 off` | terminal X5/28, the controller enable |
//! | `e1 on` … `e5 off` | digital inputs; E2 to E5 are the program inputs 02 to 05 |
//! | `mains on`, `mains off` | mains; the bus module lives on 24 V |
//! | `load 0.3` | torque against the motor, Nm |
//! | `fault OC2 on`, `fault OC2 off` | the cause of a fault |
//! | `override 50` | velocities, 0 to 100 % |
//! | `cancel` | end the record being worked off |
//! | `scope …` | the oscilloscope, see `scope_orders` |
//! | `status` | one line: state, fault, position, speed |
//! | `help` | this list |

use std::fmt;
use std::str::FromStr;

use lenze9300_model::device::{Drive, Fault, PositioningSignals};
use lenze9300_model::plant::Mains;
use lenze9300_model::signal::Signal;
use lenze9300_model::traverse::Override;

/// An order of the operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Order {
    /// Terminal 28.
    Terminal28(Switch),
    /// E1 to E5.
    Input(u8, Switch),
    /// Mains.
    Mains(Switch),
    /// Torque against the motor, Nm.
    Load(f64),
    /// The cause of a fault.
    Fault(Fault, Switch),
    /// Velocity override.
    Override(Override),
    /// POS-PS-CANCEL.
    Cancel,
    /// Tell how the drive is.
    Status,
    /// Tell what can be ordered.
    Help,
}

/// On or off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Switch {
    On,
    Off,
}

impl Switch {
    fn is_on(self) -> bool {
        self == Self::On
    }
}

/// The operator's side of the signals that stay until they are changed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Operator {
    signals: PositioningSignals,
}

impl Operator {
    /// Carries an order out and returns what to tell, if anything.
    pub(crate) fn obey(&mut self, order: Order, drive: &mut Drive) -> Option<String> {
        match order {
            Order::Terminal28(switch) => drive.set_terminal_28(switch.is_on()),
            Order::Input(number, switch) => drive.set_input(number, switch.is_on()),
            Order::Mains(Switch::On) => drive.set_mains(Mains::On),
            Order::Mains(Switch::Off) => drive.set_mains(Mains::Off),
            Order::Load(torque_nm) => drive.set_load_torque(torque_nm),
            Order::Fault(fault, switch) => drive.inject(fault, switch.is_on()),
            Order::Override(velocity_override) => {
                self.signals.velocity_override = velocity_override;
                drive.set_positioning(self.signals);
            }
            Order::Cancel => drive.set_positioning(PositioningSignals {
                cancel: true,
                ..self.signals
            }),
            Order::Status => return Some(Status(drive).to_string()),
            Order::Help => return Some(format!("{HELP}\n{}", crate::scope_orders::HELP)),
        }
        None
    }

    /// A millisecond has passed: a cancel is a pulse.
    pub(crate) fn release(&self, drive: &mut Drive) {
        drive.set_positioning(self.signals);
    }
}

const HELP: &str = "28 on|off, e1…e5 on|off, mains on|off, load NM, fault NAME on|off, override PERCENT, cancel, scope …, status, help";

/// How the drive is, on one line.
struct Status<'a>(&'a Drive);

impl fmt::Display for Status<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let drive = self.0;
        write!(f, "C0183 = {}, fault ", drive.diagnosis())?;
        match Fault::from_lecom_number(drive.shown_fault()) {
            Some((fault, _)) if drive.shown_fault() != 0 => write!(f, "{} {fault}", drive.shown_fault())?,
            _ => write!(f, "none")?,
        }
        for signal in [Signal::PosAct, Signal::Speed, Signal::Current, Signal::DcLink] {
            write!(f, ", {} {:.1} {}", signal.name(), signal.read(drive), signal.unit())?;
        }
        Ok(())
    }
}

impl FromStr for Order {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let input = |word: &str| {
            let number = word.strip_prefix(['e', 'E'])?.parse::<u8>().ok()?;
            (1..=5).contains(&number).then_some(number)
        };
        match words[..] {
            ["28", level] => switch(level).map(Order::Terminal28),
            ["mains", level] => switch(level).map(Order::Mains),
            ["load", torque] => match torque.parse::<f64>() {
                Ok(torque_nm) if torque_nm.abs() <= MAX_LOAD_NM => Ok(Order::Load(torque_nm)),
                _ => Err(format!(
                    "load {torque}: allowed is a torque from -{MAX_LOAD_NM} to {MAX_LOAD_NM} Nm"
                )),
            },
            ["fault", name, level] => {
                let named = |fault: &Fault| fault.display().eq_ignore_ascii_case(name);
                match Fault::ALL.into_iter().find(named) {
                    Some(fault) => switch(level).map(|switch| Order::Fault(fault, switch)),
                    None => Err(format!(
                        "fault {name} is unknown; there are {}",
                        Fault::ALL.map(Fault::display).join(", ")
                    )),
                }
            }
            ["override", percent] => match percent.parse::<f64>() {
                Ok(value) if (0.0..=100.0).contains(&value) => {
                    let velocity_override = Override::from_percent_e4((value * 10_000.0).round() as i32);
                    Ok(Order::Override(velocity_override))
                }
                _ => Err(format!("override {percent}: allowed is 0 to 100 %")),
            },
            ["cancel"] => Ok(Order::Cancel),
            ["status"] => Ok(Order::Status),
            ["help"] => Ok(Order::Help),
            [word, level] if input(word).is_some() => {
                let number = input(word).unwrap_or_default();
                switch(level).map(|switch| Order::Input(number, switch))
            }
            _ => Err(format!("`{}` is no order; there are {HELP}", line.trim())),
        }
    }
}

/// The motor's peak torque: more would only show that the axis is torn along.
const MAX_LOAD_NM: f64 = 3.1;

fn switch(word: &str) -> Result<Switch, String> {
    match word {
        "on" => Ok(Switch::On),
        "off" => Ok(Switch::Off),
        _ => Err(format!("`{word}`: allowed is on or off")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lenze9300_model::device::DriveConfig;

    fn drive() -> Drive {
        let mut drive = Drive::new(DriveConfig::default());
        drive.set_aif(drivecom::AifControl(0));
        run(&mut drive, 200);
        drive
    }

    fn run(drive: &mut Drive, milliseconds: u64) {
        for _ in 0..milliseconds * lenze9300_model::TICKS_PER_MS {
            drive.tick();
        }
    }

    #[test]
    fn every_order_acts_on_the_drive() {
        let mut operator = Operator::default();
        // Order, and C0183 a few milliseconds later (9300 facts 4.4): 121 terminal 28, 104 message, 102 TRIP, 250 warning.
        for (line, diagnosis) in [
            ("28 off", 121),
            ("28 on", 0),
            ("fault ou on", 104),
            ("fault OU off", 0),
            ("fault OH4 on", 250),
            ("fault OH4 off", 0),
            ("e3 on", 0),
            ("load 0.3", 0),
            ("override 50", 0),
            ("cancel", 0),
            ("fault oc2 on", 102),
        ] {
            let mut drive = drive();
            if let Some((_, cause)) = line.strip_suffix(" off").map(|cause| (line, cause)) {
                let before = format!("{cause} on").parse().unwrap();
                operator.obey(before, &mut drive);
                run(&mut drive, 5);
            }
            assert_eq!(operator.obey(line.parse().unwrap(), &mut drive), None, "{line}");
            run(&mut drive, 5);
            operator.release(&mut drive);
            assert_eq!(drive.diagnosis(), diagnosis, "{line}");
            match line {
                "e3 on" => assert!(drive.terminals().e[2]),
                "load 0.3" => {
                    run(&mut drive, 200);
                    assert!(drive.axis().sample().torque > 0.2);
                }
                _ => {}
            }
        }
    }

    #[test]
    fn the_mains_can_be_taken_away() {
        let mut drive = drive();
        Operator::default().obey("mains off".parse().unwrap(), &mut drive);
        run(&mut drive, 2000);
        // 9300 facts 4.9: LU 1030.
        assert_eq!(drive.shown_fault(), 1030);
    }

    #[test]
    fn the_status_is_one_line_with_fault_position_and_speed() {
        let mut drive = drive();
        let status = |drive: &mut Drive| Operator::default().obey(Order::Status, drive).unwrap();
        let told = status(&mut drive);
        assert!(
            told.starts_with("C0183 = 0, fault none, POS-ACT 0.0 inc, N-ACT 0.0 1/min, I-ACT"),
            "{told}"
        );
        drive.inject(Fault::Oc2, true);
        run(&mut drive, 2);
        let told = status(&mut drive);
        assert!(told.starts_with("C0183 = 102, fault 12 OC2 (earth fault)"), "{told}");
        assert!(!told.contains('\n'));
    }

    #[test]
    fn what_is_no_order_is_told_with_what_is() {
        for (line, told) in [
            ("28 up", "`up`: allowed is on or off"),
            ("load 5", "load 5: allowed is a torque from -3.1 to 3.1 Nm"),
            ("load x", "load x: allowed is a torque from -3.1 to 3.1 Nm"),
            ("override 101", "override 101: allowed is 0 to 100 %"),
        ] {
            assert_eq!(line.parse::<Order>(), Err(told.to_owned()));
        }
        let unknown = "fault X1 on".parse::<Order>().unwrap_err();
        assert!(
            unknown.starts_with("fault X1 is unknown; there are CCr, CE0,"),
            "{unknown}"
        );
        for line in ["", "e6 on", "e0 on", "stop", "28"] {
            let error = line.parse::<Order>().unwrap_err();
            assert!(error.contains("is no order; there are 28 on|off"), "{error}");
        }
    }
}

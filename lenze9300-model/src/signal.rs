//! The signals of a drive, named once: oscilloscope, files and views read them by these names.

use std::str::FromStr;

use thiserror::Error;

use crate::device::Drive;
use crate::units::Rpm;

/// A signal of a drive. Names are the drive's own where it has one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Signal {
    /// Position set-value of the interpolator, inc from the reference.
    PosSetp,
    /// Position actual value, inc from the reference.
    PosAct,
    /// Set-value minus actual value, inc.
    #[doc(alias = "Schleppfehler")]
    FollowingError,
    /// Speed of the interpolator, % of C0011.
    PosNout,
    /// Motor speed behind the filter C0497, % of C0011.
    MctrlNact,
    /// Motor speed as the controllers see it, 1/min.
    Speed,
    /// Speed set-value of the position controller, % of C0011 (C0050).
    MctrlNset2,
    /// Torque set-value, % of C0057.
    MctrlMset2,
    /// Torque in the air gap, Nm.
    Torque,
    /// Motor current, A rms.
    Current,
    /// Current along d, A peak.
    CurrentD,
    /// Current along q, A peak.
    CurrentQ,
    /// Voltage of the DC link, V.
    DcLink,
    /// Record being worked off, 0 = none yet.
    Record,
    /// Program function outputs, bit 0 = PFO 01.
    ProgramOutputs,
    /// The status word C0150.
    StatusWord,
    /// LECOM number of the present fault, 0 = none.
    Fault,
    /// Level at E1.
    E1,
}

struct Row {
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
}

impl Signal {
    /// All of them.
    pub const ALL: [Self; 18] = [
        Self::PosSetp,
        Self::PosAct,
        Self::FollowingError,
        Self::PosNout,
        Self::MctrlNact,
        Self::Speed,
        Self::MctrlNset2,
        Self::MctrlMset2,
        Self::Torque,
        Self::Current,
        Self::CurrentD,
        Self::CurrentQ,
        Self::DcLink,
        Self::Record,
        Self::ProgramOutputs,
        Self::StatusWord,
        Self::Fault,
        Self::E1,
    ];

    const fn row(self) -> Row {
        let (name, unit, meaning) = match self {
            Self::PosSetp => ("POS-SETP", "inc", "position set-value"),
            Self::PosAct => ("POS-ACT", "inc", "position actual value"),
            Self::FollowingError => ("POS-ERR", "inc", "following error"),
            Self::PosNout => ("POS-NOUT", "%", "speed of the interpolator, of C0011"),
            Self::MctrlNact => ("MCTRL-NACT", "%", "motor speed, filtered, of C0011"),
            Self::Speed => ("N-ACT", "1/min", "motor speed"),
            Self::MctrlNset2 => ("MCTRL-NSET2", "%", "speed set-value, of C0011"),
            Self::MctrlMset2 => ("MCTRL-MSET2", "%", "torque set-value, of C0057"),
            Self::Torque => ("M-ACT", "Nm", "torque in the air gap"),
            Self::Current => ("I-ACT", "A", "motor current"),
            Self::CurrentD => ("I-D", "A", "current along d, peak"),
            Self::CurrentQ => ("I-Q", "A", "current along q, peak"),
            Self::DcLink => ("U-DC", "V", "voltage of the DC link"),
            Self::Record => ("PS", "", "traversing record"),
            Self::ProgramOutputs => ("PFO", "", "program function outputs, bit by bit"),
            Self::StatusWord => ("C0150", "", "status word, bit by bit"),
            Self::Fault => ("C0067", "", "present fault, LECOM number"),
            Self::E1 => ("E1", "", "level at E1"),
        };
        Row { name, unit, meaning }
    }

    /// Name, as in files and views.
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// Unit; empty for a pure number.
    pub const fn unit(self) -> &'static str {
        self.row().unit
    }

    /// What it is, for people.
    pub const fn meaning(self) -> &'static str {
        self.row().meaning
    }

    /// Its value now.
    pub fn read(self, drive: &Drive) -> f64 {
        let sample = drive.axis().sample();
        let params = drive.axis().params();
        let full_rad_s = params.codes.c0011_n_max.to_rad_s();
        match self {
            Self::PosSetp => drive.setpoint().position as f64,
            Self::PosAct => drive.position() as f64,
            Self::FollowingError => drive.following_error() as f64,
            Self::PosNout => {
                let rad_s = drive.setpoint().velocity * 1000.0 / crate::units::INC_PER_RAD;
                100.0 * rad_s / full_rad_s
            }
            Self::MctrlNact => 100.0 * sample.omega_filtered / full_rad_s,
            Self::Speed => Rpm::from_rad_s(sample.omega_meas).0,
            Self::MctrlNset2 => 100.0 * drive.speed_set_value() / full_rad_s,
            Self::MctrlMset2 => 100.0 * sample.torque_ref / params.torque_max_nm(),
            Self::Torque => sample.torque,
            Self::Current => sample.current_rms(),
            Self::CurrentD => sample.i_d,
            Self::CurrentQ => sample.i_q,
            Self::DcLink => sample.u_dc,
            Self::Record => f64::from(drive.traverse_status().record),
            Self::ProgramOutputs => f64::from(drive.traverse_status().outputs),
            Self::StatusWord => f64::from(drive.status_word()),
            Self::Fault => f64::from(drive.shown_fault()),
            Self::E1 => f64::from(u8::from(drive.terminals().e[0])),
        }
    }
}

impl FromStr for Signal {
    type Err = SignalError;

    /// By its name, in capitals or not.
    fn from_str(text: &str) -> Result<Self, SignalError> {
        let named = |signal: &Self| signal.name().eq_ignore_ascii_case(text);
        Self::ALL
            .into_iter()
            .find(named)
            .ok_or_else(|| SignalError { got: text.to_owned() })
    }
}

/// No signal has this name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{got}` is no signal; there are {}", Signal::ALL.map(Signal::name).join(", "))]
pub struct SignalError {
    /// The name given.
    pub got: String,
}

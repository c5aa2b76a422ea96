//! Physics of one axis: mains, DC link, inverter, motor, shaft, resolver.
//!
//! Convention of the crate: quantities of the machine are peak-valued (amplitude-invariant) and rotor-fixed, see [`Dq`]. Angles
//! and speeds are those of the motor shaft and positive in the direction of positive q current. All values are SI.
//! How closely is chosen by [`Fidelity`].

mod current_sensor;
mod dc_link;
mod dq;
mod drive_train;
mod elastic;
mod energy;
mod feedback;
mod fidelity;
mod inverter;
mod mechanics;
mod pmsm;
mod shaft;
mod solver;
mod terminals;
mod thermal;

pub use current_sensor::CurrentSensorParams;
pub use dc_link::{BrakeModule, DcLink, DcLinkParams, LinkState, LinkThresholds, Mains};
pub use dq::Dq;
pub use drive_train::DriveTrain;
pub use energy::EnergyBalance;
pub use feedback::{Feedback, FeedbackParams, ResolverErrors};
pub use fidelity::{Fidelity, UnknownFidelity};
pub use inverter::{InverterParams, OutputStage, Realised, limit_to_voltage_circle};
pub use mechanics::{Contact, Coupling, MechanicsParams};
pub use pmsm::{MotorState, PmsmParams};
pub use shaft::{ShaftAngle, ShaftSegment};
pub use solver::{MAX_STEP_TIMES_RADIUS, rk4_step, rk4_step_with_integral, substeps};
pub use terminals::{Interval, RotorFixed, StatorFixed, Terminals};
pub use thermal::{Thermal, ThermalParams};

pub(crate) use current_sensor::CurrentSensor;
pub(crate) use drive_train::without_denormals;
pub(crate) use feedback::{SETTLED_INC, TrackingGains};
pub(crate) use inverter::{Switches, SwitchingPoint};

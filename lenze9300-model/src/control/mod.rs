//! The sampled cascade: position, speed, current; tuned from inside out.
//!
//! | loop | period | type | codes |
//! |---|---|---|---|
//! | position | 1 ms, called by the device | P with speed feed-forward | C0254 |
//! | speed | 250 µs | PID with torque limit | C0070, C0071, C0072, C0022 |
//! | current | 125 µs | PI in d and q with decoupling | C0075, C0076 |
//!
//! # When torque or voltage runs out
//!
//! - Torque: C0022 is the radius of the current circle. The d current is led to zero, so the whole circle is for the
//!   q current. At the limit the integrator of the speed controller is led so that it is left without a swing, see
//!   [`SpeedController`].
//! - Voltage: the demanded vector is shortened to the circle of radius U_dc/√3 in its direction. Both integrators of
//!   the current controller follow what was realised, and the speed controller stops to ask for more torque
//!   ([`VoltageReserve`]).
//! - No field weakening (the drive runs a synchronous motor, C0006 = 3, with i_d = 0): above the speed at which the
//!   back EMF fills the circle there is no torque. On a link of 566 V that is some 8500 rpm for MDSKS036-13, far
//!   above NMAX (C0596, 5500 rpm); with the link at its LU threshold of 285 V it is 4280 rpm. The set-value is then
//!   not reached; the drive reports the limit (status bit 11), and the following error grows until P14 or P03 trips.
//!
//! Controllers know nothing of codes: [`crate::ControllerCodes`] turns codes into gains.

mod current;
mod pi;
mod position;
mod speed;
pub mod tuning;

pub use current::{CurrentController, CurrentDemand, Decoupling};
pub use pi::{PiController, PiGains};
pub use position::PositionController;
pub use speed::{SpeedController, SpeedGains, SpeedInput, TorqueDemand, VoltageReserve};

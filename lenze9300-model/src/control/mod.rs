//! The sampled cascade: position, speed, current; tuned from inside out.
//!
//! | loop | period | type | codes |
//! |---|---|---|---|
//! | position | 1 ms, called by the device | P with speed feed-forward | C0254 |
//! | speed | 250 µs | PI with torque limit | C0070, C0071, C0022 |
//! | current | 125 µs | PI in d and q with decoupling | C0075, C0076 |
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
pub use speed::{SpeedController, TorqueDemand};

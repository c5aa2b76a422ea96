//! The three loops as measured: step responses of the running axis, and its open loops over frequency.
//!
//! | file | what it does |
//! |---|---|
//! | `step` | lets the real controllers answer a small step on the real plant, and reads the figures off |
//! | `linear` | the same sampled loop, linearised about its operating point, as matrices |
//! | `margins` | crossover, phase margin and gain margin of an open loop |
//! | `figures`, `plot` | all of it as table, JSON, picture |
//!
//! ```
//! use lenze9300_model::AxisParams;
//! use lenze9300_model::response::{LinearLoop, LoopKind, Margins, StepResponse};
//!
//! let axis = AxisParams::default();
//! let step = StepResponse::measure(&axis, LoopKind::Current);
//! assert!(step.overshoot_percent() < 10.0);
//! let margins = Margins::of(&LinearLoop::new(&axis, LoopKind::Current));
//! assert!(margins.phase_margin_deg.is_some_and(|margin| margin > 45.0));
//! ```

mod figures;
mod linear;
mod margins;
mod plot;
mod step;

pub use figures::LoopFigures;
pub use linear::LinearLoop;
pub use margins::{BodePoint, Margins};
pub use plot::{PlotError, plot_open_loop, plot_step};
pub use step::{StepPoint, StepResponse, StepSize};

use serde::Serialize;

use crate::AxisParams;
use crate::units::RAD_PER_INC;

/// One of the three loops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LoopKind {
    /// Current controller and winding, the shaft locked.
    Current,
    /// Speed controller, around the closed current loop.
    Speed,
    /// Position controller, around the closed speed loop.
    Position,
}

/// Gains of a loop's controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopGains {
    /// Proportional gain: V/A, Nm·s/rad or 1/s.
    pub k_p: f64,
    /// Integral time, s; `None` without an integral part.
    pub t_n_s: Option<f64>,
}

impl LoopKind {
    /// `current`, `speed` or `position`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Current => "current",
            Self::Speed => "speed",
            Self::Position => "position",
        }
    }

    /// Unit of the proportional gain.
    #[must_use]
    pub const fn gain_unit(self) -> &'static str {
        match self {
            Self::Current => "V/A",
            Self::Speed => "Nm·s/rad",
            Self::Position => "1/s",
        }
    }

    /// The gains that the codes of an axis give this loop.
    #[must_use]
    pub fn gains(self, params: &AxisParams) -> LoopGains {
        let pi = match self {
            Self::Current => params.current_gains(),
            Self::Speed => params.speed_gains(),
            Self::Position => {
                return LoopGains {
                    k_p: params.position_controller().k_v(),
                    t_n_s: None,
                };
            }
        };
        LoopGains {
            k_p: pi.k_p,
            t_n_s: pi.t_n_s.is_finite().then_some(pi.t_n_s),
        }
    }

    /// Ticks in a period of this loop's controller.
    #[must_use]
    pub fn ticks_per_period(self, params: &AxisParams) -> u64 {
        match self {
            Self::Current => 1,
            Self::Speed => params.ticks_per_speed_period(),
            Self::Position => params.ticks_per_position_period(),
        }
    }

    /// Speed of the shaft about which the loop is looked at, rad/s.
    ///
    /// The current loop has its shaft locked. The others turn: at standstill static friction would hold the shaft,
    /// and the answer would depend on the size of the step. 1000 increments a millisecond are 916 rpm; whole
    /// increments in a period make the quantisation of the resolver stand still.
    pub(crate) fn base_speed(self) -> f64 {
        match self {
            Self::Current => 0.0,
            Self::Speed | Self::Position => BASE_INC_PER_MS * 1000.0 * RAD_PER_INC,
        }
    }
}

/// Increments in a millisecond at the operating point of speed and position loop.
const BASE_INC_PER_MS: f64 = 1000.0;

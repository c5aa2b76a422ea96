//! Tuning from inside out: formulas I to VI of the thesis (ch. 5.3, fig. 30 to 32), and what they need to know.
//!
//! | file | question |
//! |---|---|
//! | `optimum` | which gains do time constants and inertia ask for |
//! | `cascade` | which codes does a whole axis get |
//! | `identify` | which inertia and friction does a recorded feed show |
//! | `noise` | how far does the resolver let the speed gain go |

mod cascade;
mod identify;
mod noise;
mod optimum;

pub use cascade::Cascade;
pub use identify::{Identified, IdentifyError, TraceSample, identify_mechanics};
pub use noise::{NoiseLimit, quantisation_rms_inc, speed_noise_gain};
pub use optimum::{
    current_loop_time_s, following_error, magnitude_optimum, peak_following_error, position_gain, sampled_t_sigma_s,
    speed_loop_time_s, symmetrical_optimum,
};

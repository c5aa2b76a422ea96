//! The machine around the drive: roller, film, print marks and the reader on the drive's input E1.
//!
//! The film is rigid and does not slip: its position is the motor's angle through gear and roller. What stretches
//! and slips comes with another machine.

mod film;
mod marks;

pub use film::{Edge, Film, FilmConfig, RESIDUAL_PATH_MM, Roller};
pub use marks::{MarkConfig, Marks, Missing};

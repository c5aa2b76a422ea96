//! The machine around the drive: roller, film, print marks and the reader on the drive's input E1.
//!
//! By default the film is rigid and does not slip: its position is the motor's angle through gear and roller. [`WebParams`] make it
//! an elastic one that comes off a roll.

mod film;
mod marks;
mod reader;
mod web;

pub use film::{Edge, Film, FilmConfig, RESIDUAL_PATH_MM, Roller};
pub use marks::{MarkConfig, Marks, Missing};
pub(crate) use reader::ReaderDelay;
pub use reader::ReaderParams;
pub use web::WebParams;

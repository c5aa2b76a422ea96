//! Petri nets as data, and the parameter exchange net of the film feed block.
//!
//! [`PARAMETER_NET`] is the table T1…T13 of the block; [`Net::fire_cycle`] runs one PLC cycle of it against a
//! [`NetContext`]; [`Net::dot`] and [`Net::table`] draw it. Nothing here knows a telegram: guards ask the
//! context, actions tell it.
//!
//! Source: film-feed specification, sections 8 and 8.1; A.2 and A.3 of the thesis.

mod marking;
mod net;
mod render;

pub use marking::{Marking, PLACES, Places};
pub use net::{
    Action, Firing, Guard, Net, NetContext, PARAMETER_NET, PARAMETER_TRANSITIONS, Puts, RESET_MARKING, Transition,
};
pub use render::{DotRendering, TableRendering};

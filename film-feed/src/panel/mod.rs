//! The commissioning panel: one page in the browser, served by this program, live over a WebSocket.
//!
//! ```text
//!   browser ◄── frames, 20 a second ──┐            ┌── orders ──► engine (a thread): the rig in paced virtual time
//!      └────── orders ──────► server (axum) ◄──────┘◄── frames ──┘
//! ```
//!
//! The engine never waits for anybody: a client that does not take its frames is dropped. Who gets in is decided in [`access`], which page
//! may change something in `hub`; what can be asked and told is in [`protocol`]. [`HandTurned`] is all that without server, thread and clock.

pub mod access;
mod capture;
mod codes;
mod engine;
mod feeds;
mod hand_turned;
mod hub;
mod inputs;
mod live;
pub mod protocol;
mod server;
mod simulated;
mod snapshot;
mod stations;

pub use access::{Access, AccessRefused, PanelError};
pub use engine::Engine;
pub use hand_turned::HandTurned;
pub use server::{Machine, Panel, serve};

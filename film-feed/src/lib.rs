//! The film feed: PLC block, bus, drive and film in one chain.
//!
//! From the machine upwards:
//!
//! - [`machine_file`]: MACHINE.toml, one axis in one file, with its [`catalogue`] of motors and drives;
//! - [`size`]: whether motor and drive are large enough for it;
//! - [`budget`]: what puts its film beside its place;
//! - [`machine`]: roller, film, print marks, reader;
//! - [`rig`]: block, master, line, bus module, drive and film in virtual time;
//! - [`block`]: the PLC function block "FB Folienvorzug", and [`plc`], its view of the periphery;
//! - [`operator`]: works the block's inputs as a person would; [`parameter_watch`]: what the block never looks at;
//! - [`run`]: a whole run with its [`report`]; [`real_line`]: the same against a real drive;
//! - [`advise`](mod@advise): what will go wrong, before it does;
//! - [`sweep`]: many machines at once; [`fit`]: what a trace tells of its axis;
//! - [`scope`] and [`plot`]: the oscilloscope; [`replay`]: the block alone, in JSON lines;
//! - [`cli`]: the commands of the program.
//!
//! ```
//! use film_feed::operator::FeedPlan;
//! use film_feed::report::FeedMode;
//! use film_feed::rig::RigConfig;
//! use film_feed::run::{Observation, simulated};
//!
//! let plan = FeedPlan { series: vec![(FeedMode::Length, 1)], ..FeedPlan::default() };
//! let (report, _) = simulated(&RigConfig::default(), plan, Observation::FeedsOnly, || {})?;
//! assert!(report.ok);
//! # Ok::<(), film_feed::rig::RigError>(())
//! ```

pub mod advise;
pub mod block;
pub mod budget;
pub mod bus_config;
pub mod catalogue;
pub mod cli;
pub mod feed_probe;
pub mod fit;
pub mod machine;
pub mod machine_file;
pub mod operator;
#[cfg(feature = "panel")]
pub mod panel;
pub mod parameter_watch;
mod parquet_file;
pub mod plc;
pub mod plot;
pub mod real_line;
pub mod replay;
pub mod report;
pub mod rig;
pub mod run;
pub mod scope;
pub mod signal_trace;
pub mod size;
pub mod sweep;
mod toml_section;

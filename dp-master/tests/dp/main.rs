//! DP, master and slave on the virtual line, with the acyclic services of DP-V1.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

mod acyclic;
mod answers;
mod auto_clear;
mod bus_time;
mod class2;
mod common;
mod configuration;
mod control;
mod cycle;
mod diag_blocks;
mod diagnosis;
mod exchange;
mod independent_masters;
mod known_failures;
mod latency;
mod live_list;
mod lock;
mod modular;
mod retries;
mod set_slave_add;
mod startup;
mod startup_answers;
mod v1_alarms;
mod v1_bench;
mod v1_client;
mod v1_msac1;
mod v1_msac2;
mod v1_pdu;
mod watchdog;

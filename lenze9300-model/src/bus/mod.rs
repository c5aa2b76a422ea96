//! The bus modules of the drive.

pub mod can;
pub mod can_port;
pub mod dp;
mod records;

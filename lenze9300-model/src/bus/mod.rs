//! The bus modules of the drive.

pub mod dp;
mod records;

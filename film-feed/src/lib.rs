//! The film feed: PLC block, bus, drive and film in one chain.
//!
//! - [`block`]: the PLC function block "FB Folienvorzug".
//! - [`replay`]: the block alone, fed from and answering in JSON lines.
//! - [`cli`]: the commands of the program.

pub mod block;
pub mod replay;

/// The commands of the program, one module each.
pub mod cli {
    pub mod replay;
}

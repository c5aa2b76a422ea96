//! The PLC block "FB Folienvorzug", cycle for cycle as its printed source computes it.
//!
//! The source decides, not its comments: every quirk of the original is kept, each with its reason beside it and listed in
//! `PARITY.md`. Order within a cycle: read process data → outputs → control word → write process data → clamp the inputs →
//! build the telegrams → Petri net of the parameter channel (which exchanges parameter data at its end).
//!
//! ```
//! use film_feed::block::{FilmFeedBlock, Inputs, Periphery};
//!
//! /// A drive that is "ready to switch on" and never answers on the parameter channel.
//! #[derive(Default)]
//! struct Silent { control: u16 }
//! impl Periphery for Silent {
//!     fn dprd_dat(&mut self, laddr: u16, record: &mut [u8; 8]) -> bool {
//!         *record = if laddr == 280 { [0, 0x01, 0, 0, 0, 0, 0, 0] } else { [0; 8] };
//!         true
//!     }
//!     fn dpwr_dat(&mut self, laddr: u16, record: &[u8; 8]) -> bool {
//!         if laddr == 280 { self.control = u16::from_be_bytes([record[0], record[1]]); }
//!         true
//!     }
//! }
//!
//! let mut drive = Silent::default();
//! let mut block = FilmFeedBlock::new();
//! let mut inputs = Inputs { pzd_adr: 280, enable: true, distance: 12_000, ..Inputs::default() };
//! block.cycle(&mut inputs, &mut drive);
//! assert_eq!(drive.control, 0x007F); // switch on and enable, no stop, no start
//! assert_eq!(inputs.velocity, 1_000); // never written: clamped to the minimum, in place
//! ```

mod clamp;
mod inputs;
mod outputs;
mod parameter_net;
mod periphery;
mod process_data;
mod real;
mod telegrams;

pub use inputs::Inputs;
pub use outputs::Outputs;
pub use periphery::Periphery;
pub use telegrams::{Constants, ParameterTelegram};

pub use drivecom::petri::{Firing, Marking};

use parameter_net::ParameterNet;
use process_data::{ProcessDataIn, ProcessDataOut};
use telegrams::Telegrams;

/// Octets from the process data down to the parameter channel in the PLC's address space.
const PAR_OFFSET: u16 = 8;

/// The block with its instance data. [`FilmFeedBlock::new`] is the state after power-up.
///
/// The inputs are kept by the caller and lent to each [`cycle`](Self::cycle), which clamps them in place.
#[derive(Debug, Clone, Default)]
#[doc(alias = "FB Folienvorzug")]
#[doc(alias = "IDB Folienvorzug")]
pub struct FilmFeedBlock {
    outputs: Outputs,
    telegrams: Telegrams,
    pzd_receive: ProcessDataIn,
    pzd_send: ProcessDataOut,
    net: ParameterNet,
    constants: Constants,
}

impl FilmFeedBlock {
    /// The block after power-up: everything 0 but the marking.
    pub fn new() -> Self {
        Self::default()
    }

    /// One PLC cycle. Bounded work: two reads and two writes of 8 octets, no allocation.
    ///
    /// Addresses: process data at [`Inputs::pzd_adr`], parameter data 8 below it, wrapping at 16 bits.
    pub fn cycle(&mut self, inputs: &mut Inputs, periphery: &mut impl Periphery) -> &Outputs {
        periphery.dprd_dat(inputs.pzd_adr, &mut self.pzd_receive.image);
        // The constants are those of the cycle before: the telegrams are evaluated further down.
        self.outputs = self.pzd_receive.evaluate(&self.constants);
        self.pzd_send = ProcessDataOut::build(inputs, &self.outputs, &self.pzd_receive);
        periphery.dpwr_dat(inputs.pzd_adr, &self.pzd_send.image());

        clamp::clamp(inputs);
        self.constants = self.telegrams.build(inputs);

        if inputs.error_reset {
            // The original jumps to the end: no transition, no exchange of parameter data.
            self.net.reset();
        } else {
            let par_adr = inputs.pzd_adr.wrapping_sub(PAR_OFFSET);
            self.net.cycle(&mut self.telegrams, par_adr, periphery);
        }
        &self.outputs
    }

    /// Outputs of the last cycle.
    pub fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    /// Marking of the parameter net.
    pub fn marking(&self) -> Marking {
        self.net.marking
    }

    /// The transitions that fired in the last cycle; none while Error_RESET is set. Not part of the original's data.
    pub fn fired(&self) -> Firing {
        self.net.fired
    }

    /// Number of the telegram in work, 0…6.
    #[doc(alias = "ACT_TELE")]
    pub fn telegram_counter(&self) -> u16 {
        self.net.memory.counter
    }

    /// Octet address of the telegram in work within the instance data: 22, 30, … 70; 0 before the first cycle.
    #[doc(alias = "ACT_TELE_Pointer")]
    pub fn telegram_pointer(&self) -> u16 {
        self.net.memory.pointer
    }

    /// Which of [`telegrams`](Self::telegrams) the pointer shows: 0…6; 0 before the first cycle. Not the counter: Error_RESET starts with
    /// the first telegram again and leaves the counter as it is.
    pub fn telegram_at_work(&self) -> usize {
        Telegrams::slot(self.telegram_pointer()).unwrap_or(0)
    }

    /// Whether the last cycle took an answer and went on to the next telegram (T12).
    pub fn exchange_is_done(&self) -> bool {
        self.fired().fired(12)
    }

    /// The seven telegrams in the order they are sent.
    #[doc(alias = "PAR_Telegramm")]
    pub fn telegrams(&self) -> &[ParameterTelegram; 7] {
        self.telegrams.all()
    }

    /// The constants as the next cycle will use them.
    pub fn constants(&self) -> Constants {
        self.constants
    }

    /// The control word last built, whether or not the write reached a module.
    #[doc(alias = "Steuerwort")]
    pub fn control_word(&self) -> u16 {
        self.pzd_send.control
    }

    /// Parameter data last received.
    #[doc(alias = "PAR_receive")]
    pub fn parameter_received(&self) -> ParameterTelegram {
        self.net.memory.received
    }

    /// Parameter data to send.
    #[doc(alias = "PAR_send")]
    pub fn parameter_sent(&self) -> ParameterTelegram {
        self.net.memory.sent
    }
}

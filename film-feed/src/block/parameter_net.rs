//! Networks "Telegrammkommunikation" and "Parameterkommunikation": the block's memory under the Petri net T1…T13.
//!
//! The net itself is data ([`drivecom::petri::PARAMETER_NET`]); here are its guards and actions.

use drivecom::petri::{Action, Firing, Guard, Marking, NetContext, PARAMETER_NET, RESET_MARKING};

use super::{
    periphery::Periphery,
    telegrams::{ParameterTelegram, Telegrams},
};

/// Greatest counter value that still leads to a next telegram. The counter is increased after the comparison, so a
/// round shows 0…6.
const LAST_COUNTED: u16 = 5;

/// The parameter channel's memory: marking, pointer, counter and the two images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ParameterNet {
    pub(crate) marking: Marking,
    /// What fired in the last cycle. Not part of the original's data.
    pub(crate) fired: Firing,
    /// Pointer, counter, images.
    pub(crate) memory: Memory,
}

/// What guards ask and actions change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Memory {
    /// Octet address of the telegram in work. 0 until T1 has fired.
    pub(crate) pointer: u16,
    /// Number of the telegram in work, 0…6. Error_RESET leaves it alone.
    pub(crate) counter: u16,
    pub(crate) received: ParameterTelegram,
    pub(crate) sent: ParameterTelegram,
    /// AR1 of the CPU. Place 10 holds a token at the end of every cycle, so T2 loads it anew before anything uses it.
    address_register: u16,
}

impl Default for ParameterNet {
    fn default() -> Self {
        Self {
            marking: RESET_MARKING,
            fired: Firing::default(),
            memory: Memory::default(),
        }
    }
}

impl ParameterNet {
    /// Error_RESET: only the marking goes back. Counter, images and pointer stay, and PAR is not exchanged.
    pub(crate) fn reset(&mut self) {
        self.marking = RESET_MARKING;
        self.fired = Firing::default();
    }

    /// Fires T1…T13 once, in order.
    pub(crate) fn cycle(&mut self, telegrams: &mut Telegrams, par_adr: u16, periphery: &mut impl Periphery) {
        let mut context = Context {
            memory: &mut self.memory,
            telegrams,
            par_adr,
            periphery,
        };
        self.fired = PARAMETER_NET.fire_cycle(&mut self.marking, &mut context);
    }
}

/// One cycle's view of everything the net touches.
struct Context<'a, P> {
    memory: &'a mut Memory,
    telegrams: &'a mut Telegrams,
    par_adr: u16,
    periphery: &'a mut P,
}

impl<P> Context<'_, P> {
    /// The telegram at the address register. Pointer and counter start together and the counter ends the round, so it never
    /// points behind the seventh; the default (neither read nor write) would stop the net.
    fn telegram(&self) -> ParameterTelegram {
        self.telegrams
            .at(self.memory.address_register)
            .copied()
            .unwrap_or_default()
    }
}

impl<P: Periphery> NetContext for Context<'_, P> {
    fn guard(&self, guard: Guard) -> bool {
        match guard {
            Guard::Always => true,
            Guard::TelegramIsRead => self.telegram().is_read(),
            Guard::TelegramIsWrite => self.telegram().is_write(),
            // Only the handshake of the answer is looked at: neither its service, index and subindex nor its error bit.
            Guard::HandshakeSet => self.memory.received.handshake(),
            Guard::HandshakeClear => !self.memory.received.handshake(),
            Guard::CounterAboveFive => self.memory.counter > LAST_COUNTED,
        }
    }

    fn act(&mut self, action: Action) {
        let telegram = self.telegram();
        let memory = &mut *self.memory;
        match action {
            Action::PointToFirst => memory.pointer = Telegrams::FIRST,
            Action::LoadAddress => memory.address_register = memory.pointer,
            // Reads do not come here: their request carries the data of the last write.
            Action::LatchWriteData => memory.sent.data = telegram.data,
            Action::SendServiceHandshakeCleared => {
                memory.sent.service = telegram.service & !ParameterTelegram::HANDSHAKE;
            }
            Action::SendServiceHandshakeSet => {
                memory.sent.service = telegram.service | ParameterTelegram::HANDSHAKE;
            }
            Action::SendAddressing => {
                memory.sent.subindex = telegram.subindex;
                memory.sent.index = telegram.index;
            }
            Action::StoreReadData => {
                if let Some(telegram) = self.telegrams.at_mut(memory.address_register) {
                    telegram.data = memory.received.data;
                }
            }
            Action::NextTelegram => {
                if memory.counter > LAST_COUNTED {
                    // The pointer goes back to the first telegram only when T1 fires, in the next cycle.
                    memory.counter = 0;
                } else {
                    memory.counter += 1;
                    memory.pointer += Telegrams::SIZE;
                }
            }
            Action::ExchangeParameterImage => {
                // Reads before it writes: the answer to what is written now is seen in the next cycle at the earliest.
                let mut image = memory.received.to_bytes();
                self.periphery.dprd_dat(self.par_adr, &mut image);
                memory.received = ParameterTelegram::from_bytes(image);
                self.periphery.dpwr_dat(self.par_adr, &memory.sent.to_bytes());
            }
        }
    }
}

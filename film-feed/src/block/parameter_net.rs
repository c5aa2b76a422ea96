//! Network "Telegrammkommunikation" and "Parameterkommunikation": the Petri net T1…T13 on the block's memory.

use super::{
    periphery::Periphery,
    telegrams::{ParameterTelegram, Telegrams},
};

/// Marking of the places 1…11; place p is bit p − 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[doc(alias = "Petrinetz")]
pub struct Marking(u16);

impl Marking {
    /// Tokens in places 1 and 10: power-up and Error_RESET.
    pub const INITIAL: Self = Self(1 << 0 | 1 << 9);

    /// Whether place `place` (1…11) holds a token.
    pub fn holds(self, place: u32) -> bool {
        (1..=11).contains(&place) && self.0 & 1 << (place - 1) != 0
    }

    /// Takes the tokens of `takes` and puts those of `puts`, if the former are all there and `puts` are all empty.
    fn fire(&mut self, takes: u16, puts: u16, guard: bool) -> bool {
        let enabled = self.0 & takes == takes && self.0 & puts == 0 && guard;
        if enabled {
            self.0 = self.0 & !takes | puts;
        }
        enabled
    }
}

/// Place `p` as a mask.
const fn place(p: u16) -> u16 {
    1 << (p - 1)
}

/// The parameter channel's memory: marking, pointer, counter and the two images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ParameterNet {
    pub(crate) marking: Marking,
    /// Octet address of the telegram in work. 0 until T1 has fired.
    pub(crate) pointer: u16,
    /// Number of the telegram in work, 0…6. Error_RESET leaves it alone.
    pub(crate) counter: u16,
    pub(crate) received: ParameterTelegram,
    pub(crate) sent: ParameterTelegram,
    /// AR1 of the CPU. T2 loads it in each cycle before anything uses it.
    address_register: u16,
}

impl Default for ParameterNet {
    fn default() -> Self {
        Self {
            marking: Marking::INITIAL,
            pointer: 0,
            counter: 0,
            received: ParameterTelegram::default(),
            sent: ParameterTelegram::default(),
            address_register: 0,
        }
    }
}

impl ParameterNet {
    /// Error_RESET: only the marking goes back. Counter, images and address stay, and PAR is not exchanged.
    pub(crate) fn reset(&mut self) {
        self.marking = Marking::INITIAL;
    }

    /// Fires T1…T13 once, in order. T13 exchanges the images: it reads before it writes.
    pub(crate) fn cycle(
        &mut self,
        telegrams: &mut Telegrams,
        par_adr: u16,
        periphery: &mut impl Periphery,
    ) {
        const M1: u16 = place(1);
        const M2: u16 = place(2);
        const M3: u16 = place(3);
        const M4: u16 = place(4);
        const M5: u16 = place(5);
        const M6: u16 = place(6);
        const M7: u16 = place(7);
        const M8: u16 = place(8);
        const M9: u16 = place(9);
        const M10: u16 = place(10);
        const M11: u16 = place(11);
        let answered = self.received.handshake();
        let m = &mut self.marking;
        // T1
        if m.fire(M1, M2, true) {
            self.pointer = Telegrams::FIRST;
        }
        // T2
        if m.fire(M10, M11, true) {
            self.address_register = self.pointer;
        }
        let telegram = telegrams
            .at(self.address_register)
            .copied()
            .unwrap_or_default();
        // T3
        m.fire(M2, M3, telegram.is_read());
        // T4
        if m.fire(M2, M3, telegram.is_write()) {
            self.sent.data = telegram.data;
        }
        // T5
        if m.fire(M3, M4 | M5, answered) {
            self.sent.service = telegram.service & !ParameterTelegram::HANDSHAKE;
        }
        // T6
        if m.fire(M3, M4 | M7, !answered) {
            self.sent.service = telegram.service | ParameterTelegram::HANDSHAKE;
        }
        // T7
        if m.fire(M4, M6, true) {
            self.sent.subindex = telegram.subindex;
            self.sent.index = telegram.index;
        }
        // T8
        m.fire(M6 | M5, M9, !answered);
        // T9
        m.fire(M6 | M7, M9, answered);
        // T10
        if m.fire(M9, M8, telegram.is_read()) {
            if let Some(telegram) = telegrams.at_mut(self.address_register) {
                telegram.data = self.received.data;
            }
        }
        // T11
        m.fire(M9, M8, telegram.is_write());
        // T12
        if m.0 & M8 != 0 && m.0 & (M1 | M2) == 0 {
            if self.counter > 5 {
                m.fire(M8, M1, true);
                self.counter = 0;
            } else {
                m.fire(M8, M2, true);
                self.counter += 1;
                self.pointer += Telegrams::SIZE;
            }
        }
        // T13
        if m.fire(M11, M10, true) {
            let mut image = self.received.to_bytes();
            periphery.dprd_dat(par_adr, &mut image);
            self.received = ParameterTelegram::from_bytes(image);
            periphery.dpwr_dat(par_adr, &self.sent.to_bytes());
        }
    }
}

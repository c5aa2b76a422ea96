use super::{CanFrame, Object, SdoChannel};

/// Telegrams of one drive, counted as C0360 and C0361 show them.
///
/// | subcode | C0360, telegrams | C0361, share of the bus in % |
/// |---|---|---|
/// | 1, 2 | sent, received | sent, received |
/// | 3, 4, 5 | CAN-OUT1, CAN-OUT2, CAN-OUT3 | the same |
/// | 6, 7 | sent by parameter channel 1, 2 | 6: both |
/// | 8, 9, 10 | CAN-IN1, CAN-IN2, CAN-IN3 | |
/// | 11, 12 | received by parameter channel 1, 2 | |
///
/// The order of the subcodes is assumed. Counters have 16 bits and begin anew at 0. Source: 9300 facts 5.
#[derive(Debug, Clone, Default)]
pub(super) struct Traffic {
    counts: [u16; COUNTERS],
    bits: [u32; LOADS],
    /// Load of the last whole second, %.
    percent: [u8; LOADS],
    ms: u32,
}

pub(super) const COUNTERS: usize = 12;
pub(super) const LOADS: usize = 6;

/// Length of a load window, ms.
const WINDOW_MS: u32 = 1000;

impl Traffic {
    pub(super) fn sent(&mut self, frame: &CanFrame, object: Option<Object>) {
        self.count(1);
        self.load(1, frame);
        let (counter, load) = match object {
            Some(Object::Out1) => (3, 3),
            Some(Object::Out2) => (4, 4),
            Some(Object::Out3) => (5, 5),
            Some(Object::SdoResponse(SdoChannel::First)) => (6, 6),
            Some(Object::SdoResponse(SdoChannel::Second)) => (7, 6),
            _ => return,
        };
        self.count(counter);
        self.load(load, frame);
    }

    pub(super) fn received(&mut self, frame: &CanFrame, object: Object) {
        self.count(2);
        self.load(2, frame);
        match object {
            Object::In1 => self.count(8),
            Object::In2 => self.count(9),
            Object::In3 => self.count(10),
            Object::SdoRequest(SdoChannel::First) => self.count(11),
            Object::SdoRequest(SdoChannel::Second) => self.count(12),
            _ => {}
        }
    }

    /// A millisecond on a bus of so many bits a second.
    pub(super) fn pass_1ms(&mut self, bit_rate: u32) {
        self.ms += 1;
        if self.ms < WINDOW_MS {
            return;
        }
        self.ms = 0;
        let capacity = f64::from(bit_rate) * f64::from(WINDOW_MS) / 1000.0;
        for (percent, bits) in self.percent.iter_mut().zip(&mut self.bits) {
            *percent = (100.0 * f64::from(*bits) / capacity).round().clamp(0.0, 100.0) as u8;
            *bits = 0;
        }
    }

    /// C0360, subcode 1 first.
    pub(super) fn counts(&self) -> [u16; COUNTERS] {
        self.counts
    }

    /// C0361, subcode 1 first.
    pub(super) fn percent(&self) -> [u8; LOADS] {
        self.percent
    }

    fn count(&mut self, subcode: usize) {
        self.counts[subcode - 1] = self.counts[subcode - 1].wrapping_add(1);
    }

    fn load(&mut self, subcode: usize, frame: &CanFrame) {
        let bits = &mut self.bits[subcode - 1];
        *bits = bits.saturating_add(frame.bits());
    }
}

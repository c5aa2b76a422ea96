//! How long things take on a line, in bit times: telegrams, message cycles, the way through cables, repeaters and glass.
//!
//! | symbol | meaning | formula |
//! |---|---|---|
//! | TS/R, TA/R | request, response | 11 tBIT · octets |
//! | Ttd | transmission delay, one way | 5 ns · metres + 1.5 tBIT · repeaters + 6 tBIT · optical modules (7 at 12 Mbit/s) |
//! | Tmc | message cycle | TS/R + Tsdr + TA/R + Tid + 2·Ttd |
//! | Ttc | token cycle | 33 tBIT + Ttd + Tid |
//!
//! Source: EN 50170-2, part 4, 4.2.1 (Ttc) and 4.2.2 (Tmc). 5 ns/m: signals travel at two thirds of the speed of light in the cable as in
//! glass. 1.5 tBIT: usual value of an RS485 repeater. Optical modules: derived from the constants of their vendor, see
//! [`OpticalTopology`](super::OpticalTopology).

use crate::time::{BITS_PER_CHARACTER, Baud, BitTimes};

/// A token: SD4, DA, SA.
pub const TOKEN_BITS: BitTimes = BitTimes(3 * BITS_PER_CHARACTER);

/// How soon a slave with an ordinary protocol chip answers: 30 tBIT, between min Tsdr (11) and max Tsdr.
///
/// Interpretation: the 9300 facts (1.6) name about 655 tBIT for two telegrams of 25 characters, Tsdr and Tid1 at 12 Mbit/s;
/// 655 − 2 · 275 − 76 = 29.
pub const TYPICAL_TSDR: BitTimes = BitTimes(30);

/// Octets of a telegram with this many octets of data, service access points included: SD1, SD3 or SD2.
///
/// Source: IEC 61158-4-3, formats.
#[must_use]
pub const fn telegram_octets(data: usize) -> usize {
    match data {
        0 => 6,
        8 => 14,
        data => data.saturating_add(9),
    }
}

/// Octets of the response of a Data_Exchange: a slave without inputs acknowledges with one octet.
#[must_use]
pub const fn response_octets(inputs: usize) -> usize {
    match inputs {
        0 => 1,
        inputs => telegram_octets(inputs),
    }
}

/// How long octets take on the line: 11 tBIT each.
#[must_use]
pub const fn octet_bits(octets: usize) -> BitTimes {
    let bits = octets.saturating_mul(BITS_PER_CHARACTER as usize);
    BitTimes(if bits > u32::MAX as usize {
        u32::MAX
    } else {
        bits as u32
    })
}

/// What lies between the two stations that are farthest from each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Way {
    /// Copper and glass together, in centimetres.
    pub cable_cm: u32,
    /// Repeaters passed.
    pub repeaters: u32,
    /// Optical modules passed.
    pub optical_modules: u32,
}

impl Way {
    /// 2·Ttd, there and back, rounded up to a bit time once, at the end.
    #[must_use]
    pub const fn round_trip(&self, baud: Baud) -> BitTimes {
        // In units of 10⁻¹⁰ s · bit/s, that is 10⁻¹⁰ tBIT: 5 ns a metre are 0.05 ns a centimetre, 0.1 ns there and back.
        const UNITS: u128 = 10_000_000_000;
        let cable = self.cable_cm as u128 * baud.bits_per_second() as u128;
        let repeaters = self.repeaters as u128 * 3 * UNITS;
        let optical = self.optical_modules as u128 * 2 * optical_bits(baud) as u128 * UNITS;
        let bits = (cable + repeaters + optical).div_ceil(UNITS);
        BitTimes(if bits > u32::MAX as u128 { u32::MAX } else { bits as u32 })
    }
}

/// Delay of one optical module, one way.
pub(super) const fn optical_bits(baud: Baud) -> u32 {
    match baud {
        Baud::B12000000 => 7,
        _ => 6,
    }
}

/// What is asked and answered in one message cycle, in octets on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageCycle {
    /// Octets of the request.
    pub request: usize,
    /// Octets of the response or acknowledgement.
    pub response: usize,
}

impl MessageCycle {
    /// Request and response of full length, 255 octets each.
    pub const LONGEST: Self = Self {
        request: 255,
        response: 255,
    };

    /// Data_Exchange with a slave.
    #[must_use]
    pub const fn data_exchange(outputs: usize, inputs: usize) -> Self {
        Self {
            request: telegram_octets(outputs),
            response: response_octets(inputs),
        }
    }

    /// Tmc = TS/R + Tsdr + TA/R + Tid + 2·Ttd.
    #[must_use]
    pub fn bits(&self, t_sdr: BitTimes, t_id: BitTimes, round_trip: BitTimes) -> BitTimes {
        octet_bits(self.request) + t_sdr + octet_bits(self.response) + t_id + round_trip
    }

    /// The same when nobody answers: TS/R + Tsl + Tid.
    #[must_use]
    pub fn unanswered_bits(&self, t_sl: BitTimes, t_id: BitTimes) -> BitTimes {
        octet_bits(self.request) + t_sl + t_id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn telegrams_have_the_lengths_of_their_formats() {
        // IEC 61158-4-3: SD1 6, SD3 14, SD2 9 + data; the longest has 246 octets of data.
        assert_eq!([0, 1, 7, 8, 9, 246].map(telegram_octets), [6, 10, 16, 14, 18, 255]);
        assert_eq!(response_octets(0), 1);
        assert_eq!(octet_bits(25), BitTimes(275));
    }

    #[test]
    fn sixteen_octets_each_way_at_12_mbit_take_about_655_bit_times() {
        // 9300 facts 1.6. By hand: 275 + 30 + 275 + 76 = 656; at min Tsdr 275 + 11 + 275 + 76 = 637.
        let cycle = MessageCycle::data_exchange(16, 16);
        assert_eq!(cycle.bits(TYPICAL_TSDR, BitTimes(76), BitTimes(0)), BitTimes(656));
        assert_eq!(cycle.bits(BitTimes(11), BitTimes(76), BitTimes(0)), BitTimes(637));
        // 656 / 12·10⁶ s = 54.67 µs.
        assert_eq!(Baud::B12000000.duration(BitTimes(656)).as_nanos(), 54_667);
    }

    #[test]
    fn the_way_there_and_back_is_rounded_once() {
        // 800 m · 5 ns = 4 µs = 6 tBIT at 1.5 Mbit/s; three repeaters 4.5 tBIT; twice 10.5 = 21.
        let way = Way {
            cable_cm: 80_000,
            repeaters: 3,
            optical_modules: 0,
        };
        assert_eq!(way.round_trip(Baud::B1500000), BitTimes(21));
        // 3 m · 10 ns = 30 ns = 0.36 tBIT at 12 Mbit/s.
        let short = Way {
            cable_cm: 300,
            ..Way::default()
        };
        assert_eq!(short.round_trip(Baud::B12000000), BitTimes(1));
        assert_eq!(Way::default().round_trip(Baud::B12000000), BitTimes(0));
    }

    #[test]
    fn absurd_lengths_saturate() {
        let way = Way {
            cable_cm: u32::MAX,
            repeaters: u32::MAX,
            optical_modules: u32::MAX,
        };
        assert_eq!(way.round_trip(Baud::B12000000), BitTimes(u32::MAX));
        assert_eq!(octet_bits(usize::MAX), BitTimes(u32::MAX));
    }
}

//! Time on the bus: instants and spans in nanoseconds, bit times, and the ten baud rates.
//!
//! Bus parameters are [`BitTimes`]; [`Baud`] is the only place that turns them into nanoseconds, always rounding up, so that a pause is
//! never too short and a timer never early. Nothing here is a microsecond: 11 bits at 12 Mbit/s are 917 ns.

use core::fmt;
use core::ops::{Add, AddAssign, Sub};
use core::str::FromStr;

/// A moment, in nanoseconds since an epoch that the caller chooses ([`Instant::ZERO`] is fine).
///
/// 64 bits of nanoseconds reach 584 years; sums saturate there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Instant(u64);

impl Instant {
    /// The epoch.
    pub const ZERO: Self = Self(0);
    /// The last moment that can be named.
    pub const MAX: Self = Self(u64::MAX);

    /// The moment `nanos` nanoseconds after the epoch.
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the epoch.
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }
}

impl Add<Duration> for Instant {
    type Output = Self;

    #[inline]
    fn add(self, rhs: Duration) -> Self {
        Self(self.0.saturating_add(rhs.0))
    }
}

impl AddAssign<Duration> for Instant {
    #[inline]
    fn add_assign(&mut self, rhs: Duration) {
        *self = *self + rhs;
    }
}

impl Sub<Duration> for Instant {
    type Output = Self;

    /// Saturates at the epoch.
    #[inline]
    fn sub(self, rhs: Duration) -> Self {
        Self(self.0.saturating_sub(rhs.0))
    }
}

impl Sub for Instant {
    type Output = Duration;

    /// The time from `rhs` to `self`; zero when `rhs` is the later one.
    #[inline]
    fn sub(self, rhs: Self) -> Duration {
        Duration(self.0.saturating_sub(rhs.0))
    }
}

impl fmt::Display for Instant {
    /// Seconds with nine digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:09} s", self.0 / 1_000_000_000, self.0 % 1_000_000_000)
    }
}

/// A span of time in nanoseconds, never negative.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Duration(u64);

impl Duration {
    /// No time.
    pub const ZERO: Self = Self(0);

    /// A span of nanoseconds.
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// A span of microseconds; saturates.
    #[must_use]
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros.saturating_mul(1_000))
    }

    /// A span of milliseconds; saturates.
    #[must_use]
    pub const fn from_millis(millis: u64) -> Self {
        Self(millis.saturating_mul(1_000_000))
    }

    /// The span in nanoseconds.
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }
}

impl Add for Duration {
    type Output = Self;

    #[inline]
    fn add(self, rhs: Self) -> Self {
        Self(self.0.saturating_add(rhs.0))
    }
}

impl AddAssign for Duration {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        *self = *self + rhs;
    }
}

impl Sub for Duration {
    type Output = Self;

    /// Saturates at zero.
    #[inline]
    fn sub(self, rhs: Self) -> Self {
        Self(self.0.saturating_sub(rhs.0))
    }
}

impl From<Duration> for core::time::Duration {
    fn from(value: Duration) -> Self {
        Self::from_nanos(value.0)
    }
}

impl From<core::time::Duration> for Duration {
    /// Saturates at 584 years.
    fn from(value: core::time::Duration) -> Self {
        Self(u64::try_from(value.as_nanos()).unwrap_or(u64::MAX))
    }
}

impl fmt::Display for Duration {
    /// Microseconds with three digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:03} µs", self.0 / 1_000, self.0 % 1_000)
    }
}

/// A span counted in bits on the line (tBIT = 1 / baud rate), the unit of every bus parameter.
///
/// Source: film-feed specification, section 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BitTimes(pub u32);

impl Add for BitTimes {
    type Output = Self;

    #[inline]
    fn add(self, rhs: Self) -> Self {
        Self(self.0.saturating_add(rhs.0))
    }
}

impl fmt::Display for BitTimes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} tBIT", self.0)
    }
}

/// Bits of one character on the line: start, eight data bits (least significant first), even parity, stop.
///
/// Source: film-feed specification, section 2.
pub const BITS_PER_CHARACTER: u32 = 11;

/// The ten baud rates of a DP line.
///
/// Source: 9300 facts 1.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Baud {
    /// 9.6 kbit/s.
    B9600,
    /// 19.2 kbit/s.
    B19200,
    /// 45.45 kbit/s.
    B45450,
    /// 93.75 kbit/s.
    B93750,
    /// 187.5 kbit/s.
    B187500,
    /// 500 kbit/s.
    B500000,
    /// 1.5 Mbit/s.
    B1500000,
    /// 3 Mbit/s.
    B3000000,
    /// 6 Mbit/s.
    B6000000,
    /// 12 Mbit/s.
    B12000000,
}

impl Baud {
    /// All ten, slowest first.
    pub const ALL: [Self; 10] = [
        Self::B9600,
        Self::B19200,
        Self::B45450,
        Self::B93750,
        Self::B187500,
        Self::B500000,
        Self::B1500000,
        Self::B3000000,
        Self::B6000000,
        Self::B12000000,
    ];

    /// The baud rate with exactly this many bits per second, if it is one of the ten.
    #[must_use]
    pub fn from_bits_per_second(bits_per_second: u32) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|baud| baud.bits_per_second() == bits_per_second)
    }

    /// Bits per second.
    #[must_use]
    pub const fn bits_per_second(self) -> u32 {
        match self {
            Self::B9600 => 9_600,
            Self::B19200 => 19_200,
            Self::B45450 => 45_450,
            Self::B93750 => 93_750,
            Self::B187500 => 187_500,
            Self::B500000 => 500_000,
            Self::B1500000 => 1_500_000,
            Self::B3000000 => 3_000_000,
            Self::B6000000 => 6_000_000,
            Self::B12000000 => 12_000_000,
        }
    }

    /// How long `bits` take, rounded up to the next nanosecond.
    #[inline]
    #[must_use]
    pub const fn duration(self, bits: BitTimes) -> Duration {
        Duration(self.nanos(bits.0 as u64))
    }

    /// How long `n` characters of 11 bits take when they follow each other without a gap, rounded up once, at the end.
    #[inline]
    #[must_use]
    pub const fn characters(self, n: usize) -> Duration {
        Duration(self.nanos((n as u64).saturating_mul(BITS_PER_CHARACTER as u64)))
    }

    /// How many whole bit times fit into `span`; the inverse of [`Baud::duration`], used to report measured pauses.
    ///
    /// A span that [`Baud::duration`] made from `n` bits gives `n` back.
    #[must_use]
    pub const fn bits(self, span: Duration) -> u64 {
        // u128: 64 bits of nanoseconds times 12·10⁶ do not fit into 64.
        (span.0 as u128 * self.bits_per_second() as u128 / NANOS_PER_SECOND as u128) as u64
    }

    /// Nanoseconds of `bits`, rounded up. The length of a bit is written as a reduced fraction so that the compiler divides by a constant.
    #[inline]
    const fn nanos(self, bits: u64) -> u64 {
        match self {
            Self::B9600 => bits.saturating_mul(312_500).div_ceil(3),
            Self::B19200 => bits.saturating_mul(156_250).div_ceil(3),
            Self::B45450 => bits.saturating_mul(20_000_000).div_ceil(909),
            Self::B93750 => bits.saturating_mul(32_000).div_ceil(3),
            Self::B187500 => bits.saturating_mul(16_000).div_ceil(3),
            Self::B500000 => bits.saturating_mul(2_000),
            Self::B1500000 => bits.saturating_mul(2_000).div_ceil(3),
            Self::B3000000 => bits.saturating_mul(1_000).div_ceil(3),
            Self::B6000000 => bits.saturating_mul(500).div_ceil(3),
            Self::B12000000 => bits.saturating_mul(250).div_ceil(3),
        }
    }
}

impl fmt::Display for Baud {
    /// In kbit/s, as the data sheets write it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} kbit/s", f64::from(self.bits_per_second()) / 1_000.0)
    }
}

impl FromStr for Baud {
    type Err = ParseBaudError;

    /// Reads bits per second in decimal, such as `1500000`.
    ///
    /// # Errors
    ///
    /// [`ParseBaudError`] for everything but the ten rates.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse()
            .ok()
            .and_then(Self::from_bits_per_second)
            .ok_or(ParseBaudError)
    }
}

/// A text that is none of the ten baud rates in bits per second; the message lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParseBaudError;

impl fmt::Display for ParseBaudError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("allowed are the ten PROFIBUS rates ")?;
        for (place, baud) in Baud::ALL.into_iter().enumerate() {
            let separator = match place {
                0 => "",
                _ if place + 1 == Baud::ALL.len() => " and ",
                _ => ", ",
            };
            write!(f, "{separator}{}", baud.bits_per_second())?;
        }
        f.write_str(" bit/s")
    }
}

impl core::error::Error for ParseBaudError {}

const NANOS_PER_SECOND: u64 = 1_000_000_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_character_at_12_mbit_is_917_ns_and_not_0_microseconds() {
        // 11 / 12e6 s = 916.67 ns.
        assert_eq!(Baud::B12000000.characters(1).as_nanos(), 917);
    }

    #[test]
    fn bit_times_round_up_at_every_baud_rate() {
        for baud in Baud::ALL {
            for bits in [0_u32, 1, 2, 3, 7, 11, 33, 100, 275, 2_805, 65_535, 16_777_215, u32::MAX] {
                // tBIT = 1 / baud (film-feed specification, section 2).
                let exact = u128::from(bits) * 1_000_000_000;
                let rate = u128::from(baud.bits_per_second());
                let got = u128::from(baud.duration(BitTimes(bits)).as_nanos());
                assert!(got * rate >= exact, "{bits} bits at {baud} are too short");
                assert!(
                    got * rate < exact + rate,
                    "{bits} bits at {baud} are a nanosecond too long"
                );
            }
        }
    }

    #[test]
    fn characters_round_once_and_not_once_per_character() {
        // 25 · 11 / 12e6 s = 22 916.67 ns; 25 · 917 ns would be 22 925 ns.
        assert_eq!(Baud::B12000000.characters(25).as_nanos(), 22_917);
    }

    #[test]
    fn spans_made_of_whole_bits_count_back_to_the_same_bits() {
        for baud in Baud::ALL {
            for bits in 0..4_000_u32 {
                assert_eq!(
                    baud.bits(baud.duration(BitTimes(bits))),
                    u64::from(bits),
                    "{bits} bits at {baud}"
                );
            }
        }
    }

    #[test]
    fn only_the_ten_rates_of_dp_are_baud_rates() {
        for baud in Baud::ALL {
            assert_eq!(Baud::from_bits_per_second(baud.bits_per_second()), Some(baud));
        }
        assert_eq!(Baud::from_bits_per_second(115_200), None);
        assert_eq!(Baud::from_bits_per_second(0), None);
    }

    #[test]
    fn a_baud_rate_is_read_in_bits_per_second() {
        for baud in Baud::ALL {
            assert_eq!(baud.bits_per_second().to_string().parse(), Ok(baud));
        }
        // The rates of an ordinary serial port, kbit/s, a fraction, nothing.
        for text in ["115200", "1500", "45.45", "-9600", "12000000000", "1.5M", ""] {
            assert_eq!(text.parse::<Baud>(), Err(ParseBaudError), "{text}");
        }
    }

    #[test]
    fn the_refusal_of_a_baud_rate_names_the_ten() {
        assert_eq!(
            ParseBaudError.to_string(),
            "allowed are the ten PROFIBUS rates 9600, 19200, 45450, 93750, 187500, 500000, 1500000, 3000000, 6000000 and \
             12000000 bit/s"
        );
    }

    #[test]
    fn instants_saturate_instead_of_wrapping() {
        assert_eq!(Instant::ZERO - Instant::from_nanos(5), Duration::ZERO);
        assert_eq!(Instant::MAX + Duration::from_nanos(1), Instant::MAX);
        assert_eq!(Instant::from_nanos(7) - Instant::from_nanos(5), Duration::from_nanos(2));
    }

    #[test]
    fn spans_are_shown_in_microseconds_and_bits() {
        for (nanos, shown) in [
            (0, "0.000 µs"),
            (1, "0.001 µs"),
            (1_500, "1.500 µs"),
            (12_034_056, "12034.056 µs"),
        ] {
            assert_eq!(Duration::from_nanos(nanos).to_string(), shown);
        }
        assert_eq!(BitTimes(11).to_string(), "11 tBIT");
        assert_eq!(Instant::from_nanos(2_000_000_345).to_string(), "2.000000345 s");
    }

    #[test]
    fn a_baud_rate_is_shown_in_kbit_as_data_sheets_do() {
        // The ten rates of film-feed specification, section 2.
        let shown = Baud::ALL.map(|baud| baud.to_string());
        assert_eq!(
            shown.join(", "),
            "9.6 kbit/s, 19.2 kbit/s, 45.45 kbit/s, 93.75 kbit/s, 187.5 kbit/s, 500 kbit/s, 1500 kbit/s, 3000 kbit/s, \
             6000 kbit/s, 12000 kbit/s"
        );
    }

    #[test]
    fn spans_saturate_instead_of_wrapping() {
        let longest = Duration::from_nanos(u64::MAX);
        assert_eq!(Duration::from_millis(u64::MAX), longest);
        assert_eq!(Duration::from_micros(u64::MAX), longest);
        assert_eq!(longest + Duration::from_nanos(1), longest);
        assert_eq!(Duration::from_nanos(1) - Duration::from_nanos(2), Duration::default());
        assert_eq!(
            Duration::from_nanos(5) - Duration::from_nanos(2),
            Duration::from_nanos(3)
        );
        assert_eq!(BitTimes(u32::MAX) + BitTimes(1), BitTimes(u32::MAX));
        assert_eq!(BitTimes(2) + BitTimes(3), BitTimes(5));
        let mut sum = Duration::from_micros(1);
        sum += Duration::from_millis(1);
        assert_eq!(sum.as_nanos(), 1_001_000);
    }

    #[test]
    fn spans_of_the_system_are_the_same_spans() {
        let span = core::time::Duration::from_micros(7);
        assert_eq!(Duration::from(span), Duration::from_micros(7));
        assert_eq!(core::time::Duration::from(Duration::from_micros(7)), span);
        assert_eq!(
            Duration::from(core::time::Duration::MAX),
            Duration::from_nanos(u64::MAX)
        );
    }
}

//! The watchdog time a master gives its slaves in Set_Prm.

use crate::time::Duration;

/// The watchdog factors of Set_Prm: the time is 10 ms × `fact_1` × `fact_2`.
///
/// Both factors lie in 1…255, so the time lies in 10 ms … 650.25 s. A DP-V1 slave may be told to count in units of 1 ms instead
/// (WD_Base_1ms); that stands in its user parameters, not in the factors.
///
/// Source: 9300 facts 1.2; IEC 61158-6-3, Set_Prm octets 2 and 3 (WD_Fact_1, WD_Fact_2).
#[doc(alias = "Ansprechüberwachung")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Watchdog {
    fact_1: u8,
    fact_2: u8,
    base: Base,
}

/// What one unit of the product of the factors is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Base {
    TenMilliseconds,
    OneMillisecond,
}

impl Watchdog {
    /// One unit of the product of the factors.
    pub const UNIT: Duration = Duration::from_millis(10);
    /// The longest time the factors can say: 650.25 s.
    pub const MAX: Duration = Duration::from_millis(10 * 255 * 255);

    /// The watchdog with these factors; `None` when one of them is 0.
    pub const fn from_factors(fact_1: u8, fact_2: u8) -> Option<Self> {
        if fact_1 == 0 || fact_2 == 0 {
            return None;
        }
        Some(Self {
            fact_1,
            fact_2,
            base: Base::TenMilliseconds,
        })
    }

    /// The same factors in units of 1 ms (WD_Base_1ms of DP-V1).
    #[must_use]
    pub const fn in_milliseconds(self) -> Self {
        Self {
            base: Base::OneMillisecond,
            ..self
        }
    }

    /// The factors of the shortest watchdog time that is not below `time`, with the smallest `fact_1`.
    ///
    /// # Errors
    ///
    /// [`WatchdogError`] when `time` is above 650.25 s. A time of zero gives 10 ms: no watchdog is
    /// the absence of this value.
    pub fn at_least(time: Duration) -> Result<Self, WatchdogError> {
        let units = time.as_nanos().div_ceil(Self::UNIT.as_nanos()).max(1);
        let mut best: Option<(u64, Self)> = None;
        for fact_1 in 1..=255u8 {
            let Ok(fact_2) = u8::try_from(units.div_ceil(u64::from(fact_1))) else {
                continue;
            };
            let product = u64::from(fact_1) * u64::from(fact_2);
            if best.is_none_or(|(least, _)| product < least) {
                let base = Base::TenMilliseconds;
                best = Some((product, Self { fact_1, fact_2, base }));
            }
            if product == units {
                break;
            }
        }
        match best {
            Some((_, watchdog)) => Ok(watchdog),
            None => Err(WatchdogError { requested: time }),
        }
    }

    /// The two factors, WD_Fact_1 and WD_Fact_2.
    pub const fn factors(self) -> (u8, u8) {
        (self.fact_1, self.fact_2)
    }

    /// The watchdog time.
    pub const fn time(self) -> Duration {
        let unit_ms = match self.base {
            Base::TenMilliseconds => 10,
            Base::OneMillisecond => 1,
        };
        Duration::from_millis(unit_ms * self.fact_1 as u64 * self.fact_2 as u64)
    }
}

/// A watchdog time that two factors of one octet cannot express.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("watchdog time: expected at most 650.25 s, got {} ms", requested.as_nanos() / 1_000_000)]
pub struct WatchdogError {
    /// What was asked for.
    pub requested: Duration,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_is_ten_milliseconds_times_both_factors() {
        // 9300 facts 1.2
        let watchdog = Watchdog::from_factors(3, 7).unwrap();
        assert_eq!(watchdog.time(), Duration::from_millis(210));
        assert_eq!(Watchdog::from_factors(0, 1), None);
    }

    #[test]
    fn the_chosen_factors_never_fall_below_the_wish_and_are_the_tightest() {
        for millis in [1u64, 10, 11, 50, 2_550, 2_551, 12_345, 100_000, 650_250] {
            let wish = Duration::from_millis(millis);
            let watchdog = Watchdog::at_least(wish).unwrap();
            assert!(watchdog.time() >= wish, "{millis} ms");
            let products = (1..=255u64).flat_map(|a| (1..=255u64).map(move |b| 10 * a * b));
            let tightest = products.filter(|&p| p >= millis).min().unwrap();
            assert_eq!(watchdog.time(), Duration::from_millis(tightest));
        }
    }

    #[test]
    fn a_time_above_the_factors_is_refused() {
        assert!(Watchdog::at_least(Duration::from_millis(650_251)).is_err());
    }
}

//! Bus parameters: the times every station of a line agrees on, and the rules between them.
//!
//! | kbit/s | Tsl | max Tsdr | Tset | Tqui | retries |
//! |---|---|---|---|---|---|
//! | 9.6 | 100 | 60 | 1 | 0 | 1 |
//! | 19.2 | 100 | 60 | 1 | 0 | 1 |
//! | 45.45 | 640 | 400 | 95 | 0 | 1 |
//! | 93.75 | 100 | 60 | 1 | 0 | 1 |
//! | 187.5 | 100 | 60 | 1 | 0 | 1 |
//! | 500 | 200 | 100 | 1 | 0 | 1 |
//! | 1500 | 300 | 150 | 1 | 0 | 1 |
//! | 3000 | 400 | 250 | 4 | 3 | 2 |
//! | 6000 | 600 | 450 | 8 | 6 | 3 |
//! | 12000 | 1000 | 800 | 16 | 9 | 4 |
//!
//! min Tsdr is 11 everywhere. At 45.45 kbit/s GSD files name a max Tsdr of 250; the profile allows for 400.
//!
//! Source: film-feed specification, section 2 (meaning); IEC 61784-1 CPF 3, profile DP (values).

use crate::address::Address;
use crate::time::{Baud, BitTimes, Duration};

/// Synchronisation time Tsyn: the line is idle that long before every request.
///
/// Source: IEC 61158-4-3: 33 tBIT, three characters.
pub const T_SYN: BitTimes = BitTimes(33);

/// The bus parameters of one station.
///
/// A plain value: change what differs from [`BusParams::standard`]. Who takes it asks [`validate`](Self::validate).
#[doc(alias = "Busparameter")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BusParams {
    /// Baud rate.
    pub baud: Baud,
    /// Slot time: longest wait from the last bit of a request to the end of the first character of the reply, 37…16383 tBIT.
    pub t_sl: BitTimes,
    /// Least time a responder takes before it answers, 11…1023 tBIT.
    pub t_sdr_min: BitTimes,
    /// Most time a responder takes before it answers, above `t_sdr_min`, up to 1023 tBIT.
    pub t_sdr_max: BitTimes,
    /// Setup time: from an event to the reaction inside a station, 1…255 tBIT.
    pub t_set: BitTimes,
    /// Quiet time: transmitter fall time or repeater switch-over, 0…255 tBIT, below `t_rdy` or 0.
    pub t_qui: BitTimes,
    /// Idle time after an acknowledgement, reply or token before the next request.
    pub t_id1: BitTimes,
    /// Idle time after an unacknowledged telegram.
    pub t_id2: BitTimes,
    /// Time after which a requester must be able to receive the reply, at most `t_sdr_min`.
    pub t_rdy: BitTimes,
    /// Target token rotation time, 1…16777215 tBIT.
    pub t_tr: BitTimes,
    /// Token rotations between two looks for new active stations, 1…100.
    #[doc(alias = "GAP-Faktor")]
    pub gap_factor: u8,
    /// How often a request is repeated after a bad or missing answer, 0…8.
    pub retry_limit: u8,
    /// Highest address of an active station.
    pub hsa: Address,
    /// What an operating system or adapter may add to a reply without its being a timeout; zero on real hardware.
    pub latency_allowance: Duration,
}

impl BusParams {
    /// The values of profile DP for a baud rate.
    ///
    /// `t_tr` is 78 000 tBIT, the 6.5 ms of the thesis at 12 Mbit/s (film-feed specification, section 1); a station that
    /// is alone in the ring keeps the token anyway. HSA is 126.
    pub const fn standard(baud: Baud) -> Self {
        let (t_sl, t_sdr_max, t_set, t_qui, retry_limit) = match baud {
            Baud::B9600 | Baud::B19200 | Baud::B93750 | Baud::B187500 => (100, 60, 1, 0, 1),
            Baud::B45450 => (640, 400, 95, 0, 1),
            Baud::B500000 => (200, 100, 1, 0, 1),
            Baud::B1500000 => (300, 150, 1, 0, 1),
            Baud::B3000000 => (400, 250, 4, 3, 2),
            Baud::B6000000 => (600, 450, 8, 6, 3),
            Baud::B12000000 => (1000, 800, 16, 9, 4),
        };
        let params = Self {
            baud,
            t_sl: BitTimes(t_sl),
            t_sdr_min: BitTimes(11),
            t_sdr_max: BitTimes(t_sdr_max),
            t_set: BitTimes(t_set),
            t_qui: BitTimes(t_qui),
            t_id1: BitTimes(0),
            t_id2: BitTimes(0),
            t_rdy: BitTimes(11),
            t_tr: BitTimes(78_000),
            gap_factor: 10,
            retry_limit,
            hsa: Address::MAX_STATION,
            latency_allowance: Duration::ZERO,
        };
        params.with_least_idle_times()
    }

    /// Tsm, the safety margin: 2 + 2·Tset + Tqui.
    pub const fn t_sm(&self) -> BitTimes {
        BitTimes(
            self.t_set
                .0
                .saturating_mul(2)
                .saturating_add(2)
                .saturating_add(self.t_qui.0),
        )
    }

    /// Tid1 may not be below max(Tsyn + Tsm, min Tsdr).
    pub const fn least_t_id1(&self) -> BitTimes {
        max(T_SYN.0.saturating_add(self.t_sm().0), self.t_sdr_min.0)
    }

    /// Tid2 may not be below max(Tsyn + Tsm, max Tsdr).
    pub const fn least_t_id2(&self) -> BitTimes {
        max(T_SYN.0.saturating_add(self.t_sm().0), self.t_sdr_max.0)
    }

    /// Tsl may not be below max Tsdr + 11 + Tsm, the delay of the line not counted.
    pub const fn least_t_sl(&self) -> BitTimes {
        BitTimes(self.t_sdr_max.0.saturating_add(11).saturating_add(self.t_sm().0))
    }

    /// The same parameters with the shortest idle times the rules allow.
    #[must_use]
    pub const fn with_least_idle_times(mut self) -> Self {
        self.t_id1 = self.least_t_id1();
        self.t_id2 = self.least_t_id2();
        self
    }

    /// The same parameters with a slot time that forgives this much latency of an operating system, adapter or pseudo-terminal.
    #[must_use]
    pub const fn with_latency_allowance(mut self, latency: Duration) -> Self {
        self.latency_allowance = latency;
        self
    }

    /// The slot time with the latency allowance.
    pub fn slot_time(&self) -> Duration {
        self.baud.duration(self.t_sl) + self.latency_allowance
    }

    /// The silence after which the station with this address takes the token for lost: 6·Tsl + 2·TS·Tsl.
    ///
    /// Source: IEC 61158-4-3, Ttimeout.
    pub fn token_timeout(&self, ts: Address) -> Duration {
        let slots = 6 + 2 * u64::from(ts.value());
        Duration::from_nanos(self.slot_time().as_nanos().saturating_mul(slots))
    }

    /// Checks the ranges and the rules between the parameters.
    ///
    /// # Errors
    ///
    /// [`BusParamsError`], one variant a rule.
    pub const fn validate(&self) -> Result<(), BusParamsError> {
        if self.retry_limit > 8 {
            return Err(BusParamsError::RetryLimit { got: self.retry_limit });
        }
        if self.gap_factor < 1 || self.gap_factor > 100 {
            return Err(BusParamsError::GapFactor { got: self.gap_factor });
        }
        if self.t_sdr_min.0 < 11 {
            return Err(BusParamsError::MinTsdr { got: self.t_sdr_min });
        }
        if self.t_sdr_max.0 <= self.t_sdr_min.0 || self.t_sdr_max.0 > 1023 {
            return Err(BusParamsError::MaxTsdr {
                min: self.t_sdr_min,
                got: self.t_sdr_max,
            });
        }
        if self.t_set.0 < 1 || self.t_set.0 > 255 {
            return Err(BusParamsError::Tset { got: self.t_set });
        }
        if self.t_rdy.0 > self.t_sdr_min.0 {
            return Err(BusParamsError::Trdy {
                min_tsdr: self.t_sdr_min,
                got: self.t_rdy,
            });
        }
        if self.t_qui.0 != 0 && self.t_qui.0 >= self.t_rdy.0 {
            return Err(BusParamsError::Tqui {
                t_rdy: self.t_rdy,
                got: self.t_qui,
            });
        }
        if self.t_id1.0 < self.least_t_id1().0 {
            return Err(BusParamsError::Tid1 {
                least: self.least_t_id1(),
                got: self.t_id1,
            });
        }
        if self.t_id2.0 < self.least_t_id2().0 {
            return Err(BusParamsError::Tid2 {
                least: self.least_t_id2(),
                got: self.t_id2,
            });
        }
        if self.t_sl.0 < self.least_t_sl().0 || self.t_sl.0 > 16_383 {
            return Err(BusParamsError::Tsl {
                least: self.least_t_sl(),
                got: self.t_sl,
            });
        }
        if self.t_tr.0 < 1 || self.t_tr.0 > 0x00FF_FFFF {
            return Err(BusParamsError::Ttr { got: self.t_tr });
        }
        if self.hsa.value() > 126 {
            return Err(BusParamsError::Hsa { got: self.hsa });
        }
        Ok(())
    }
}

const fn max(a: u32, b: u32) -> BitTimes {
    BitTimes(if a > b { a } else { b })
}

/// Which rule a set of bus parameters breaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BusParamsError {
    /// Retry limit 0…8.
    #[error("retry limit: expected 0 to 8, got {got}")]
    RetryLimit {
        /// The value.
        got: u8,
    },
    /// GAP factor 1…100.
    #[error("GAP factor: expected 1 to 100, got {got}")]
    GapFactor {
        /// The value.
        got: u8,
    },
    /// min Tsdr of at least one character.
    #[error("min Tsdr: expected at least 11 tBIT, got {got}")]
    MinTsdr {
        /// The value.
        got: BitTimes,
    },
    /// max Tsdr above min Tsdr, at most 1023.
    #[error("max Tsdr: expected above min Tsdr ({min}) and at most 1023 tBIT, got {got}")]
    MaxTsdr {
        /// min Tsdr.
        min: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// Tset 1…255.
    #[error("Tset: expected 1 to 255 tBIT, got {got}")]
    Tset {
        /// The value.
        got: BitTimes,
    },
    /// Trdy at most min Tsdr: the requester must listen before the first reply can come.
    #[error("Trdy: expected at most min Tsdr ({min_tsdr}), got {got}")]
    Trdy {
        /// min Tsdr.
        min_tsdr: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// Tqui below Trdy: a transmitter must be off before the reply can come.
    #[error("Tqui: expected 0 or below Trdy ({t_rdy}), got {got}")]
    Tqui {
        /// Trdy.
        t_rdy: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// Tid1 at least max(Tsyn + Tsm, min Tsdr).
    #[error("Tid1: expected at least max(Tsyn + Tsm, min Tsdr) = {least}, got {got}")]
    Tid1 {
        /// What the rule gives.
        least: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// Tid2 at least max(Tsyn + Tsm, max Tsdr).
    #[error("Tid2: expected at least max(Tsyn + Tsm, max Tsdr) = {least}, got {got}")]
    Tid2 {
        /// What the rule gives.
        least: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// Tsl at least max Tsdr + 11 + Tsm, at most 16383.
    #[error("Tsl: expected max Tsdr + 11 + Tsm = {least} to 16383 tBIT, got {got}")]
    Tsl {
        /// What the rule gives.
        least: BitTimes,
        /// The value.
        got: BitTimes,
    },
    /// Ttr 1…2²⁴ − 1.
    #[error("Ttr: expected 1 to 16777215 tBIT, got {got}")]
    Ttr {
        /// The value.
        got: BitTimes,
    },
    /// HSA 0…126.
    #[error("HSA: expected 0 to 126, got {got}")]
    Hsa {
        /// The value.
        got: Address,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_values_keep_all_rules() {
        for baud in Baud::ALL {
            assert_eq!(BusParams::standard(baud).validate(), Ok(()), "{baud}");
        }
    }

    #[test]
    fn idle_times_at_1500_kbit_are_37_and_150() {
        // IEC 61158-4-3: Tsm = 2 + 2·1 + 0 = 4, Tid1 = max(33 + 4, 11), Tid2 = max(37, 150)
        let params = BusParams::standard(Baud::B1500000);
        assert_eq!(params.t_sm(), BitTimes(4));
        assert_eq!((params.t_id1, params.t_id2), (BitTimes(37), BitTimes(150)));
    }

    #[test]
    fn idle_times_at_12_mbit_are_76_and_800() {
        // Tsm = 2 + 2·16 + 9 = 43, Tid1 = 33 + 43
        let params = BusParams::standard(Baud::B12000000);
        assert_eq!((params.t_id1, params.t_id2), (BitTimes(76), BitTimes(800)));
    }

    #[test]
    fn the_token_is_lost_after_six_slots_and_two_for_each_address_below() {
        // 1.5 Mbit/s, address 2: (6 + 4) · 300 tBIT = 2 ms
        let params = BusParams::standard(Baud::B1500000);
        let ts = Address::new(2).unwrap();
        assert_eq!(params.token_timeout(ts), Duration::from_millis(2));
    }

    #[test]
    fn each_broken_rule_is_named() {
        let good = BusParams::standard(Baud::B12000000);
        let with = |change: fn(&mut BusParams)| {
            let mut params = good;
            change(&mut params);
            params.validate().unwrap_err()
        };
        assert_eq!(with(|p| p.retry_limit = 9), BusParamsError::RetryLimit { got: 9 });
        assert_eq!(
            with(|p| p.t_sl = BitTimes(853)),
            // 800 + 11 + 43
            BusParamsError::Tsl {
                least: BitTimes(854),
                got: BitTimes(853)
            }
        );
        assert!(matches!(with(|p| p.t_id1 = BitTimes(75)), BusParamsError::Tid1 { .. }));
        assert!(matches!(with(|p| p.t_id2 = BitTimes(799)), BusParamsError::Tid2 { .. }));
        assert!(matches!(with(|p| p.t_qui = BitTimes(11)), BusParamsError::Tqui { .. }));
        assert!(matches!(with(|p| p.t_rdy = BitTimes(12)), BusParamsError::Trdy { .. }));
        assert!(matches!(
            with(|p| p.t_sdr_max = BitTimes(11)),
            BusParamsError::MaxTsdr { .. }
        ));
    }

    #[test]
    fn each_range_ends_where_the_standard_ends_it() {
        // EN 50170-2 part 4, bus parameters: max Tsdr to 1023, Tset 1…255, Tsl to 2^14 - 1, Ttr 1…2^24 - 1.
        let good = BusParams {
            t_id2: BitTimes(2_000),
            t_sl: BitTimes(2_000),
            ..BusParams::standard(Baud::B12000000)
        };
        let is_right = |change: fn(&mut BusParams)| {
            let mut params = good;
            change(&mut params);
            params.validate().is_ok()
        };
        assert!(is_right(|p| p.t_sdr_max = BitTimes(1023)));
        assert!(!is_right(|p| p.t_sdr_max = BitTimes(1024)));
        let set = |t_set| {
            BusParams {
                t_set: BitTimes(t_set),
                t_id1: BitTimes(1_000),
                ..good
            }
            .validate()
            .is_ok()
        };
        assert_eq!([0, 1, 255, 256].map(set), [false, true, true, false]);
        assert!(is_right(|p| p.t_sl = BitTimes(16_383)));
        assert!(!is_right(|p| p.t_sl = BitTimes(16_384)));
        for (t_tr, right) in [(0, false), (1, true), (0x00FF_FFFF, true), (0x0100_0000, false)] {
            let params = BusParams {
                t_tr: BitTimes(t_tr),
                ..good
            };
            assert_eq!(params.validate().is_ok(), right, "Ttr {t_tr}");
        }
    }

    #[test]
    fn the_latency_allowance_only_lengthens_the_slot() {
        let params = BusParams::standard(Baud::B1500000);
        let lenient = params.with_latency_allowance(Duration::from_millis(20));
        assert_eq!(params.slot_time(), Duration::from_micros(200));
        assert_eq!(lenient.slot_time(), Duration::from_micros(20_200));
        assert_eq!(lenient.validate(), Ok(()));
    }
}

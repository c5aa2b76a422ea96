//! The frame count bit (FCB): the master toggles it, the slave recognises a repetition by it.
//!
//! Source: IEC 61158-4-3 (FCB and FCV of the function code).

use crate::address::Address;
use crate::wire::{Fcb, FunctionCode, Header, MAX_DATA};

/// The frame count bit of the master towards one slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FcbCounter(Fcb);

impl FcbCounter {
    /// First contact: FCB = 1, FCV = 0.
    pub const START: Self = Self(Fcb::First);

    /// The value for the next request and for all its repetitions.
    pub const fn current(self) -> Fcb {
        self.0
    }

    /// The request was answered: the next one carries the other bit.
    pub fn confirm(&mut self) {
        self.0 = self.0.next();
    }

    /// The slave was lost: the next request makes first contact again.
    pub fn reset(&mut self) {
        *self = Self::START;
    }
}

/// What a responder remembers of the last counted request, to tell a repetition from a new one.
///
/// The bit alone is not enough: a master that was restarted, or one that lost count, sends something else with the same
/// bit. So the octets are compared too. Data_Exchange (default SAP both ways) is excepted: a repetition may carry newer
/// outputs; its reply is repeated and its octets are ignored.
#[derive(Debug, Clone)]
pub struct RetryGuard {
    last: Option<Counted>,
    data: [u8; MAX_DATA],
}

#[derive(Debug, Clone, Copy)]
struct Counted {
    sa: Address,
    dsap: Option<u8>,
    ssap: Option<u8>,
    fcb: CountBit,
    len: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CountBit {
    Zero,
    One,
}

/// What a request is to a responder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Novelty {
    /// To be carried out.
    New,
    /// The reply sent last is to be repeated, nothing is to be carried out.
    Repetition,
}

impl RetryGuard {
    /// Nothing remembered: every request is new.
    pub const fn new() -> Self {
        Self {
            last: None,
            data: [0; MAX_DATA],
        }
    }

    /// Judges a request and remembers it when it is new.
    pub fn judge(&mut self, header: &Header, data: &[u8]) -> Novelty {
        let FunctionCode::Request { fcb, .. } = header.fc else {
            return Novelty::New;
        };
        let (bit, counted) = match fcb {
            Fcb::Inactive => {
                self.last = None;
                return Novelty::New;
            }
            Fcb::First => (CountBit::One, false),
            Fcb::High => (CountBit::One, true),
            Fcb::Low => (CountBit::Zero, true),
        };
        if counted && self.last.is_some_and(|last| self.repeats(last, bit, header, data)) {
            return Novelty::Repetition;
        }
        let len = if header.dsap.is_some() { data.len() } else { 0 };
        // Longer than any telegram cannot come from the decoder; it is then never taken for a repetition.
        self.last = match (self.data.get_mut(..len), data.get(..len)) {
            (Some(target), Some(source)) => {
                target.copy_from_slice(source);
                Some(Counted {
                    sa: header.sa,
                    dsap: header.dsap,
                    ssap: header.ssap,
                    fcb: bit,
                    len,
                })
            }
            _ => None,
        };
        Novelty::New
    }

    /// Forgets the last request.
    pub fn clear(&mut self) {
        self.last = None;
    }

    fn repeats(&self, last: Counted, bit: CountBit, header: &Header, data: &[u8]) -> bool {
        let same_request =
            last.fcb == bit && last.sa == header.sa && last.dsap == header.dsap && last.ssap == header.ssap;
        let is_data_exchange = header.dsap.is_none() && header.ssap.is_none();
        same_request && (is_data_exchange || self.data.get(..last.len) == Some(data))
    }
}

impl Default for RetryGuard {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::RequestFunction;

    fn request(fcb: Fcb, sap: Option<u8>) -> Header {
        Header {
            da: Address::new(3).unwrap(),
            sa: Address::new(2).unwrap(),
            dsap: sap,
            ssap: sap.map(|_| 62),
            fc: FunctionCode::Request {
                fcb,
                function: RequestFunction::SrdHigh,
            },
        }
    }

    #[test]
    fn the_bit_toggles_after_first_contact() {
        // 6D 5D 7D 5D: FCB 1 (FCV 0), then 0, 1, 0
        let mut counter = FcbCounter::START;
        let mut seen = Vec::new();
        for _ in 0..4 {
            seen.push(counter.current());
            counter.confirm();
        }
        assert_eq!(seen, [Fcb::First, Fcb::Low, Fcb::High, Fcb::Low]);
        counter.reset();
        assert_eq!(counter.current(), Fcb::First);
    }

    #[test]
    fn the_same_bit_with_the_same_octets_is_a_repetition() {
        let mut guard = RetryGuard::new();
        assert_eq!(guard.judge(&request(Fcb::Low, Some(62)), &[1, 2]), Novelty::New);
        assert_eq!(guard.judge(&request(Fcb::Low, Some(62)), &[1, 2]), Novelty::Repetition);
        assert_eq!(guard.judge(&request(Fcb::High, Some(62)), &[1, 2]), Novelty::New);
    }

    #[test]
    fn the_same_bit_with_other_octets_is_new() {
        let mut guard = RetryGuard::new();
        guard.judge(&request(Fcb::Low, Some(62)), &[1, 2]);
        assert_eq!(guard.judge(&request(Fcb::Low, Some(62)), &[1, 3]), Novelty::New);
        assert_eq!(guard.judge(&request(Fcb::Low, Some(61)), &[1, 3]), Novelty::New);
    }

    #[test]
    fn a_repeated_data_exchange_may_carry_newer_outputs() {
        let mut guard = RetryGuard::new();
        guard.judge(&request(Fcb::Low, None), &[1]);
        assert_eq!(guard.judge(&request(Fcb::Low, None), &[2]), Novelty::Repetition);
    }

    #[test]
    fn first_contact_is_always_new() {
        let mut guard = RetryGuard::new();
        guard.judge(&request(Fcb::First, Some(60)), &[]);
        assert_eq!(guard.judge(&request(Fcb::First, Some(60)), &[]), Novelty::New);
    }

    #[test]
    fn another_master_with_the_same_bit_is_new() {
        let mut guard = RetryGuard::new();
        guard.judge(&request(Fcb::Low, None), &[1]);
        let mut other = request(Fcb::Low, None);
        other.sa = Address::new(4).unwrap();
        assert_eq!(guard.judge(&other, &[1]), Novelty::New);
    }

    #[test]
    fn a_request_without_frame_count_is_new_and_so_is_what_follows() {
        let mut guard = RetryGuard::default();
        guard.judge(&request(Fcb::Low, None), &[1]);
        assert_eq!(guard.judge(&request(Fcb::Inactive, None), &[1]), Novelty::New);
        assert_eq!(guard.judge(&request(Fcb::Low, None), &[1]), Novelty::New);
    }

    #[test]
    fn a_response_is_no_repetition_and_is_not_remembered() {
        let mut guard = RetryGuard::new();
        guard.judge(&request(Fcb::High, None), &[1]);
        let mut response = request(Fcb::High, None);
        response.fc = FunctionCode::from_octet(0x08);
        assert_eq!(guard.judge(&response, &[1]), Novelty::New);
        assert_eq!(guard.judge(&request(Fcb::High, None), &[1]), Novelty::Repetition);
        guard.clear();
        assert_eq!(guard.judge(&request(Fcb::High, None), &[1]), Novelty::New);
    }

    #[test]
    fn the_first_contact_counts_as_one() {
        let mut guard = RetryGuard::new();
        guard.judge(&request(Fcb::First, None), &[1]);
        // FCB is 1 in both: the answer to the first contact was lost and the master went on (EN 50170-2, part 4).
        assert_eq!(guard.judge(&request(Fcb::High, None), &[1]), Novelty::Repetition);
        guard.judge(&request(Fcb::First, None), &[1]);
        assert_eq!(guard.judge(&request(Fcb::Low, None), &[1]), Novelty::New);
    }

    #[test]
    fn an_access_point_more_or_less_is_another_request() {
        let mut guard = RetryGuard::new();
        guard.judge(&request(Fcb::Low, Some(62)), &[1]);
        let mut other = request(Fcb::Low, Some(62));
        other.ssap = Some(61);
        assert_eq!(guard.judge(&other, &[1]), Novelty::New);
        // With one access point alone it is no Data_Exchange: the data count.
        let mut half = request(Fcb::High, None);
        half.dsap = Some(55);
        guard.judge(&half, &[1]);
        assert_eq!(guard.judge(&half, &[2]), Novelty::New);
        assert_eq!(guard.judge(&half, &[2]), Novelty::Repetition);
    }
}

//! Looks over the block's shoulder at the parameter channel and tells what the block never looks at: a refused
//! parameter, an answer that does not belong to the request, no answer at all (film-feed specification, section 11).

use drivecom::CodeNumber;
use drivecom::param::ErrorCode;

use crate::block::{FilmFeedBlock, ParameterTelegram};
use crate::report::ParameterTrouble;

/// Counts the block's exchanges and judges each answer. One call per PLC cycle, after the block.
#[derive(Debug, Clone)]
pub struct ParameterWatch {
    limit_ns: u64,
    counter: u16,
    /// Which of the seven telegrams was in work after the last cycle. Not the counter: Error_RESET starts with the first
    /// telegram again and leaves the counter as it is.
    at_work: usize,
    /// The answer the block saw in this cycle: what it received at the end of the cycle before.
    received: ParameterTelegram,
    last_done_ns: u64,
    rounds: u64,
    silent: bool,
    troubles: Vec<ParameterTrouble>,
}

impl ParameterWatch {
    /// A watch that calls an exchange lost when it takes longer than `limit_ns`.
    pub fn new(limit_ns: u64, now_ns: u64) -> Self {
        ParameterWatch {
            limit_ns,
            counter: 0,
            at_work: 0,
            received: ParameterTelegram::default(),
            last_done_ns: now_ns,
            rounds: 0,
            silent: false,
            troubles: Vec::new(),
        }
    }

    /// Complete rounds of the telegrams so far.
    pub fn rounds(&self) -> u64 {
        self.rounds
    }

    /// What went wrong, each once.
    pub fn troubles(&self) -> &[ParameterTrouble] {
        &self.troubles
    }

    /// Sees the block after a cycle at `now_ns`.
    pub fn observe(&mut self, now_ns: u64, block: &FilmFeedBlock, error_reset: bool) {
        let counter = block.telegram_counter();
        if counter != self.counter {
            if let Some(request) = block.telegrams().get(self.at_work) {
                let answer = self.received;
                self.judge(request, &answer);
            }
            if counter == 0 {
                self.rounds += 1;
            }
            self.counter = counter;
            self.last_done_ns = now_ns;
            self.silent = false;
        } else if error_reset {
            // Error_RESET holds the net on purpose.
            self.last_done_ns = now_ns;
        } else if !self.silent && now_ns.saturating_sub(self.last_done_ns) > self.limit_ns {
            self.silent = true;
            if let Some(request) = block.telegrams().get(self.at_work) {
                let waited_ms = self.limit_ns / 1_000_000;
                self.report(request, format!("the drive did not answer within {waited_ms} ms"));
            }
        }
        self.at_work = usize::from(block.telegram_pointer().saturating_sub(FIRST_TELEGRAM)) / TELEGRAM_SIZE;
        self.received = block.parameter_received();
    }

    fn judge(&mut self, request: &ParameterTelegram, answer: &ParameterTelegram) {
        if answer.service & ERROR_BIT != 0 {
            let error = ErrorCode::from_data(answer.data.to_be_bytes());
            self.report(request, format!("the drive refused it: {error}"));
        } else if answer.index != 0 && (answer.index, answer.subindex) != (request.index, request.subindex) {
            // Index 0: a module that does not echo the address cannot be checked.
            // The block takes a handshake that was there from the start for the answer to its first telegram.
            self.report(
                request,
                "its answer never came, the block took an older one for it".to_string(),
            );
        }
    }

    fn report(&mut self, request: &ParameterTelegram, what: String) {
        let trouble = ParameterTrouble {
            code: code_name(request),
            what,
        };
        if !self.troubles.contains(&trouble) {
            self.troubles.push(trouble);
        }
    }
}

/// Octet address of the first telegram in the block's instance data, and the octets of each.
const FIRST_TELEGRAM: u16 = 22;
const TELEGRAM_SIZE: usize = 8;

/// Bit 7 of the answer's service byte (9300 fact sheet, section 3.1).
const ERROR_BIT: u8 = 0x80;

fn code_name(telegram: &ParameterTelegram) -> String {
    match CodeNumber::from_index(telegram.index) {
        Some(code) => format!("C{:04}/{}", code.number(), telegram.subindex),
        None => format!("index 0x{:04X}/{}", telegram.index, telegram.subindex),
    }
}

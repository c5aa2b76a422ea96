//! Looks over the block's shoulder at the parameter channel and tells what the block never looks at: a refused
//! parameter, an answer that does not belong to the request, no answer at all (film-feed specification, section 11).

use drivecom::param::ErrorCode;

use crate::block::{FilmFeedBlock, ParameterTelegram};
use crate::report::ParameterTrouble;

/// Whether the slave's images are exchanged in a PLC cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Periphery {
    /// The slave is in data exchange.
    Present,
    /// It is not: what the block reads stays as it was, what it writes goes nowhere.
    Absent,
}

/// Follows the block's exchanges and judges each answer. One call per PLC cycle, after the block.
#[derive(Debug, Clone)]
pub struct ParameterWatch {
    limit_ns: u64,
    /// Which of the seven telegrams was in work after the last cycle.
    at_work: usize,
    /// Cycles in which the request in work was written to the periphery.
    written: u32,
    /// The answer the block saw in this cycle: what it received at the end of the cycle before.
    received: ParameterTelegram,
    /// Whether the module was seen to repeat index and subindex of the request.
    echoes: bool,
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
            at_work: 0,
            written: 0,
            received: ParameterTelegram::default(),
            echoes: false,
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
    pub fn observe(&mut self, now_ns: u64, block: &FilmFeedBlock, error_reset: bool, periphery: Periphery) {
        let fired = block.fired();
        if block.exchange_is_done() {
            if let Some(request) = block.telegrams().get(self.at_work) {
                let answer = self.received;
                self.judge(request, &answer);
            }
            if block.telegram_counter() == 0 {
                self.rounds += 1;
            }
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
        if NEW_REQUEST.into_iter().any(|transition| fired.fired(transition)) {
            self.written = 0;
        }
        if !error_reset && periphery == Periphery::Present {
            self.written = self.written.saturating_add(1);
        }
        self.at_work = block.telegram_at_work();
        self.received = block.parameter_received();
    }

    /// The block has taken `answer` for that to `request`.
    fn judge(&mut self, request: &ParameterTelegram, answer: &ParameterTelegram) {
        // The block reads before it writes: an answer that was there when the request was first written is none to it.
        // So it goes with a drive whose handshake starts at 1 (film-feed specification, section 8.1 point 8).
        if self.written <= 1 {
            let what = "it never reached the drive: the handshake already stood as the block awaited it";
            self.report(request, what.to_string());
            return;
        }
        if (answer.index, answer.subindex) == (request.index, request.subindex) {
            self.echoes = true;
        } else if answer.index != 0 {
            let what = "its answer never came, the block took an older one for it";
            self.report(request, what.to_string());
        } else if self.echoes {
            let what = "its answer never came, the block took an empty image for it";
            self.report(request, what.to_string());
        }
        // Index 0 from a module that never repeats the address cannot be told from an answer.
        if answer.is_refusal() {
            let error = ErrorCode::from_data(answer.data.to_be_bytes());
            let refused = if answer.index == 0 { request } else { answer };
            self.report(refused, format!("the drive refused it: {error}"));
        }
    }

    fn report(&mut self, telegram: &ParameterTelegram, what: String) {
        let trouble = ParameterTrouble {
            code: telegram.code_name(),
            what,
        };
        if !self.troubles.contains(&trouble) {
            self.troubles.push(trouble);
        }
    }
}

/// T5 and T6 choose the handshake of a new request; T13 writes it in the same cycle.
const NEW_REQUEST: [u8; 2] = [5, 6];

#[cfg(test)]
mod tests {
    use drivecom::param::{Frame, Handshake, Server, ServerAction, ServerOptions};

    use super::*;
    use crate::block::{self, Inputs};

    const PZD: u16 = 280;
    const PAR: u16 = 272;
    const CYCLE_NS: u64 = 5_000_000;
    const LIMIT_NS: u64 = 1_000_000_000;

    /// The parameter server of the profile behind a periphery that can go away.
    struct Drive {
        server: Server,
        request: Frame,
        /// PLC cycles a job takes.
        delay: u32,
        waited: u32,
        /// Code that is refused, with octets 5 to 8 of the answer.
        refused: Option<(u16, [u8; 4])>,
        /// Jobs are taken and never done.
        mute: bool,
        /// The answer image reads as zero.
        vanished: bool,
        present: bool,
        served: Vec<(u16, u8)>,
    }

    impl Drive {
        fn new(initial_handshake: Handshake) -> Self {
            Drive {
                server: Server::new(ServerOptions {
                    initial_handshake,
                    ..ServerOptions::default()
                }),
                request: Frame::EMPTY,
                delay: 0,
                waited: 0,
                refused: None,
                mute: false,
                vanished: false,
                present: true,
                served: Vec::new(),
            }
        }

        /// Between two PLC cycles.
        fn work(&mut self) {
            if self.server.running().is_none()
                && let ServerAction::Start(_) = self.server.poll(&self.request)
            {
                self.waited = 0;
            }
            let Some(job) = self.server.running().filter(|_| !self.mute) else {
                return;
            };
            if self.waited < self.delay {
                self.waited += 1;
                return;
            }
            self.served.push((job.code.number(), job.subcode.0));
            let refusal = self.refused.filter(|(code, _)| *code == job.code.number());
            // 179.0708, 7 and 1 would be read; any value does here.
            self.server.complete(match refusal {
                Some((_, data)) => Err(ErrorCode::from_data(data)),
                None => Ok(10_000),
            });
        }
    }

    impl block::Periphery for Drive {
        fn dprd_dat(&mut self, address: u16, record: &mut [u8; 8]) -> bool {
            if !self.present {
                return false;
            }
            *record = match address {
                PAR if !self.vanished => self.server.answer().0,
                _ => [0; 8],
            };
            true
        }

        fn dpwr_dat(&mut self, address: u16, record: &[u8; 8]) -> bool {
            if self.present && address == PAR {
                self.request = Frame(*record);
            }
            self.present
        }
    }

    struct Bench {
        block: FilmFeedBlock,
        inputs: Inputs,
        drive: Drive,
        watch: ParameterWatch,
        now_ns: u64,
    }

    impl Bench {
        fn new(drive: Drive) -> Self {
            Bench {
                block: FilmFeedBlock::new(),
                inputs: Inputs {
                    pzd_adr: PZD,
                    ..Inputs::default()
                },
                drive,
                watch: ParameterWatch::new(LIMIT_NS, 0),
                now_ns: 0,
            }
        }

        fn run(&mut self, cycles: u32) {
            for _ in 0..cycles {
                self.drive.work();
                self.now_ns += CYCLE_NS;
                self.block.cycle(&mut self.inputs, &mut self.drive);
                let periphery = if self.drive.present {
                    Periphery::Present
                } else {
                    Periphery::Absent
                };
                self.watch
                    .observe(self.now_ns, &self.block, self.inputs.error_reset, periphery);
            }
        }

        fn told(&self) -> Vec<(&str, &str)> {
            self.watch
                .troubles()
                .iter()
                .map(|trouble| (trouble.code.as_str(), trouble.what.as_str()))
                .collect()
        }
    }

    #[test]
    fn a_drive_that_answers_gives_no_trouble_and_its_rounds_are_counted() {
        // Film-feed specification, section 8.1 point 5: 21 cycles a round at best, 7 · d more with a delay of d.
        for (delay, cycles) in [(0, 21), (8, 77)] {
            let mut bench = Bench::new(Drive::new(Handshake::Clear));
            bench.drive.delay = delay;
            bench.run(10 * cycles);
            assert_eq!(bench.watch.rounds(), 10, "delay {delay}");
            assert_eq!(bench.told(), [], "delay {delay}");
        }
    }

    #[test]
    fn a_silent_drive_is_told_once_with_the_code_that_waits() {
        let mut bench = Bench::new(Drive::new(Handshake::Clear));
        bench.run(21);
        bench.drive.mute = true;
        bench.run(200);
        assert_eq!(bench.told(), [], "not before the limit");
        bench.run(1_000);
        assert_eq!(bench.told(), [("C1302/1", "the drive did not answer within 1000 ms")]);
        bench.drive.mute = false;
        bench.run(200);
        assert_eq!(bench.told().len(), 1, "it answered after all");
        assert!(bench.watch.rounds() > 2);
    }

    #[test]
    fn each_silence_is_told_but_never_twice_in_the_same_words() {
        let mut bench = Bench::new(Drive::new(Handshake::Clear));
        bench.drive.delay = 300;
        bench.run(14 * 310);
        let codes: Vec<&str> = bench.told().iter().map(|(code, _)| *code).collect();
        assert_eq!(
            codes,
            [
                "C1302/1", "C1302/2", "C1303/1", "C1301/1", "C1204/0", "C1202/0", "C1203/0"
            ]
        );
    }

    #[test]
    fn the_time_under_error_reset_is_no_silence() {
        let mut bench = Bench::new(Drive::new(Handshake::Clear));
        bench.run(21);
        bench.inputs.error_reset = true;
        bench.run(1_000);
        bench.inputs.error_reset = false;
        bench.run(42);
        assert_eq!(bench.told(), []);
    }

    #[test]
    fn a_refused_parameter_is_told_with_its_reason() {
        // 9300 fact sheet, section 3.3.
        let mut bench = Bench::new(Drive::new(Handshake::Clear));
        bench.drive.refused = Some((1204, [0x06, 0x07, 0x00, 0x00]));
        bench.run(63);
        let told = bench.told();
        assert_eq!(told.len(), 1, "{told:?}");
        assert_eq!(told[0].0, "C1204/0");
        assert!(told[0].1.starts_with("the drive refused it: "), "{told:?}");
        assert!(told[0].1.contains("does not exist"), "{told:?}");
        // The block itself stores the error as the constant (section 9.1): 0x06070000 / 10000 = 10 112.2048.
        assert_eq!(bench.block.constants().feed_constant, 10_112.205);
    }

    #[test]
    fn a_drive_that_starts_with_handshake_1_never_gets_the_first_telegram_and_that_is_told() {
        // Film-feed specification, section 8.1 point 8.
        let mut bench = Bench::new(Drive::new(Handshake::Set));
        bench.run(20);
        assert_eq!(bench.drive.served.first(), Some(&(1302, 2)));
        let lost = "it never reached the drive: the handshake already stood as the block awaited it";
        assert_eq!(bench.told(), [("C1302/1", lost)]);
        bench.run(200);
        assert!(bench.drive.served.contains(&(1302, 1)), "the next round carries it");
        assert_eq!(bench.told().len(), 1);
    }

    #[test]
    fn a_handshake_of_1_that_shows_only_when_the_bus_comes_up_is_told_all_the_same() {
        let mut bench = Bench::new(Drive::new(Handshake::Set));
        bench.drive.present = false;
        bench.run(50);
        bench.drive.present = true;
        bench.run(100);
        assert_eq!(bench.told().len(), 1, "{:?}", bench.told());
        assert_eq!(bench.told()[0].0, "C1302/1");
    }

    #[test]
    fn an_answer_image_that_falls_to_zero_is_not_taken_for_an_answer() {
        // Film-feed specification, section 8.1 point 9.
        let mut bench = Bench::new(Drive::new(Handshake::Clear));
        bench.run(21);
        // The second request of this round awaits handshake 0 when the drive goes mute and its image falls to zero.
        bench.run(1);
        bench.drive.mute = true;
        bench.run(5);
        assert!(
            !bench.block.parameter_sent().handshake(),
            "the test wants handshake 0 awaited"
        );
        bench.drive.vanished = true;
        bench.run(3);
        assert_eq!(
            bench.told(),
            [("C1302/1", "its answer never came, the block took an empty image for it")]
        );
    }

    #[test]
    fn the_answer_to_a_request_overtaken_by_error_reset_is_not_taken_for_that_of_the_next() {
        // Film-feed specification, section 8.1 point 7: a reset during a handshake loses the first telegram of that round.
        let mut bench = Bench::new(Drive::new(Handshake::Clear));
        bench.drive.delay = 10;
        // In work is the second telegram.
        bench.run(13 + 4);
        assert_eq!(bench.block.telegram_counter(), 1);
        bench.inputs.error_reset = true;
        bench.run(2);
        bench.inputs.error_reset = false;
        bench.run(12);
        assert_eq!(
            bench.told(),
            [("C1302/1", "its answer never came, the block took an older one for it")]
        );
        assert_eq!(bench.drive.served, [(1302, 1), (1302, 2)]);
    }

    #[test]
    fn an_answer_that_came_while_error_reset_held_the_net_is_none_to_the_next_request() {
        let mut bench = Bench::new(Drive::new(Handshake::Clear));
        bench.drive.delay = 10;
        bench.run(13 + 4);
        bench.inputs.error_reset = true;
        bench.run(20);
        bench.inputs.error_reset = false;
        bench.run(3);
        let told = bench.told();
        assert_eq!(told.len(), 1, "{told:?}");
        assert_eq!(told[0].0, "C1302/1");
        assert!(told[0].1.starts_with("it never reached the drive"), "{told:?}");
    }

    #[test]
    fn a_module_that_does_not_repeat_the_address_is_not_accused() {
        let mut watch = ParameterWatch::new(LIMIT_NS, 0);
        watch.written = 5;
        let request = ParameterTelegram::from_bytes([0x32, 1, 0x5A, 0xE9, 0, 0x0F, 0x42, 0x40]);
        watch.judge(&request, &ParameterTelegram::from_bytes([0x40, 0, 0, 0, 0, 0, 0, 0]));
        assert_eq!(watch.troubles(), []);
        watch.judge(&request, &ParameterTelegram::from_bytes([0xB0, 0, 0, 0, 8, 0, 0, 0x31]));
        assert_eq!(watch.troubles().len(), 1);
        assert_eq!(watch.troubles()[0].code, "C1302/1");
    }
}

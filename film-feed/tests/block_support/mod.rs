//! A small scripted drive for the tests of the block.

use film_feed::block::{FilmFeedBlock, Inputs, Outputs, ParameterTelegram, Periphery};

pub(crate) const PZD: u16 = 280;
pub(crate) const PAR: u16 = 272;

/// What the block did to the periphery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    Read(u16),
    Write(u16),
}

/// Drive behind a bus module: process data as scripted, a parameter server with handshake.
#[derive(Debug, Clone)]
pub(crate) struct Drive {
    pub(crate) status: u16,
    pub(crate) speed: u16,
    pub(crate) position: i32,
    /// Control word last written.
    pub(crate) control: u16,
    /// Request and answer on the parameter channel, as they stand in the images.
    pub(crate) request: ParameterTelegram,
    pub(crate) answer: ParameterTelegram,
    /// Cycles an answer takes after the next image.
    pub(crate) delay: u32,
    pub(crate) waiting: Option<u32>,
    /// Requests that are thrown away as if they had never come.
    pub(crate) swallow: u32,
    pub(crate) swallowed: Option<bool>,
    /// Code that is answered with this error.
    pub(crate) error: Option<(u16, u32)>,
    /// The answer image reads as zero while this is set.
    pub(crate) dead: bool,
    /// C1202, C1203, C1204 as on the bus, ×10000.
    pub(crate) codes: [(u16, u32); 3],
    /// Requests served, in order.
    pub(crate) served: Vec<ParameterTelegram>,
    pub(crate) log: Vec<Access>,
}

impl Default for Drive {
    fn default() -> Self {
        Self {
            status: 0x0233,
            speed: 0,
            position: 0,
            control: 0,
            request: ParameterTelegram::default(),
            answer: ParameterTelegram::default(),
            delay: 0,
            waiting: None,
            swallow: 0,
            swallowed: None,
            error: None,
            dead: false,
            // Commissioning values: film-feed specification, section 5.
            codes: [(1202, 70_000), (1203, 10_000), (1204, 1_790_708)],
            served: Vec::new(),
            log: Vec::new(),
        }
    }
}

/// Code number of a telegram: index = 24575 − code (film-feed specification, section 3).
pub(crate) fn code(telegram: &ParameterTelegram) -> u16 {
    24_575 - telegram.index
}

impl Drive {
    /// A drive whose handshake is 1 when the PLC powers up.
    pub(crate) fn beginning_with_handshake_1() -> Self {
        let answer = ParameterTelegram {
            service: 0x40,
            ..ParameterTelegram::default()
        };
        Self {
            answer,
            ..Self::default()
        }
    }

    /// Between two PLC cycles: looks at the request and answers if it is time.
    fn work(&mut self) {
        let wanted = self.request.handshake();
        if self.request.service == 0 || wanted == self.answer.handshake() || self.swallowed == Some(wanted) {
            return;
        }
        if self.swallow > 0 {
            self.swallow -= 1;
            self.swallowed = Some(wanted);
            return;
        }
        match self.waiting.unwrap_or(self.delay) {
            0 => {
                self.waiting = None;
                self.serve();
            }
            left => self.waiting = Some(left - 1),
        }
    }

    fn serve(&mut self) {
        self.served.push(self.request);
        self.answer = self.request;
        let code = code(&self.request);
        if let Some((_, value)) = self.error.filter(|(failing, _)| *failing == code) {
            self.answer.service |= 0x80;
            self.answer.data = value;
        } else if let Some((_, value)) = self.codes.iter().find(|(known, _)| *known == code) {
            self.answer.data = *value;
        }
    }
}

impl Periphery for Drive {
    fn dprd_dat(&mut self, laddr: u16, record: &mut [u8; 8]) -> bool {
        self.log.push(Access::Read(laddr));
        match laddr {
            PZD => {
                let [s1, s0] = self.status.to_be_bytes();
                let [n1, n0] = self.speed.to_be_bytes();
                let [p3, p2, p1, p0] = self.position.to_be_bytes();
                *record = [s1, s0, n1, n0, p1, p0, p3, p2];
            }
            PAR => *record = if self.dead { [0; 8] } else { self.answer.to_bytes() },
            _ => return false,
        }
        true
    }

    fn dpwr_dat(&mut self, laddr: u16, record: &[u8; 8]) -> bool {
        self.log.push(Access::Write(laddr));
        match laddr {
            PZD => self.control = u16::from_be_bytes([record[0], record[1]]),
            PAR => self.request = ParameterTelegram::from_bytes(*record),
            _ => return false,
        }
        true
    }
}

/// Block, inputs and drive.
#[derive(Debug, Clone)]
pub(crate) struct Bench {
    pub(crate) block: FilmFeedBlock,
    pub(crate) inputs: Inputs,
    pub(crate) drive: Drive,
    /// Number of the last cycle, from 1.
    pub(crate) cycle: u32,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::with(Drive::default())
    }

    pub(crate) fn with(drive: Drive) -> Self {
        let inputs = Inputs {
            pzd_adr: PZD,
            ..Inputs::default()
        };
        Self {
            block: FilmFeedBlock::new(),
            inputs,
            drive,
            cycle: 0,
        }
    }

    /// One PLC cycle, the drive having worked since the last one.
    pub(crate) fn step(&mut self) -> Outputs {
        self.drive.work();
        self.drive.log.clear();
        self.cycle += 1;
        *self.block.cycle(&mut self.inputs, &mut self.drive)
    }

    pub(crate) fn run(&mut self, cycles: u32) {
        for _ in 0..cycles {
            self.step();
        }
    }

    /// Runs up to and including cycle `cycle`.
    pub(crate) fn run_to(&mut self, cycle: u32) {
        assert!(cycle >= self.cycle);
        self.run(cycle - self.cycle);
    }

    /// The marked places.
    pub(crate) fn places(&self) -> Vec<u8> {
        (1..=11).filter(|place| self.block.marking().holds(*place)).collect()
    }

    /// Whether a bit of the control word last written is high.
    pub(crate) fn control(&self, bit: u32) -> bool {
        self.drive.control >> bit & 1 == 1
    }
}

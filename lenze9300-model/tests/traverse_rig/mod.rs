//! A film that follows the set-value without delay, with marks and a touch probe.

use lenze9300_model::code::table::number::*;
use lenze9300_model::code::{CodeStore, Inhibit};
use lenze9300_model::traverse::*;

/// Increments per millimetre (9300 facts 11).
pub(crate) const PER_MM: f64 = 2_561.847_045_972_878;

pub(crate) struct Rig {
    pub(crate) traverse: Traverse,
    pub(crate) codes: CodeStore,
    pub(crate) inputs: TraverseInputs,
    pub(crate) last: Setpoint,
    /// Film position that counts as 0, in inc of the roller since power-up.
    pub(crate) reference: i64,
    /// Film position in inc.
    pub(crate) film: i64,
    /// Marks on the film in inc, ascending.
    pub(crate) marks: Vec<i64>,
    pub(crate) probe: TouchProbe,
    pub(crate) events: Vec<TraverseEvent>,
    pub(crate) ticks: u64,
}

#[allow(dead_code, reason = "each test file uses its part of the rig")]
impl Rig {
    pub(crate) fn new() -> Self {
        Self::with_parameters(TraverseParameters::default())
    }

    /// The film feed, enabled, at rest, at 100 % speed and acceleration, 1200 mm, marks read at 20 %.
    pub(crate) fn with_parameters(parameters: TraverseParameters) -> Self {
        let mut rig = Self {
            traverse: Traverse::with_parameters(film_feed_program(), parameters),
            codes: CodeStore::thesis(),
            inputs: TraverseInputs {
                enabled: true,
                ..TraverseInputs::default()
            },
            last: Setpoint::default(),
            reference: 0,
            film: 0,
            marks: Vec::new(),
            probe: TouchProbe::new(LatchMode::Fast, ActiveEdge::Rising),
            events: Vec::new(),
            ticks: 0,
        };
        rig.set(C1301, 1, 1200_0000);
        rig.set(C1302, 1, 100_0000);
        rig.set(C1302, 2, 20_0000);
        rig.set(C1303, 1, 100_0000);
        rig.tick();
        rig
    }

    pub(crate) fn set(&mut self, code: u16, subcode: u8, value: i32) {
        self.codes
            .write(code, subcode, value, Inhibit::Inactive)
            .expect("a value in range");
    }

    pub(crate) fn tick(&mut self) -> Setpoint {
        self.inputs.pos_act = self.film - self.reference;
        let setpoint = self.traverse.tick_1ms(&self.inputs, &self.codes);
        self.reference -= setpoint.reference_shift;
        self.last = setpoint;
        self.ticks += 1;
        let before = self.film;
        if self.inputs.enabled {
            self.film = setpoint.position + self.reference;
        }
        for &mark in self.marks.iter().filter(|&&mark| before < mark && mark <= self.film) {
            self.probe.handle_edge(ActiveEdge::Rising, mark - self.reference);
        }
        self.inputs.touch = self.probe.tick_1ms(false, self.film - self.reference);
        while let Some(event) = self.traverse.poll_event() {
            self.events.push(event);
        }
        setpoint
    }

    pub(crate) fn run(&mut self, ticks: u64) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    /// Low for a tick, then high: the edge is in the last tick.
    pub(crate) fn start(&mut self) {
        self.inputs.start = false;
        self.tick();
        self.inputs.start = true;
        self.tick();
    }

    /// Ticks until the program runs no more (bounded by a minute).
    pub(crate) fn until_ended(&mut self) -> u64 {
        for ticks in 1..=60_000 {
            self.tick();
            if !self.traverse.status().running {
                return ticks;
            }
        }
        panic!("the program never ended");
    }

    /// Starts and works the program off; the number of ticks from the edge to the end.
    pub(crate) fn feed(&mut self) -> u64 {
        self.start();
        self.until_ended()
    }

    pub(crate) fn film_mm(&self) -> f64 {
        self.film as f64 / PER_MM
    }

    /// A mark this many millimetres ahead of the present position.
    pub(crate) fn mark_ahead(&mut self, mm: f64) {
        self.marks.push(self.film + (mm * PER_MM).round() as i64);
    }

    pub(crate) fn saw(&self, event: TraverseEvent) -> bool {
        self.events.contains(&event)
    }

    pub(crate) fn reversed(&self) -> bool {
        self.events
            .iter()
            .any(|event| matches!(event, TraverseEvent::ReversalPlanned { .. }))
    }
}

/// Record number, known to lie in range.
#[allow(dead_code, reason = "each test file uses its part of the rig")]
pub(crate) fn number(number: u8) -> RecordNumber {
    RecordNumber::new(number).expect("1 to 32")
}

/// A record that sets the reference to 0 and goes on at record 1: absolute targets need one (9300 facts 4.2). Put it at 32 and
/// let C1211 begin there.
#[allow(dead_code, reason = "each test file uses its part of the rig")]
pub(crate) fn reference_first() -> (u8, Record) {
    let record = Record {
        jump: Successor::Record(number(1)),
        ..Record::new(Mode::SetReference, Target::Zero)
    };
    (32, record)
}

//! Whole cycles, the net composed with an abstract drive.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use drivecom::petri::{
    Action, Guard, Marking, Net, NetContext, PARAMETER_NET, PARAMETER_TRANSITIONS, Places, RESET_MARKING, Transition,
};

use crate::{Counterexample, Verdict, broken};

/// How the drive treats a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Behaviour {
    /// Answers after any number of cycles.
    Answers,
    /// Never answers.
    Silent,
    /// Answers after any number of cycles and may fall silent at any time for good.
    MayDie,
}

/// Block and drive between two cycles. Seven telegrams, four writes and three reads, as in the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct World {
    marking: Marking,
    counter: u8,
    pointer: u8,
    address: u8,
    received: bool,
    sent: bool,
    // The service octet has been written once; before, the image is all zero and no request.
    spoken: bool,
    accepted: bool,
    shown: bool,
    pending: bool,
    alive: bool,
    // Jobs the drive took since the last T12; counts to 2.
    deliveries: u8,
    // Deliveries at the T12 of the last cycle.
    finished_with: Option<u8>,
}

impl NetContext for World {
    fn guard(&self, guard: Guard) -> bool {
        match guard {
            Guard::Always => true,
            Guard::TelegramIsWrite => self.address < 4,
            Guard::TelegramIsRead => self.address >= 4,
            Guard::HandshakeSet => self.received,
            Guard::HandshakeClear => !self.received,
            Guard::CounterAboveFive => self.counter > 5,
        }
    }

    fn act(&mut self, action: Action) {
        match action {
            Action::PointToFirst => self.pointer = 0,
            Action::LoadAddress => self.address = self.pointer,
            Action::SendServiceHandshakeCleared => (self.sent, self.spoken) = (false, true),
            Action::SendServiceHandshakeSet => (self.sent, self.spoken) = (true, true),
            Action::NextTelegram => {
                if self.counter > 5 {
                    self.counter = 0;
                } else {
                    self.counter += 1;
                    self.pointer += 1;
                }
                self.finished_with = Some(self.deliveries);
                self.deliveries = 0;
            }
            Action::ExchangeParameterImage => self.received = self.shown,
            Action::LatchWriteData | Action::SendAddressing | Action::StoreReadData => {}
        }
    }
}

impl World {
    fn with_drive_at(handshake: bool) -> Self {
        Self {
            marking: RESET_MARKING,
            counter: 0,
            pointer: 0,
            address: 0,
            received: false,
            sent: false,
            spoken: false,
            accepted: handshake,
            shown: handshake,
            pending: false,
            alive: true,
            deliveries: 0,
            finished_with: None,
        }
    }

    fn cycle(&mut self, net: &Net<'_>) -> Vec<u8> {
        self.finished_with = None;
        let mut marking = self.marking;
        let fired = net.fire_cycle(&mut marking, self);
        self.marking = marking;
        fired.iter().collect()
    }

    /// The drive between two cycles: takes a request, and finishes it now when asked to.
    fn drive(&mut self, finish: bool) {
        if self.spoken && !self.pending && self.sent != self.accepted {
            self.accepted = self.sent;
            self.pending = true;
            self.deliveries = (self.deliveries + 1).min(2);
        }
        if self.pending && finish {
            self.pending = false;
            self.shown = self.accepted;
        }
    }

    /// All worlds one cycle later.
    fn successors(self, net: &Net<'_>, behaviour: Behaviour, reset: Reset) -> Vec<(String, Self)> {
        let mut list = Vec::new();
        let mut after = self;
        let fired: Vec<_> = after.cycle(net).iter().map(|n| format!("T{n}")).collect();
        let mut blocks = vec![(fired.join(" "), after)];
        if reset == Reset::AtAnyTime {
            // Error_RESET: the marking is written and nothing else happens in this cycle, no exchange either.
            blocks.push((
                "reset".into(),
                Self {
                    marking: RESET_MARKING,
                    finished_with: None,
                    ..self
                },
            ));
        }
        for (label, world) in blocks {
            let answers = behaviour != Behaviour::Silent && world.alive;
            if !answers {
                list.push((label, world));
                continue;
            }
            for finish in [true, false] {
                let mut next = world;
                next.drive(finish);
                if finish || next.pending {
                    list.push((label.clone(), next));
                    if behaviour == Behaviour::MayDie {
                        list.push((label.clone(), Self { alive: false, ..next }));
                    }
                }
            }
        }
        list
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reset {
    Never,
    AtAnyTime,
}

/// All worlds reachable at cycle ends, each with the cycle that found it.
struct Worlds {
    found_by: BTreeMap<World, Option<(World, String)>>,
    edges: BTreeMap<World, Vec<World>>,
}

impl Worlds {
    fn of(net: &Net<'_>, start: World, behaviour: Behaviour, reset: Reset) -> Self {
        let mut found_by = BTreeMap::from([(start, None)]);
        let mut edges = BTreeMap::new();
        let mut queue = VecDeque::from([start]);
        while let Some(world) = queue.pop_front() {
            let list = world.successors(net, behaviour, reset);
            for (label, next) in &list {
                found_by.entry(*next).or_insert_with(|| {
                    queue.push_back(*next);
                    Some((world, label.clone()))
                });
            }
            edges.insert(world, list.into_iter().map(|(_, next)| next).collect());
        }
        Self { found_by, edges }
    }

    fn path(&self, to: World) -> String {
        let mut text = to.marking.places().to_string();
        let mut at = to;
        while let Some(Some((from, label))) = self.found_by.get(&at) {
            text = format!("{} --[{label}]--> {text}", from.marking.places());
            at = *from;
        }
        text
    }

    /// Worlds from which no world with `goal` can be reached any more.
    fn without_way_to(&self, goal: impl Fn(&World) -> bool) -> Vec<World> {
        let mut good: BTreeSet<World> = self.found_by.keys().copied().filter(|w| goal(w)).collect();
        loop {
            let before = good.len();
            for (world, next) in &self.edges {
                if next.iter().any(|w| good.contains(w)) {
                    good.insert(*world);
                }
            }
            if good.len() == before {
                break;
            }
        }
        self.found_by.keys().copied().filter(|w| !good.contains(w)).collect()
    }

    fn markings(&self) -> BTreeSet<Marking> {
        self.found_by.keys().map(|world| world.marking).collect()
    }

    /// Every telegram the block counts as done was taken by the drive exactly once.
    fn delivered_exactly_once(&self) -> Verdict {
        for world in self.found_by.keys() {
            if let Some(deliveries) = world.finished_with
                && deliveries != 1
            {
                return Err(Counterexample(format!(
                    "delivered {deliveries} times: {}",
                    self.path(*world)
                )));
            }
        }
        Ok(())
    }

    /// From everywhere T12 can fire again.
    fn always_goes_on(&self) -> Verdict {
        match self.without_way_to(|w| w.finished_with.is_some()).first() {
            Some(world) => Err(Counterexample(format!("hangs: {}", self.path(*world)))),
            None => Ok(()),
        }
    }
}

fn marking(places: &[u8]) -> Marking {
    Marking::new(Places::of(places))
}

fn cycle_end_markings() -> BTreeSet<Marking> {
    BTreeSet::from([
        marking(&[1, 10]),
        marking(&[2, 10]),
        marking(&[5, 6, 10]),
        marking(&[6, 7, 10]),
    ])
}

#[test]
fn exactly_4_markings_occur_at_the_end_of_a_cycle() {
    for handshake in [false, true] {
        for reset in [Reset::Never, Reset::AtAnyTime] {
            let start = World::with_drive_at(handshake);
            let worlds = Worlds::of(&PARAMETER_NET, start, Behaviour::Answers, reset);
            assert_eq!(
                worlds.markings(),
                cycle_end_markings(),
                "drive starts with {handshake}, reset {reset:?}"
            );
        }
    }
    // The order of the sweep decides: with T7 tested first, a cycle ends in {4, 5, 10} and {4, 7, 10} as well.
    let mut net = PARAMETER_TRANSITIONS;
    net[..7].rotate_right(1);
    assert_eq!(net[0].number, 7);
    let worlds = Worlds::of(
        &Net { transitions: &net },
        World::with_drive_at(false),
        Behaviour::Answers,
        Reset::Never,
    );
    assert!(worlds.markings().contains(&marking(&[4, 7, 10])) && worlds.markings().len() == 6);
}

#[test]
fn with_a_drive_that_answers_every_telegram_goes_round_for_ever() {
    for handshake in [false, true] {
        let worlds = Worlds::of(
            &PARAMETER_NET,
            World::with_drive_at(handshake),
            Behaviour::Answers,
            Reset::Never,
        );
        worlds.always_goes_on().unwrap();
        for telegram in 0..7 {
            assert!(
                worlds.without_way_to(|w| w.address == telegram && w.pending).is_empty(),
                "telegram {telegram} is served again from everywhere"
            );
        }
    }
    let net = broken(7, |_| None);
    let worlds = Worlds::of(
        &Net { transitions: &net },
        World::with_drive_at(false),
        Behaviour::Answers,
        Reset::Never,
    );
    let Err(Counterexample(path)) = worlds.always_goes_on() else {
        panic!("without T7 the chain must hang")
    };
    assert!(path.starts_with("hangs: {1, 10}"), "{path}");
}

#[test]
fn a_silent_drive_leaves_the_net_resting_with_only_the_clock_running() {
    let rest = |behaviour, handshake| {
        let worlds = Worlds::of(&PARAMETER_NET, World::with_drive_at(handshake), behaviour, Reset::Never);
        let stuck = worlds.without_way_to(|w| w.finished_with.is_some());
        // Of the stuck worlds, those that only lead to themselves.
        let fixed: BTreeSet<_> = stuck
            .iter()
            .filter(|w| worlds.edges[w].iter().all(|next| next == *w))
            .map(|w| w.marking)
            .collect();
        for world in stuck.iter().filter(|w| fixed.contains(&w.marking)) {
            let mut next = *world;
            assert_eq!(next.cycle(&PARAMETER_NET), [2, 13], "places 10 and 11 still cycle");
        }
        fixed
    };
    assert_eq!(rest(Behaviour::Silent, false), BTreeSet::from([marking(&[6, 7, 10])]));
    // With a standing 1 the first telegram counts as done, and the second waits for 0.
    assert_eq!(rest(Behaviour::Silent, true), BTreeSet::from([marking(&[5, 6, 10])]));
    assert_eq!(
        rest(Behaviour::MayDie, false),
        BTreeSet::from([marking(&[5, 6, 10]), marking(&[6, 7, 10])])
    );
    assert_eq!(rest(Behaviour::Answers, false), BTreeSet::new());
}

#[test]
fn every_telegram_is_delivered_exactly_once_when_the_drive_starts_with_0() {
    let start = World::with_drive_at(false);
    Worlds::of(&PARAMETER_NET, start, Behaviour::Answers, Reset::Never)
        .delivered_exactly_once()
        .unwrap();

    let net = broken(9, |t| {
        Some(Transition {
            guard: Guard::HandshakeClear,
            ..t
        })
    });
    let worlds = Worlds::of(&Net { transitions: &net }, start, Behaviour::Answers, Reset::Never);
    let Err(Counterexample(path)) = worlds.delivered_exactly_once() else {
        panic!("a T9 that does not wait for the handshake must lose telegrams")
    };
    assert!(
        path.starts_with("delivered 0 times") && path.contains("T6 T7 T9 T11 T12"),
        "{path}"
    );
}

#[test]
fn a_drive_that_starts_with_1_never_sees_the_first_telegram_and_every_later_one_once() {
    // Film-feed specification, section 8.1, point 8.
    let start = World::with_drive_at(true);
    let worlds = Worlds::of(&PARAMETER_NET, start, Behaviour::Answers, Reset::Never);
    let Err(Counterexample(path)) = worlds.delivered_exactly_once() else {
        panic!("the loss must be found")
    };
    assert_eq!(
        path,
        "delivered 0 times: {1, 10} --[T1 T2 T4 T6 T7 T13]--> {6, 7, 10} --[T2 T9 T11 T12 T13]--> {2, 10}"
    );
    let lost = worlds.found_by.keys().filter(|w| w.finished_with == Some(0)).count();
    assert_eq!(lost, 1, "only the very first");
    assert!(worlds.found_by.keys().all(|w| w.finished_with != Some(2)));
}

#[test]
fn an_error_reset_during_a_handshake_loses_a_telegram_but_never_hangs() {
    // Film-feed specification, section 8.1, point 7.
    let start = World::with_drive_at(false);
    let worlds = Worlds::of(&PARAMETER_NET, start, Behaviour::Answers, Reset::AtAnyTime);
    worlds.always_goes_on().unwrap();
    let Err(Counterexample(path)) = worlds.delivered_exactly_once() else {
        panic!("the loss must be found")
    };
    assert!(path.contains("[reset]"), "{path}");
}

#[test]
fn one_exchange_takes_3_cycles_and_those_of_the_answer() {
    // Film-feed specification, section 8.1, point 5.
    for delay in 0..4_usize {
        let mut world = World::with_drive_at(false);
        let mut pending_for = 0;
        let mut log = Vec::new();
        while world.counter == 0 {
            log.push(world.cycle(&PARAMETER_NET));
            world.drive(pending_for >= delay);
            if world.pending {
                pending_for += 1;
            }
        }
        assert_eq!(log.len(), 3 + delay);
        assert_eq!(log[0], [1, 2, 4, 6, 7, 13]);
        assert!(log[1..=1 + delay].iter().all(|fired| fired == &[2, 13]));
        assert_eq!(log[2 + delay], [2, 9, 11, 12, 13]);
    }
}

#[test]
fn a_round_takes_21_cycles_and_the_handshake_of_a_telegram_alternates_from_round_to_round() {
    // Film-feed specification, section 8.1, points 4 and 5.
    let mut world = World::with_drive_at(false);
    let mut fired = Vec::new();
    for _ in 0..42 {
        fired.push(world.cycle(&PARAMETER_NET));
        world.drive(true);
    }
    assert_eq!(
        (world.counter, world.marking),
        (0, marking(&[1, 10])),
        "two whole rounds"
    );
    for round in 0..2 {
        for telegram in 0..7 {
            let exchange = &fired[21 * round + 3 * telegram..][..3];
            let mut expected = vec![2, if telegram < 4 { 4 } else { 3 }];
            if telegram == 0 {
                expected.insert(0, 1);
            }
            let (ask, done) = if (round + telegram) % 2 == 0 { (6, 9) } else { (5, 8) };
            expected.extend([ask, 7, 13]);
            assert_eq!(exchange[0], expected, "round {round}, telegram {telegram}");
            assert_eq!(exchange[2], [2, done, if telegram < 4 { 11 } else { 10 }, 12, 13]);
        }
    }
}

#[test]
fn after_a_reset_at_counter_k_the_next_round_has_7_minus_k_telegrams() {
    // Film-feed specification, section 8.1, point 7; the reset comes when no handshake is open.
    for k in 0..7_u8 {
        let mut world = World::with_drive_at(false);
        while world.counter != k {
            world.cycle(&PARAMETER_NET);
            world.drive(true);
        }
        world.marking = RESET_MARKING;
        let mut telegrams = 0;
        loop {
            world.cycle(&PARAMETER_NET);
            world.drive(true);
            telegrams += u8::from(world.finished_with.is_some());
            if world.marking == RESET_MARKING {
                break;
            }
        }
        assert_eq!(telegrams, 7 - k);
    }
}

//! Markings by single firing, the guards nondeterministic.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use drivecom::petri::{
    Guard, Marking, Net, PARAMETER_NET, PARAMETER_TRANSITIONS, Places, Puts, RESET_MARKING, Transition,
};

use crate::{Counterexample, Verdict, broken};

/// All markings reachable by single firings, each with the firing that found it.
struct Reachable {
    found_by: BTreeMap<Marking, Option<(Marking, u8)>>,
}

/// What a transition may put: one set, or either of two.
fn outputs(transition: &Transition) -> Vec<Places> {
    match transition.puts {
        Puts::Places(places) => vec![places],
        Puts::Choice { then, otherwise, .. } => vec![then, otherwise],
    }
}

/// Firing as a token game proper: "needs empty" is ignored, so that it can be shown redundant.
fn successors(net: &Net<'_>, marking: Marking) -> Vec<(u8, Marking, Places)> {
    let mut list = Vec::new();
    for transition in net.transitions.iter().filter(|t| marking.holds_all(t.takes)) {
        for puts in outputs(transition) {
            list.push((transition.number, marking.moved(transition.takes, puts), puts));
        }
    }
    list
}

impl Reachable {
    fn of(net: &Net<'_>) -> Self {
        let mut found_by = BTreeMap::from([(RESET_MARKING, None)]);
        let mut queue = VecDeque::from([RESET_MARKING]);
        while let Some(marking) = queue.pop_front() {
            for (number, next, _) in successors(net, marking) {
                found_by.entry(next).or_insert_with(|| {
                    queue.push_back(next);
                    Some((marking, number))
                });
            }
        }
        Self { found_by }
    }

    fn path(&self, to: Marking) -> String {
        let mut text = to.places().to_string();
        let mut at = to;
        while let Some(Some((from, number))) = self.found_by.get(&at) {
            text = format!("{} -T{number}-> {text}", from.places());
            at = *from;
        }
        text
    }

    fn violation(&self, at: Marking, what: &str) -> Counterexample {
        Counterexample(format!("{what}: {}", self.path(at)))
    }
}

fn safe(net: &Net<'_>) -> Verdict {
    let reachable = Reachable::of(net);
    for marking in reachable.found_by.keys() {
        for transition in net.transitions.iter().filter(|t| marking.holds_all(t.takes)) {
            for puts in outputs(transition) {
                let rest = marking.moved(transition.takes, Places::NONE);
                if rest.holds_any(puts) {
                    let what = format!("T{} puts a second token into {puts}", transition.number);
                    return Err(reachable.violation(*marking, &what));
                }
            }
        }
    }
    Ok(())
}

fn needs_empty_is_redundant(net: &Net<'_>) -> Verdict {
    let reachable = Reachable::of(net);
    for marking in reachable.found_by.keys() {
        for transition in net.transitions {
            if marking.holds_all(transition.takes) && marking.holds_any(transition.needs_empty) {
                let what = format!("T{} is held back by a full place", transition.number);
                return Err(reachable.violation(*marking, &what));
            }
        }
    }
    Ok(())
}

/// The sum of tokens over these places is 1 in every reachable marking.
fn invariant(net: &Net<'_>, places: &[u8]) -> Verdict {
    let reachable = Reachable::of(net);
    for marking in reachable.found_by.keys() {
        let tokens = places.iter().filter(|place| marking.holds(**place)).count();
        if tokens != 1 {
            return Err(reachable.violation(*marking, &format!("{tokens} tokens in {places:?}")));
        }
    }
    Ok(())
}

fn exclusive(a: Guard, b: Guard) -> bool {
    use Guard::{HandshakeClear, HandshakeSet, TelegramIsRead, TelegramIsWrite};
    matches!(
        (a, b),
        (HandshakeClear, HandshakeSet)
            | (HandshakeSet, HandshakeClear)
            | (TelegramIsRead, TelegramIsWrite)
            | (TelegramIsWrite, TelegramIsRead)
    )
}

fn conflict_free(net: &Net<'_>) -> Verdict {
    let reachable = Reachable::of(net);
    for marking in reachable.found_by.keys() {
        let marked: Vec<_> = net.transitions.iter().filter(|t| marking.holds_all(t.takes)).collect();
        for (i, a) in marked.iter().enumerate() {
            for b in &marked[i + 1..] {
                if !a.takes.intersection(b.takes).is_empty() && !exclusive(a.guard, b.guard) {
                    let what = format!("T{} and T{} compete", a.number, b.number);
                    return Err(reachable.violation(*marking, &what));
                }
            }
        }
    }
    Ok(())
}

/// Whether from every reachable marking every transition can fire again; the clock T2, T13 does not count as life.
fn live(net: &Net<'_>) -> Verdict {
    let reachable = Reachable::of(net);
    for marking in reachable.found_by.keys() {
        let mut seen = BTreeSet::from([*marking]);
        let mut queue = VecDeque::from([*marking]);
        let mut fired = BTreeSet::new();
        while let Some(at) = queue.pop_front() {
            for (number, next, _) in successors(net, at) {
                fired.insert(number);
                if seen.insert(next) {
                    queue.push_back(next);
                }
            }
        }
        if let Some(dead) = net.transitions.iter().find(|t| !fired.contains(&t.number)) {
            let what = format!("dead: T{} can never fire again", dead.number);
            return Err(reachable.violation(*marking, &what));
        }
    }
    Ok(())
}

/// Apart from the clock T2, T13 something can always fire, for some answer of the guards.
fn deadlock_free(net: &Net<'_>) -> Verdict {
    let reachable = Reachable::of(net);
    for marking in reachable.found_by.keys() {
        if successors(net, *marking)
            .iter()
            .all(|(number, _, _)| matches!(number, 2 | 13))
        {
            return Err(reachable.violation(*marking, "deadlock"));
        }
    }
    Ok(())
}

const INVARIANTS: [&[u8]; 3] = [&[10, 11], &[1, 2, 3, 4, 6, 8, 9], &[1, 2, 3, 5, 7, 8, 9]];

fn must_reject(verdict: Verdict, needle: &str) {
    let Err(Counterexample(text)) = verdict else {
        panic!("a broken net passed; expected: {needle}")
    };
    assert!(text.contains(needle), "expected {needle:?} in: {text}");
    assert!(
        text.contains("{1, 10}"),
        "the path must begin at the reset marking: {text}"
    );
}

#[test]
fn the_rows_are_those_of_the_specification() {
    // Film-feed specification, section 8: T, takes, needs empty, puts (T12: the two alternatives).
    type Row = (u8, &'static [u8], &'static [u8], &'static [&'static [u8]]);
    let rows: [Row; 13] = [
        (1, &[1], &[2], &[&[2]]),
        (2, &[10], &[11], &[&[11]]),
        (3, &[2], &[3], &[&[3]]),
        (4, &[2], &[3], &[&[3]]),
        (5, &[3], &[4, 5], &[&[4, 5]]),
        (6, &[3], &[4, 7], &[&[4, 7]]),
        (7, &[4], &[6], &[&[6]]),
        (8, &[5, 6], &[9], &[&[9]]),
        (9, &[6, 7], &[9], &[&[9]]),
        (10, &[9], &[8], &[&[8]]),
        (11, &[9], &[8], &[&[8]]),
        (12, &[8], &[1, 2], &[&[1], &[2]]),
        (13, &[11], &[10], &[&[10]]),
    ];
    assert_eq!(PARAMETER_TRANSITIONS.len(), rows.len());
    for ((number, takes, needs_empty, puts), row) in rows.into_iter().zip(&PARAMETER_TRANSITIONS) {
        let expected: Vec<_> = puts.iter().map(|places| Places::of(places)).collect();
        assert_eq!(
            (row.number, row.takes, row.needs_empty),
            (number, Places::of(takes), Places::of(needs_empty))
        );
        assert_eq!(outputs(row), expected, "T{number}");
    }
    assert_eq!(RESET_MARKING, Marking::new(Places::of(&[1, 10])));
}

#[test]
fn exactly_18_markings_are_reachable() {
    let reachable = Reachable::of(&PARAMETER_NET);
    let rest: [&[u8]; 9] = [&[1], &[2], &[3], &[4, 5], &[4, 7], &[5, 6], &[6, 7], &[9], &[8]];
    let expected: BTreeSet<_> = rest
        .iter()
        .flat_map(|places| [10, 11].map(|clock| Marking::new(Places::of(places).union(Places::of(&[clock])))))
        .collect();
    assert_eq!(expected.len(), 18);
    assert_eq!(reachable.found_by.keys().copied().collect::<BTreeSet<_>>(), expected);
}

#[test]
fn the_net_is_1_safe() {
    safe(&PARAMETER_NET).unwrap();
    let net = broken(12, |t| {
        Some(Transition {
            puts: Puts::Places(Places::of(&[2, 10])),
            ..t
        })
    });
    must_reject(safe(&Net { transitions: &net }), "second token");
}

#[test]
fn every_needs_empty_is_redundant() {
    needs_empty_is_redundant(&PARAMETER_NET).unwrap();
    let net = broken(2, |t| {
        Some(Transition {
            needs_empty: Places::of(&[1]),
            ..t
        })
    });
    must_reject(needs_empty_is_redundant(&Net { transitions: &net }), "T2 is held back");
}

#[test]
fn the_three_place_invariants_hold() {
    for places in INVARIANTS {
        invariant(&PARAMETER_NET, places).unwrap();
    }
    let net = broken(13, |t| {
        Some(Transition {
            puts: Puts::Places(Places::of(&[10, 11])),
            ..t
        })
    });
    must_reject(
        invariant(&Net { transitions: &net }, INVARIANTS[0]),
        "2 tokens in [10, 11]",
    );
    let net = broken(5, |t| {
        Some(Transition {
            puts: Puts::Places(Places::of(&[5])),
            ..t
        })
    });
    must_reject(invariant(&Net { transitions: &net }, INVARIANTS[1]), "0 tokens");
}

#[test]
fn no_two_transitions_compete_for_a_token() {
    conflict_free(&PARAMETER_NET).unwrap();
    let net = broken(5, |t| {
        Some(Transition {
            guard: Guard::Always,
            ..t
        })
    });
    must_reject(conflict_free(&Net { transitions: &net }), "T5 and T6 compete");
}

#[test]
fn the_net_is_deadlock_free_and_without_t7_a_deadlock_is_found() {
    deadlock_free(&PARAMETER_NET).unwrap();
    let net = broken(7, |_| None);
    must_reject(deadlock_free(&Net { transitions: &net }), "deadlock");
}

#[test]
fn the_net_is_live_when_the_guards_may_take_any_value() {
    live(&PARAMETER_NET).unwrap();
    let net = broken(12, |t| {
        Some(Transition {
            puts: Puts::Places(Places::of(&[2])),
            ..t
        })
    });
    must_reject(live(&Net { transitions: &net }), "dead: T1 ");
}

//! The search: breadth first over everything that is new, then backwards for what has no way to the goal.

use std::collections::{HashMap, VecDeque};

use super::report::{Case, Report};

/// What brought a step about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The machines went on, and nothing disturbed them.
    Undisturbed,
    /// Something was done to them.
    Disturbed,
}

/// Something a step showed that must not be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Finding {
    /// What, in a few words.
    pub what: &'static str,
    /// Where the original is documented to do this; `None` for a violation.
    pub documented: Option<&'static str>,
}

/// One step of a model.
#[derive(Debug, Clone)]
pub struct Step<S> {
    /// What happened, for the path.
    pub label: String,
    /// Why.
    pub cause: Cause,
    /// Afterwards.
    pub state: S,
    /// What it showed.
    pub findings: Vec<Finding>,
}

/// A model: machines and what may happen to them.
pub trait Model {
    /// The machines between two steps.
    type State: Clone;

    /// The name in the report.
    fn name(&self) -> String;

    /// Where it begins.
    fn initial(&self) -> Vec<Step<Self::State>>;

    /// Everything that can come next.
    fn steps(&self, state: &Self::State) -> Vec<Step<Self::State>>;

    /// Equal for states that behave alike.
    fn key(&self, state: &Self::State) -> u128;

    /// Whether this is where an undisturbed system comes to again and again.
    fn is_goal(&self, state: &Self::State) -> bool;

    /// Where it is documented that there is no way on from here.
    fn excuse(&self, state: &Self::State) -> Option<&'static str>;
}

/// How far a search may go. It is there for a model that turns out to be endless: a search that meets it has failed.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// States.
    pub states: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { states: 5_000_000 }
    }
}

/// What is kept of a state once its steps are known.
struct Node {
    parent: u32,
    label: Box<str>,
    depth: u32,
    goal: bool,
    excuse: Option<&'static str>,
}

const ROOT: u32 = u32::MAX;

/// States between two reports of progress.
const PROGRESS: usize = 1_000;

/// Searches the whole model.
pub fn search<M: Model>(model: &M, limits: Limits, found: &mut dyn FnMut(usize)) -> Report {
    let mut explored = Explored {
        nodes: Vec::new(),
        numbers: HashMap::new(),
        back: Vec::new(),
        cases: Vec::new(),
    };
    let mut transitions = 0;
    let mut queue = VecDeque::new();
    for step in model.initial() {
        if let Some(number) = explored.add(model, &step, ROOT) {
            queue.push_back((number, step.state));
        }
    }
    while explored.nodes.len() <= limits.states
        && let Some((number, state)) = queue.pop_front()
    {
        for step in model.steps(&state) {
            transitions += 1;
            if let Some(next) = explored.add(model, &step, number) {
                queue.push_back((next, step.state));
                if explored.nodes.len().is_multiple_of(PROGRESS) {
                    found(explored.nodes.len());
                }
            }
        }
    }
    // What was not looked at may lead anywhere.
    let unknown: Vec<usize> = queue.iter().map(|(number, _)| *number as usize).collect();
    let way_back = explored.way_to_goal(unknown);
    let dead_ends = explored.dead_ends(&way_back);
    Report {
        model: model.name(),
        states: explored.nodes.len(),
        transitions,
        depth: explored.nodes.iter().map(|node| node.depth).max().unwrap_or(0),
        goals: explored.nodes.iter().filter(|node| node.goal).count(),
        longest_way_back: way_back.iter().flatten().copied().max().unwrap_or(0),
        exhausted: queue.is_empty(),
        dead_ends,
        findings: explored.cases,
    }
}

struct Explored {
    nodes: Vec<Node>,
    numbers: HashMap<u128, u32>,
    /// Undisturbed steps backwards: for each state, from where one leads to it.
    back: Vec<Vec<u32>>,
    cases: Vec<Case>,
}

impl Explored {
    /// Enters a step; the number of its state when that is new.
    fn add<M: Model>(&mut self, model: &M, step: &Step<M::State>, from: u32) -> Option<u32> {
        let next = self.nodes.len() as u32;
        let number = *self.numbers.entry(model.key(&step.state)).or_insert(next);
        let is_new = number == next;
        if is_new {
            self.nodes.push(Node {
                parent: from,
                label: step.label.as_str().into(),
                depth: self.nodes.get(from as usize).map_or(0, |node| node.depth + 1),
                goal: model.is_goal(&step.state),
                excuse: model.excuse(&step.state),
            });
            self.back.push(Vec::new());
        }
        if step.cause == Cause::Undisturbed && from != ROOT {
            self.back[number as usize].push(from);
        }
        for finding in &step.findings {
            self.note(*finding, from, &step.label);
        }
        is_new.then_some(next)
    }

    /// The first path to a finding is the shortest, so it is the one kept.
    fn note(&mut self, finding: Finding, from: u32, label: &str) {
        match self.cases.iter_mut().find(|case| case.is(&finding)) {
            Some(case) => case.count += 1,
            None => {
                let mut path = self.path(from);
                path.push(label.to_owned());
                self.cases.push(Case::new(finding, path));
            }
        }
    }

    fn path(&self, to: u32) -> Vec<String> {
        let mut path = Vec::new();
        let mut at = to;
        while let Some(node) = self.nodes.get(at as usize) {
            path.push(node.label.to_string());
            at = node.parent;
        }
        path.reverse();
        path
    }

    /// Undisturbed steps to the nearest goal, or to the nearest state that is taken for one; `None` where there is no way.
    fn way_to_goal(&self, taken_for_goals: Vec<usize>) -> Vec<Option<u32>> {
        let mut distance = vec![None; self.nodes.len()];
        let goals = (0..self.nodes.len()).filter(|&number| self.nodes[number].goal);
        let mut queue: VecDeque<_> = goals.chain(taken_for_goals).collect();
        for &goal in &queue {
            distance[goal] = Some(0);
        }
        while let Some(number) = queue.pop_front() {
            let further = distance[number].map(|steps: u32| steps + 1);
            for &from in &self.back[number] {
                if distance[from as usize].is_none() {
                    distance[from as usize] = further;
                    queue.push_back(from as usize);
                }
            }
        }
        distance
    }

    fn dead_ends(&self, way_back: &[Option<u32>]) -> Vec<Case> {
        let mut cases: Vec<Case> = Vec::new();
        for (number, node) in self.nodes.iter().enumerate() {
            if way_back[number].is_some() {
                continue;
            }
            let finding = Finding {
                what: "dead end: undisturbed, it never works again",
                documented: node.excuse,
            };
            match cases.iter_mut().find(|case| case.is(&finding)) {
                Some(case) => case.count += 1,
                None => cases.push(Case::new(finding, self.path(number as u32))),
            }
        }
        cases
    }
}

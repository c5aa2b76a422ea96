//! Which values stand together at a point.

use super::parameter::Setting;

/// How points are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// Every value with every other.
    Grid,
    /// Points of a Sobol sequence.
    Random {
        /// How many, 1…65 536.
        count: u32,
    },
    /// The first values together, then the second ones.
    List,
}

/// What a parameter can be.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Range {
    /// One of these; at least one.
    Values(Vec<Setting>),
    /// Anything between two numbers.
    Span(Span),
}

/// Numbers between two ends, both included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) from: f64,
    pub(super) to: f64,
    /// Number of values in a grid, 2 or more.
    pub(super) steps: u32,
    pub(super) scale: Scale,
    /// Values are whole multiples of this; 0 for any.
    pub(super) step: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scale {
    Linear,
    /// Equal factors; both ends are above 0.
    Log,
}

impl Span {
    /// The number at a share of the way, 0…1.
    pub(super) fn at(&self, share: f64) -> f64 {
        let exact = match self.scale {
            _ if share >= 1.0 => self.to,
            Scale::Linear => self.from + share * (self.to - self.from),
            Scale::Log => self.from * (self.to / self.from).powf(share),
        };
        // A decimal step by its reciprocal: 0.3 is 3/10 exactly rounded, 3 · 0.1 is not.
        let steps_in_one = (1.0 / self.step).round();
        if self.step <= 0.0 {
            exact
        } else if (steps_in_one * self.step - 1.0).abs() < 1e-9 {
            (exact * steps_in_one).round() / steps_in_one
        } else {
            (exact / self.step).round() * self.step
        }
    }
}

impl Range {
    /// How many values a grid or a list has of it.
    pub(super) fn len(&self) -> u64 {
        match self {
            Range::Values(values) => values.len() as u64,
            Range::Span(span) => u64::from(span.steps),
        }
    }

    /// Value number `place` of a grid or a list.
    pub(super) fn value(&self, place: u64) -> Setting {
        match self {
            Range::Values(values) => values[place as usize].clone(),
            Range::Span(span) => Setting::Number(span.at(place as f64 / f64::from(span.steps - 1).max(1.0))),
        }
    }

    /// The value at a share of the range, 0 up to below 1.
    fn at(&self, share: f64) -> Setting {
        match self {
            Range::Values(values) => {
                let place = (share * values.len() as f64) as usize;
                values[place.min(values.len() - 1)].clone()
            }
            Range::Span(span) => Setting::Number(span.at(share)),
        }
    }
}

/// How many points there are; `None` when they cannot be counted.
pub(super) fn points(layout: Layout, ranges: &[&Range]) -> Option<u64> {
    match layout {
        Layout::Grid => ranges
            .iter()
            .try_fold(1_u64, |product, range| product.checked_mul(range.len())),
        Layout::Random { count } => Some(u64::from(count)),
        Layout::List => Some(ranges.iter().map(|range| range.len()).min().unwrap_or(1)),
    }
}

/// The value of each parameter at place `place`, from 0.
pub(super) fn values(layout: Layout, ranges: &[&Range], seed: u32, place: u64) -> Vec<Setting> {
    match layout {
        Layout::Grid => {
            let mut rest = place;
            let mut values: Vec<Setting> = ranges
                .iter()
                .rev()
                .map(|range| {
                    let value = range.value(rest % range.len());
                    rest /= range.len();
                    value
                })
                .collect();
            values.reverse();
            values
        }
        Layout::Random { .. } => ranges
            .iter()
            .zip(0_u32..)
            .map(|(range, dimension)| {
                let share = sobol_burley::sample(place as u32, dimension, seed);
                range.at(f64::from(share))
            })
            .collect(),
        Layout::List => ranges.iter().map(|range| range.value(place)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(from: f64, to: f64, steps: u32, scale: Scale, step: f64) -> Range {
        Range::Span(Span {
            from,
            to,
            steps,
            scale,
            step,
        })
    }

    fn number(setting: &Setting) -> f64 {
        match setting {
            Setting::Number(number) => *number,
            Setting::Word(word) => panic!("{word}"),
        }
    }

    #[test]
    fn in_a_grid_the_last_parameter_goes_fastest_and_every_pair_comes_once() {
        let (a, b) = (
            span(1.0, 2.0, 2, Scale::Linear, 0.0),
            span(10.0, 1000.0, 3, Scale::Log, 0.0),
        );
        let ranges = [&a, &b];
        assert_eq!(points(Layout::Grid, &ranges), Some(6));
        let all: Vec<(f64, f64)> = (0..6)
            .map(|place| values(Layout::Grid, &ranges, 1, place))
            .map(|values| (number(&values[0]), number(&values[1]).round()))
            .collect();
        let expected = [
            (1.0, 10.0),
            (1.0, 100.0),
            (1.0, 1000.0),
            (2.0, 10.0),
            (2.0, 100.0),
            (2.0, 1000.0),
        ];
        assert_eq!(all, expected);
    }

    /// What makes a Sobol sequence better than dice: of the first 2ⁿ points each of 2ⁿ equal parts of a range holds exactly one, for
    /// every parameter (a (0, 1)-sequence in base 2 in each dimension; Owen's scrambling keeps that).
    #[test]
    fn sobol_points_are_spread_evenly_over_every_parameter() {
        let ranges: Vec<Range> = (0..6).map(|_| span(0.0, 256.0, 2, Scale::Linear, 0.0)).collect();
        let ranges: Vec<&Range> = ranges.iter().collect();
        let layout = Layout::Random { count: 256 };
        for seed in [1, 2, 77] {
            for dimension in 0..ranges.len() {
                let mut hit = [false; 256];
                for place in 0..256 {
                    hit[number(&values(layout, &ranges, seed, place)[dimension]) as usize] = true;
                }
                assert!(hit.iter().all(|hit| *hit), "seed {seed}, dimension {dimension}");
            }
        }
        assert_ne!(values(layout, &ranges, 1, 5), values(layout, &ranges, 2, 5));
    }

    #[test]
    fn a_span_keeps_its_ends_and_its_step() {
        let span = Span {
            from: 1.0,
            to: 8.0,
            steps: 4,
            scale: Scale::Log,
            step: 0.5,
        };
        assert_eq!((span.at(0.0), span.at(1.0)), (1.0, 8.0));
        // √8 = 2.83, the nearest half is 3.
        assert_eq!(span.at(0.5), 3.0);
    }
}

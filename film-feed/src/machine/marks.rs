//! Print marks on the film (German: Druckmarken): where they are, and which of them are missing.

use lenze9300_model::noise;

/// How the film was printed.
#[derive(Debug, Clone, PartialEq)]
#[doc(alias = "Druckmarke")]
pub struct MarkConfig {
    /// Mean distance from mark to mark, mm.
    pub repeat_mm: f64,
    /// Largest deviation of a distance from `repeat_mm`, mm; deviations are evenly distributed and independent
    /// (film-feed specification, section 6: the distance may vary by ±50 mm).
    pub tolerance_mm: f64,
    /// Length of a mark along the film, mm: so long the reader's signal stays high. Assumed.
    pub width_mm: f64,
    /// Seed of the deviations.
    pub seed: u64,
    /// Marks that were not printed, or that the reader does not see.
    pub missing: Missing,
}

impl Default for MarkConfig {
    fn default() -> Self {
        MarkConfig {
            repeat_mm: 1200.0,
            tolerance_mm: 50.0,
            width_mm: 5.0,
            seed: 1,
            missing: Missing::None,
        }
    }
}

/// Which marks the reader never sees. Mark 0 lies behind the reader when the film is threaded.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Missing {
    /// All are there.
    #[default]
    None,
    /// Those with these numbers.
    Numbers(Vec<usize>),
    /// All: unprinted film, or a dead reader.
    All,
}

/// The marks of one film, made one after the other as they come near.
#[derive(Debug, Clone)]
pub struct Marks {
    config: MarkConfig,
    /// Film position at which the leading edge of mark k is under the reader, mm.
    leading_mm: Vec<f64>,
}

/// Channel of the counter-based noise that belongs to the print.
const PRINT_CHANNEL: u64 = 0x6D61_726B;

impl Marks {
    /// A film whose mark 0 is under the reader at film position `first_mm`.
    pub fn new(config: MarkConfig, first_mm: f64) -> Self {
        Marks {
            config,
            leading_mm: vec![first_mm],
        }
    }

    /// Film position at which the leading edge of mark `number` is under the reader, mm.
    pub fn leading_mm(&mut self, number: usize) -> f64 {
        while self.leading_mm.len() <= number {
            let k = self.leading_mm.len();
            let deviation = self.config.tolerance_mm * noise::symmetric(self.config.seed, PRINT_CHANNEL, k as u64);
            self.leading_mm
                .push(self.leading_mm[k - 1] + self.config.repeat_mm + deviation);
        }
        self.leading_mm[number]
    }

    /// Whether the reader sees mark `number`.
    pub fn is_seen(&self, number: usize) -> bool {
        match &self.config.missing {
            Missing::None => true,
            Missing::Numbers(numbers) => !numbers.contains(&number),
            Missing::All => false,
        }
    }

    /// The print of mark `number` fails: the reader does not see it.
    pub fn blank(&mut self, number: usize) {
        match &mut self.config.missing {
            Missing::None => self.config.missing = Missing::Numbers(vec![number]),
            Missing::Numbers(numbers) if !numbers.contains(&number) => numbers.push(number),
            Missing::Numbers(_) | Missing::All => {}
        }
    }

    /// Length of a mark, mm.
    pub fn width_mm(&self) -> f64 {
        self.config.width_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_stay_within_the_tolerance_and_use_it() {
        let mut marks = Marks::new(MarkConfig::default(), -50.0);
        let distances: Vec<f64> = (1..2000)
            .map(|k| marks.leading_mm(k) - marks.leading_mm(k - 1) - 1200.0)
            .collect();
        assert!(distances.iter().all(|d| d.abs() <= 50.0));
        assert!(distances.iter().any(|d| *d < -45.0) && distances.iter().any(|d| *d > 45.0));
    }

    #[test]
    fn a_blanked_mark_is_not_seen_and_all_others_are() {
        let mut marks = Marks::new(MarkConfig::default(), 0.0);
        for number in [3, 7, 3] {
            marks.blank(number);
        }
        let blanks: Vec<usize> = (0..10).filter(|number| !marks.is_seen(*number)).collect();
        assert_eq!(blanks, [3, 7]);
    }

    #[test]
    fn a_mark_lies_where_it_lies_whatever_was_asked_before() {
        let mut forwards = Marks::new(MarkConfig::default(), 0.0);
        let mut at_once = forwards.clone();
        let one_by_one: Vec<f64> = (0..50).map(|k| forwards.leading_mm(k)).collect();
        assert_eq!(at_once.leading_mm(49), one_by_one[49]);
    }
}

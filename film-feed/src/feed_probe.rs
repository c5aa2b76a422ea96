//! Measures one feed from inside the machine: what the block and the bus cannot see.

use lenze9300_model::traverse::TraverseEvent;

use crate::machine::RESIDUAL_PATH_MM;
use crate::report::{FeedMode, FeedReport, TOLERANCE_MM};

/// What the probe reads once per drive tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Film position since power-up, mm.
    pub film_mm: f64,
    /// Motor speed, 1/min.
    pub rpm: f64,
    /// Air-gap torque, Nm.
    pub torque_nm: f64,
    /// Motor current, A peak.
    pub current_a_peak: f64,
    /// Position set-value minus actual value, mm of film.
    pub following_error_mm: f64,
}

/// Collects the figures of the feed under way.
#[derive(Debug, Clone, Default)]
pub struct FeedProbe {
    start_mm: f64,
    /// From the start to the target. Kept as given: start + way − start would not be the way to the last digit.
    commanded_mm: Option<f64>,
    /// Film position at the end of each millisecond since the program started: the first is that after 1 ms.
    film_by_ms: Vec<f64>,
    program_started: bool,
    set_point_ms: Option<usize>,
    highest_mm: f64,
    deepest_retreat_mm: f64,
    peak_rpm: f64,
    peak_torque_nm: f64,
    current_square_sum: f64,
    peak_current_square: f64,
    ticks: u64,
    max_following_error_mm: f64,
    no_mark_found: bool,
}

impl FeedProbe {
    /// A feed by length starts at film position `start_mm` and shall move `commanded_mm`; a feed to the mark learns
    /// its target when the mark passes.
    pub fn start(&mut self, start_mm: f64, commanded_mm: Option<f64>) {
        let film_by_ms = std::mem::take(&mut self.film_by_ms);
        *self = FeedProbe {
            start_mm,
            commanded_mm,
            film_by_ms,
            highest_mm: start_mm,
            ..FeedProbe::default()
        };
        self.film_by_ms.clear();
    }

    /// One drive tick.
    pub fn tick(&mut self, reading: &Reading) {
        self.highest_mm = self.highest_mm.max(reading.film_mm);
        self.deepest_retreat_mm = self.deepest_retreat_mm.max(self.highest_mm - reading.film_mm);
        self.peak_rpm = self.peak_rpm.max(reading.rpm.abs());
        self.peak_torque_nm = self.peak_torque_nm.max(reading.torque_nm.abs());
        let square = reading.current_a_peak * reading.current_a_peak;
        self.current_square_sum += square;
        self.peak_current_square = self.peak_current_square.max(square);
        self.ticks += 1;
        self.max_following_error_mm = self.max_following_error_mm.max(reading.following_error_mm.abs());
    }

    /// One millisecond, after its ticks.
    pub fn millisecond(&mut self, film_mm: f64) {
        if self.program_started {
            self.film_by_ms.push(film_mm);
        }
    }

    /// Something happened in the traversing program; `last_mark_mm` is where the film stood when the last mark passed.
    pub fn event(&mut self, event: &TraverseEvent, last_mark_mm: f64) {
        match event {
            TraverseEvent::ProgramStarted => self.program_started = true,
            TraverseEvent::MarkLatched { .. } => {
                self.commanded_mm = Some(last_mark_mm + RESIDUAL_PATH_MM - self.start_mm);
            }
            TraverseEvent::NoMarkFound { .. } => self.no_mark_found = true,
            TraverseEvent::ProgramEnded => self.set_point_ms = Some(self.film_by_ms.len()),
            _ => {}
        }
    }

    /// Whether the search ended without a mark.
    pub fn no_mark_found(&self) -> bool {
        self.no_mark_found
    }

    /// The feed is over and the film stands at `end_mm`.
    pub fn report(&self, n: usize, mode: FeedMode, end_mm: f64, pos_act_mm: f64, job_ns: Option<u64>) -> FeedReport {
        let film_mm = end_mm - self.start_mm;
        let commanded_mm = self.commanded_mm;
        FeedReport {
            n,
            mode,
            commanded_mm,
            film_mm: Some(film_mm),
            error_mm: commanded_mm.map(|commanded| film_mm - commanded),
            pos_act_mm: Some(pos_act_mm).filter(|mm| mm.is_finite()),
            set_point_s: self.set_point_ms.map(|ms| ms as f64 / 1000.0),
            in_position_s: self.in_position_s(),
            job_s: job_ns.map(|ns| ns as f64 / 1e9),
            finished: job_ns.is_some(),
            peak_rpm: Some(self.peak_rpm),
            peak_torque_nm: Some(self.peak_torque_nm),
            rms_current_a: Some(self.rms_current_a()),
            peak_current_a: Some((self.peak_current_square / 2.0).sqrt()),
            max_following_error_mm: Some(self.max_following_error_mm),
            reversed: self.deepest_retreat_mm > TOLERANCE_MM,
        }
    }

    /// When the film was first seen within ±0.01 mm of its target never to leave it again.
    fn in_position_s(&self) -> Option<f64> {
        let target = self.start_mm + self.commanded_mm?;
        let within = |mm: &f64| (mm - target).abs() <= TOLERANCE_MM;
        let settled = self.film_by_ms.iter().rev().take_while(|mm| within(mm)).count();
        (settled > 0).then(|| (self.film_by_ms.len() - settled + 1) as f64 / 1000.0)
    }

    /// Peak value of a three-phase current to the rms value of one phase: 1/√2.
    fn rms_current_a(&self) -> f64 {
        if self.ticks == 0 {
            0.0
        } else {
            (self.current_square_sum / self.ticks as f64 / 2.0).sqrt()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(film_mm: f64) -> Reading {
        Reading {
            film_mm,
            rpm: 0.0,
            torque_nm: 0.0,
            current_a_peak: 1.0,
            following_error_mm: 0.0,
        }
    }

    #[test]
    fn in_position_counts_from_the_last_time_the_film_was_outside() {
        let mut probe = FeedProbe::default();
        probe.start(10.0, Some(100.0));
        probe.event(&TraverseEvent::ProgramStarted, 0.0);
        // After 1, 2, … 6 ms.
        for film_mm in [10.0, 60.0, 110.0, 110.02, 110.005, 110.0] {
            probe.millisecond(film_mm);
        }
        assert_eq!(
            probe.report(1, FeedMode::Length, 110.0, 100.0, None).in_position_s,
            Some(0.005)
        );
    }

    #[test]
    fn a_film_that_comes_to_rest_outside_was_never_in_position() {
        let mut probe = FeedProbe::default();
        probe.start(0.0, Some(100.0));
        probe.event(&TraverseEvent::ProgramStarted, 0.0);
        probe.millisecond(100.0);
        probe.millisecond(99.98);
        assert_eq!(
            probe.report(1, FeedMode::Length, 99.98, 99.98, None).in_position_s,
            None
        );
    }

    #[test]
    fn a_retreat_beyond_the_tolerance_is_a_reversal() {
        for (retreat_mm, reversed) in [(0.009, false), (0.011, true)] {
            let mut probe = FeedProbe::default();
            probe.start(0.0, Some(100.0));
            probe.tick(&reading(100.0));
            probe.tick(&reading(100.0 - retreat_mm));
            assert_eq!(
                probe.report(1, FeedMode::Length, 100.0, 100.0, Some(1)).reversed,
                reversed,
                "{retreat_mm}"
            );
        }
    }

    #[test]
    fn one_ampere_peak_is_seven_tenths_rms() {
        let mut probe = FeedProbe::default();
        probe.start(0.0, None);
        probe.tick(&reading(0.0));
        let rms = probe.report(1, FeedMode::Mark, 0.0, 0.0, None).rms_current_a.unwrap();
        assert!((rms - std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-12);
    }
}

//! The film under the reader: what the shaft's motion does to it, and when the reader switches.

use std::f64::consts::PI;

use lenze9300_model::plant::{ShaftAngle, ShaftSegment};
use lenze9300_model::units::INC_PER_REV;

use super::marks::{MarkConfig, Marks};
use super::web::{Web, WebParams};

/// The roller that pulls the film, behind the gear.
#[derive(Debug, Clone, Copy, PartialEq)]
#[doc(alias = "Vorzugwelle")]
pub struct Roller {
    /// Diameter, mm (film-feed specification, section 1: 57 mm).
    pub diameter_mm: f64,
    /// Motor revolutions per roller revolution (7:1).
    pub gear_ratio: f64,
}

impl Default for Roller {
    fn default() -> Self {
        Roller {
            diameter_mm: 57.0,
            gear_ratio: 7.0,
        }
    }
}

impl Roller {
    /// Film travel per increment of the motor, mm.
    pub fn mm_per_increment(&self) -> f64 {
        PI * self.diameter_mm / (self.gear_ratio * INC_PER_REV as f64)
    }
}

/// What the machine is made of.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FilmConfig {
    /// The roller.
    pub roller: Roller,
    /// The print.
    pub marks: MarkConfig,
    /// What stretches and slips. `None`, the default: the film goes with the roller.
    pub web: Option<WebParams>,
}

/// The reader's output changed inside the last tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// When, as a fraction of the tick, 0…1.
    pub fraction: f64,
    /// The level after the edge: `true` while a mark is under the reader.
    pub level: bool,
}

/// The film: its position, its marks, the reader over it.
#[derive(Debug, Clone)]
pub struct Film {
    roller: Roller,
    mm_per_increment: f64,
    shaft: ShaftAngle,
    marks: Marks,
    /// Number of the last mark whose leading edge has passed the reader.
    passed: usize,
    /// Shaft angles between which the reader's level stays as it is; the second no longer belongs to the range.
    steady: (ShaftAngle, ShaftAngle),
    level: bool,
    position_mm: f64,
    /// The elastic film, and the position it was threaded at, mm.
    web: Option<(Web, f64)>,
}

impl Film {
    /// A film threaded with mark 0 at 50 mm before the reader's line, which is where a finished feed leaves a mark
    /// (film-feed specification, section 6), the shaft standing at `shaft`.
    pub fn new(config: FilmConfig, shaft: ShaftAngle) -> Self {
        let mm_per_increment = config.roller.mm_per_increment();
        let position_mm = shaft.offset_from(ShaftAngle::default()) * mm_per_increment;
        let marks = Marks::new(config.marks, position_mm - RESIDUAL_PATH_MM);
        let mut film = Film {
            roller: config.roller,
            mm_per_increment,
            marks,
            passed: 0,
            shaft,
            steady: (shaft, shaft),
            level: false,
            position_mm,
            web: config.web.map(|params| (Web::new(params), position_mm)),
        };
        film.find_steady_range();
        film
    }

    /// Threads the same kind of film anew, mark 0 just 50 mm behind the reader.
    pub fn rethread(&mut self, marks: MarkConfig) {
        *self = Film::new(
            FilmConfig {
                roller: self.roller,
                marks,
                web: self.web.as_ref().map(|(web, _)| *web.params()),
            },
            self.shaft,
        );
    }

    /// Tension of the film, N; `None` for a film that does not stretch.
    pub fn tension_n(&self) -> Option<f64> {
        self.web.as_ref().map(|(web, _)| web.tension_n())
    }

    /// Lowest and highest tension since threading, N; `None` for a film that does not stretch.
    pub fn tension_range_n(&self) -> Option<(f64, f64)> {
        self.web.as_ref().map(|(web, _)| web.tension_range_n())
    }

    /// Radius of the roll the film comes from, mm; `None` for a film that does not stretch.
    pub fn roll_radius_mm(&self) -> Option<f64> {
        self.web.as_ref().map(|(web, _)| 1000.0 * web.roll_radius_m())
    }

    /// Way that slip and creep have cost since threading, mm; `None` for a film that does not stretch.
    pub fn slipped_mm(&self) -> Option<f64> {
        self.web.as_ref().map(|(web, _)| 1000.0 * web.slipped_m())
    }

    /// Torque with which the film's tension holds the motor back, Nm.
    pub fn torque_at_motor_nm(&self) -> f64 {
        let arm_m = 0.5e-3 * self.roller.diameter_mm / self.roller.gear_ratio;
        self.tension_n().map_or(0.0, |tension_n| tension_n * arm_m)
    }

    /// How far the film has moved since power-up, mm, seen at the reader. Of an elastic film its length without tension counts, as on
    /// the finished product.
    pub fn position_mm(&self) -> f64 {
        self.position_mm
    }

    /// Film travel per increment of the motor, mm.
    pub fn mm_per_increment(&self) -> f64 {
        self.mm_per_increment
    }

    /// Whether a mark is under the reader now.
    pub fn reader_level(&self) -> bool {
        self.level
    }

    /// Film position at which the leading edge of the last passed mark was under the reader, mm.
    pub fn last_mark_mm(&mut self) -> f64 {
        self.marks.leading_mm(self.passed)
    }

    /// Number of the last mark whose leading edge passed the reader.
    pub fn marks_passed(&self) -> usize {
        self.passed
    }

    /// The print of the next mark before the reader fails.
    pub fn blank_next_mark(&mut self) {
        self.marks.blank(self.passed + 1);
    }

    /// Marks whose leading edge lies from `before_mm` before the reader to `behind_mm` behind it: how far each is before it, mm, and
    /// whether it is printed.
    pub fn marks_near(&mut self, before_mm: f64, behind_mm: f64) -> Vec<(f64, bool)> {
        let mut number = self.passed;
        while number > 0 && self.position_mm - self.marks.leading_mm(number - 1) <= behind_mm {
            number -= 1;
        }
        let mut near = Vec::new();
        loop {
            let ahead_mm = self.marks.leading_mm(number) - self.position_mm;
            if ahead_mm > before_mm {
                return near;
            }
            if ahead_mm >= -behind_mm {
                near.push((ahead_mm, self.marks.is_seen(number)));
            }
            number += 1;
        }
    }

    /// Moves the film with the shaft; tells when the reader switched, if it did.
    ///
    /// One edge a tick at the most: at 1200 mm/s the film moves 0.15 mm in 125 µs, a mark is millimetres long.
    pub fn follow(&mut self, shaft: &ShaftSegment) -> Option<Edge> {
        self.shaft = shaft.end;
        if self.web.is_some() {
            return self.follow_elastic(shaft);
        }
        self.position_mm = shaft.end.offset_from(ShaftAngle::default()) * self.mm_per_increment;
        if shaft.end >= self.steady.0 && shaft.end < self.steady.1 {
            return None;
        }
        let crossed = if shaft.end < self.steady.0 {
            self.steady.0
        } else {
            self.steady.1
        };
        let level_before = self.level;
        self.find_steady_range();
        (self.level != level_before).then(|| Edge {
            fraction: shaft.crossing(crossed).unwrap_or(1.0),
            level: self.level,
        })
    }

    /// [`follow`](Self::follow) of a film that stretches: the reader sees its position, not the shaft's.
    fn follow_elastic(&mut self, shaft: &ShaftSegment) -> Option<Edge> {
        let (web, threaded_mm) = self.web.as_mut()?;
        let before_mm = self.position_mm;
        web.advance(shaft.travel() * self.mm_per_increment / 1000.0, shaft.dt_s);
        self.position_mm = *threaded_mm + 1000.0 * web.at_reader_m();
        let at = ShaftAngle::new(0, self.position_mm / self.mm_per_increment);
        if at >= self.steady.0 && at < self.steady.1 {
            return None;
        }
        let crossed = if at < self.steady.0 {
            self.steady.0
        } else {
            self.steady.1
        };
        let crossed_mm = crossed.offset_from(ShaftAngle::default()) * self.mm_per_increment;
        let level_before = self.level;
        self.find_steady_range();
        // The speed hardly changes in a tick: at 2400 mm/s² a straight line is 5 nm off.
        let fraction = ((crossed_mm - before_mm) / (self.position_mm - before_mm)).clamp(0.0, 1.0);
        (self.level != level_before).then_some(Edge {
            fraction,
            level: self.level,
        })
    }

    /// Finds the marks left and right of the reader and the range in which nothing changes.
    fn find_steady_range(&mut self) {
        while self.marks.leading_mm(self.passed + 1) <= self.position_mm {
            self.passed += 1;
        }
        while self.passed > 0 && self.marks.leading_mm(self.passed) > self.position_mm {
            self.passed -= 1;
        }
        let leading = self.marks.leading_mm(self.passed);
        let trailing = leading + self.marks.width_mm();
        let next = self.marks.leading_mm(self.passed + 1);
        let angle = |mm: f64| ShaftAngle::new(0, mm / self.mm_per_increment);
        let (range, covered) = if self.position_mm < leading {
            // Only before mark 0, where nothing was printed.
            ((ShaftAngle::new(i64::MIN, 0.0), angle(leading)), false)
        } else if self.position_mm < trailing {
            ((angle(leading), angle(trailing)), true)
        } else {
            ((angle(trailing), angle(next)), false)
        };
        self.level = covered && self.marks.is_seen(self.passed);
        self.steady = range;
    }
}

/// Where a finished feed leaves the mark behind the reader, mm (film-feed specification, section 6).
pub const RESIDUAL_PATH_MM: f64 = 50.0;

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 125e-6;

    fn segment(film: &Film, from_mm: f64, to_mm: f64) -> ShaftSegment {
        let angle = |mm: f64| ShaftAngle::new(0, mm / film.mm_per_increment);
        let (start, end) = (angle(from_mm), angle(to_mm));
        let omega = end.offset_from(start) / INC_PER_REV as f64 * 2.0 * PI / DT_S;
        ShaftSegment {
            start,
            end,
            omega_start: omega,
            omega_end: omega,
            dt_s: DT_S,
        }
    }

    fn film() -> Film {
        let marks = MarkConfig {
            repeat_mm: 1200.0,
            tolerance_mm: 0.0,
            ..MarkConfig::default()
        };
        Film::new(
            FilmConfig {
                marks,
                ..FilmConfig::default()
            },
            ShaftAngle::default(),
        )
    }

    /// Moves in steps of 0.03 mm (240 mm/s) and lists the edges with their film positions.
    fn edges(film: &mut Film, from_mm: f64, to_mm: f64) -> Vec<(f64, bool)> {
        let steps = ((to_mm - from_mm) / 0.03).abs().ceil();
        let step = (to_mm - from_mm) / steps;
        (0..steps as u32)
            .filter_map(|k| {
                let start = from_mm + f64::from(k) * step;
                let edge = film.follow(&segment(film, start, start + step))?;
                Some((start + edge.fraction * step, edge.level))
            })
            .collect()
    }

    #[test]
    fn one_millimetre_is_2561_847_increments() {
        // Film-feed specification, section 5, with the unrounded constant of the roller: 65536 · 7 / (π · 57).
        let per_mm = 1.0 / Roller::default().mm_per_increment();
        assert!((per_mm - 2_561.847_31).abs() < 1e-4, "{per_mm}");
    }

    #[test]
    fn a_threaded_film_has_its_next_mark_1150_mm_ahead() {
        // Film-feed specification, section 6: the film stands 50 mm behind a mark.
        let mut film = film();
        let edges = edges(&mut film, 0.0, 1200.0);
        assert_eq!(edges.len(), 2);
        assert!((edges[0].0 - 1150.0).abs() < 1e-6 && edges[0].1, "{edges:?}");
        assert!((edges[1].0 - 1155.0).abs() < 1e-6 && !edges[1].1, "{edges:?}");
        assert_eq!(film.last_mark_mm(), 1150.0);
    }

    #[test]
    fn a_film_running_backwards_meets_the_edges_in_reverse() {
        let mut film = film();
        edges(&mut film, 0.0, 1152.0);
        assert!(film.reader_level());
        let back = edges(&mut film, 1152.0, 1140.0);
        assert_eq!(back.len(), 1);
        assert!((back[0].0 - 1150.0).abs() < 1e-6 && !back[0].1, "{back:?}");
    }

    #[test]
    fn an_elastic_film_meets_its_marks_where_it_is_stretched_to() {
        // A stiff film on a light roll behind a fine brake: strain F/(E·A) = 18.75/8/6000 = 3.9e-4 (see `web`). Of 1150 mm of film
        // the roller needs 1150 · (1 + ε).
        let web = WebParams {
            modulus_pa: 300e6,
            thickness_m: 50e-6,
            roll_radius_m: 8.0,
            brake_nm: 18.75,
            density_kg_m3: 1e-3,
            ..WebParams::default()
        };
        let mut film = Film::new(
            FilmConfig {
                marks: MarkConfig {
                    tolerance_mm: 0.0,
                    ..MarkConfig::default()
                },
                web: Some(web),
                ..FilmConfig::default()
            },
            ShaftAngle::default(),
        );
        assert_eq!(film.tension_n().map(|n| (n * 1e6).round() / 1e6), Some(18.75 / 8.0));
        let edges = edges(&mut film, 0.0, 1160.0);
        let expected = 1150.0 * (1.0 + 18.75 / 8.0 / web.stiffness_n());
        assert!((edges[0].0 - expected).abs() < 0.005, "{edges:?} {expected}");
        assert!((film.torque_at_motor_nm() / (film.tension_n().unwrap_or(0.0) * 0.0285 / 7.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn marks_near_the_reader_are_told_with_their_distance() {
        // Film-feed specification, section 6: threaded with a mark 50 mm behind the reader; the next comes 1150 mm ahead.
        let mut film = film();
        assert_eq!(film.marks_near(1200.0, 100.0), [(-50.0, true), (1150.0, true)]);
        assert_eq!(film.marks_near(1000.0, 10.0), []);
        edges(&mut film, 0.0, 1200.0);
        let near = film.marks_near(200.0, 1300.0);
        assert_eq!(near.len(), 2);
        assert!((near[1].0 + 50.0).abs() < 1e-6, "{near:?}");
    }

    #[test]
    fn a_missing_mark_switches_nothing() {
        let mut film = film();
        film.rethread(MarkConfig {
            missing: super::super::Missing::Numbers(vec![1]),
            tolerance_mm: 0.0,
            ..MarkConfig::default()
        });
        let edges = edges(&mut film, 0.0, 2400.0);
        assert_eq!(edges.len(), 2);
        assert!((edges[0].0 - 2350.0).abs() < 1e-6, "{edges:?}");
    }
}

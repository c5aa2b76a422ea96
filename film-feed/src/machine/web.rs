//! An elastic film between the roll it comes from and the roller that pulls it: stretch, tension, slip, radius of the roll.
//!
//! ```text
//!   roll, braked          span                reader      roller
//!     ( R )──────────────── ε = L/c − 1 ─────────┴──────────( )──►
//!      v1 of the film off the roll        F = E·A·ε      v2 of the film on the roller
//! ```
//!
//! The span of length L holds `c` metres of film, told as what they are without tension. What comes off the roll fills it, what the
//! roller takes empties it: dc/dt = v1 − v2·c/L. A span that holds more film than its length is slack and pulls nothing. Source
//! of the equation: Brandenburg, *Verhalten elastischer Bahnen*; Shelton, *Lateral and longitudinal dynamics of webs* (mass
//! balance of a web span), with the film on the roll free of tension.

use std::f64::consts::PI;

/// Film, roll, brake and pinch of the roller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WebParams {
    /// Modulus of elasticity of the film, Pa. Assumed: oriented polypropylene, 2 GPa.
    #[doc(alias = "E-Modul")]
    pub modulus_pa: f64,
    /// Thickness of the film, m. Assumed.
    pub thickness_m: f64,
    /// Width of the film, m: that of the roller, 400 mm (film-feed specification, section 5).
    pub width_m: f64,
    /// Density of the film, kg/m³. Assumed: oriented polypropylene.
    pub density_kg_m3: f64,
    /// Damping of the film with the roll on it, as a share of the critical one. Assumed.
    pub damping_ratio: f64,
    /// From roll to roller, m. Assumed.
    pub span_m: f64,
    /// From reader to roller, m; within the span. Assumed.
    pub reader_to_roller_m: f64,
    /// Outer radius of the roll at the start, m. Assumed.
    pub roll_radius_m: f64,
    /// Radius of its core, m. Assumed: 76 mm across.
    pub core_radius_m: f64,
    /// Torque of the brake on the roll, Nm; it gives the film its tension and stops the roll with the roller. Assumed: 12.5 N at the full
    /// roll, more than the 9 N that its 3.7 kg take at 2400 mm/s².
    pub brake_nm: f64,
    /// Tension at which the film slips on the roller, N. Assumed.
    #[doc(alias = "Schlupf")]
    pub grip_n: f64,
    /// Creep below that: share of the travel that the film falls behind, per newton of tension. Assumed none.
    pub creep_per_n: f64,
}

impl Default for WebParams {
    fn default() -> Self {
        WebParams {
            modulus_pa: 2e9,
            thickness_m: 30e-6,
            width_m: 0.4,
            density_kg_m3: 905.0,
            damping_ratio: 0.1,
            span_m: 1.0,
            reader_to_roller_m: 0.3,
            roll_radius_m: 0.08,
            core_radius_m: 0.038,
            brake_nm: 1.0,
            grip_n: 60.0,
            creep_per_n: 0.0,
        }
    }
}

impl WebParams {
    /// Tension for a strain of 1, N.
    pub fn stiffness_n(&self) -> f64 {
        self.modulus_pa * self.thickness_m * self.width_m
    }

    /// Mass of the film on the roll and of nothing else as a moment of inertia, kg m².
    pub fn roll_inertia_kg_m2(&self, radius_m: f64) -> f64 {
        0.5 * PI * self.density_kg_m3 * self.width_m * (radius_m.powi(4) - self.core_radius_m.powi(4)) + CORE_KG_M2
    }
}

/// Inertia of an empty core with its shaft. Assumed.
const CORE_KG_M2: f64 = 1e-3;

/// The film between roll and roller, in motion.
#[derive(Debug, Clone)]
pub(super) struct Web {
    params: WebParams,
    /// Film in the span, told without tension, m.
    content_m: f64,
    /// Tension of the span, N: that of the stretch and that of the damping.
    tension_n: f64,
    /// The same at threading.
    content_at_start_m: f64,
    /// Film that has passed the roller, told without tension, m.
    passed_m: f64,
    /// Film that has left the roll, m.
    unwound_m: f64,
    /// Speed of the film off the roll, m/s.
    roll_speed: f64,
    /// Way that the film has lost on the roller by slip and creep, m.
    slipped_m: f64,
    /// Lowest and highest tension since threading, N.
    tension_range_n: (f64, f64),
}

impl Web {
    /// A film at rest, as tight as the brake holds it.
    pub(super) fn new(params: WebParams) -> Self {
        let tension_n = (params.brake_nm / params.roll_radius_m).min(params.grip_n);
        let content_m = params.span_m / (1.0 + tension_n / params.stiffness_n());
        Web {
            params,
            content_m,
            tension_n,
            content_at_start_m: content_m,
            passed_m: 0.0,
            unwound_m: 0.0,
            roll_speed: 0.0,
            slipped_m: 0.0,
            tension_range_n: (tension_n, tension_n),
        }
    }

    pub(super) fn params(&self) -> &WebParams {
        &self.params
    }

    /// Tension of the span, N; zero when slack.
    pub(super) fn tension_n(&self) -> f64 {
        self.tension_n
    }

    /// Tension of the stretch alone, N.
    fn stretch_n(&self, content_m: f64) -> f64 {
        self.params.stiffness_n() * (self.params.span_m / content_m - 1.0).max(0.0)
    }

    pub(super) fn tension_range_n(&self) -> (f64, f64) {
        self.tension_range_n
    }

    /// Radius of the roll, m: what has left it had the area length times thickness.
    pub(super) fn roll_radius_m(&self) -> f64 {
        let p = &self.params;
        let area = p.roll_radius_m * p.roll_radius_m - self.unwound_m.max(0.0) * p.thickness_m / PI;
        area.max(p.core_radius_m * p.core_radius_m).sqrt()
    }

    /// Way that slip and creep have cost, m.
    pub(super) fn slipped_m(&self) -> f64 {
        self.slipped_m
    }

    /// Position of the film under the reader since threading, m, told without tension: what the print goes by.
    pub(super) fn at_reader_m(&self) -> f64 {
        let share = self.params.reader_to_roller_m / self.params.span_m;
        // Slack hangs where the film comes off the roll.
        let content_m = self.content_m.min(self.params.span_m);
        self.passed_m + share * (content_m - self.content_at_start_m)
    }

    /// The surface of the roller moves on by `travel_m` within `dt_s`.
    pub(super) fn advance(&mut self, travel_m: f64, dt_s: f64) {
        let radius_m = self.roll_radius_m();
        let mass_kg = self.params.roll_inertia_kg_m2(radius_m) / (radius_m * radius_m);
        let brake_n = self.params.brake_nm / radius_m;
        // Film and roll swing with √(EA/(L m)); a twentieth of a radian a step keeps the swing.
        let omega = (self.params.stiffness_n() / (self.params.span_m * mass_kg)).sqrt();
        let steps = (omega * dt_s / 0.05).ceil().clamp(1.0, 64.0);
        for _ in 0..steps as u32 {
            self.step(travel_m / steps, dt_s / steps, mass_kg, brake_n);
        }
    }

    fn step(&mut self, travel_m: f64, dt_s: f64, mass_kg: f64, brake_n: f64) {
        let p = self.params;
        let crept_m = travel_m * p.creep_per_n * self.tension_n;
        let mut on_roller_m = travel_m - crept_m;
        // A stretched film passes less of itself; a slack one lies as it is.
        let share = (self.content_m / p.span_m).min(1.0);
        let mut content_m = self.content_m + self.roll_speed * dt_s - on_roller_m * share;
        if self.stretch_n(content_m) > p.grip_n {
            // The pinch lets go: film slides back until its tension is what the grip holds.
            let held_m = p.span_m / (1.0 + p.grip_n / p.stiffness_n());
            let slid_m = (held_m - content_m) / share;
            on_roller_m -= slid_m;
            self.slipped_m += slid_m;
            content_m = held_m;
        }
        self.slipped_m += crept_m;
        self.passed_m += on_roller_m * share;
        self.unwound_m += self.roll_speed * dt_s;
        self.content_m = content_m;
        let stretch_n = self.stretch_n(content_m);
        let damping = 2.0 * p.damping_ratio * (p.stiffness_n() / p.span_m * mass_kg).sqrt();
        self.tension_n = if stretch_n > 0.0 {
            let stretching = on_roller_m * share / dt_s - self.roll_speed;
            (stretch_n + damping * stretching).clamp(0.0, p.grip_n)
        } else {
            0.0
        };
        let (lowest, highest) = self.tension_range_n;
        self.tension_range_n = (lowest.min(self.tension_n), highest.max(self.tension_n));
        // The speed after the way (semi-implicit): such a step neither feeds nor starves the swing.
        self.roll_speed = braked(
            self.roll_speed,
            self.tension_n / mass_kg * dt_s,
            brake_n / mass_kg * dt_s,
        );
    }
}

/// Speed after a push against dry friction, which at most stops.
fn braked(speed: f64, push: f64, friction: f64) -> f64 {
    let pushed = speed + push;
    if pushed > friction {
        pushed - friction
    } else if pushed < -friction {
        pushed + friction
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 125e-6;

    /// Polyethylene behind a weak brake, whose figures the tests work out by hand.
    fn soft() -> WebParams {
        WebParams {
            modulus_pa: 300e6,
            thickness_m: 50e-6,
            density_kg_m3: 920.0,
            brake_nm: 0.15,
            ..WebParams::default()
        }
    }

    /// Film of 6000 N per strain behind a roller at a constant speed, m/s.
    fn run(params: WebParams, speed: f64, seconds: f64) -> Web {
        let mut web = Web::new(params);
        for _ in 0..(seconds / DT_S) as u32 {
            web.advance(speed * DT_S, DT_S);
        }
        web
    }

    #[test]
    fn at_rest_the_brake_holds_the_film_tight_and_nothing_moves() {
        let web = run(soft(), 0.0, 1.0);
        // 0.15 Nm at 80 mm.
        assert!((web.tension_n() - 1.875).abs() < 1e-9, "{}", web.tension_n());
        assert_eq!((web.at_reader_m(), web.unwound_m), (0.0, 0.0));
    }

    #[test]
    fn in_steady_travel_the_roller_passes_less_film_than_its_surface_by_the_strain() {
        // F = M/R = 1.875 N, ε = F/(E·A) = 3.125e-4: of each metre of surface 1/(1 + ε) of film (mass balance of the span).
        let params = WebParams {
            thickness_m: 50e-6,
            // No film leaves the roll's radius unchanged: an endless one.
            roll_radius_m: 10.0,
            brake_nm: 18.75,
            density_kg_m3: 1e-3,
            ..soft()
        };
        let mut web = run(params, 0.5, 20.0);
        let before = web.passed_m;
        for _ in 0..8000 {
            web.advance(0.5 * DT_S, DT_S);
        }
        let strain = 1.875 / params.stiffness_n();
        assert!(
            (web.passed_m - before - 0.5 / (1.0 + strain)).abs() < 1e-8,
            "{}",
            web.passed_m - before
        );
    }

    #[test]
    fn accelerating_the_roll_takes_tension() {
        // F = M_B/R + J a/R²: a solid roll of 80 mm around 76 mm of core, 0.4 m wide, at 1 m/s².
        let params = soft();
        let inertia = 0.5 * PI * 920.0 * 0.4 * (0.08_f64.powi(4) - 0.038_f64.powi(4)) + CORE_KG_M2;
        assert!((params.roll_inertia_kg_m2(0.08) - inertia).abs() < 1e-12);
        let mut web = Web::new(params);
        let (mut sum, mut count) = (0.0, 0.0);
        let mut speed = 0.0;
        for tick in 0..16_000 {
            speed += 1.0 * DT_S;
            web.advance(speed * DT_S, DT_S);
            // Over whole seconds the swing of the roll on the film averages out.
            if tick >= 8000 {
                sum += web.tension_n();
                count += 1.0;
            }
        }
        let expected = 0.15 / 0.08 + inertia / (0.08 * 0.08);
        assert!(
            (sum / count / expected - 1.0).abs() < 0.03,
            "{} {expected}",
            sum / count
        );
    }

    #[test]
    fn above_the_grip_the_film_slips() {
        let params = WebParams { grip_n: 3.0, ..soft() };
        let mut web = Web::new(params);
        for tick in 0..1600 {
            web.advance(f64::from(tick) * 2.4 * DT_S * DT_S, DT_S);
            assert!(web.tension_n() <= 3.0 + 1e-9);
        }
        assert!(web.slipped_m() > 0.01, "{}", web.slipped_m());
        let surface_m = 0.5 * 2.4 * 0.2 * 0.2;
        assert!(web.passed_m < surface_m - 0.01);
    }

    #[test]
    fn a_stopped_roller_leaves_the_roll_to_run_on_and_the_film_slack_until_the_brake_holds() {
        // Without a dancer the roll of 2.4 kg equivalent mass runs on: v²/(2 F/m) at 1.2 m/s and 1.875 N.
        let params = soft();
        let mut web = run(params, 1.2, 20.0);
        let (radius_m, unwound_m) = (web.roll_radius_m(), web.unwound_m);
        let roll_speed = web.roll_speed;
        let mut slack = false;
        for _ in 0..80_000 {
            web.advance(0.0, DT_S);
            slack |= web.tension_n() == 0.0;
        }
        assert!(slack && web.roll_speed == 0.0);
        let mass = params.roll_inertia_kg_m2(radius_m) / (radius_m * radius_m);
        let run_on_m = roll_speed * roll_speed * mass * radius_m / (2.0 * params.brake_nm);
        assert!(
            ((web.unwound_m - unwound_m) / run_on_m - 1.0).abs() < 0.05,
            "{} {run_on_m}",
            web.unwound_m - unwound_m
        );
    }

    #[test]
    fn the_roll_shrinks_by_the_area_of_what_has_left_it() {
        // 50 m of 50 µm: 2.5e-3 m² of side; R² falls by that over π.
        let mut web = Web::new(soft());
        web.unwound_m = 50.0;
        let expected = (0.08_f64 * 0.08 - 50.0 * 50e-6 / PI).sqrt();
        assert!((web.roll_radius_m() - expected).abs() < 1e-12);
        web.unwound_m = 1e6;
        assert_eq!(web.roll_radius_m(), 0.038);
    }
}

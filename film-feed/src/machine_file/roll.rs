//! The roll that the film comes from, and how hard it pulls.

use super::MachineFile;
use crate::machine::WebParams;

/// The roll the film comes from, its brake, and the span up to the roller. The film itself (width, thickness, modulus) stands in
/// [`FilmWeb`](super::FilmWeb).
#[derive(Debug, Clone, Copy, PartialEq)]
#[doc(alias = "Folienrolle")]
pub struct FilmRoll {
    /// Outer radius of a full roll, mm, 40…2000 (80).
    pub radius_mm: f64,
    /// Radius of its core, mm, 5 up to `radius_mm` (38).
    pub core_radius_mm: f64,
    /// Torque of the brake on the roll, Nm, 0…1000.
    pub brake_nm: f64,
    /// From roll to roller, mm, 300…10⁵ (1000).
    pub span_mm: f64,
    /// From reader to roller, mm, 0 up to `span_mm` (300).
    pub reader_to_roller_mm: f64,
    /// Tension at which the film slips on the roller, N, 0.1…10⁶ (60).
    pub grip_n: f64,
    /// Creep below that, share of the travel per newton, 0…0.01 (0).
    pub creep_per_n: f64,
    /// Density of the film, kg/m³, 100…10 000 (905).
    pub density_kg_m3: f64,
    /// Damping of the film with the roll on it, share of the critical one, 0.001…1 (0.1).
    pub damping_ratio: f64,
}

impl MachineFile {
    /// The elastic film of a run; `None` without a roll.
    pub fn web_params(&self) -> Option<WebParams> {
        let (film, roll) = (&self.film, self.roll.as_ref()?);
        Some(WebParams {
            modulus_pa: film.modulus_n_mm2 * 1e6,
            thickness_m: film.thickness_um * 1e-6,
            width_m: film.width_mm * 1e-3,
            density_kg_m3: roll.density_kg_m3,
            damping_ratio: roll.damping_ratio,
            span_m: roll.span_mm * 1e-3,
            reader_to_roller_m: roll.reader_to_roller_mm * 1e-3,
            roll_radius_m: roll.radius_mm * 1e-3,
            core_radius_m: roll.core_radius_mm * 1e-3,
            brake_nm: roll.brake_nm,
            grip_n: roll.grip_n,
            creep_per_n: roll.creep_per_n,
        })
    }

    /// Least and greatest pull of the film at the roller at a film acceleration, N: `pull_n`, and of the roll `M_brake/R + J·a/R²`, full and
    /// all but empty. A film cannot push.
    pub fn pull_n(&self, accel_mm_s2: f64) -> (f64, f64) {
        let constant_n = self.film.pull_n;
        let Some(web) = self.web_params() else {
            return (constant_n, constant_n);
        };
        let at = |radius_m: f64| {
            let mass_kg = web.roll_inertia_kg_m2(radius_m) / (radius_m * radius_m);
            (web.brake_nm / radius_m + mass_kg * accel_mm_s2 * 1e-3).max(0.0)
        };
        let (full_n, empty_n) = (at(web.roll_radius_m), at(web.core_radius_m));
        (constant_n + full_n.min(empty_n), constant_n + full_n.max(empty_n))
    }

    /// Torque at the motor's shaft for a pull at the roller, Nm: F·r / i.
    pub fn torque_of_pull_nm(&self, pull_n: f64) -> f64 {
        pull_n * self.mechanics.roller_diameter_mm * 0.5e-3 / self.mechanics.gear_ratio()
    }
}

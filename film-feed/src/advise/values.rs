//! The numbers that the checks compare, from what a run is given.

use std::f64::consts::TAU;

use lenze9300_model::code::CodeStore;
use lenze9300_model::code::table::number::{C1202, C1203, C1204, C1240, C1250};
use lenze9300_model::units::INC_PER_REV;

use super::Demands;
use crate::operator::FeedPlan;
use crate::report::FeedMode;
use crate::rig::RigConfig;

/// Everything in SI units, film lengths in mm.
pub(super) struct Values<'c> {
    pub(super) rig: &'c RigConfig,
    pub(super) tolerance_mm: f64,
    pub(super) cycle_s: Option<f64>,
    pub(super) by_length: bool,
    pub(super) to_mark: bool,
    pub(super) length_mm: f64,
    pub(super) speed_mm_s: f64,
    pub(super) mark_speed_mm_s: f64,
    pub(super) accel_mm_s2: f64,
    /// C1240 and C1250.
    pub(super) v_max_mm_s: f64,
    pub(super) a_max_mm_s2: f64,
    /// As the drive believes, from C1202 to C1204.
    pub(super) mm_per_rad: f64,
    pub(super) mm_per_inc: f64,
    /// Torque of the ramps beside friction, and all that stands against the motion, Nm.
    pub(super) inertia_nm: f64,
    pub(super) resistance_nm: f64,
}

impl<'c> Values<'c> {
    pub(super) fn new(rig: &'c RigConfig, plan: &FeedPlan, demands: &Demands) -> Self {
        let has = |mode| plan.series.iter().any(|(series, feeds)| *series == mode && *feeds > 0);
        let codes = &rig.drive.codes;
        let (v_max_mm_s, a_max_mm_s2) = (codes.number(C1240, 0), codes.number(C1250, 0));
        let share = |hundredth_percent: i16| f64::from(hundredth_percent) / 10_000.0;
        let mm_per_rev = codes.number(C1204, 0) * codes.number(C1203, 0) / codes.number(C1202, 0);
        let mm_per_rad = mm_per_rev / TAU;
        let accel_mm_s2 = a_max_mm_s2 * share(plan.accel_hundredth_percent);
        let mechanics = &rig.drive.axis.mechanics;
        let speed_mm_s = v_max_mm_s * share(plan.speed_hundredth_percent);
        Values {
            rig,
            tolerance_mm: demands.tolerance_mm,
            cycle_s: demands.cycle_s,
            by_length: has(FeedMode::Length),
            to_mark: has(FeedMode::Mark),
            length_mm: f64::from(plan.length_tenth_mm) / 10.0,
            speed_mm_s,
            // The block limits it to the travel velocity (film-feed specification, section 10).
            mark_speed_mm_s: (v_max_mm_s * share(plan.mark_speed_hundredth_percent)).min(speed_mm_s),
            accel_mm_s2,
            v_max_mm_s,
            a_max_mm_s2,
            mm_per_rad,
            mm_per_inc: mm_per_rev / INC_PER_REV as f64,
            inertia_nm: mechanics.j_total_kg_m2() * accel_mm_s2 / mm_per_rad,
            resistance_nm: mechanics.coulomb_nm
                + mechanics.viscous_nm_s * speed_mm_s / mm_per_rad
                + rig.load_torque_nm.max(0.0),
        }
    }

    pub(super) fn codes(&self) -> &CodeStore {
        &self.rig.drive.codes
    }

    /// Motor speed at a film speed, 1/min.
    pub(super) fn rpm(&self, mm_s: f64) -> f64 {
        mm_s / self.mm_per_rad * 60.0 / TAU
    }

    /// The shortest motion of a feed, s: by length, or to the earliest mark.
    pub(super) fn motion_s(&self) -> f64 {
        let by_length = ramps_s(self.length_mm, self.speed_mm_s, 0.0, self.accel_mm_s2);
        if !self.to_mark {
            return by_length;
        }
        let slow = self.mark_speed_mm_s;
        let travel = ramps_s(self.length_mm - SEARCH_MM, self.speed_mm_s, slow, self.accel_mm_s2);
        // From the earliest mark the film goes on for the residual path.
        let earliest = (self.rig.film.marks.repeat_mm - self.rig.film.marks.tolerance_mm).max(0.0);
        let search_mm = (earliest - (self.length_mm - SEARCH_MM)).max(0.0);
        let to_mark = travel + search_mm / slow + 0.5 * slow / self.accel_mm_s2;
        if self.by_length {
            by_length.min(to_mark)
        } else {
            to_mark
        }
    }

    /// The longest way of the process data from the PLC's cycle to the drive's program, s: DP cycle, module, the drive's task.
    pub(super) fn path_s(&self) -> f64 {
        let dp_s = self.rig.dp_cycle_ns as f64 * 1e-9;
        let exchange_s = EXCHANGE_BITS / f64::from(self.rig.baud.bits_per_second());
        let module_s = self.rig.module.process_data_delay_ms as f64 * 1e-3;
        dp_s.max(exchange_s) + exchange_s + module_s + TASK_S
    }

    pub(super) fn plc_s(&self) -> f64 {
        self.rig.plc_cycle_ns as f64 * 1e-9
    }
}

/// Time over `length` from rest to the speed `last`, with `speed` and `accel` as limits.
fn ramps_s(length: f64, speed: f64, last: f64, accel: f64) -> f64 {
    let peak = (accel * length + 0.5 * last * last).sqrt().min(speed);
    let ramps_mm = (2.0 * peak * peak - last * last) / (2.0 * accel);
    (2.0 * peak - last) / accel + (length - ramps_mm).max(0.0) / peak
}

/// Record 04 begins so far before the feed length (film-feed specification, section 6).
pub(super) const SEARCH_MM: f64 = 100.0;
/// The drive's function blocks work once a millisecond.
pub(super) const TASK_S: f64 = 1e-3;
/// An exchange of 16 octets each way, tBIT (9300 facts 1.6).
const EXCHANGE_BITS: f64 = 655.0;

//! What the values of the motion do by themselves.

use lenze9300_model::code::table::number::{C0011, C0022, C0596, C1218};
use lenze9300_model::traverse::LatchMode;

use super::values::{SEARCH_MM, TASK_S, Values};
use super::{Finding, Severity, short};
use crate::machine::RESIDUAL_PATH_MM;

pub(super) fn findings(values: &Values<'_>) -> Vec<Finding> {
    let checks: [fn(&Values<'_>) -> Option<Finding>; 12] = [
        reversal,
        mark_early,
        mark_late,
        speed,
        torque,
        following_error,
        latch,
        reader,
        resolver,
        target_window,
        range,
        cycle,
    ];
    checks.into_iter().filter_map(|check| check(values)).collect()
}

fn fails(id: &'static str, (value, limit, unit): (f64, f64, &'static str), cause: String, remedy: String) -> Finding {
    Finding {
        id,
        severity: Severity::Fails,
        cause,
        value,
        limit: Some(limit),
        unit,
        remedy,
    }
}

/// The drive plans the end anew a millisecond after the mark, so that much of the residual path is gone when it brakes.
fn reversal(v: &Values<'_>) -> Option<Finding> {
    let (speed, accel) = (v.mark_speed_mm_s, v.accel_mm_s2);
    let braking_mm = speed * speed / (2.0 * accel) + speed * TASK_S;
    if !v.to_mark || braking_mm <= RESIDUAL_PATH_MM {
        return None;
    }
    // v²/(2a) + v·T = s solved for v and for a.
    let most_mm_s = accel * ((TASK_S * TASK_S + 2.0 * RESIDUAL_PATH_MM / accel).sqrt() - TASK_S);
    let least_mm_s2 = speed * speed / (2.0 * (RESIDUAL_PATH_MM - speed * TASK_S));
    let harder = if least_mm_s2 > 0.0 && least_mm_s2 <= v.a_max_mm_s2 {
        format!(", or the acceleration to {least_mm_s2:.0} mm/s² or more")
    } else {
        String::new()
    };
    Some(fails(
        "reversal",
        (braking_mm, RESIDUAL_PATH_MM, "mm"),
        format!(
            "braking from the mark-reading velocity {speed:.1} mm/s takes {braking_mm:.2} mm, only {RESIDUAL_PATH_MM} mm are left behind the mark: the film runs backwards by {:.2} mm and goes slack",
            braking_mm - RESIDUAL_PATH_MM
        ),
        format!(
            "set the mark-reading velocity to {most_mm_s:.1} mm/s or less, {:.1} % of C1240{harder}",
            100.0 * most_mm_s / v.v_max_mm_s
        ),
    ))
}

/// A finished feed leaves the mark 50 mm behind the reader; the next one is ahead by its distance less that.
fn mark_early(v: &Values<'_>) -> Option<Finding> {
    let marks = &v.rig.film.marks;
    let earliest_mm = marks.repeat_mm - marks.tolerance_mm - RESIDUAL_PATH_MM;
    let search_mm = v.length_mm - SEARCH_MM;
    if !v.to_mark || earliest_mm >= search_mm - ROUNDING_MM {
        return None;
    }
    Some(fails(
        "mark_early",
        (earliest_mm, search_mm, "mm"),
        format!(
            "the next mark can lie {earliest_mm:.1} mm ahead, but record 04 searches only from {search_mm:.1} mm on: such a mark is passed unseen in record 03 and the film goes on to the one behind it"
        ),
        format!(
            "let the marks vary by {:.1} mm at most, or set the feed length to {:.1} mm or less",
            (marks.repeat_mm - v.length_mm + RESIDUAL_PATH_MM).max(0.0),
            earliest_mm + SEARCH_MM
        ),
    ))
}

/// Record 04 ends 100 mm and a feed length behind where it began (film-feed specification, section 6): twice the length.
fn mark_late(v: &Values<'_>) -> Option<Finding> {
    let marks = &v.rig.film.marks;
    let latest_mm = marks.repeat_mm + marks.tolerance_mm - RESIDUAL_PATH_MM;
    let search_mm = 2.0 * v.length_mm;
    if !v.to_mark || latest_mm <= search_mm + ROUNDING_MM {
        return None;
    }
    Some(fails(
        "mark_late",
        (latest_mm, search_mm, "mm"),
        format!(
            "the next mark can lie {latest_mm:.1} mm ahead, but record 04 ends {search_mm:.1} mm ahead: the feed ends without a mark"
        ),
        format!("set the feed length to {:.1} mm or more", 0.5 * latest_mm),
    ))
}

fn speed(v: &Values<'_>) -> Option<Finding> {
    let rpm = v.rpm(v.speed_mm_s);
    let n_max_rpm = v.codes().number(C0011, 0);
    let plant_rpm = v.codes().number(C0596, 0);
    let (limit, what) = if rpm > plant_rpm {
        (plant_rpm, "C0596: the drive trips with NMAX")
    } else if rpm > n_max_rpm {
        (n_max_rpm, "C0011, the reference of all speeds: v_max must lie below it")
    } else {
        return None;
    };
    let allowed_mm_s = v.speed_mm_s * limit / rpm;
    Some(fails(
        "speed",
        (rpm, limit, "1/min"),
        format!(
            "{:.1} mm/s need {rpm:.1} 1/min of the motor, more than {limit:.0} 1/min of {what}",
            v.speed_mm_s
        ),
        format!("set C1240 or the travel velocity to {allowed_mm_s:.1} mm/s or less, or take a smaller gear ratio"),
    ))
}

fn torque(v: &Values<'_>) -> Option<Finding> {
    let needed_nm = v.inertia_nm + v.resistance_nm;
    let limit_nm = v.rig.drive.axis.torque_max_nm();
    if needed_nm <= limit_nm {
        return None;
    }
    let left_nm = (limit_nm - v.resistance_nm).max(0.0);
    let remedy = if left_nm > 0.0 {
        format!(
            "set the acceleration to {:.0} mm/s² or less, or C0022 to {:.2} A or more if motor and drive can give it",
            v.accel_mm_s2 * left_nm / v.inertia_nm,
            v.codes().number(C0022, 0) * needed_nm / limit_nm
        )
    } else {
        format!(
            "friction and pull alone take {:.3} Nm; take a larger motor or drive",
            v.resistance_nm
        )
    };
    Some(fails(
        "torque",
        (needed_nm, limit_nm, "Nm"),
        format!(
            "the ramp needs {needed_nm:.3} Nm, C0022 allows {limit_nm:.3} Nm: the axis falls behind its set-value and trips with P14"
        ),
        remedy,
    ))
}

/// Bound of the following error: what the proportional parts alone need to make the torque step of a ramp, ΔM/(K_p · k_v). The integral
/// part only takes it away again.
fn following_error(v: &Values<'_>) -> Option<Finding> {
    let axis = &v.rig.drive.axis;
    let k_v = axis.position_controller().k_v();
    let k_p = axis.speed_gains().k_p;
    // From rest the friction has to be overcome as well; from driving to braking at once the inertia counts twice.
    let reaches_speed = v.speed_mm_s * v.speed_mm_s / v.accel_mm_s2 <= v.length_mm;
    let step_nm = if reaches_speed {
        v.inertia_nm + v.resistance_nm
    } else {
        (v.inertia_nm + v.resistance_nm).max(2.0 * v.inertia_nm)
    };
    let error_mm = step_nm / (k_p * k_v) * v.mm_per_rad;
    let limit_mm = v.codes().number(C1218, 1);
    if error_mm <= limit_mm {
        return None;
    }
    Some(fails(
        "following_error",
        (error_mm, limit_mm, "mm"),
        format!(
            "the ramps can make a following error of {error_mm:.3} mm (ΔM {step_nm:.3} Nm by K_p {k_p:.4} Nm·s/rad and k_v {k_v:.1} 1/s), C1218/1 trips with P14 at {limit_mm} mm"
        ),
        format!(
            "raise C0070 or C0254 by {:.1}, lower the acceleration, or set C1218/1 to {} mm or more",
            error_mm / limit_mm,
            short(1.2 * error_mm)
        ),
    ))
}

fn latch(v: &Values<'_>) -> Option<Finding> {
    let way_mm = v.mark_speed_mm_s * TASK_S;
    if !v.to_mark || v.rig.drive.touch_input != LatchMode::Sampled1ms || way_mm <= v.tolerance_mm {
        return None;
    }
    Some(fails(
        "latch",
        (way_mm, v.tolerance_mm, "mm"),
        format!(
            "E1 is looked at once a millisecond, in which the film moves up to {way_mm:.3} mm: marks are seen that late, the tolerance is {} mm",
            v.tolerance_mm
        ),
        format!(
            "put the reader on an input that latches the exact position, or read marks at {:.1} mm/s or less",
            v.tolerance_mm / TASK_S
        ),
    ))
}

fn reader(v: &Values<'_>) -> Option<Finding> {
    let reader = &v.rig.reader;
    let way_mm = v.mark_speed_mm_s * (reader.delay_us + reader.jitter_us) * 1e-6;
    if !v.to_mark || way_mm <= v.tolerance_mm {
        return None;
    }
    Some(fails(
        "reader",
        (way_mm, v.tolerance_mm, "mm"),
        format!(
            "the reader switches up to {:.0} µs late, in which the film moves {way_mm:.4} mm, more than the tolerance of {} mm",
            reader.delay_us + reader.jitter_us,
            v.tolerance_mm
        ),
        format!(
            "read marks at {:.1} mm/s or less, take a faster reader, or shift it by the mean {:.4} mm so that only the scatter of ±{:.4} mm counts",
            v.tolerance_mm / ((reader.delay_us + reader.jitter_us) * 1e-6),
            v.mark_speed_mm_s * reader.delay_us * 1e-6,
            v.mark_speed_mm_s * reader.jitter_us * 1e-6
        ),
    ))
}

fn resolver(v: &Values<'_>) -> Option<Finding> {
    let bits = v.rig.drive.axis.feedback.resolver_bits.clamp(8, 16);
    let step_mm = f64::from(1_u32 << (16 - bits)) * v.mm_per_inc;
    if step_mm <= v.tolerance_mm {
        return None;
    }
    let needed = (f64::from(1_u32 << 16) * v.mm_per_inc / v.tolerance_mm).log2().ceil();
    Some(fails(
        "resolver",
        (step_mm, v.tolerance_mm, "mm"),
        format!(
            "a step of the resolver with {bits} bits is {step_mm:.4} mm of film, more than the tolerance of {} mm: where in a step the film stands, nobody knows",
            v.tolerance_mm
        ),
        format!("evaluate the resolver with {needed:.0} bits or more, or take a greater gear ratio"),
    ))
}

fn target_window(v: &Values<'_>) -> Option<Finding> {
    let window_mm = f64::from(v.rig.drive.traverse.target_window_e4) / 1e4;
    if window_mm <= v.tolerance_mm {
        return None;
    }
    Some(fails(
        "target_window",
        (window_mm, v.tolerance_mm, "mm"),
        format!(
            "JOB_FIN comes when the following error is within {window_mm} mm, more than the tolerance of {} mm: a feed is reported done that is not",
            v.tolerance_mm
        ),
        format!("set the target window to {} mm or less", short(0.9 * v.tolerance_mm)),
    ))
}

fn range(v: &Values<'_>) -> Option<Finding> {
    let way_mm = if v.to_mark { 2.0 * v.length_mm } else { v.length_mm };
    let way_inc = way_mm / v.mm_per_inc;
    let (limit, what) = if way_inc > f64::from(i32::MAX) {
        (
            f64::from(i32::MAX),
            "32 bits with a sign: the position runs over within one feed",
        )
    } else if way_inc > REAL_INC {
        (REAL_INC, "24 bits of a REAL: POS_ACT of the block loses increments")
    } else {
        return None;
    };
    Some(fails(
        "range",
        (way_inc, limit, "inc"),
        format!("the longest way, {way_mm:.1} mm, is {way_inc:.0} increments, more than the {limit:.0} of {what}"),
        format!("take a gear ratio smaller by {:.1}, or feed in parts", way_inc / limit),
    ))
}

/// What a feed takes as the PLC sees it: two PLC cycles, both ways of the process data, the motion.
fn cycle(v: &Values<'_>) -> Option<Finding> {
    let cycle_s = v.cycle_s?;
    let motion_s = v.motion_s();
    let around_s = 2.0 * v.plc_s() + 2.0 * v.path_s();
    let needed_s = motion_s + around_s;
    if needed_s <= cycle_s {
        return None;
    }
    Some(fails(
        "cycle",
        (needed_s, cycle_s, "s"),
        format!(
            "a feed takes {needed_s:.4} s from POS_START to JOB_FIN: {motion_s:.4} s of motion, {:.1} ms for two PLC cycles, {:.1} ms for the way to the drive and back; the next start is due after {cycle_s} s",
            2e3 * v.plc_s(),
            2e3 * v.path_s()
        ),
        format!(
            "let the machine take {needed_s:.3} s or more, move faster, or shorten PLC and DP cycle by {:.1} ms",
            1e3 * (needed_s - cycle_s)
        ),
    ))
}

/// Lengths in tenths of a millimetre are not exact in binary.
const ROUNDING_MM: f64 = 1e-6;
/// Whole numbers that a REAL (IEEE 754, 32 bits) holds exactly.
const REAL_INC: f64 = 16_777_216.0;

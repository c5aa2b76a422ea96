//! What the thesis' block does to a true drive without meaning to (9300 facts 9.1).

use lenze9300_model::code::table::number::{C0142, C1204};
use lenze9300_model::device::{Fault, Reaction};

use super::values::{TASK_S, Values};
use super::{Finding, Severity};

pub(super) fn findings(values: &Values<'_>) -> Vec<Finding> {
    let checks: [fn(&Values<'_>) -> Option<Finding>; 5] = [
        lost_start,
        unwanted_start,
        zero_outputs,
        errors_as_data,
        message_recovery,
    ];
    checks.into_iter().filter_map(|check| check(values)).collect()
}

/// The drive takes a start edge only after a millisecond of low level in the state "ready to start".
fn lost_start(v: &Values<'_>) -> Option<Finding> {
    // A start travels as long as the one before it, so the drive sees both a cycle apart, give or take the PLC's and the bus's grid.
    let needed_s = v.motion_s() + 2.0 * TASK_S;
    if let Some(cycle_s) = v.cycle_s.filter(|cycle_s| *cycle_s < needed_s) {
        return Some(Finding {
            id: "lost_start",
            severity: Severity::Fails,
            cause: format!(
                "a start every {cycle_s} s reaches the drive before the program of {:.4} s has ended and a millisecond has passed: it is swallowed, and nobody tells",
                v.motion_s()
            ),
            value: cycle_s,
            limit: Some(needed_s),
            unit: "s",
            remedy: format!("start every {needed_s:.3} s or later, and only when RUNNING is seen low"),
        });
    }
    let blind_ms = 1e3 * (v.path_s() + v.plc_s() + TASK_S);
    Some(Finding {
        id: "lost_start",
        severity: Severity::Hazard,
        cause: format!(
            "a start that is raised before the PLC sees RUNNING drop can reach the drive within a millisecond of the program's end: it is swallowed, although POS_START stays high; what the PLC sees is up to {blind_ms:.1} ms old"
        ),
        value: blind_ms,
        limit: None,
        unit: "ms",
        remedy: "raise POS_START only in a cycle after RUNNING was seen low, and watch that RUNNING comes".to_owned(),
    })
}

/// Bit 5 of the control word is ¬POS_START ∧ ¬ERROR, and its falling edge starts the program.
fn unwanted_start(v: &Values<'_>) -> Option<Finding> {
    let warnings: Vec<&str> = Fault::ALL
        .into_iter()
        .filter(|fault| fault.reaction(v.codes()) == Reaction::Warning)
        .map(Fault::display)
        .collect();
    if warnings.is_empty() {
        return None;
    }
    let codes: Vec<String> = Fault::ALL
        .into_iter()
        .filter(|fault| fault.reaction(v.codes()) == Reaction::Warning)
        .filter_map(|fault| {
            fault
                .reaction_code()
                .map(|code| format!("C{code:04} ({})", fault.display()))
        })
        .collect();
    let off = if codes.is_empty() {
        String::new()
    } else {
        format!(", or give {} another reaction", codes.join(", "))
    };
    Some(Finding {
        id: "unwanted_start",
        severity: Severity::Hazard,
        cause: format!(
            "a warning ({}) that comes while POS_START is low raises ERROR, and that makes a start edge: the film moves {:.1} mm and nobody asked for it",
            warnings.join(", "),
            v.length_mm
        ),
        value: warnings.len() as f64,
        limit: Some(0.0),
        unit: "warnings",
        remedy: format!("hold POS_START high until the next feed is to begin (its end makes no edge){off}"),
    })
}

/// With all outputs zero the voltage is inhibited: what turns coasts against friction alone.
fn zero_outputs(v: &Values<'_>) -> Option<Finding> {
    let mechanics = &v.rig.drive.axis.mechanics;
    let omega = v.speed_mm_s / v.mm_per_rad;
    let friction_nm = mechanics.coulomb_nm + v.rig.load_torque_nm;
    let (coast_mm, how) = if friction_nm > 0.0 {
        let energy_j = 0.5 * mechanics.j_total_kg_m2() * omega * omega;
        let coast_mm = energy_j / friction_nm * v.mm_per_rad;
        (coast_mm, format!("up to {coast_mm:.0} mm until friction stops it"))
    } else {
        (f64::INFINITY, "without an end, as nothing brakes it".to_owned())
    };
    Some(Finding {
        id: "zero_outputs",
        severity: Severity::Hazard,
        cause: format!(
            "a master in Clear, or one that has not spoken yet, makes all outputs zero: that is a start edge, but stop dominates and the voltage is off, so a film under way coasts, {how}, and the feed is lost"
        ),
        // JSON knows no infinity.
        value: coast_mm.min(1e9),
        limit: None,
        unit: "mm",
        remedy: "keep the PLC in RUN while the film moves; after Clear bring the film to its place by hand before the next start".to_owned(),
    })
}

/// Error 6/7/0000, read as a number with four decimals.
fn errors_as_data(v: &Values<'_>) -> Option<Finding> {
    const CODE_MISSING: f64 = 0x0607_0000 as f64 / 10_000.0;
    let factor = CODE_MISSING / v.codes().number(C1204, 0);
    Some(Finding {
        id: "errors_as_data",
        severity: Severity::Hazard,
        cause: format!(
            "the block takes the error of a rejected read for its value: with 6/7/0000 for C1204 the feed constant is {CODE_MISSING:.4} and POS_ACT reads {factor:.2} times too much; a rejected write it does not notice at all"
        ),
        value: factor,
        limit: Some(1.0),
        unit: "times",
        remedy: "watch the parameter channel (`parameters` in the report of `film-feed run`); do not load or save parameter sets while the block runs".to_owned(),
    })
}

fn message_recovery(v: &Values<'_>) -> Option<Finding> {
    if v.codes().number(C0142, 0) == 0.0 {
        return None;
    }
    let link = &v.rig.drive.axis.dc_link;
    let (full_v, low_v) = (link.rectified_v(), link.thresholds.lu_v);
    let bridged_ms = 1e3 * link.capacitance_f * (full_v * full_v - low_v * low_v) / (2.0 * link.standby_w);
    Some(Finding {
        id: "message_recovery",
        severity: Severity::Hazard,
        cause: format!(
            "C0142 = 1: after a message, such as LU, of more than 0.5 s the reference is gone, and the drive enables itself as soon as it is over, because the control word still says so; at rest the DC link bridges {bridged_ms:.0} ms of mains failure, in motion less"
        ),
        value: bridged_ms.min(1e9),
        limit: None,
        unit: "ms",
        remedy: "set C0142 = 0: then a new enable is needed; or take Freigabe away when ERROR comes".to_owned(),
    })
}

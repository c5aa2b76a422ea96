//! The fields of a record as numbers, with the variables as they stand.

use super::interpolator::Limits;
use super::record::{Acceleration, FinalVelocity, Record, Target, Velocity};
use super::resolution::Resolution;
use crate::code::CodeStore;
use crate::code::table::number::*;

/// A target as the sum of two lengths ×10000: stored variable and wired constant.
pub(super) fn length_e4(target: Target, codes: &CodeStore) -> [i32; 2] {
    let Target::Variable(number) = target else {
        return [0, 0];
    };
    match codes.wired_positions().iter().find(|wired| wired.number == number) {
        Some(wired) => [codes.raw(C1301, wired.base), wired.offset_e4],
        None => [codes.raw(C1301, number), 0],
    }
}

/// Limits of a record; those of the jerk are no field of it.
pub(super) fn record_limits(record: &Record, codes: &CodeStore) -> Limits {
    let resolution = Resolution::from_codes(codes);
    let rate = |rate| {
        let percent_e4 = match rate {
            Acceleration::Max => 100_0000,
            Acceleration::Variable(number) => codes.raw(C1303, number),
        };
        resolution.acceleration_from_codes(percent_e4, codes)
    };
    let percent_e4 = match record.velocity {
        Velocity::Max => 100_0000,
        Velocity::Variable(number) => codes.raw(C1302, number),
    };
    Limits {
        v_max: resolution.velocity_from_codes(percent_e4, codes),
        acc: rate(record.acceleration),
        dec: rate(record.deceleration),
        jerk: f64::INFINITY,
    }
}

pub(super) fn final_velocity(record: &Record, codes: &CodeStore) -> f64 {
    match record.final_velocity {
        FinalVelocity::Standstill => 0.0,
        FinalVelocity::Variable(number) => {
            Resolution::from_codes(codes).velocity_from_codes(codes.raw(C1302, number), codes)
        }
    }
}

/// A target in whole increments: each summand is truncated, as the drive's arithmetic block adds increments.
pub(super) fn whole_increments(target: Target, resolution: &Resolution, codes: &CodeStore) -> i64 {
    let [length, offset] = length_e4(target, codes);
    resolution.whole_increments(length) + resolution.whole_increments(offset)
}

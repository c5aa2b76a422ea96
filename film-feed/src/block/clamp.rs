//! Network "Werte Begrenzen": the four numbers are bounded where they stand, in the instance data.

use super::inputs::Inputs;

/// Least and greatest feed length in 1/10 mm.
const DISTANCE: (i32, i32) = (2_000, 20_000);
/// Least and greatest velocity and acceleration in 1/100 %.
const PERCENT: (i16, i16) = (1_000, 10_000);

/// Clamps distance, velocity, mark velocity and acceleration in place, in the original's order and with its quirks.
///
/// Each bound is a load, a load, a compare and, if it held, a transfer of accumulator 1 (the bound). What decides is the
/// width of the compare:
///
/// - `L #Strecke; L L#2000; <D` compares 32 bits, but loading an INT fills the upper half with zeros. A negative distance
///   is therefore a number from 32768 to 65535, and becomes the maximum.
/// - The others compare 16 bits (`<I`, `>I`), where the sign counts: a negative number becomes the minimum.
/// - The mark velocity's upper bound is the velocity just clamped. What was cut stays cut when the velocity rises again.
///
/// Source: film-feed specification, section 8.1 points 1 and 2.
pub(crate) fn clamp(inputs: &mut Inputs) {
    inputs.distance = zero_extended(inputs.distance).clamp(DISTANCE.0, DISTANCE.1) as i16;
    inputs.velocity = bounded(inputs.velocity, PERCENT.0, PERCENT.1);
    inputs.mark_velocity = bounded(inputs.mark_velocity, PERCENT.0, inputs.velocity);
    inputs.acceleration = bounded(inputs.acceleration, PERCENT.0, PERCENT.1);
}

/// `L` of an INT: 16 bits into the low half of the accumulator, zeros into the high half.
fn zero_extended(int: i16) -> i32 {
    i32::from(int as u16)
}

/// Lower bound first, then upper bound, each with a 16-bit compare.
fn bounded(value: i16, low: i16, high: i16) -> i16 {
    value.max(low).min(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clamped(velocity: i16, mark_velocity: i16, acceleration: i16, distance: i16) -> [i16; 4] {
        let mut inputs = Inputs {
            velocity,
            mark_velocity,
            acceleration,
            distance,
            ..Inputs::default()
        };
        clamp(&mut inputs);
        [
            inputs.velocity,
            inputs.mark_velocity,
            inputs.acceleration,
            inputs.distance,
        ]
    }

    #[test]
    fn a_negative_distance_becomes_the_maximum_and_the_other_negatives_the_minimum() {
        assert_eq!(clamped(-1, -1, -1, -1), [1_000, 1_000, 1_000, 20_000]);
        assert_eq!(
            clamped(i16::MIN, i16::MIN, i16::MIN, i16::MIN),
            [1_000, 1_000, 1_000, 20_000]
        );
    }

    #[test]
    fn bounds_are_kept_and_what_lies_between_is_untouched() {
        assert_eq!(clamped(1_000, 1_000, 1_000, 2_000), [1_000, 1_000, 1_000, 2_000]);
        assert_eq!(
            clamped(10_000, 10_000, 10_000, 20_000),
            [10_000, 10_000, 10_000, 20_000]
        );
        assert_eq!(clamped(999, 999, 999, 1_999), [1_000, 1_000, 1_000, 2_000]);
        assert_eq!(
            clamped(10_001, 10_001, 10_001, 20_001),
            [10_000, 10_000, 10_000, 20_000]
        );
        assert_eq!(clamped(5_000, 4_000, 3_000, 12_000), [5_000, 4_000, 3_000, 12_000]);
    }

    #[test]
    fn the_mark_velocity_is_bounded_by_the_velocity_already_clamped() {
        assert_eq!(clamped(500, 9_000, 1_000, 2_000)[1], 1_000);
        assert_eq!(clamped(32_767, 32_767, 1_000, 2_000)[1], 10_000);
    }
}

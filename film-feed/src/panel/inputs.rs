//! The block's inputs by name, within the ranges of the panel's table.

use super::protocol::INPUTS;
use crate::block::Inputs;

pub(super) fn set_input(inputs: &mut Inputs, name: &str, value: i32) -> Result<(), String> {
    let info = INPUTS
        .iter()
        .find(|info| info.name == name)
        .ok_or_else(|| format!("`{name}` is no input of the block"))?;
    if !(info.min..=info.max).contains(&value) {
        let scale = 10_f64.powi(i32::from(info.decimals));
        let shown = |raw: i32| format!("{:.*}", usize::from(info.decimals), f64::from(raw) / scale);
        return Err(format!(
            "{}: {} is not allowed, {} to {} {} is",
            info.original,
            shown(value),
            shown(info.min),
            shown(info.max),
            info.unit
        ));
    }
    let is_set = value == 1;
    match name {
        "enable" => inputs.enable = is_set,
        "pos_start" => inputs.pos_start = is_set,
        "pos_stop" => inputs.pos_stop = is_set,
        "error_reset" => inputs.error_reset = is_set,
        "read_mark" => inputs.read_mark = is_set,
        "manual" => inputs.manual = is_set,
        "manual_pos" => inputs.manual_pos = is_set,
        "manual_neg" => inputs.manual_neg = is_set,
        // The ranges of the table fit 16 bits.
        "velocity" => inputs.velocity = value as i16,
        "mark_velocity" => inputs.mark_velocity = value as i16,
        "acceleration" => inputs.acceleration = value as i16,
        _ => inputs.distance = value as i16,
    }
    Ok(())
}

/// Values of the inputs in the order of [`INPUTS`].
pub(super) fn input_values(inputs: &Inputs) -> Vec<i32> {
    vec![
        i32::from(inputs.enable),
        i32::from(inputs.pos_start),
        i32::from(inputs.pos_stop),
        i32::from(inputs.error_reset),
        i32::from(inputs.read_mark),
        i32::from(inputs.manual),
        i32::from(inputs.manual_pos),
        i32::from(inputs.manual_neg),
        i32::from(inputs.velocity),
        i32::from(inputs.mark_velocity),
        i32::from(inputs.acceleration),
        i32::from(inputs.distance),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_input_of_the_table_is_set_and_shown_at_its_own_place() {
        for (place, info) in INPUTS.iter().enumerate() {
            let mut inputs = Inputs::default();
            set_input(&mut inputs, info.name, info.max).expect("inside the range");
            let values = input_values(&inputs);
            for (other, value) in values.iter().enumerate() {
                assert_eq!(
                    *value,
                    if other == place { info.max } else { 0 },
                    "{} at {other}",
                    info.name
                );
            }
            let told = set_input(&mut inputs, info.name, info.max + 1).expect_err("above the range");
            assert!(told.contains(info.original), "{told}");
        }
        assert!(set_input(&mut Inputs::default(), "Freigabe", 1).is_err());
    }
}

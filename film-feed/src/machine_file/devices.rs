//! What follows from motor, drive and gear: codes, current limit.

use std::fmt;
use std::str::FromStr;

use lenze9300_model::code::table::number::{
    C0006, C0022, C0081, C0084, C0085, C0086, C0087, C0088, C0089, C0090, C1202, C1203, C1204, C1240, C1250,
};
use lenze9300_model::code::{CodeStore, Inhibit, MOTOR_LIST, entry};
use serde::Serialize;

use super::{Feed, MachineFile, Mechanics};
use crate::catalogue::{DriveUnit, Motor};

/// A gear: motor revolutions to output revolutions, as `7` or `7:2`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Gear {
    /// Motor revolutions, 1…65 535.
    pub numerator: u16,
    /// Output revolutions, 1…65 535.
    pub denominator: u16,
}

impl FromStr for Gear {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (numerator, denominator) = text.split_once(':').unwrap_or((text, "1"));
        let whole = |text: &str| text.trim().parse().ok().filter(|number| *number > 0);
        match (whole(numerator), whole(denominator)) {
            (Some(numerator), Some(denominator)) => Ok(Self { numerator, denominator }),
            _ => Err(format!(
                "a gear is written as 7 or 7:2, both from 1 to 65535, got {text}"
            )),
        }
    }
}

impl fmt::Display for Gear {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.numerator, self.denominator)
    }
}

impl MachineFile {
    /// The gear.
    pub fn gear(&self) -> Gear {
        Gear {
            numerator: self.mechanics.gear_numerator,
            denominator: self.mechanics.gear_denominator,
        }
    }

    /// The same machine with other devices; what `[codes]` gave for C0022, the gear and the motor makes way for what follows from these.
    pub fn with_devices(&self, motor: &Motor, drive: &DriveUnit, gear: Gear) -> Self {
        let mechanics = Mechanics {
            gear_numerator: gear.numerator,
            gear_denominator: gear.denominator,
            ..self.mechanics
        };
        let current_limit_a = largest_current_a(motor, drive);
        let mut codes = self.codes.clone();
        set_devices(&mut codes, &mechanics, motor, current_limit_a);
        Self {
            mechanics,
            motor: motor.clone(),
            drive: drive.clone(),
            codes,
            current_limit_a,
            ..self.clone()
        }
    }

    /// Sets a code without subcodes, rounded to its step and limited to its range.
    pub fn set_code(&mut self, code: u16, value: f64) {
        set(&mut self.codes, code, value);
    }
}

/// Current that C0086 sets C0022 to, 1.5 times the motor's rated one (thesis 8.3), or what the drive can give, A rms.
pub(super) fn largest_current_a(motor: &Motor, drive: &DriveUnit) -> f64 {
    (1.5 * motor.rated_current_a).min(drive.peak_current_a)
}

/// The codes of the thesis, and what follows from machine and motor.
pub(super) fn derived_codes(mechanics: &Mechanics, feed: &Feed, motor: &Motor, current_limit_a: f64) -> CodeStore {
    let mut codes = CodeStore::thesis();
    set_devices(&mut codes, mechanics, motor, current_limit_a);
    set(&mut codes, C1240, feed.speed_mm_s);
    set(&mut codes, C1250, feed.acceleration_mm_s2);
    codes
}

fn set_devices(codes: &mut CodeStore, mechanics: &Mechanics, motor: &Motor, current_limit_a: f64) {
    // The list resets what belongs to the motor. A motor that the model's list does not have is set by hand.
    let listed = motor
        .motor_list
        .filter(|list| MOTOR_LIST.iter().any(|entry| entry.number == *list));
    match listed {
        Some(number) => set(codes, C0086, f64::from(number)),
        None => {
            for (code, value) in [
                (C0006, 3.0),
                (C0081, motor.rated_power_w / 1000.0),
                (C0084, motor.resistance_ohm),
                (C0085, motor.inductance_mh),
                (C0087, motor.rated_speed_rpm),
                (C0088, motor.rated_current_a),
                (C0089, motor.rated_frequency_hz),
                (C0090, motor.rated_voltage_v),
            ] {
                set(codes, code, value);
            }
        }
    }
    for (code, value) in [
        (C0022, current_limit_a),
        (C1202, f64::from(mechanics.gear_numerator)),
        (C1203, f64::from(mechanics.gear_denominator)),
        (C1204, mechanics.feed_constant_mm()),
    ] {
        set(codes, code, value);
    }
}

/// Writes a code, rounded to its step and limited to its range.
fn set(codes: &mut CodeStore, code: u16, value: f64) {
    let Some(domain) = entry(code).map(|entry| &entry.domain) else {
        return;
    };
    let raw = (value * 10_000.0)
        .round()
        .clamp(f64::from(domain.min()), f64::from(domain.max())) as i32;
    let accepted = codes.write(code, 0, raw, Inhibit::Active);
    debug_assert!(accepted.is_ok(), "C{code:04} := {raw}: {accepted:?}");
}

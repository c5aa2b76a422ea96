//! From units to increments.

use approx::assert_relative_eq;
use lenze9300_model::code::CodeStore;
use lenze9300_model::traverse::{Residue, Resolution};
use proptest::prelude::*;

fn film() -> Resolution {
    Resolution::from_codes(&CodeStore::thesis())
}

/// 9300 facts 11.
#[test]
fn the_check_values_of_the_film_hold() {
    let film = film();
    assert_eq!(film.whole_increments(1200_0000), 3_074_216);
    assert_eq!(film.whole_increments(50_0000), 128_092);
    assert_eq!(film.whole_increments(100_0000), 256_184);
    assert_eq!(film.whole_increments(1150_0000), 2_946_124);
    assert_relative_eq!(film.increments_per_unit(), 2_561.847_046, epsilon = 1e-6);
    assert_relative_eq!(film.velocity(100_0000, 1200_0000), 3074.216, epsilon = 1e-3);
    assert_relative_eq!(film.acceleration(100_0000, 2400_0000), 6.148_433, epsilon = 1e-6);
    // 1200 mm/s are 2814.5292 rpm at the motor.
    let rpm = film.velocity(100_0000, 1200_0000) * 60_000.0 / 65_536.0;
    assert_relative_eq!(rpm, 2814.5292, epsilon = 1e-4);
}

#[test]
fn truncation_goes_toward_zero() {
    assert_eq!(film().whole_increments(-1200_0000), -3_074_216);
    assert_eq!(film().whole_increments(3), 0);
    assert_eq!(film().whole_increments(-3), 0);
}

/// 1200.0000 mm leave 0.455 inc over (film-feed specification, section 5). Truncated feeds fall short by n times that,
/// carried feeds by less than one increment.
#[test]
fn a_thousand_feeds_add_the_fraction_up_or_carry_it() {
    let film = film();
    let exact = 1200.0 * 2_561.847_045_972_878;
    let mut residue = Residue::default();
    let (mut truncated, mut carried) = (0, 0);
    for _ in 0..1000 {
        truncated += film.whole_increments(1200_0000);
        carried += film.carried_increments(1200_0000, &mut residue);
    }
    let short = 1000.0 * exact - truncated as f64;
    assert_relative_eq!(short, 1000.0 * (exact - 3_074_216.0), epsilon = 1e-3);
    assert!((454.0..456.0).contains(&short), "{short}");
    let left = 1000.0 * exact - carried as f64;
    assert!((0.0..1.0).contains(&left), "{left}");
    assert_relative_eq!(residue.increments(), left, epsilon = 1e-3);
}

#[test]
fn a_changed_gear_drops_the_residue() {
    let mut residue = Residue::default();
    film().carried_increments(1200_0000, &mut residue);
    assert!(residue.increments() > 0.4);
    let other = Resolution::new(1_0000, 1_0000, 1_0000);
    assert_eq!(other.carried_increments(1_0000, &mut residue), 65_536);
    assert_eq!(residue.increments(), 0.0);
}

proptest! {
    #[test]
    fn whole_increments_are_the_integer_part_for_every_code(
        length in -i32::MAX.., n in 1_i32..=655_350_000, d in 1_i32..=655_350_000, f in 1_i32..=2_140_000_000,
    ) {
        let resolution = Resolution::new(n, d, f);
        let whole = resolution.whole_increments(length);
        let exact = f64::from(length) * 65_536.0 * f64::from(n) / f64::from(d) / f64::from(f);
        prop_assume!(exact.abs() < 1e15);
        prop_assert!((whole as f64 - exact).abs() <= 1.0 + exact.abs() * 1e-14);
        prop_assert!((whole as f64).abs() <= exact.abs() * (1.0 + 1e-14) + 1e-9);
        prop_assert_eq!(resolution.whole_increments(-length), -whole);
    }
}

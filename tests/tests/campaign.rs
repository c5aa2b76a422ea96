//! The fault campaign in its short form, and its committed table.

use std::sync::atomic::{AtomicUsize, Ordering};

use system_tests::campaign::soak::soak;
use system_tests::campaign::{Draw, FAMILIES, Family, trust, try_family};

#[test]
fn the_short_campaign_holds_in_every_family() {
    for family in FAMILIES {
        let tried = AtomicUsize::new(0);
        let outcome = try_family(family, 2, 7, || {
            tried.fetch_add(1, Ordering::Relaxed);
        });
        assert_eq!(outcome.failures, [], "{}", family.name);
        assert_eq!(tried.into_inner(), 2);
    }
}

#[test]
fn a_short_soak_loses_nothing() {
    let soak = soak(24, 2, 3, || {});
    assert!(soak.ok(), "{soak:?}");
    assert_eq!(soak.commanded, 24);
}

#[test]
fn a_case_is_determined_by_seed_and_number() {
    let drawn = |seed, number| {
        let mut draw = Draw::new(seed, number);
        [draw.between(0, u64::MAX - 1), draw.between(0, u64::MAX - 1)]
    };
    assert_eq!(drawn(1, 2), drawn(1, 2));
    assert_ne!(drawn(1, 2), drawn(1, 3));
    assert_ne!(drawn(1, 2), drawn(2, 2));
}

#[test]
fn a_rule_that_does_not_hold_is_told_with_its_case() {
    let liar = Family {
        case: |draw| {
            if draw.number == 3 {
                Err("broken".to_string())
            } else {
                Ok(())
            }
        },
        ..FAMILIES[0]
    };
    let outcome = try_family(&liar, 5, 1, || {});
    assert_eq!(outcome.failures, [(3, "broken".to_string())]);
    let table = trust::table(&[outcome], None, 1);
    assert!(
        table.contains("**not held in 1**") && table.contains("case 3: broken"),
        "{table}"
    );
}

#[test]
fn the_committed_table_has_a_row_for_every_family_and_the_soak_and_all_held() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../TRUST.md");
    let table = std::fs::read_to_string(file).expect("TRUST.md is committed");
    for family in FAMILIES {
        let row = table
            .lines()
            .find(|line| line.starts_with(&format!("| {} |", family.name)))
            .unwrap_or_else(|| panic!("no row for {}", family.name));
        assert!(
            row.contains(family.rule) && row.contains(family.fault),
            "out of date: {row}"
        );
    }
    assert!(table.lines().any(|line| line.starts_with("| soak |")));
}

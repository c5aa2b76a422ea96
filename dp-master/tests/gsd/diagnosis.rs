//! Diagnosis in words: what a slave sends, with the texts of its GSD file and the names of its modules.
//!
//! Octets by hand: bit 0 is the least significant bit of the octet after the header of a device-related block (guideline "Volume 1: GSD",
//! Unit_Diag_Bit); blocks as in IEC 61158-6-3, coding of Ext_Diag_Data.

#![cfg(feature = "std")]

use dp_master::dp::Diagnosis;
use dp_master::gsd::{DiagnosisText, Origin, Setup};

use crate::bench::{COMPACT, DPV1, DRIVE, MODULAR, clean, read};

/// A diagnosis with these blocks behind its six standard octets.
fn diagnosis(blocks: &[&[u8]]) -> Diagnosis {
    let standard = [0x08, 0x0C, 0x00, 0x02, 0xF1, 0x01];
    Diagnosis::parse(&[&standard[..], &blocks.concat()].concat()).unwrap()
}

fn words(texts: Vec<DiagnosisText>) -> Vec<String> {
    texts.into_iter().map(|text| text.text).collect()
}

fn of(setup: &Setup<'_>, blocks: &[&[u8]]) -> Vec<String> {
    words(setup.diagnosis_texts(&diagnosis(blocks)))
}

#[test]
fn bits_and_areas_of_a_device_have_the_texts_of_the_file() {
    let gsd = read(COMPACT);
    // Bits 0 and 7; area 8 to 11 is 2, area 12 to 15 is 5.
    let texts = gsd.diagnosis_texts(&diagnosis(&[&[0x03, 0x81, 0x52]]));
    let origins: Vec<Origin> = texts.iter().map(|text| text.origin).collect();
    let bits = |first_bit, last_bit| Origin::Device { first_bit, last_bit };
    assert_eq!(origins, [bits(0, 0), bits(7, 7), bits(8, 11), bits(12, 15)]);
    assert_eq!(
        words(texts),
        ["Überlast", "EEPROM defekt", "Tara aktiv", "Kalibrierung fällig"]
    );
}

#[test]
fn an_area_with_a_text_for_zero_says_it_and_one_without_says_nothing() {
    let gsd = read(COMPACT);
    assert_eq!(
        words(gsd.diagnosis_texts(&diagnosis(&[&[0x03, 0x00, 0x00]]))),
        ["Stillstand"]
    );
    // The block ends before the areas.
    assert_eq!(words(gsd.diagnosis_texts(&diagnosis(&[&[0x02, 0x02]]))), ["Unterlast"]);
}

#[test]
fn a_not_bit_speaks_when_it_is_zero() {
    let gsd = read(DRIVE);
    let setup = gsd.configure();
    assert_eq!(
        of(&setup, &[&[0x03, 0x04, 0x02]]),
        ["Overtemperature", "Fan stands still", "Motor phase missing"]
    );
    assert_eq!(of(&setup, &[&[0x03, 0x0C, 0x00]]), ["Overtemperature"]);
}

#[test]
fn what_the_file_has_no_text_for_is_told_by_number() {
    let gsd = read(DRIVE);
    assert_eq!(
        of(&gsd.configure(), &[&[0x03, 0x48, 0x09]]),
        ["bit 6 is set", "bits 8 to 15 are 9"]
    );
    // A file without any texts: the octets.
    let gsd = clean("");
    let texts = gsd.configure().diagnosis_texts(&diagnosis(&[&[0x03, 0x32, 0x10]]));
    assert_eq!(texts[0].to_string(), "of the device: 32 10");
    let all = Origin::Device {
        first_bit: 0,
        last_bit: 15,
    };
    assert_eq!(texts[0].origin, all);
    // Behind the head of an alarm only what belongs to it: process alarm of slot 3, specifier 0, then two octets.
    let gsd = clean("DPV1_Slave = 1\nC1_Read_Write_supp = 1\nC1_Read_Write_required = 1");
    assert_eq!(
        of(&gsd.configure(), &[&[0x06, 0x02, 0x03, 0x00, 0xAB, 0xCD]]),
        ["slot 3: process alarm", "of the device: AB CD"]
    );
}

#[test]
fn an_area_counts_no_more_than_32_bits() {
    let gsd = clean("Unit_Diag_Area = 8-47\nValue(1) = \"one\"\nUnit_Diag_Area_End");
    // Bits 8 and 40, which is 32 behind the first.
    assert_eq!(of(&gsd.configure(), &[&[0x07, 0, 0x01, 0, 0, 0, 0x01]]), ["one"]);
}

#[test]
fn only_a_slave_of_dp_v1_sends_alarms() {
    // What would be DPV1_Status_1 with DPV1_Enable is a parameter of its own here.
    let gsd = clean("Ext_User_Prm_Data_Const(0) = 0x80,0,0");
    assert_eq!(
        of(&gsd.configure(), &[&[0x06, 0x02, 0x03, 0x00, 0xAB, 0xCD]]),
        ["of the device: 02 03 00 AB CD"]
    );
}

#[test]
fn a_module_without_texts_speaks_with_those_of_the_station() {
    let gsd = clean("DPV1_Slave = 1\nC1_Read_Write_supp = 1\nC1_Read_Write_required = 1\nUnit_Diag_Bit(24) = \"hot\"");
    let mut setup = gsd.configure();
    setup.plug("first").unwrap();
    assert_eq!(
        of(&setup, &[&[0x05, 0x02, 0x01, 0x00, 0x01]]),
        ["slot 1 `first`: process alarm", "hot"]
    );
}

#[test]
fn help_comes_with_its_text() {
    let gsd = read(DRIVE);
    let texts = gsd.configure().diagnosis_texts(&diagnosis(&[&[0x02, 0x0C]]));
    assert_eq!(texts[0].help.as_deref(), Some("Clean the heat sink, reduce the load."));
}

#[test]
fn modules_are_named_by_the_place_of_their_identifiers() {
    let gsd = read(MODULAR);
    let mut setup = gsd.configure();
    // Two identifiers, one identifier of four octets, one identifier.
    for module in ["Two parts", "Scale", "AI 2"] {
        setup.plug(module).unwrap();
    }
    // Places 0, 1, 2, 3 and 6.
    assert_eq!(
        of(&setup, &[&[0x42, 0x4F]]),
        [
            "slot 1 `Two parts` has a diagnosis",
            "slot 1 `Two parts` has a diagnosis",
            "slot 2 `Scale` has a diagnosis",
            "slot 3 `AI 2` has a diagnosis",
            "module 6 on the bus has a diagnosis",
        ]
    );
    assert_eq!(
        words(gsd.diagnosis_texts(&diagnosis(&[&[0x42, 0x02]]))),
        ["module 1 on the bus has a diagnosis"]
    );
}

#[test]
fn channels_have_the_text_of_the_standard_of_the_module_or_of_the_station() {
    let gsd = read(MODULAR);
    let mut setup = gsd.configure();
    setup.plug("AI 2").unwrap();
    setup.plug("DO 16").unwrap();
    // Header 80 + place; direction and channel; unit (word A0, bit 20) and error.
    let channel = |place: u8, channel: u8, error: u8| of(&setup, &[&[0x80 | place, channel, error]]);
    assert_eq!(
        channel(0, 0x41, 0xA6),
        ["slot 1 `AI 2`: input channel 1 (word): line break"]
    );
    assert_eq!(
        channel(0, 0x40, 0xB0),
        ["slot 1 `AI 2`: input channel 0 (word): Sensor broken"]
    );
    assert_eq!(
        channel(1, 0x8F, 0x30),
        ["slot 2 `DO 16`: output channel 15 (bit): Sensor supply missing"]
    );
    assert_eq!(
        channel(0, 0x40, 0xB5),
        ["slot 1 `AI 2`: input channel 0 (word): Reference channel"]
    );
    assert_eq!(
        channel(0, 0x40, 0xBE),
        ["slot 1 `AI 2`: input channel 0 (word): error 30"]
    );
    let texts = setup.diagnosis_texts(&diagnosis(&[&[0x81, 0x8F, 0x30]]));
    assert_eq!(texts[0].help.as_deref(), Some("Check the fuse of the terminal."));
    assert_eq!(texts[0].origin, Origin::Channel { place: 1, channel: 15 });
}

#[test]
fn alarms_and_status_messages_of_dp_v1_name_their_slot_and_use_the_texts_of_their_kind() {
    let gsd = read(DPV1);
    let setup = gsd.configure();
    // Diagnosis alarm of slot 2, appearing; bits 24 and 25; area 32 to 39 is 2.
    assert_eq!(
        of(&setup, &[&[0x06, 0x01, 0x02, 0x01, 0x03, 0x02]]),
        [
            "slot 2 `AI 4`: diagnosis alarm",
            "Wire break",
            "Short circuit",
            "Channel 1"
        ]
    );
    // Status message of slot 0: the texts of the station.
    assert_eq!(
        of(&setup, &[&[0x05, 0x81, 0x00, 0x00, 0x01]]),
        ["slot 0: status message", "Maintenance needed"]
    );
    // The other kinds (EN 50170-2 amendment DP-V1, Alarm_Type and Status_Type), of slot 4 without data.
    for (kind, told) in [
        (0x02, "process alarm"),
        (0x03, "pull alarm"),
        (0x05, "status alarm"),
        (0x06, "update alarm"),
        (0x20, "alarm 32"),
        (0x81, "status message"),
        (0x82, "module status"),
        (0xA0, "status 32"),
    ] {
        assert_eq!(
            of(&setup, &[&[0x04, kind, 0x04, 0x00]]),
            [format!("slot 4 `DQ 8`: {told}")]
        );
    }
    // Plug alarm of slot 4 without data.
    assert_eq!(of(&setup, &[&[0x04, 0x04, 0x04, 0x08]]), ["slot 4 `DQ 8`: plug alarm"]);
}

#[test]
fn revision_and_octets_that_are_no_block_are_told_too() {
    let gsd = read(MODULAR);
    let setup = gsd.configure();
    assert_eq!(of(&setup, &[&[0xC7]]), ["revision 7"]);
    assert_eq!(
        of(&setup, &[&[0xC1], &[0x44, 0x01]]),
        ["revision 1", "diagnosis block 0x44: expected 4 octets, got 2"]
    );
    assert_eq!(of(&setup, &[]), [""; 0]);
}

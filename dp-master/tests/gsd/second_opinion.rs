//! A second opinion: `gsd-parser` 0.6 reads the same files, and says the same where it says anything.
//!
//! It does not know comments behind a continuation and the end-of-file character of DOS, so these are taken out for it; the module's own file of
//! the drive is compared in the crate of the drive. Where the two differ on purpose has a test of its own at the end.

#![cfg(feature = "std")]

use std::path::Path;

use dp_master::gsd::{self, Gsd, Module, Parameter, PrmLayout, PrmType, Rate, UnitDiag};
use gsd_parser::{
    GenericStationDescription, PrmBuilder, PrmValueConstraint, SupportedSpeeds, UserPrmData, UserPrmDataDefinition,
    UserPrmDataType,
};

use crate::bench::{COMPACT, DPV1, DRIVE, FILES, MODULAR, SLAVE, read};

/// The file as the other reader takes it.
fn other(file: &[u8]) -> GenericStationDescription {
    let text: String = file
        .iter()
        .filter(|&&octet| octet != 0x1A)
        .map(|&octet| char::from(octet))
        .collect();
    let lines = text.lines().map(|line| match line.split_once(";") {
        Some((before, _)) if before.trim_end().ends_with('\\') => format!("{}\n", before.trim_end()),
        _ => format!("{line}\n"),
    });
    gsd_parser::parser::parse(Path::new("x.gsd"), &lines.collect::<String>()).unwrap()
}

fn text(text: &Option<String>) -> &str {
    text.as_deref().unwrap_or("")
}

fn same_layout(own: &PrmLayout, gsd: &Gsd, other: &UserPrmData, what: &str) {
    let constants: Vec<_> = own
        .constants
        .iter()
        .map(|constant| (usize::from(constant.offset), constant.octets.clone()))
        .collect();
    assert_eq!(constants, other.data_const, "{what}");
    assert_eq!(own.places.len(), other.data_ref.len(), "{what}");
    for (place, (offset, definition)) in own.places.iter().zip(&other.data_ref) {
        assert_eq!(usize::from(place.offset), *offset, "{what}");
        same_parameter(gsd, &gsd.parameters[&place.reference], definition);
    }
}

fn same_parameter(gsd: &Gsd, own: &Parameter, other: &UserPrmDataDefinition) {
    assert_eq!(own.name, other.name.trim_end());
    let data_type = match other.data_type {
        UserPrmDataType::Unsigned8 => PrmType::Unsigned8,
        UserPrmDataType::Unsigned16 => PrmType::Unsigned16,
        UserPrmDataType::Unsigned32 => PrmType::Unsigned32,
        UserPrmDataType::Signed8 => PrmType::Signed8,
        UserPrmDataType::Signed16 => PrmType::Signed16,
        UserPrmDataType::Signed32 => PrmType::Signed32,
        UserPrmDataType::Bit(bit) => PrmType::Bit(bit),
        UserPrmDataType::BitArea(first, last) => PrmType::BitArea { first, last },
    };
    assert_eq!(own.data_type, data_type, "{}", own.name);
    assert_eq!(own.default, other.default_value, "{}", own.name);
    assert_eq!(own.changeable, other.changeable, "{}", own.name);
    assert_eq!(own.visible, other.visible, "{}", own.name);
    match &other.constraint {
        PrmValueConstraint::MinMax(min, max) => assert_eq!(own.values.0, [(*min, *max)], "{}", own.name),
        PrmValueConstraint::Enum(values) => {
            let values: Vec<_> = values.iter().map(|&value| (value, value)).collect();
            assert_eq!(own.values.0, values, "{}", own.name);
        }
        PrmValueConstraint::Unconstrained => assert!(own.values.is_any(), "{}", own.name),
    }
    let texts = own.text.map(|text| &gsd.prm_texts[&text].texts);
    assert_eq!(texts.is_some(), other.text_ref.is_some(), "{}", own.name);
    for (value, words) in texts.into_iter().flatten() {
        assert_eq!(other.text_ref.as_ref().unwrap().get(words), Some(value), "{}", own.name);
    }
}

fn same_unit_diag(own: &UnitDiag, other: &gsd_parser::UnitDiag) {
    let bits = |bits: &std::collections::BTreeMap<u16, gsd::DiagText>| -> Vec<_> {
        bits.iter()
            .map(|(&bit, text)| (u32::from(bit), text.text.clone(), text.help.clone()))
            .collect()
    };
    let other_bits = |bits: &std::collections::BTreeMap<u32, gsd_parser::UnitDiagBitInfo>| -> Vec<_> {
        bits.iter()
            .map(|(&bit, info)| (bit, info.text.clone(), info.help.clone()))
            .collect()
    };
    assert_eq!(bits(&own.bits), other_bits(&other.bits));
    assert_eq!(bits(&own.not_bits), other_bits(&other.not_bits));
    assert_eq!(own.areas.len(), other.areas.len());
    for (own, other) in own.areas.iter().zip(&other.areas) {
        assert_eq!((own.first, own.last), (other.first, other.last));
        let own: Vec<_> = own
            .values
            .iter()
            .map(|(&value, text)| (value, text.text.clone()))
            .collect();
        let other: Vec<_> = other
            .values
            .iter()
            .map(|(&value, text)| (u32::from(value), text.clone()))
            .collect();
        assert_eq!(own, other);
    }
}

fn same_module(own: &Module, gsd: &Gsd, other: &gsd_parser::Module) {
    assert_eq!(own.name, other.name);
    assert_eq!(own.config, other.config, "{}", own.name);
    assert_eq!(own.reference.map(u32::from), other.reference, "{}", own.name);
    assert_eq!(own.info_text, other.info_text, "{}", own.name);
    assert_eq!(own.prm.len.unwrap_or(0), other.module_prm_data.length, "{}", own.name);
    same_layout(&own.prm, gsd, &other.module_prm_data, &own.name);
}

fn same(own: &Gsd, other: &GenericStationDescription) {
    let general = &own.general;
    assert_eq!(general.gsd_revision, Some(other.gsd_revision));
    assert_eq!(text(&general.vendor_name), other.vendor);
    assert_eq!(text(&general.model_name), other.model);
    assert_eq!(text(&general.revision), other.revision);
    assert_eq!(general.revision_number.unwrap_or(0), other.revision_number);
    assert_eq!(general.ident_number, Some(other.ident_number));
    assert_eq!(text(&general.hardware_release), other.hardware_release);
    assert_eq!(text(&general.software_release), other.software_release);
    assert_eq!(text(&general.implementation_type), other.implementation_type);
    let slave = &own.slave;
    assert_eq!(slave.freeze_mode_supp, other.freeze_mode_supported);
    assert_eq!(slave.sync_mode_supp, other.sync_mode_supported);
    assert_eq!(slave.auto_baud_supp, other.auto_baud_supported);
    assert_eq!(slave.set_slave_add_supp, other.set_slave_addr_supported);
    assert_eq!(slave.fail_safe, other.fail_safe);
    assert_eq!(slave.max_diag_data_len, Some(other.max_diag_data_length));
    assert_eq!(slave.modular_station, other.modular_station);
    if slave.modular_station {
        assert_eq!(slave.max_module, Some(other.max_modules));
        assert_eq!(slave.max_input_len, Some(other.max_input_length));
        assert_eq!(slave.max_output_len, Some(other.max_output_length));
        assert_eq!(slave.max_data_len.unwrap_or(0), other.max_data_length);
    }
    let speeds = [
        (Rate::B9600, SupportedSpeeds::B9600, other.max_tsdr.b9600),
        (Rate::B19200, SupportedSpeeds::B19200, other.max_tsdr.b19200),
        (Rate::B31250, SupportedSpeeds::B31250, other.max_tsdr.b31250),
        (Rate::B45450, SupportedSpeeds::B45450, other.max_tsdr.b45450),
        (Rate::B93750, SupportedSpeeds::B93750, other.max_tsdr.b93750),
        (Rate::B187500, SupportedSpeeds::B187500, other.max_tsdr.b187500),
        (Rate::B500000, SupportedSpeeds::B500000, other.max_tsdr.b500000),
        (Rate::B1500000, SupportedSpeeds::B1500000, other.max_tsdr.b1500000),
        (Rate::B3000000, SupportedSpeeds::B3000000, other.max_tsdr.b3000000),
        (Rate::B6000000, SupportedSpeeds::B6000000, other.max_tsdr.b6000000),
        (Rate::B12000000, SupportedSpeeds::B12000000, other.max_tsdr.b12000000),
    ];
    for (rate, speed, max_tsdr) in speeds {
        let features = own.rates.get(&rate).copied().unwrap_or_default();
        assert_eq!(features.supported, other.supported_speeds.contains(speed), "{rate}");
        if let Some(own) = features.max_tsdr {
            assert_eq!(own, max_tsdr, "{rate}");
        }
    }
    if other.user_prm_data.data_const.is_empty() || !own.prm.is_empty() {
        same_layout(&own.prm, own, &other.user_prm_data, "station");
    }
    assert_eq!(own.modules.len(), other.available_modules.len());
    for (module, other) in own.modules.iter().zip(&other.available_modules) {
        same_module(module, own, other);
    }
    assert_eq!(own.slots.len(), other.slots.len());
    for (slot, other) in own.slots.iter().zip(&other.slots) {
        assert_eq!((slot.number, &slot.name), (other.number, &other.name));
        assert_eq!(Some(u32::from(slot.default)), other.default.reference);
        let allowed: Vec<_> = own
            .modules
            .iter()
            .filter(|module| module.reference.is_some_and(|own| slot.allowed.contains(own.into())))
            .map(|module| &module.name)
            .collect();
        let other: Vec<_> = other.allowed_modules.iter().map(|module| &module.name).collect();
        assert_eq!(allowed, other, "slot {}", slot.number);
    }
    same_unit_diag(&own.unit_diag, &other.unit_diag);
}

#[test]
fn both_read_the_same_from_files_of_all_kinds() {
    for (name, file) in FILES {
        println!("{name}");
        same(&read(file), &other(file));
    }
    let slave =
        format!("{SLAVE}Unit_Diag_Bit(7) = \"a\"\nUnit_Diag_Not_Bit(8) = \"b\"\nUnit_Diag_Bit_Help(7) = \"c\"\n");
    same(&read(slave.as_bytes()), &other(slave.as_bytes()));
}

#[test]
fn both_make_the_same_octets_where_no_bit_area_stands_beside_others() {
    let (own, peer) = (read(COMPACT), other(COMPACT));
    assert_eq!(
        own.configure().user_prm().unwrap(),
        PrmBuilder::new(&peer.user_prm_data).into_bytes()
    );

    let (own, peer) = (read(MODULAR), other(MODULAR));
    let mut setup = own.configure();
    setup.plug("Counter").unwrap();
    setup.set_in(1, "Preset value", 0xFEDC_BA98).unwrap();
    setup.set_in(1, "Offset", -100).unwrap();
    let counter = peer
        .available_modules
        .iter()
        .find(|module| module.name == "Counter")
        .unwrap();
    let mut builder = PrmBuilder::new(&counter.module_prm_data);
    builder.set_prm("Preset value", 0xFEDC_BA98).set_prm("Offset", -100);
    assert_eq!(setup.user_prm().unwrap()[3..], *builder.as_bytes());
}

#[test]
fn here_a_bit_area_keeps_its_neighbours_there_it_wipes_them() {
    // Constant A0 in octet 2; the delay in bits 5 and 4 has the default 1 (guideline: only the bits of the area are its own).
    let own = read(MODULAR).configure().user_prm().unwrap();
    let peer = PrmBuilder::new(&other(MODULAR).user_prm_data).into_bytes();
    assert_eq!(own, [0x00, 0x08, 0x90]);
    assert_eq!(peer, [0x00, 0x08, 0x10]);
}

#[test]
fn here_signed_values_reach_their_ends_there_they_panic() {
    let own = read(DRIVE);
    assert!(own.configure().user_prm().is_ok());
    let peer = other(DRIVE);
    assert!(std::panic::catch_unwind(|| PrmBuilder::new(&peer.user_prm_data)).is_err());
    // The DP-V1 file has no such value.
    assert!(!PrmBuilder::new(&other(DPV1).user_prm_data).as_bytes().is_empty());
}

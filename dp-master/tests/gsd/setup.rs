//! Modules and parameters chosen, octets of Chk_Cfg and Set_Prm that follow.
//!
//! The octets are worked out by hand from the files under `tests/gsd`: constants first, parameters over them, big-endian, then the modules in
//! the order of the slots (guideline "Volume 1: GSD"); DPV1_Status_1…3 as in IEC 61158-6-3, coding of Set_Prm.

#![cfg(feature = "std")]

use dp_master::address::Address;
use dp_master::dp::v1::{AlarmMode, AlarmTypes, V1Status};
use dp_master::dp::{
    AcceptedConfigurations, ClearOutputs, Demand, DpMaster, DpSlave, IoLengths, MasterConfig, Mode, SlaveIdentity,
    SlaveState,
};
use dp_master::fdl::BusParams;
use dp_master::gsd::{ModuleKey, Part, PrmValue, SetupError};
use dp_master::phy::{PortId, VirtualBus, pump};
use dp_master::station::Station;
use dp_master::time::{Baud, Duration, Instant};

use crate::bench::{COMPACT, DPV1, DRIVE, MODULAR, clean, read, with};

fn at(address: u8) -> Address {
    Address::new(address).unwrap()
}

fn message<T: core::fmt::Debug>(result: Result<T, SetupError>) -> String {
    result.unwrap_err().to_string()
}

// Compact slave

#[test]
fn a_compact_slave_is_set_up_with_nothing_chosen() {
    let gsd = read(COMPACT);
    let setup = gsd.configure();
    assert_eq!(setup.identifiers().unwrap(), [0x13, 0x21]);
    assert_eq!(setup.user_prm().unwrap(), [0x00, 0x10, 0x00, 0x00, 0x2F]);
    let slave = setup.slave_config(at(9)).unwrap();
    assert_eq!((slave.address, slave.ident), (at(9), 0xF101));
    assert_eq!(slave.configuration.lengths(), IoLengths { inputs: 4, outputs: 2 });
    assert_eq!(&slave.user_prm[..], [0x00, 0x10, 0x00, 0x00, 0x2F]);
    assert_eq!(slave.min_tsdr, 11);
    // Min_Slave_Intervall 6 is 600 µs.
    assert_eq!(slave.min_slave_interval, Duration::from_micros(600));
    assert_eq!(slave.clear_outputs, ClearOutputs::Zeros);
    assert_eq!(
        (slave.watchdog, slave.sync, slave.freeze),
        (None, Demand::No, Demand::No)
    );
}

#[test]
fn parameters_without_names_count_when_the_station_has_no_others() {
    let old = "User_Prm_Data_Len = 2\nUser_Prm_Data = 7,8\n";
    let user_prm = |statements: &str| {
        let gsd = with(statements).gsd;
        let mut setup = gsd.configure();
        setup.plug("first").unwrap();
        setup.user_prm().unwrap()
    };
    assert_eq!(user_prm(old), [7, 8]);
    // The newer keywords exclude the older ones.
    assert_eq!(user_prm(&format!("{old}Ext_User_Prm_Data_Const(0) = 1")), [1]);
    assert_eq!(user_prm(""), [0; 0]);
}

#[test]
fn a_compact_slave_takes_no_second_module_and_has_no_named_parameters() {
    let gsd = read(COMPACT);
    let mut setup = gsd.configure();
    assert_eq!(
        message(setup.plug("4 Byte in, 2 Byte out")),
        "there is no free slot for module `4 Byte in, 2 Byte out`; modules plugged: 1"
    );
    assert_eq!(
        message(setup.set("Unit", 1)),
        "station: there is no parameter `Unit`; parameters are none"
    );
}

#[test]
fn what_a_slave_cannot_do_is_not_asked_of_it() {
    let gsd = read(COMPACT);
    let mut setup = gsd.configure();
    assert_eq!(
        message(setup.freeze()),
        "the slave does not support it: `Freeze_Mode_supp` is not set in the GSD file"
    );
    setup.sync().unwrap();
    assert_eq!(setup.slave_config(at(9)).unwrap().sync, Demand::Yes);
    assert!(setup.clear_outputs(ClearOutputs::Empty).is_err());
    assert!(setup.use_v1(V1Status::ENABLED).is_err());
}

// Modular slave

#[test]
fn modules_follow_each_other_in_chk_cfg_and_set_prm_in_the_order_of_the_slots() {
    let gsd = read(MODULAR);
    let mut setup = gsd.configure();
    assert_eq!(setup.plug("AI 2"), Ok(1));
    assert_eq!(setup.plug(20), Ok(2));
    assert_eq!(setup.plug("Two parts"), Ok(3));
    assert_eq!(setup.identifiers().unwrap(), [0x51, 0xC0, 0x82, 0x05, 0x11, 0x20]);
    let lengths = setup.configuration().unwrap().lengths();
    // 2 words; 6 in and 3 out; 2 in and 1 out.
    assert_eq!((lengths.inputs, lengths.outputs), (4 + 6 + 2, 3 + 1));
    let expected = [
        &[0x00, 0x08, 0x90][..],
        // 27648 = 6C00h, −27648 = 9400h
        &[0x06, 0x00, 0x6C, 0x00, 0x94, 0x00],
        &[0x00, 0x00, 0x00, 0x00, 0x05, 0xFD],
    ];
    assert_eq!(setup.user_prm().unwrap(), expected.concat());
}

#[test]
fn bits_and_bit_areas_of_a_module_do_not_wipe_their_neighbours() {
    let gsd = read(MODULAR);
    let mut setup = gsd.configure();
    let ai = setup.plug("AI 2").unwrap();
    setup.set_in(ai, "Range channel 0", "not used").unwrap();
    setup.set_in(ai, "Range channel 1", "4-20 mA").unwrap();
    setup.set_in(ai, "Upper limit", -1).unwrap();
    assert_eq!(setup.user_prm().unwrap()[3..], [0x06, 0x27, 0xFF, 0xFF, 0x94, 0x00]);
    setup.set_in(ai, "Range channel 0", 1).unwrap();
    assert_eq!(setup.user_prm().unwrap()[4], 0x21);

    // The constant A0 keeps its other bits, whatever the delay in bits 5 and 4 is.
    for (delay, octet) in [("0.1 ms", 0x80), ("3 ms", 0x90), ("15 ms", 0xA0)] {
        setup.set("Input delay", delay).unwrap();
        assert_eq!(setup.user_prm().unwrap()[2], octet);
    }
    setup.set("Start with fewer modules", "on").unwrap();
    assert_eq!(setup.user_prm().unwrap()[1], 0x09);
    setup.set("Diagnosis of the station", "off").unwrap();
    assert_eq!(setup.user_prm().unwrap()[1], 0x01);
}

#[test]
fn two_modules_of_a_kind_have_values_of_their_own() {
    let gsd = read(MODULAR);
    let mut setup = gsd.configure();
    setup.plug("Counter").unwrap();
    setup.plug("Counter").unwrap();
    setup.set_in(2, "Preset value", 0x0102_0304).unwrap();
    setup.set_in(1, "Offset", -128).unwrap();
    let expected = [
        &[0x00, 0x08, 0x90][..],
        &[0x00, 0x00, 0x00, 0x00, 0x05, 0x80],
        &[0x01, 0x02, 0x03, 0x04, 0x05, 0xFD],
    ];
    assert_eq!(setup.user_prm().unwrap(), expected.concat());
}

#[test]
fn the_limits_of_the_station_are_kept() {
    let gsd = read(MODULAR);
    let mut setup = gsd.configure();
    assert_eq!(setup.identifiers(), Err(SetupError::NoModules));
    setup.plug("Serial 16").unwrap();
    assert!(setup.identifiers().is_ok());
    setup.plug("Serial 16").unwrap();
    assert_eq!(
        message(setup.identifiers()),
        "64 octets of inputs; `Max_Input_Len` allows 48"
    );

    // 32 + 4 · 4 inputs and 32 + 2 · 4 outputs are allowed alone, but not together.
    let mut setup = gsd.configure();
    setup.plug("Serial 16").unwrap();
    for module in ["AI 2", "AI 2", "AI 2", "AI 2", "AO 2", "AO 2"] {
        setup.plug(module).unwrap();
    }
    assert_eq!(
        message(setup.identifiers()),
        "88 octets of data; `Max_Data_Len` allows 80"
    );

    let mut setup = gsd.configure();
    for _ in 0..10 {
        setup.plug("AI 2").unwrap();
    }
    assert!(setup.identifiers().is_ok());
    assert_eq!(
        message(setup.user_prm()),
        "63 octets of user parameters; `Max_User_Prm_Data_Len` allows 60"
    );

    let mut setup = gsd.configure();
    for slot in 1..=12 {
        assert_eq!(setup.plug("DI 8"), Ok(slot));
    }
    assert_eq!(
        message(setup.plug("DI 8")),
        "there is no free slot for module `DI 8`; modules plugged: 12"
    );
    assert_eq!(
        message(setup.plug_at(13, "DI 8")),
        "there is no slot 13; slots are 1 to 12"
    );
}

#[test]
fn a_gap_between_modules_is_told_and_can_be_filled_with_an_empty_slot() {
    let gsd = read(MODULAR);
    let mut setup = gsd.configure();
    setup.plug_at(1, "DI 8").unwrap();
    setup.plug_at(3, "DO 8").unwrap();
    assert_eq!(message(setup.identifiers()), "slot 2: no module is plugged");
    setup.plug_at(2, "Empty slot").unwrap();
    assert_eq!(setup.identifiers().unwrap(), [0x10, 0x00, 0x20]);
    setup.unplug(3).unwrap();
    assert_eq!(setup.identifiers().unwrap(), [0x10, 0x00]);
    assert_eq!(message(setup.set_in(3, "Offset", 0)), "slot 3: no module is plugged");
}

#[test]
fn a_name_that_is_not_there_is_answered_with_those_that_are() {
    let gsd = read(MODULAR);
    let mut setup = gsd.configure();
    assert_eq!(
        message(setup.plug("DI 7")),
        "there is no module `DI 7`; modules are `DI 8`, `DI 16`, `DI 32`, `DO 8`, `DO 16`, `AI 2`, `AO 2`, `Counter`, \
         `Scale`, `Serial 16`, `Two parts`, `Empty slot`"
    );
    assert!(message(setup.plug(ModuleKey::Reference(99))).starts_with("there is no module with reference 99;"));
    setup.plug("AI 2").unwrap();
    assert_eq!(
        message(setup.set_in(1, "Range", 0)),
        "slot 1: there is no parameter `Range`; parameters are `Range channel 0`, `Range channel 1`, `Upper limit`, \
         `Lower limit`"
    );
    assert_eq!(
        message(setup.set_in(1, "Range channel 0", "0-10 V")),
        "slot 1: parameter `Range channel 0` has no text `0-10 V`; texts are `+/-10 V`, `0-20 mA`, `4-20 mA`, `not used`"
    );
}

#[test]
fn the_settings_show_names_values_and_texts() {
    let gsd = read(MODULAR);
    let mut setup = gsd.configure();
    setup.plug("AI 2").unwrap();
    setup.set("Input delay", 2).unwrap();
    let station: Vec<_> = setup
        .settings(Part::Station)
        .unwrap()
        .into_iter()
        .map(|setting| {
            (
                setting.parameter.name.as_str(),
                setting.offset,
                setting.value,
                setting.text,
            )
        })
        .collect();
    assert_eq!(
        station,
        [
            ("Start with fewer modules", 1, 0, Some("off")),
            ("Diagnosis of the station", 1, 1, Some("on")),
            ("Input delay", 2, 2, Some("15 ms")),
        ]
    );
    let module = setup.settings(Part::Slot(1)).unwrap();
    assert_eq!((module[2].value, module[2].text, module[2].offset), (27_648, None, 2));
    assert!(setup.settings(Part::Slot(2)).is_err());
}

// Drive

#[test]
fn a_drive_has_its_defaults_and_its_constants_beside_them() {
    let gsd = read(DRIVE);
    let mut setup = gsd.configure();
    setup.plug("PPO type 2").unwrap();
    // Constant 40 and stop mode 1 in octet 1; 50 = 0032h; 3000 = 0BB8h; 4096 = 1000h; firmware 7.
    let expected = [
        &[0x10, 0x41, 0x00, 0x32, 0x00, 0x32, 0x01, 0x0B, 0xB8][..],
        &[0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x10, 0x00, 0x07],
    ];
    assert_eq!(setup.user_prm().unwrap(), expected.concat());
    assert_eq!(setup.identifiers().unwrap(), [0xF3, 0xF5]);
}

#[test]
fn every_type_of_parameter_reaches_its_ends() {
    let gsd = read(DRIVE);
    let mut setup = gsd.configure();
    setup.plug("PPO type 1").unwrap();
    setup.set("Stop mode", "Quick stop").unwrap();
    setup.set("Brake", "Enabled").unwrap();
    setup.set("Acceleration (0.1 s)", 36_000).unwrap();
    setup.set("Direction", "Left").unwrap();
    setup.set("Speed limit (rpm)", -6_000).unwrap();
    setup.set("Position offset (inc)", i64::from(i32::MIN)).unwrap();
    setup.set(108, i64::from(u32::MAX)).unwrap();
    // 36000 = 8CA0h, −6000 = E890h
    let expected = [
        &[0x10, 0x46, 0x8C, 0xA0, 0x00, 0x32, 0xFF, 0xE8, 0x90][..],
        &[0x80, 0x00, 0x00, 0x00, 0xFF, 0xFF, 0xFF, 0xFF, 0x07],
    ];
    assert_eq!(setup.user_prm().unwrap(), expected.concat());
}

#[test]
fn values_outside_of_the_file_s_range_or_set_are_refused() {
    let gsd = read(DRIVE);
    let mut setup = gsd.configure();
    setup.plug("PPO type 1").unwrap();
    let before = setup.user_prm().unwrap();
    let refusals: [(&str, PrmValue<'_>, &str); 6] = [
        ("Direction", 0.into(), "0 is not allowed; allowed are -1, 1"),
        (
            "Speed limit (rpm)",
            6_001.into(),
            "6001 is not allowed; allowed are -6000 to 6000",
        ),
        ("Stop mode", 3.into(), "3 is not allowed; allowed are 0 to 2"),
        (
            "Encoder increments",
            0.into(),
            "0 is not allowed; allowed are 1 to 4294967295",
        ),
        (
            "Acceleration (0.1 s)",
            (-1).into(),
            "-1 is not allowed; allowed are 0 to 36000",
        ),
        (
            "Position offset (inc)",
            i64::MAX.into(),
            "9223372036854775807 is not allowed; allowed are -2147483648 to 2147483647",
        ),
    ];
    for (name, value, why) in refusals {
        assert_eq!(
            message(setup.set(name, value)),
            format!("station: parameter `{name}`: {why}")
        );
    }
    assert_eq!(
        message(setup.set("Firmware", 8)),
        "station: parameter `Firmware` cannot be changed"
    );
    setup.set("Firmware", 7).unwrap();
    assert_eq!(setup.user_prm().unwrap(), before);
}

#[test]
fn parameters_with_the_same_name_are_told_apart_by_reference_or_place() {
    // As in motor starters of a large maker, which have four parameters `Type`.
    let gsd = clean(
        "ExtUserPrmData = 1 \"Type      \"\nBit(0) 0 0-1\nEndExtUserPrmData\nExtUserPrmData = 2 \"Type      \"\nBit(1) 0 0-1\n\
         EndExtUserPrmData\nExt_User_Prm_Data_Ref(0) = 1\nExt_User_Prm_Data_Ref(0) = 2\nExt_User_Prm_Data_Ref(1) = 2\n",
    );
    let mut setup = gsd.configure();
    setup.plug("first").unwrap();
    assert_eq!(
        message(setup.set("Type", 1)),
        "station: there are several parameters `Type`, name one by reference or place: 1 at octet 0, 2 at octet 0, 2 at octet 1"
    );
    setup.set(1, 1).unwrap();
    assert!(matches!(setup.set(2, 1), Err(SetupError::Ambiguous { .. })));
    setup.set((1, 2), 1).unwrap();
    assert_eq!(setup.user_prm().unwrap(), [0x01, 0x02]);
}

// DP-V1

#[test]
fn a_dp_v1_slave_starts_with_what_the_file_puts_into_its_slots_and_requires() {
    let gsd = read(DPV1);
    let setup = gsd.configure();
    let modules: Vec<_> = setup
        .modules()
        .map(|(slot, module)| (slot, module.name.as_str()))
        .collect();
    assert_eq!(modules, [(1, "Power"), (2, "AI 4"), (3, "DQ 8"), (4, "DQ 8")]);
    let expected = [
        &[0x00][..],
        &[0x43, 0xC3, 0x03, 0x03, 0x03],
        &[0x80, 0x00],
        &[0x80, 0x00],
    ];
    assert_eq!(setup.identifiers().unwrap(), expected.concat());
    let expected = [
        // DPV1_Enable (C1_Read_Write_required) and Fail_Safe; process alarm (module) and diagnostic alarm (station);
        // Prm_Structure, a constant of the file.
        &[0xC0, 0x60, 0x08][..],
        &[0x05, 0x81, 0x00, 0x00, 0x01],
        // Slot number 2, filter 20 ms.
        &[0x07, 0x82, 0x02, 0x00, 0x00, 0x00, 0x14],
    ];
    assert_eq!(setup.user_prm().unwrap(), expected.concat());
    assert_eq!(setup.slave_config(at(5)).unwrap().clear_outputs, ClearOutputs::Empty);
}

#[test]
fn the_slot_number_is_written_where_the_file_asks_for_it() {
    let gsd = read(DPV1);
    let mut setup = gsd.configure();
    setup.plug_at(4, "AI 4").unwrap();
    setup.set_in(4, "Process alarm", "yes").unwrap();
    setup.set_in(4, "Filter time (ms)", 500).unwrap();
    let user = setup.user_prm().unwrap();
    assert_eq!(user[8..15], [0x07, 0x82, 0x02, 0x00, 0x00, 0x00, 0x14]);
    // 500 = 01F4h
    assert_eq!(user[15..], [0x07, 0x82, 0x04, 0x00, 0x02, 0x01, 0xF4]);
    assert_eq!(
        message(setup.set_in(4, "Filter time (ms)", 60)),
        "slot 4: parameter `Filter time (ms)`: 60 is not allowed; allowed are 0, 5, 10, 20, 50, 100, 500, 1000"
    );
}

#[test]
fn the_rules_of_the_slots_are_kept() {
    let gsd = read(DPV1);
    let mut setup = gsd.configure();
    assert_eq!(
        message(setup.plug_at(1, "AI 4")),
        "slot 1: module `AI 4` may not be here; allowed are `Power`, `Supply with diagnosis`"
    );
    assert_eq!(
        message(setup.plug_at(5, "AI 4")),
        "there is no slot 5; slots are 1, 2, 3, 4"
    );
    setup.plug_at(1, "Supply with diagnosis").unwrap();
    assert_eq!(setup.identifiers().unwrap()[..2], [0x10, 0x43]);
    setup.unplug(2).unwrap();
    assert_eq!(message(setup.identifiers()), "slot 2: no module is plugged");
    assert_eq!(setup.plug("DQ 8"), Ok(2));
    // Slots at the end may be empty.
    setup.unplug(4).unwrap();
    assert_eq!(setup.identifiers().unwrap(), [0x10, 0x80, 0x00, 0x80, 0x00]);
}

#[test]
fn what_a_file_demands_or_does_not_offer_is_kept() {
    // A station that demands Fail_Safe and cannot obey Sync.
    let gsd = with("Fail_Safe = 1\nFail_Safe_required = 1\n").gsd;
    let mut setup = gsd.configure();
    assert_eq!(
        message(setup.clear_outputs(ClearOutputs::Zeros)),
        "the slave does not work without: `Fail_Safe_required` is set in the GSD file"
    );
    setup.clear_outputs(ClearOutputs::Empty).unwrap();
    assert_eq!(
        message(setup.sync()),
        "the slave does not support it: `Sync_Mode_supp` is not set in the GSD file"
    );
    let gsd = with("Freeze_Mode_supp = 1\n").gsd;
    let mut setup = gsd.configure();
    setup.plug("first").unwrap();
    setup.freeze().unwrap();
    assert_eq!(setup.slave_config(at(9)).unwrap().freeze, Demand::Yes);
}

#[test]
fn dp_v1_can_be_asked_for_as_the_file_supports_it() {
    let gsd = read(DPV1);
    let mut setup = gsd.configure();
    let status = V1Status::ENABLED.with_alarms(AlarmTypes::DIAGNOSIS, AlarmMode::Two);
    setup.use_v1(status.with_watchdog_1ms()).unwrap();
    assert_eq!(setup.user_prm().unwrap()[..3], [0xC4, 0x20, 0x09]);
    setup.clear_outputs(ClearOutputs::Zeros).unwrap();
    assert_eq!(setup.user_prm().unwrap()[..3], [0x84, 0x20, 0x09]);
    assert_eq!(
        message(setup.use_v1(status.with_alarms(AlarmTypes::STATUS, AlarmMode::Two))),
        "the slave does not support it: `Status_Alarm_supp` is not set in the GSD file"
    );
}

#[test]
fn the_watchdog_counts_in_the_unit_the_slave_is_told() {
    let gsd = read(DPV1);
    let mut setup = gsd.configure();
    setup.watchdog(Duration::from_millis(45));
    let factors = |setup: &dp_master::gsd::Setup<'_>| {
        let (first, second) = setup.slave_config(at(5)).unwrap().watchdog.unwrap().factors();
        u32::from(first) * u32::from(second)
    };
    // At least 45 ms: five times 10 ms, or 45 times 1 ms.
    assert_eq!(factors(&setup), 5);
    setup.use_v1(V1Status::ENABLED.with_watchdog_1ms()).unwrap();
    assert_eq!(factors(&setup), 45);
    // 65 025 ms is the most in this unit.
    setup.watchdog(Duration::from_millis(65_026));
    assert_eq!(
        message(setup.slave_config(at(5))),
        "a watchdog of 65026 ms is too long for the slave"
    );
}

#[test]
fn a_module_with_profisafe_parameters_is_refused() {
    let gsd = read(DPV1);
    let mut setup = gsd.configure();
    setup.plug_at(3, "Safe DI").unwrap();
    assert_eq!(
        message(setup.user_prm()),
        "module `Safe DI` needs PROFIsafe parameters with their checksum, which this tool does not make"
    );
}

#[test]
fn a_modular_station_starts_empty_though_there_is_but_one_module() {
    assert_eq!(clean("").configure().modules().count(), 0);
}

#[test]
fn parameters_of_a_dp_v1_slave_begin_with_its_three_status_octets_if_there_are_any() {
    let user_prm = |constant: &str| {
        let gsd = clean(&format!("DPV1_Slave = 1\n{constant}"));
        let mut setup = gsd.configure();
        setup.plug("first").unwrap();
        setup.user_prm().unwrap()
    };
    assert_eq!(user_prm(""), [0_u8; 0]);
    assert_eq!(user_prm("Ext_User_Prm_Data_Const(0) = 1"), [1, 0, 0]);
}

#[test]
fn one_sign_of_profisafe_is_enough_to_refuse_a_module() {
    for line in ["F_ParamDescCRC = 1", "F_Ext_User_Prm_Data_Const(0) = 1"] {
        let gsd = with(&format!("Module = \"safe\" 0x20\n{line}\nEndModule")).gsd;
        let mut setup = gsd.configure();
        setup.plug("safe").unwrap();
        assert!(
            message(setup.user_prm()).starts_with("module `safe` needs PROFIsafe"),
            "{line}"
        );
    }
}

#[test]
fn only_what_is_preset_and_fixed_stays_plugged() {
    for (fixed, preset) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let module = format!("Module = \"p\" 0x20\nPreset = {preset}\nEndModule");
        let gsd = with(&format!("{module}\nFixPresetModules = {fixed}")).gsd;
        let mut setup = gsd.configure();
        if preset == 0 {
            setup.plug("p").unwrap();
        }
        let slot = setup.modules().next().unwrap().0;
        assert_eq!(
            setup.unplug(slot).is_err(),
            (fixed, preset) == (1, 1),
            "fixed {fixed}, preset {preset}"
        );
    }
}

// On the bus

#[test]
fn a_slave_on_the_line_gets_the_octets_of_the_file_and_exchanges_data() {
    let gsd = read(DRIVE);
    let mut setup = gsd.configure();
    setup.plug("PPO type 2").unwrap();
    setup.set("Direction", "Left").unwrap();
    setup.watchdog(Duration::from_millis(100));
    setup.sync().unwrap();

    let baud = Baud::B1500000;
    let mut master = DpMaster::<1>::new(MasterConfig::new(at(2), BusParams::standard(baud))).unwrap();
    let drive = master.add_slave(setup.slave_config(at(7)).unwrap()).unwrap();
    master.set_outputs(drive, &[3; 20]).unwrap();
    master.set_mode(Mode::Operate);
    let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF5]]);
    let mut slave = DpSlave::new(SlaveIdentity::new(at(7), 0xF103, baud, accepted)).unwrap();

    let mut bus = VirtualBus::new(baud);
    let ports = [bus.attach(), bus.attach()];
    let mut now = Instant::ZERO;
    while master.exchanges(drive) < 3 {
        let mut stations: [(PortId, &mut dyn Station); 2] = [(ports[0], &mut master), (ports[1], &mut slave)];
        now = pump(&mut bus, now, &mut stations).unwrap();
    }
    assert_eq!(master.state(drive), SlaveState::DataExchange);
    assert_eq!(slave.outputs(), [3; 20]);
    assert_eq!(slave.user_prm(), setup.user_prm().unwrap());
    assert_eq!(slave.user_prm()[6], 0xFF);
    assert_eq!(slave.watchdog().unwrap().time(), Duration::from_millis(100));
}

//! Bad GSD files: what is said, in which line, and what is read all the same; and that no octets whatever stop the reader.
//!
//! Lines in `complaints` are counted from the first one behind the smallest slave.

#![cfg(feature = "std")]

use dp_master::dp::Diagnosis;
use dp_master::gsd::{self, Reading};
use proptest::prelude::*;

use crate::bench::{FILES, SLAVE, SLAVE_LINES, complaints, has_error, remarks, with};

/// The smallest slave without the lines that start with one of these.
fn without(keywords: &[&str]) -> Vec<String> {
    let lines = SLAVE
        .lines()
        .filter(|line| !keywords.iter().any(|keyword| line.starts_with(keyword)));
    let text: String = lines.map(|line| format!("{line}\n")).collect();
    remarks(&gsd::parse(text.as_bytes()))
}

// What is missing

#[test]
fn an_empty_file_lacks_everything() {
    for empty in [&b""[..], b"\n\n", b"; comment", b"\x1A"] {
        let messages: Vec<_> = gsd::parse(empty)
            .diagnostics
            .into_iter()
            .map(|remark| remark.message)
            .collect();
        assert_eq!(messages.len(), 13, "{messages:?}");
        assert_eq!(
            messages[0],
            "the line `#Profibus_DP` is missing, so the whole file is read as a description"
        );
        assert!(messages.contains(&"`Ident_Number` is missing".to_owned()));
        assert!(messages.contains(&"no baud rate is supported".to_owned()));
    }
}

#[test]
fn every_mandatory_keyword_is_missed() {
    for keyword in [
        "Vendor_Name",
        "Model_Name",
        "Revision",
        "Ident_Number",
        "Protocol_Ident",
        "Station_Type",
        "Hardware_Release",
        "Software_Release",
        "Min_Slave_Intervall",
        "Max_Diag_Data_Len",
        "Slave_Family",
    ] {
        assert_eq!(without(&[keyword]), [format!("error 1: `{keyword}` is missing")]);
    }
    for keyword in ["Max_Module", "Max_Input_Len", "Max_Output_Len"] {
        assert_eq!(
            without(&[keyword]),
            [format!("error 1: `{keyword}` is missing, a modular station needs it")]
        );
    }
    assert_eq!(
        without(&["GSD_Revision"]),
        ["warning 1: `GSD_Revision` is missing, the file is taken for one from before revision 1"]
    );
    // A file from before revision 1 does not know the two that revision 1 brought.
    assert_eq!(without(&["GSD_Revision", "Max_Diag_Data_Len", "Slave_Family"]).len(), 1);
    assert_eq!(
        without(&["Module", "EndModule"]),
        ["error 1: there is no `Module`, so the slave has no configuration"]
    );
}

#[test]
fn baud_rates_and_their_reply_times_come_in_pairs() {
    assert_eq!(
        without(&["MaxTsdr_9.6"]),
        ["error 11: `MaxTsdr_9.6` is missing, 9.6 kbit/s is supported"]
    );
    assert_eq!(
        without(&["9.6_supp"]),
        [
            "error 1: no baud rate is supported",
            "warning 11: `9.6_supp` is missing, so 9.6 kbit/s is not supported"
        ]
    );
    assert_eq!(
        complaints("12M_supp = 1"),
        ["error 1: `MaxTsdr_12M` is missing, 12 Mbit/s is supported"]
    );
    assert_eq!(complaints("12M_supp = 0\nMaxTsdr_12M = 800"), [""; 0]);
}

// Blocks

#[test]
fn a_block_that_is_not_closed_costs_one_error_and_nothing_else() {
    let statements =
        "Module = \"a\" 0x10\nModule = \"b\" 0x20\nInfo_Text = \"text of b\"\nEndModule\nFreeze_Mode_supp = 1";
    assert_eq!(
        complaints(statements),
        ["error 1: `Module` is not closed by `EndModule` before `Module`"]
    );
    let gsd = with(statements).gsd;
    assert_eq!(gsd.modules.len(), 3);
    assert_eq!(gsd.modules[2].info_text.as_deref(), Some("text of b"));
    assert!(gsd.slave.freeze_mode_supp);

    let statements = "PrmText = 1\nText(0) = \"a\"\nExtUserPrmData = 1 \"p\"\nBit(0) 0\nPrm_Text_Ref = 1\nSync_Mode_supp = 1\n\
                      Ext_User_Prm_Data_Ref(0) = 1";
    assert_eq!(
        complaints(statements),
        [
            "error 1: `PrmText` is not closed by `EndPrmText` before `ExtUserPrmData`",
            "error 3: `ExtUserPrmData` is not closed by `EndExtUserPrmData` before `Sync_Mode_supp`",
        ]
    );
    let gsd = with(statements).gsd;
    assert_eq!((gsd.prm_texts.len(), gsd.parameters.len()), (1, 1));
    assert!(gsd.slave.sync_mode_supp);

    assert_eq!(
        complaints("Unit_Diag_Area = 0-7\nValue(1) = \"a\""),
        ["error 1: `Unit_Diag_Area` is not closed by `Unit_Diag_Area_End` before the end of the file"]
    );
    assert_eq!(
        complaints("Module = \"a\" 0x10\n#Other"),
        ["error 1: `Module` is not closed by `EndModule` before `#Other`"]
    );
}

#[test]
fn inner_blocks_that_are_not_closed_are_closed_with_the_outer_one() {
    assert_eq!(
        complaints("Module = \"a\" 0x10\nData_Area_Beg\nLength = 1\nEndModule"),
        ["error 2: `Data_Area_Beg` is not closed by `Data_Area_End` before `EndModule`"]
    );
    assert_eq!(
        complaints("UnitDiagType = 1\nX_Unit_Diag_Area = 24-31\nEndUnitDiagType"),
        ["error 2: `Unit_Diag_Area` is not closed by `Unit_Diag_Area_End` before `EndUnitDiagType`"]
    );
}

#[test]
fn a_revision_that_cannot_be_read_is_not_missing_too() {
    let text = SLAVE.replace("GSD_Revision = 5", "GSD_Revision = 300");
    let remarks = remarks(&gsd::parse(text.as_bytes()));
    assert_eq!(remarks.len(), 1, "{remarks:?}");
    assert!(remarks[0].starts_with("error 2: `GSD_Revision`"), "{remarks:?}");
}

#[test]
fn user_parameters_fill_a_set_prm_and_no_more() {
    // IEC 61158-6-3: 244 octets less the seven of the standard.
    for (octets, possible) in [(237, true), (238, false), (239, false)] {
        let data = vec!["0"; octets].join(",");
        let found = complaints(&format!("User_Prm_Data = {data}"));
        let told = found.iter().any(|remark| remark.contains("237 are possible"));
        assert_eq!(told, !possible, "{octets} octets: {found:?}");
    }
}

#[test]
fn an_index_that_is_not_closed_is_none() {
    for index in ["(15", "(15 1"] {
        let reading = with(&format!("Unit_Diag_Bit{index} = \"a\""));
        assert_eq!(reading.diagnostics.len(), 1, "{:?}", reading.diagnostics);
        assert!(reading.gsd.unit_diag.bits.is_empty());
    }
}

#[test]
fn errors_and_warnings_are_told_apart() {
    let reading =
        with("Preset = 1\nUnit_Diag_Area = 0-3\nUnit_Diag_Area_End\nUnit_Diag_Area = 3-5\nUnit_Diag_Area_End");
    let lines = |remarks: Vec<&gsd::Diagnostic>| {
        remarks
            .iter()
            .map(|remark| remark.line() - SLAVE_LINES)
            .collect::<Vec<_>>()
    };
    assert_eq!(lines(reading.errors().collect()), [1]);
    assert_eq!(lines(reading.warnings().collect()), [4]);
}

#[test]
fn a_channel_diagnosis_has_no_place_in_a_unit_diag_type() {
    // So it ends the block, as any other statement of the station does.
    let found = complaints("UnitDiagType = 1\nChannel_Diag(17) = \"a\"\nEndUnitDiagType");
    assert_eq!(
        found[0],
        "error 1: `UnitDiagType` is not closed by `EndUnitDiagType` before `Channel_Diag`"
    );
}

#[test]
fn entries_outside_of_their_block_are_told_where_they_belong() {
    for (statement, block) in [
        ("Text(0) = \"a\"", "PrmText"),
        ("Prm_Text_Ref = 1", "ExtUserPrmData"),
        ("Unsigned8 0 0-255", "ExtUserPrmData"),
        ("Slot(1) = \"a\" 1 1", "SlotDefinition"),
        ("Value(1) = \"a\"", "Unit_Diag_Area"),
        ("X_Value(1) = \"a\"", "Unit_Diag_Area"),
        ("Preset = 1", "Module"),
        ("Ext_Module_Prm_Data_Len = 1", "Module"),
        ("Length = 1", "Data_Area_Beg"),
        ("Data_Area_Beg", "Module"),
        ("Reaction_Delay_12M = 1", "Physical_Interface"),
    ] {
        let keyword = statement.split([' ', '(']).next().unwrap();
        assert_eq!(
            complaints(statement),
            [format!("error 1: `{keyword}` may stand only in `{block}`")]
        );
    }
}

#[test]
fn a_block_with_a_faulty_first_line_is_left_out_with_its_entries() {
    let statements = "Module = \"a\" 0x10,300\nInfo_Text = \"x\"\nEndModule\nPrmText = x\nText(0) = \"a\"\nEndPrmText\n\
                      ExtUserPrmData = 1\nUnsigned8 0\nEndExtUserPrmData\nUnit_Diag_Area = 7-3\nUnit_Diag_Area_End\nModule 0x10\nEndModule";
    assert_eq!(
        complaints(statements),
        [
            "error 1: `Module`: expected a number from 0 to 255, got 300",
            "error 4: `PrmText`: expected a number from 0 to 65535, got `x`",
            "error 7: `ExtUserPrmData`: expected a text in quotation marks, got the end of the line",
            "error 10: `Unit_Diag_Area`: expected a number from 7 to 1895, got 3",
            "error 12: `Module`: expected `=`, got `0x10`",
        ]
    );
    let gsd = with(statements).gsd;
    assert_eq!(
        (gsd.modules.len(), gsd.prm_texts.len(), gsd.parameters.len()),
        (1, 0, 0)
    );
    assert_eq!(gsd.general.info_text, None);
}

#[test]
fn definitions_that_stand_twice_are_errors_and_the_last_one_counts() {
    let statements = "PrmText = 1\nText(0) = \"a\"\nEndPrmText\nPrmText = 1\nText(0) = \"b\"\nText(0) = \"c\"\nEndPrmText\n\
                      ExtUserPrmData = 1 \"p\"\nBit(0) 0\nPrm_Text_Ref = 1\nEndExtUserPrmData\n\
                      ExtUserPrmData = 1 \"q\"\nBit(1) 0\nPrm_Text_Ref = 1\nPrm_Text_Ref = 1\nEndExtUserPrmData\n\
                      Ext_User_Prm_Data_Ref(0) = 1";
    assert_eq!(
        complaints(statements),
        [
            "error 4: `PrmText` 1 is defined already in line 23, the last one counts",
            "warning 6: `Text(0)` stands already in this `PrmText`, the last one counts",
            "error 12: `ExtUserPrmData` 1 is defined already in line 30, the last one counts",
            "warning 15: `Prm_Text_Ref` stands already in line 36, the last one counts",
        ]
    );
    let gsd = with(statements).gsd;
    assert_eq!(gsd.prm_texts[&1].texts[&0], "c");
    assert_eq!(gsd.parameters[&1].name, "q");
}

#[test]
fn modules_and_slots_that_stand_twice_are_told() {
    assert_eq!(
        complaints("Module = \"a\" 0x10\n1\nEndModule\nModule = \"a\" 0x20\n1\n2\n1\nEndModule"),
        [
            "warning 4: a module `a` stands already in line 23",
            "error 4: a module with reference 1 stands already in line 23",
            "warning 6: the module has two references, the last one counts",
            "warning 7: the module has two references, the last one counts",
        ]
    );
    assert_eq!(
        complaints(
            "Module = \"a\" 0x10\n1\nEndModule\nSlotDefinition\nSlot(1) = \"s\" 1 1\nSlot(1) = \"t\" 1 1\nEndSlotDefinition"
        ),
        ["error 6: `Slot(1)` is defined already in line 27, the last one counts"]
    );
}

// Parameters

#[test]
fn parameters_need_a_type_that_holds_their_values() {
    let complaints_about = |line: &str| {
        complaints(&format!(
            "ExtUserPrmData = 1 \"p\"\n{line}\nEndExtUserPrmData\nExt_User_Prm_Data_Ref(0) = 1"
        ))
    };
    let undefined = "error 4: there is no `ExtUserPrmData` 1";
    let wanted = "a type (Bit, BitArea, Unsigned8, Unsigned16, Unsigned32, Signed8, Signed16, Signed32)";
    assert_eq!(
        complaints_about("Unsigned64 0"),
        [&format!("error 2: expected {wanted}, got `Unsigned64`"), undefined]
    );
    assert_eq!(
        complaints_about("; nothing"),
        ["error 1: parameter `p` has no line with its type", undefined]
    );
    assert_eq!(
        complaints_about("Bit(8) 0"),
        ["error 2: expected a number from 0 to 7, got 8", undefined]
    );
    assert_eq!(
        complaints_about("BitArea(5-2) 0"),
        ["error 2: expected a number from 5 to 7, got 2", undefined]
    );
    assert_eq!(
        complaints_about("BitArea(2) 0"),
        ["error 2: expected `-`, got `)`", undefined]
    );
    assert_eq!(
        complaints_about("Unsigned8"),
        [
            "error 2: expected a number from -2147483648 to 4294967295, got the end of the line",
            undefined
        ]
    );
    assert_eq!(
        complaints_about("Unsigned8 0 7-3"),
        [
            "error 2: expected a range from a smaller to a larger number, got 7 to 3",
            undefined
        ]
    );
    // These are kept.
    assert_eq!(
        complaints_about("Unsigned8 0 0-256"),
        ["error 2: Unsigned8 holds 0 to 255, not 0 to 256"]
    );
    assert_eq!(
        complaints_about("BitArea(1-2) 0 0-4"),
        ["error 2: BitArea(1-2) holds 0 to 3, not 0 to 4"]
    );
    assert_eq!(
        complaints_about("Unsigned8 9 0-5"),
        ["error 2: the default value 9 is not allowed, these are: 0 to 5"]
    );
    assert_eq!(
        complaints_about("Signed8 200"),
        ["error 2: the default value 200 is not allowed, these are: -128 to 127"]
    );
    assert_eq!(
        complaints_about("Unsigned8 1\nUnsigned8 2"),
        ["warning 3: the parameter has two types, the last one counts"].map(str::to_owned)
    );
}

#[test]
fn references_into_nothing_are_errors_and_definitions_without_use_are_warnings() {
    assert_eq!(
        complaints(
            "ExtUserPrmData = 1 \"p\"\nBit(0) 0\nPrm_Text_Ref = 9\nEndExtUserPrmData\nExt_User_Prm_Data_Ref(0) = 1"
        ),
        ["error 1: parameter `p` refers to `PrmText` 9, which there is not"]
    );
    assert_eq!(
        complaints("PrmText = 1\nText(0) = \"a\"\nEndPrmText"),
        ["warning 1: `PrmText` 1 is not used by any parameter"]
    );
    assert_eq!(
        complaints("ExtUserPrmData = 1 \"p\"\nBit(0) 0\nEndExtUserPrmData"),
        ["warning 1: parameter `p` (1) is not used by station or module"]
    );
    assert_eq!(
        complaints("Module = \"a\" 0x10\nExt_Module_Prm_Data_Len = 1\nExt_User_Prm_Data_Ref(0) = 5\nEndModule"),
        ["error 3: there is no `ExtUserPrmData` 5"]
    );
    assert_eq!(complaints("PrmText = 1\nEndPrmText").len(), 2);
}

#[test]
fn parameters_that_overlap_are_told_but_not_headings() {
    let definitions = "ExtUserPrmData = 1 \"low\"\nBitArea(0-3) 0 0-15\nEndExtUserPrmData\n\
                       ExtUserPrmData = 2 \"mid\"\nBitArea(3-4) 0 0-3\nEndExtUserPrmData\n\
                       ExtUserPrmData = 3 \"word\"\nUnsigned16 0 0-65535\nEndExtUserPrmData\n\
                       ExtUserPrmData = 4 \"--- heading ---\"\nBit(3) 0 0-0\nEndExtUserPrmData\n";
    let places = |places: &[(u8, u16)]| {
        let places: String = places
            .iter()
            .map(|(offset, reference)| format!("Ext_User_Prm_Data_Ref({offset}) = {reference}\n"))
            .collect();
        let mut complaints = complaints(&format!("{definitions}{places}"));
        complaints.retain(|complaint| !complaint.contains("is not used"));
        complaints
    };
    assert_eq!(
        places(&[(0, 1), (0, 2)]),
        ["warning 14: parameter `mid` overlaps `low`"]
    );
    assert_eq!(
        places(&[(1, 1), (0, 3)]),
        ["warning 14: parameter `word` overlaps `low`"]
    );
    assert_eq!(places(&[(0, 1), (1, 2), (2, 3)]), [""; 0]);
    assert_eq!(places(&[(0, 4), (0, 1), (0, 4)]), [""; 0]);
}

#[test]
fn constants_and_parameters_beyond_their_length_are_told() {
    let definition = "ExtUserPrmData = 1 \"p\"\nUnsigned16 0\nEndExtUserPrmData\n";
    assert_eq!(
        complaints(&format!(
            "{definition}Ext_User_Prm_Data_Ref(19) = 1\nExt_User_Prm_Data_Const(18) = 1,2,3"
        )),
        [
            "error 4: parameter `p` ends at octet 21, `Max_User_Prm_Data_Len` says 20",
            "error 5: the constant ends at octet 21, `Max_User_Prm_Data_Len` says 20",
        ]
    );
    assert_eq!(
        complaints(&format!(
            "{definition}Module = \"a\" 0x10\nExt_Module_Prm_Data_Len = 1\nExt_User_Prm_Data_Ref(0) = 1\nEndModule"
        )),
        ["error 6: parameter `p` ends at octet 2, `Ext_Module_Prm_Data_Len` says 1"]
    );
    assert_eq!(
        complaints("Module = \"a\" 0x10\nExt_User_Prm_Data_Const(0) = 1\nEndModule"),
        ["error 1: `Ext_Module_Prm_Data_Len` is missing, module `a` has parameters"]
    );
    assert_eq!(
        complaints("User_Prm_Data_Len = 3\nUser_Prm_Data = 1,2"),
        [
            "error 2: `User_Prm_Data` has 2 octets, `User_Prm_Data_Len` says 3",
            "warning 2: `Max_User_Prm_Data_Len` stands beside `User_Prm_Data`, which is used because there is nothing else",
        ]
    );
    assert_eq!(
        complaints("User_Prm_Data_Len = 3"),
        ["error 1: `User_Prm_Data` is missing, `User_Prm_Data_Len` says 3"]
    );
}

// Modules and slots

#[test]
fn identifiers_that_are_cut_off_or_too_long_are_told() {
    assert_eq!(
        complaints("Module = \"a\" 0xC1,0x81\nEndModule"),
        [
            "error 1: module `a`: Chk_Cfg: the octets that belong to the special identifier 0xc1 at position 0 are cut off"
        ]
    );
    assert_eq!(
        complaints("Module = \"a\" 0x40,0xFF\nEndModule"),
        ["warning 1: module `a` has 128 octets, `Max_Input_Len` allows 100"]
    );
    assert_eq!(
        complaints("Module = \"a\"\nEndModule"),
        ["error 1: `Module`: expected a number from 0 to 255, got the end of the line"]
    );
}

#[test]
fn slots_with_modules_that_are_not_there_are_told() {
    let modules = "Module = \"a\" 0x10\n1\nEndModule\nModule = \"b\" 0x10\n2\nEndModule\nSlotDefinition\n";
    let slots = |slots: &str| complaints(&format!("{modules}{slots}\nEndSlotDefinition"));
    assert_eq!(slots("Slot(1) = \"s\" 1 1-9"), [""; 0]);
    assert_eq!(
        slots("Slot(1) = \"s\" 5 1,2"),
        ["error 8: there is no module with reference 5, the default of slot 1"]
    );
    assert_eq!(
        slots("Slot(1) = \"s\" 1 2"),
        ["warning 8: the default of slot 1, 1, is not among its allowed modules"]
    );
    assert_eq!(
        slots("Slot(1) = \"s\" 1 1,7,8-9"),
        [
            "error 8: slot 1 allows module 7, but there is none with such a reference",
            "error 8: slot 1 allows module 8 to 9, but there is none with such a reference"
        ]
    );
    assert_eq!(
        slots("Slot(1) = \"s\" 1"),
        ["warning 8: `Slot(1)` names no allowed modules, only its default is allowed"]
    );
    assert_eq!(
        slots("Slot(9) = \"s\" 1 1"),
        ["warning 8: slot 9 is beyond `Max_Module` 8"]
    );
    assert_eq!(
        slots("Slot(1) = 1 1"),
        ["error 8: `Slot`: expected a text in quotation marks, got `1`"]
    );
}

// Diagnosis and contradictions

#[test]
fn diagnosis_that_contradicts_itself_is_told() {
    assert_eq!(
        complaints(
            "Unit_Diag_Area = 0-3\nValue(16) = \"a\"\nUnit_Diag_Area_End\nUnit_Diag_Area = 3-5\nUnit_Diag_Area_End"
        ),
        [
            "error 2: bits 0 to 3 hold 0 to 15, not 16",
            "warning 4: bits 3 to 5 overlap another `Unit_Diag_Area`",
        ]
    );
    // Bit 456 stands in the 58th octet behind the header: 6 + 1 + 58 octets.
    let reading = with("Unit_Diag_Bit(456) = \"a\"");
    assert_eq!(
        remarks(&reading),
        ["warning 14: bit 456 of the diagnosis needs 65 octets, `Max_Diag_Data_Len` says 64"]
    );
    assert_eq!(complaints("Unit_Diag_Bit(455) = \"a\""), [""; 0]);
    assert_eq!(
        complaints("Channel_Diag(3) = \"a\""),
        ["warning 1: channel fault 3 has its text in the standard, those of a manufacturer are 16 to 31"]
    );
    assert_eq!(
        complaints("Channel_Diag(32) = \"a\""),
        ["error 1: `Channel_Diag`: expected a number from 0 to 31, got 32"]
    );
}

#[test]
fn what_is_required_but_not_supported_is_told() {
    for (required, supported) in [
        ("Fail_Safe_required", "Fail_Safe"),
        ("Process_Alarm_required", "Process_Alarm_supp"),
        (
            "Manufacturer_Specific_Alarm_required",
            "Manufacturer_Specific_Alarm_supp",
        ),
        ("C1_Read_Write_required", "C1_Read_Write_supp"),
        ("C2_Read_Write_required", "C2_Read_Write_supp"),
        ("Isochron_Mode_required", "Isochron_Mode_supp"),
    ] {
        assert_eq!(
            complaints(&format!("{required} = 1")),
            [format!("warning 1: `{required}` is set, but `{supported}` is not")]
        );
        assert_eq!(complaints(&format!("{required} = 1\n{supported} = 1")), [""; 0]);
    }
    assert_eq!(
        complaints("Max_Data_Len = 201"),
        ["warning 1: `Max_Data_Len` 201 is more than 100 of inputs and 100 of outputs"]
    );
    let compact = SLAVE.replace("Modular_Station = 1", "Modular_Station = 0");
    let reading = gsd::parse(format!("{compact}Module = \"b\" 0x20\nEndModule").as_bytes());
    assert_eq!(
        remarks(&reading),
        ["warning 23: the station is not modular, so the file should describe it with one module"]
    );
}

#[test]
fn a_file_with_many_faults_is_read_as_far_as_it_is_right() {
    let text = "\
; broken in many ways
#Profibus_DP
GSD_Revision = three
Vendor_Name = \"Broken Inc.
Model_Name = \"Worst\" 7
Ident_Number = 0x1234
Freeze_Mode_supp = 2
Sync_Mode_supp = 1
PrmText = 1
Text(a) = \"a\"
Text(1) = \"b\"
Module = \"good\" 0x10
ENDMODULE
Module = \"bad\" 0x10 0x20
EndModule
FooBar = 5
Min_Slave_Intervall = 1
";
    let reading = gsd::parse(text.as_bytes());
    let all = remarks(&reading);
    for expected in [
        "error 3: `GSD_Revision`: expected a number from 0 to 255, got `three`",
        "error 4: the text has no quotation mark at its end",
        "error 5: `Model_Name`: expected nothing more in this line, got `7`",
        "error 7: `Freeze_Mode_supp`: expected a number from 0 to 1, got 2",
        "error 9: `PrmText` is not closed by `EndPrmText` before `Module`",
        "error 10: `Text`: expected a number from -2147483648 to 4294967295, got `a`",
        "error 14: `Module`: expected `,`, got `0x20`",
        "warning 16: unknown keyword `FooBar`",
        "error 2: no baud rate is supported",
    ] {
        assert!(all.contains(&expected.to_owned()), "{expected}\n{}", all.join("\n"));
    }
    let gsd = reading.gsd;
    assert_eq!(gsd.general.vendor_name.as_deref(), Some("Broken Inc."));
    assert_eq!(gsd.general.ident_number, Some(0x1234));
    assert!(gsd.slave.sync_mode_supp);
    assert_eq!(gsd.prm_texts[&1].texts[&1], "b");
    assert_eq!(gsd.modules.len(), 1);
    assert_eq!(gsd.slave.min_slave_intervall, Some(1));
}

#[test]
fn a_message_stays_on_its_line_and_does_not_command_the_terminal() {
    assert_eq!(
        complaints("Foo \\\nBar = 1"),
        ["warning 1: unknown keyword `Foo \\\\nBar`"]
    );
    assert_eq!(
        complaints("Module = \"\u{1B}[2J\" 0xC0\nEndModule"),
        [
            "error 1: module `\\u{1b}[2J`: Chk_Cfg: the octets that belong to the special identifier 0xc0 at position 0 are cut off"
        ]
    );
    let long = "x".repeat(100);
    assert_eq!(
        complaints(&long),
        [format!("warning 1: unknown keyword `{}…`", &long[..60])]
    );
}

// Whatever the octets are

/// Everything that can be done with a description, to see that nothing panics.
fn exercise(reading: &Reading) {
    let gsd = &reading.gsd;
    let mut setup = gsd.configure();
    for module in gsd.modules.iter().take(3) {
        let _ = setup.plug(module.name.as_str());
    }
    for place in gsd.prm.places.iter().take(20) {
        for value in [0, 1, -1, i64::MAX, i64::MIN] {
            let _ = setup.set((place.offset, place.reference), value);
        }
    }
    let _ = setup.user_prm();
    let _ = setup.identifiers();
    let _ = setup.slave_config(dp_master::address::Address::new(3).unwrap());
    let diagnosis = Diagnosis::parse(&[
        0, 0, 0, 0, 0, 0, 0x06, 1, 2, 3, 0xFF, 4, 0x43, 0xFF, 0xFF, 0x81, 1, 0xFF,
    ])
    .unwrap();
    let _ = setup.diagnosis_texts(&diagnosis);
    let _ = gsd.summary().to_string();
    let _ = serde_json::to_string(reading).unwrap();
    assert!(
        reading
            .diagnostics
            .iter()
            .all(|remark| !remark.message.contains(char::is_control))
    );
}

/// First or last line of a block.
fn is_structural(line: &str) -> bool {
    let line = line.trim().to_ascii_lowercase();
    let starts = [
        "end",
        "module",
        "prmtext",
        "extuserprmdata",
        "unit_diag_area",
        "x_unit_diag_area",
        "unitdiagtype",
        "physical_interface",
        "slotdefinition",
        "#profibus_dp",
    ];
    starts.iter().any(|start| line.starts_with(start))
}

#[test]
fn each_line_that_starts_or_ends_a_block_is_missed_when_it_is_gone() {
    for (name, file) in FILES {
        let text: String = file.iter().map(|&octet| char::from(octet)).collect();
        let lines: Vec<&str> = text.lines().collect();
        for (number, line) in lines.iter().enumerate().filter(|(_, line)| is_structural(line)) {
            let rest: Vec<&str> = [&lines[..number], &lines[number + 1..]].concat();
            let reading = gsd::parse(rest.join("\n").as_bytes());
            assert_ne!(remarks(&reading), [""; 0], "{name}, line {}: {line}", number + 1);
            exercise(&reading);
        }
    }
}

#[test]
fn a_file_cut_off_inside_a_block_is_an_error() {
    for (name, file) in FILES {
        let text: String = file.iter().map(|&octet| char::from(octet)).collect();
        let mut inside = false;
        let mut read = String::new();
        for line in text.lines() {
            let lower = line.trim().to_ascii_lowercase();
            read.push_str(line);
            read.push('\n');
            if is_structural(line) && !lower.starts_with('#') {
                inside = !(lower.starts_with("end") || lower.ends_with("_end"));
            }
            if inside {
                assert!(has_error(&gsd::parse(read.as_bytes())), "{name} cut behind `{line}`");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn arbitrary_octets_are_read(octets in prop::collection::vec(any::<u8>(), 0..600)) {
        let reading = gsd::parse(&octets);
        prop_assert!(!reading.diagnostics.is_empty());
        exercise(&reading);
    }

    #[test]
    fn octets_of_the_language_in_any_order_are_read(
        words in prop::collection::vec(
            prop::sample::select(vec![
                "#Profibus_DP", "Module", "EndModule", "PrmText", "EndPrmText", "Text", "ExtUserPrmData", "EndExtUserPrmData",
                "Unsigned8", "Signed32", "BitArea", "Bit", "Unit_Diag_Area", "Unit_Diag_Area_End", "UnitDiagType",
                "EndUnitDiagType", "SlotDefinition", "Slot", "EndSlotDefinition", "Data_Area_Beg", "Data_Area_End",
                "Ext_User_Prm_Data_Ref", "Ext_User_Prm_Data_Const", "Max_User_Prm_Data_Len", "Physical_Interface", "Value",
                "Prm_Text_Ref", "Unit_Diag_Bit", "Channel_Diag", "Slave_Family", "DPV1_Slave", "Modular_Station", "Foo",
                "=", "=", "(", ")", ",", "-", "@", "\"", "\"a\"", "\"[SlotNumber]\"", "\\", ";", "\n", "\n", "\n", "\\\n",
                "0", "1", "7", "255", "65535", "4294967295", "0xFF", "\u{fc}",
            ]),
            0..200,
        ),
        gap in prop::sample::select(vec!["", " "]),
    ) {
        let reading = gsd::parse(words.join(gap).as_bytes());
        prop_assert!(!reading.diagnostics.is_empty());
        exercise(&reading);
    }

    #[test]
    fn good_files_with_octets_changed_are_read(
        file in 0..FILES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut octets = FILES[file].1.to_vec();
        for (place, octet) in changes {
            let place = place.index(octets.len());
            octets[place] = octet;
        }
        if is_cut {
            octets.truncate(cut.index(octets.len()));
        }
        exercise(&gsd::parse(&octets));
    }

    #[test]
    fn good_files_with_lines_exchanged_are_read(
        file in 0..FILES.len(),
        swaps in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..6),
    ) {
        let text: String = FILES[file].1.iter().map(|&octet| char::from(octet)).collect();
        let mut lines: Vec<&str> = text.lines().collect();
        for (a, b) in swaps {
            let (a, b) = (a.index(lines.len()), b.index(lines.len()));
            lines.swap(a, b);
        }
        exercise(&gsd::parse(lines.join("\r\n").as_bytes()));
    }
}

//! Every keyword of the GSD language is read into its field.
//!
//! One table a subject: statement, place of the value in the serialised description, value. Keywords, types and meanings from the guideline
//! "Specification for PROFIBUS Device Description and Device Integration, Volume 1: GSD"; the values are written by hand.

#![cfg(feature = "std")]

use dp_master::fdl::BusParams;
use dp_master::gsd::{self, MainFamily, Pins24V, Rate, RepeaterCtrlSig};
use dp_master::time::{Baud, BitTimes};
use serde_json::{Value, json};

use crate::bench::{SLAVE, clean, complaints, with};

/// Reads each statement alone behind the smallest slave and looks at one value.
fn check(table: &[(&str, &str, Value)]) {
    for (statement, pointer, expected) in table {
        let reading = with(statement);
        let description = serde_json::to_value(&reading.gsd).unwrap();
        assert_eq!(description.pointer(pointer), Some(expected), "{statement}");
        // What the smallest slave says already may be said again.
        for remark in &reading.diagnostics {
            let again = remark.message.ends_with("the last one counts");
            let beside = statement.starts_with("User_Prm_Data") && remark.message.contains("beside `User_Prm_Data`");
            assert!(again || beside, "{statement}: {remark}");
        }
        // Without the statement the value is another one.
        let without = serde_json::to_value(with("").gsd).unwrap();
        assert_ne!(without.pointer(pointer), Some(expected), "{statement} shows nothing");
    }
}

#[test]
fn general_keywords() {
    check(&[
        ("GSD_Revision = 4", "/general/gsd_revision", json!(4)),
        ("Vendor_Name = \"Maker\"", "/general/vendor_name", json!("Maker")),
        ("Model_Name = \"Device\"", "/general/model_name", json!("Device")),
        ("Revision = \"V1.2\"", "/general/revision", json!("V1.2")),
        ("Revision_Number = 12", "/general/revision_number", json!(12)),
        ("Ident_Number = 0xFEDC", "/general/ident_number", json!(0xFEDC)),
        ("Protocol_Ident = 16", "/general/protocol_ident", json!({ "Other": 16 })),
        ("FMS_supp = 1", "/general/fms_supp", json!(true)),
        ("Hardware_Release = \"H2\"", "/general/hardware_release", json!("H2")),
        ("Software_Release = \"S3\"", "/general/software_release", json!("S3")),
        ("Redundancy = 1", "/general/redundancy", json!(true)),
        ("Repeater_Ctrl_Sig = 1", "/general/repeater_ctrl_sig", json!("Rs485")),
        ("Repeater_Ctrl_Sig = 2", "/general/repeater_ctrl_sig", json!("Ttl")),
        ("24V_Pins = 1", "/general/pins_24v", json!("Input")),
        ("24V_Pins = 2", "/general/pins_24v", json!("Output")),
        (
            "Implementation_Type = \"SPC3\"",
            "/general/implementation_type",
            json!("SPC3"),
        ),
        ("Bitmap_Device = \"DEV_N\"", "/general/bitmap_device", json!("DEV_N")),
        ("Bitmap_Diag = \"DEV_D\"", "/general/bitmap_diag", json!("DEV_D")),
        ("Bitmap_SF = \"DEV_S\"", "/general/bitmap_sf", json!("DEV_S")),
        ("OrderNumber = \"4711\"", "/general/order_number", json!("4711")),
        ("Info_Text = \"What it is\"", "/general/info_text", json!("What it is")),
        ("Family_Name = \"Family\"", "/general/family_name", json!("Family")),
        ("Physical_Layer = 1", "/general/physical_layer", json!(1)),
    ]);
}

#[test]
fn baud_rates_and_their_times() {
    let rates = [
        ("9.6", "B9600"),
        ("19.2", "B19200"),
        ("31.25", "B31250"),
        ("45.45", "B45450"),
        ("93.75", "B93750"),
        ("187.5", "B187500"),
        ("500", "B500000"),
        ("1.5M", "B1500000"),
        ("3M", "B3000000"),
        ("6M", "B6000000"),
        ("12M", "B12000000"),
    ];
    for (keyword, name) in rates {
        // 9.6 kbit/s stands in the smallest slave.
        let supported = format!("{keyword}_supp = 1\nMaxTsdr_{keyword} = 777\n");
        let gsd = with(&supported).gsd;
        let rate = Rate::ALL.into_iter().find(|rate| rate.keyword() == keyword).unwrap();
        assert_eq!(format!("{rate:?}"), name);
        assert!(gsd.rates[&rate].supported, "{keyword}");
        assert_eq!(gsd.rates[&rate].max_tsdr, Some(777), "{keyword}");
        let at = |field: &str| format!("/rates/{name}/{field}");
        check(&[
            (&format!("{supported}Trdy_{keyword} = 11"), &at("trdy"), json!(11)),
            (&format!("{supported}Tqui_{keyword} = 9"), &at("tqui"), json!(9)),
            (&format!("{supported}Tset_{keyword} = 16"), &at("tset"), json!(16)),
            (&format!("{supported}Tsdi_{keyword} = 70"), &at("tsdi"), json!(70)),
        ]);
        let interface = format!(
            "Physical_Interface = 1\nTransmission_Delay_{keyword} = 3\nReaction_Delay_{keyword} = 5\nEnd_Physical_Interface"
        );
        let at = |field: &str| format!("/physical_interfaces/0/{field}/{name}");
        check(&[
            (&interface, "/physical_interfaces/0/kind", json!(1)),
            (&interface, &at("transmission_delay"), json!(3)),
            (&interface, &at("reaction_delay"), json!(5)),
        ]);
    }
}

#[test]
fn the_longest_reply_time_is_that_of_the_file_or_else_of_the_standard() {
    let gsd = clean("500_supp = 1\nMaxTsdr_500 = 77\n");
    assert_eq!(gsd.max_tsdr(Baud::B500000), BitTimes(77));
    assert_eq!(
        gsd.max_tsdr(Baud::B12000000),
        BusParams::standard(Baud::B12000000).t_sdr_max
    );
    assert!(gsd.supports(Baud::B500000) && !gsd.supports(Baud::B12000000));
    assert_eq!(Rate::B500000.baud(), Some(Baud::B500000));
    assert_eq!(Rate::B31250.baud(), None);
}

#[test]
fn master_keywords() {
    check(&[
        (
            "Master_Freeze_Mode_supp = 1",
            "/master/master_freeze_mode_supp",
            json!(true),
        ),
        (
            "Master_Sync_Mode_supp = 1",
            "/master/master_sync_mode_supp",
            json!(true),
        ),
        (
            "Master_Fail_Safe_supp = 1",
            "/master/master_fail_safe_supp",
            json!(true),
        ),
        ("Download_supp = 1", "/master/download_supp", json!(true)),
        ("Upload_supp = 1", "/master/upload_supp", json!(true)),
        ("Act_Para_Brct_supp = 1", "/master/act_para_brct_supp", json!(true)),
        ("Act_Param_supp = 1", "/master/act_param_supp", json!(true)),
        ("Max_MPS_Length = 100000", "/master/max_mps_length", json!(100_000)),
        ("Max_Lsdu_MS = 244", "/master/max_lsdu_ms", json!(244)),
        ("Max_Lsdu_MM = 240", "/master/max_lsdu_mm", json!(240)),
        ("Min_Poll_Timeout = 10", "/master/min_poll_timeout", json!(10)),
        ("LAS_Len = 127", "/master/las_len", json!(127)),
        ("Max_Slaves_supp = 125", "/master/max_slaves_supp", json!(125)),
        ("Max_Master_Input_Len = 244", "/master/max_master_input_len", json!(244)),
        (
            "Max_Master_Output_Len = 243",
            "/master/max_master_output_len",
            json!(243),
        ),
        ("Max_Master_Data_Len = 488", "/master/max_master_data_len", json!(488)),
        ("DPV1_Master = 1", "/master/dpv1_master", json!(true)),
        ("DPV1_Conformance_Class = 2", "/master/dpv1_conformance_class", json!(2)),
        (
            "C1_Master_Read_Write_supp = 1",
            "/master/c1_master_read_write_supp",
            json!(true),
        ),
        (
            "Master_DPV1_Alarm_supp = 1",
            "/master/master_dpv1_alarm_supp",
            json!(true),
        ),
        (
            "Master_Diagnostic_Alarm_supp = 1",
            "/master/alarms/diagnostic",
            json!(true),
        ),
        ("Master_Process_Alarm_supp = 1", "/master/alarms/process", json!(true)),
        (
            "Master_Pull_Plug_Alarm_supp = 1",
            "/master/alarms/pull_plug",
            json!(true),
        ),
        ("Master_Status_Alarm_supp = 1", "/master/alarms/status", json!(true)),
        ("Master_Update_Alarm_supp = 1", "/master/alarms/update", json!(true)),
        (
            "Master_Manufacturer_Specific_Alarm_supp = 1",
            "/master/alarms/manufacturer_specific",
            json!(true),
        ),
        (
            "Master_Extra_Alarm_SAP_supp = 1",
            "/master/master_extra_alarm_sap_supp",
            json!(true),
        ),
        (
            "Master_Alarm_Sequence_Mode = 32",
            "/master/master_alarm_sequence_mode",
            json!(32),
        ),
        (
            "Master_Alarm_Type_Mode_supp = 1",
            "/master/master_alarm_type_mode_supp",
            json!(true),
        ),
        (
            "Isochron_Mode_Synchronised = 2",
            "/master/isochron_mode_synchronised",
            json!(2),
        ),
        ("DXB_Master_supp = 1", "/master/dxb_master_supp", json!(true)),
        (
            "X_Master_Prm_SAP_supp = 1",
            "/master/x_master_prm_sap_supp",
            json!(true),
        ),
    ]);
}

#[test]
fn a_master_needs_other_keywords_than_a_slave() {
    let text = SLAVE
        .replace("Station_Type = 0", "Station_Type = 1")
        .replace("Min_Slave_Intervall = 1\n", "")
        .replace("Module = \"first\" 0x10\nEndModule\n", "");
    let reading = gsd::parse(text.as_bytes());
    assert!(!reading.gsd.is_slave());
    let messages: Vec<_> = reading
        .diagnostics
        .iter()
        .map(|remark| remark.message.as_str())
        .collect();
    assert_eq!(
        messages,
        [
            "Max_MPS_Length",
            "Max_Lsdu_MS",
            "Max_Lsdu_MM",
            "Min_Poll_Timeout",
            "LAS_Len",
            "Max_Slaves_supp"
        ]
        .map(|keyword| format!("`{keyword}` is missing, a master needs it"))
    );
}

#[test]
fn slave_keywords() {
    check(&[
        ("Freeze_Mode_supp = 1", "/slave/freeze_mode_supp", json!(true)),
        ("Sync_Mode_supp = 1", "/slave/sync_mode_supp", json!(true)),
        ("Auto_Baud_supp = 1", "/slave/auto_baud_supp", json!(true)),
        ("Set_Slave_Add_supp = 1", "/slave/set_slave_add_supp", json!(true)),
        (
            "User_Prm_Data_Len = 2\nUser_Prm_Data = 1,0xFF",
            "/slave/user_prm_data_len",
            json!(2),
        ),
        (
            "User_Prm_Data_Len = 2\nUser_Prm_Data = 1,0xFF",
            "/slave/user_prm_data",
            json!([1, 255]),
        ),
        ("Min_Slave_Intervall = 600", "/slave/min_slave_intervall", json!(600)),
        ("Max_Module = 244", "/slave/max_module", json!(244)),
        ("Max_Input_Len = 244", "/slave/max_input_len", json!(244)),
        ("Max_Output_Len = 243", "/slave/max_output_len", json!(243)),
        ("Max_Data_Len = 150", "/slave/max_data_len", json!(150)),
        ("Fail_Safe = 1", "/slave/fail_safe", json!(true)),
        (
            "Fail_Safe = 1\nFail_Safe_required = 1",
            "/slave/fail_safe_required",
            json!(true),
        ),
        ("Max_Diag_Data_Len = 244", "/slave/max_diag_data_len", json!(244)),
        ("Modul_Offset = 255", "/slave/modul_offset", json!(255)),
        ("Slave_Family = 3@TdF@ET", "/slave/slave_family/main", json!("Io")),
        (
            "Slave_Family = 3@TdF@ET",
            "/slave/slave_family/sub",
            json!(["TdF", "ET"]),
        ),
        (
            "Slave_Family = 200",
            "/slave/slave_family/main",
            json!({ "Other": 200 }),
        ),
        ("Diag_Update_Delay = 5", "/slave/diag_update_delay", json!(5)),
        ("Max_User_Prm_Data_Len = 237", "/prm/len", json!(237)),
        ("FixPresetModules = 1", "/slave/fix_preset_modules", json!(true)),
        (
            "Ident_Maintenance_supp = 1",
            "/slave/ident_maintenance_supp",
            json!(true),
        ),
        ("Time_Sync_supp = 1", "/slave/time_sync_supp", json!(true)),
        (
            "Max_iParameter_Size = 70000",
            "/slave/max_i_parameter_size",
            json!(70_000),
        ),
        ("Slave_Redundancy_supp = 8", "/slave/slave_redundancy_supp", json!(8)),
        (
            "Slave_Max_Switch_Over_Time = 300",
            "/slave/slave_max_switch_over_time",
            json!(300),
        ),
        (
            "Prm_Block_Structure_supp = 1",
            "/slave/prm_block_structure_supp",
            json!(true),
        ),
        (
            "Prm_Block_Structure_req = 1",
            "/slave/prm_block_structure_req",
            json!(true),
        ),
        ("Jokerblock_Slot = 3", "/slave/jokerblock_slot", json!(3)),
        ("Jokerblock_Location = 2", "/slave/jokerblock_location", json!(2)),
        ("PrmCmd_supp = 1", "/slave/prm_cmd_supp", json!(true)),
        ("X_Prm_SAP_supp = 1", "/slave/x_prm_sap_supp", json!(true)),
        ("X_Max_User_Prm_Data_Len = 200", "/extended_prm/len", json!(200)),
        (
            "X_Prm_Block_Structure_supp = 1",
            "/slave/x_prm_block_structure_supp",
            json!(true),
        ),
        ("Subsys_Dir_Index = 17", "/slave/subsys_dir_index", json!(17)),
    ]);
    let compact = SLAVE.replace("Modular_Station = 1", "Modular_Station = 0");
    assert!(!gsd::parse(compact.as_bytes()).gsd.slave.modular_station);
    assert!(clean("").slave.modular_station);
}

#[test]
fn dp_v1_keywords() {
    check(&[
        ("DPV1_Slave = 1", "/dpv1/dpv1_slave", json!(true)),
        ("C1_Read_Write_supp = 1", "/dpv1/c1_read_write_supp", json!(true)),
        (
            "C1_Read_Write_supp = 1\nC1_Read_Write_required = 1",
            "/dpv1/c1_read_write_required",
            json!(true),
        ),
        ("C1_Max_Data_Len = 240", "/dpv1/c1_max_data_len", json!(240)),
        ("C1_Response_Timeout = 500", "/dpv1/c1_response_timeout", json!(500)),
        ("C2_Read_Write_supp = 1", "/dpv1/c2_read_write_supp", json!(true)),
        (
            "C2_Read_Write_supp = 1\nC2_Read_Write_required = 1",
            "/dpv1/c2_read_write_required",
            json!(true),
        ),
        ("C2_Max_Data_Len = 48", "/dpv1/c2_max_data_len", json!(48)),
        ("C2_Response_Timeout = 4000", "/dpv1/c2_response_timeout", json!(4_000)),
        ("C2_Max_Count_Channels = 2", "/dpv1/c2_max_count_channels", json!(2)),
        (
            "Max_Initiate_PDU_Length = 52",
            "/dpv1/max_initiate_pdu_length",
            json!(52),
        ),
        ("Alarm_supported = 3", "/dpv1/alarm_supported", json!(3)),
        ("Diagnostic_Alarm_supp = 1", "/dpv1/alarms_supp/diagnostic", json!(true)),
        ("Process_Alarm_supp = 1", "/dpv1/alarms_supp/process", json!(true)),
        ("Pull_Plug_Alarm_supp = 1", "/dpv1/alarms_supp/pull_plug", json!(true)),
        ("Status_Alarm_supp = 1", "/dpv1/alarms_supp/status", json!(true)),
        ("Update_Alarm_supp = 1", "/dpv1/alarms_supp/update", json!(true)),
        (
            "Manufacturer_Specific_Alarm_supp = 1",
            "/dpv1/alarms_supp/manufacturer_specific",
            json!(true),
        ),
        (
            "Diagnostic_Alarm_supp = 1\nDiagnostic_Alarm_required = 1",
            "/dpv1/alarms_required/diagnostic",
            json!(true),
        ),
        (
            "Process_Alarm_supp = 1\nProcess_Alarm_required = 1",
            "/dpv1/alarms_required/process",
            json!(true),
        ),
        (
            "Pull_Plug_Alarm_supp = 1\nPull_Plug_Alarm_required = 1",
            "/dpv1/alarms_required/pull_plug",
            json!(true),
        ),
        (
            "Status_Alarm_supp = 1\nStatus_Alarm_required = 1",
            "/dpv1/alarms_required/status",
            json!(true),
        ),
        (
            "Update_Alarm_supp = 1\nUpdate_Alarm_required = 1",
            "/dpv1/alarms_required/update",
            json!(true),
        ),
        (
            "Manufacturer_Specific_Alarm_supp = 1\nManufacturer_Specific_Alarm_required = 1",
            "/dpv1/alarms_required/manufacturer_specific",
            json!(true),
        ),
        ("Extra_Alarm_SAP_supp = 1", "/dpv1/extra_alarm_sap_supp", json!(true)),
        (
            "Alarm_Sequence_Mode_Count = 16",
            "/dpv1/alarm_sequence_mode_count",
            json!(16),
        ),
        ("Alarm_Type_Mode_supp = 1", "/dpv1/alarm_type_mode_supp", json!(true)),
        ("DPV1_Data_Types = 1", "/dpv1/dpv1_data_types", json!(true)),
        ("WD_Base_1ms_supp = 1", "/dpv1/wd_base_1ms_supp", json!(true)),
        ("Check_Cfg_Mode = 1", "/dpv1/check_cfg_mode", json!(true)),
    ]);
}

#[test]
fn dp_v2_keywords() {
    check(&[
        ("Publisher_supp = 1", "/dxb/publisher_supp", json!(true)),
        ("Subscriber_supp = 1", "/dxb/subscriber_supp", json!(true)),
        ("DXB_Max_Link_Count = 125", "/dxb/dxb_max_link_count", json!(125)),
        ("DXB_Max_Data_Length = 244", "/dxb/dxb_max_data_length", json!(244)),
        (
            "DXB_Subscribertable_Block_Location = 1",
            "/dxb/dxb_subscribertable_block_location",
            json!(1),
        ),
        ("Isochron_Mode_supp = 1", "/isochron/isochron_mode_supp", json!(true)),
        (
            "Isochron_Mode_supp = 1\nIsochron_Mode_required = 1",
            "/isochron/isochron_mode_required",
            json!(true),
        ),
        ("TBASE_DP = 120000", "/isochron/tbase_dp", json!(120_000)),
        ("TDP_MIN = 8", "/isochron/tdp_min", json!(8)),
        ("TDP_MAX = 256", "/isochron/tdp_max", json!(256)),
        ("T_PLL_W_MIN = 1", "/isochron/t_pll_w_min", json!(1)),
        ("T_PLL_W_MAX = 12", "/isochron/t_pll_w_max", json!(12)),
        ("TBASE_IO = 1500", "/isochron/tbase_io", json!(1_500)),
        ("TI_MIN = 3", "/isochron/ti_min", json!(3)),
        ("TO_MIN = 4", "/isochron/to_min", json!(4)),
    ]);
}

/// A text for values, and a parameter that uses it.
const PARAMETER: &str = "\
PrmText = 7
Text(0) = \"zero\"
Text(255) = \"most\"
EndPrmText
ExtUserPrmData = 300 \"Name\"
BitArea(2-4) 3 0-5
Prm_Text_Ref = 7
Changeable = 0
Visible = 0
EndExtUserPrmData
Ext_User_Prm_Data_Const(3) = 1,2
Ext_User_Prm_Data_Ref(9) = 300
";

#[test]
fn parameters_and_their_texts() {
    check(&[
        (PARAMETER, "/prm_texts/7/texts", json!({ "0": "zero", "255": "most" })),
        (PARAMETER, "/parameters/300/name", json!("Name")),
        (PARAMETER, "/parameters/300/reference", json!(300)),
        (
            PARAMETER,
            "/parameters/300/data_type",
            json!({ "BitArea": { "first": 2, "last": 4 } }),
        ),
        (PARAMETER, "/parameters/300/default", json!(3)),
        (PARAMETER, "/parameters/300/values", json!([[0, 5]])),
        (PARAMETER, "/parameters/300/text", json!(7)),
        (PARAMETER, "/parameters/300/changeable", json!(false)),
        (PARAMETER, "/parameters/300/visible", json!(false)),
        (PARAMETER, "/prm/constants/0", json!({ "offset": 3, "octets": [1, 2] })),
        (PARAMETER, "/prm/places/0", json!({ "offset": 9, "reference": 300 })),
    ]);
}

#[test]
fn types_defaults_and_allowed_values_of_parameters() {
    let coding = |line: &str| {
        let gsd = clean(&format!(
            "ExtUserPrmData = 1 \"p\"\n{line}\nEndExtUserPrmData\nExt_User_Prm_Data_Ref(0) = 1\n"
        ));
        let parameter = &gsd.parameters[&1];
        (
            parameter.data_type.to_string(),
            parameter.default,
            parameter.values.to_string(),
            parameter.changeable,
        )
    };
    for (line, data_type, default, values) in [
        ("Bit(0) 1 0-1", "Bit(0)", 1, "0 to 1"),
        ("Bit(7) 0", "Bit(7)", 0, "any"),
        ("BitArea(0-7) 255 0-255", "BitArea(0-7)", 255, "0 to 255"),
        ("BitArea( 3 - 4 ) 2 1,2", "BitArea(3-4)", 2, "1, 2"),
        ("Unsigned8 0x10 0x00-0xFF", "Unsigned8", 16, "0 to 255"),
        ("Unsigned16 65535 0-65535", "Unsigned16", 65_535, "0 to 65535"),
        (
            "Unsigned32 4294967295 0-4294967295",
            "Unsigned32",
            4_294_967_295,
            "0 to 4294967295",
        ),
        ("Signed8 -5 -128-127", "Signed8", -5, "-128 to 127"),
        ("Signed16 -32768 -32768--1", "Signed16", -32_768, "-32768 to -1"),
        (
            "Signed32 -1 -2147483648-2147483647",
            "Signed32",
            -1,
            "-2147483648 to 2147483647",
        ),
        ("Signed8 1 -1,1,5-7", "Signed8", 1, "-1, 1, 5 to 7"),
    ] {
        assert_eq!(
            coding(line),
            (data_type.to_owned(), default, values.to_owned(), true),
            "{line}"
        );
    }
}

/// A module with everything a module can have.
const MODULE: &str = "\
ExtUserPrmData = 1 \"p\"
Unsigned8 0
EndExtUserPrmData
Module = \"Everything\" 0x42, 0x83, 1, 2
65535
Info_Text = \"A module\"
OrderNumber = \"0815\"
Ext_Module_Prm_Data_Len = 4
Ext_User_Prm_Data_Const(0) = 9,8,7,6
Ext_User_Prm_Data_Ref(3) = 1
X_Ext_Module_Prm_Data_Len = 5
X_Ext_User_Prm_Data_Const(1) = 5
X_Ext_User_Prm_Data_Ref(2) = 1
F_Ext_Module_Prm_Data_Len = 6
F_Ext_User_Prm_Data_Const(3) = 4
F_Ext_User_Prm_Data_Ref(5) = 1
F_ParamDescCRC = 0xABCD
F_IO_StructureDescCRC = 0x12345678
Preset = 1
Ident_Maintenance_supp = 1
Subsys_Module_Dir_Index = 40
Diagnostic_Alarm_required = 1
Process_Alarm_required = 1
Pull_Plug_Alarm_required = 1
Status_Alarm_required = 1
Update_Alarm_required = 1
Manufacturer_Specific_Alarm_required = 1
Channel_Diag(20) = \"dirty\"
Channel_Diag_Help(20) = \"wipe\"
Unit_Diag_Bit(5) = \"five\"
Unit_Diag_Area = 8-9
Value(3) = \"three\"
Unit_Diag_Area_End
Data_Area_Beg
Related_CFG_Identifier = 1
IO_Direction = 1
Length = 4
Consistency = 1
Publisher_allowed = 1
DP_Master_allowed = 1
Data_Type = 5,6
Data_Area_End
EndModule
";

#[test]
fn a_description_fits_on_a_page() {
    let gsd = clean(
        "OrderNumber = \"4711\"\nInfo_Text = \"What it is\"\n24V_Pins = 1\nFreeze_Mode_supp = 1\nDPV1_Slave = 1\n\
         C1_Read_Write_supp = 1",
    );
    let page = gsd.summary().to_string();
    let expected = "\
V M, ident number 0x1234, slave
revision 1, hardware 1, software 1, GSD revision 5
order number 4711
What it is
family: general
takes 24 V from the bus connector
baud rates (max Tsdr in tBIT): 9.6 kbit/s (60)
abilities: Freeze
polled at most every 100 µs
diagnosis: up to 64 octets
user parameters: up to 20 octets
modular: up to 8 modules, 100 octets in, 100 out, ? together
DP-V1: class 1 read and write
modules: 1
  first: 1 in, 0 out (10)
";
    assert_eq!(page, expected);
    assert!(clean("").summary().to_string().contains("abilities: none\n"));
}

#[test]
fn a_zero_that_says_what_holds_anyway_says_so() {
    let general = clean("Repeater_Ctrl_Sig = 0\n24V_Pins = 0").general;
    assert_eq!(general.repeater_ctrl_sig, RepeaterCtrlSig::NotConnected);
    assert_eq!(general.pins_24v, Pins24V::NotConnected);
}

#[test]
fn the_reference_of_a_module_is_a_number_alone_or_a_keyword() {
    let reference = |line: &str| {
        let gsd = clean(&format!("Module = \"a\" 0x20\n{line}\nEndModule"));
        gsd.modules[1].reference
    };
    assert_eq!(reference("7"), Some(7));
    assert_eq!(reference("Module_Reference = 7"), Some(7));
}

#[test]
fn keywords_of_modules() {
    let at = |field: &str| format!("/modules/1{field}");
    let table = [
        ("/name", json!("Everything")),
        ("/reference", json!(65_535)),
        ("/config", json!([0x42, 0x83, 1, 2])),
        ("/info_text", json!("A module")),
        ("/order_number", json!("0815")),
        ("/prm/len", json!(4)),
        ("/prm/constants/0", json!({ "offset": 0, "octets": [9, 8, 7, 6] })),
        ("/prm/places/0", json!({ "offset": 3, "reference": 1 })),
        ("/extended_prm/len", json!(5)),
        ("/extended_prm/constants/0", json!({ "offset": 1, "octets": [5] })),
        ("/extended_prm/places/0", json!({ "offset": 2, "reference": 1 })),
        ("/failsafe_prm/len", json!(6)),
        ("/failsafe_prm/constants/0", json!({ "offset": 3, "octets": [4] })),
        ("/failsafe_prm/places/0", json!({ "offset": 5, "reference": 1 })),
        ("/f_param_desc_crc", json!(0xABCD)),
        ("/f_io_structure_desc_crc", json!(0x1234_5678)),
        ("/preset", json!(true)),
        ("/ident_maintenance_supp", json!(true)),
        ("/subsys_module_dir_index", json!(40)),
        ("/alarms_required/diagnostic", json!(true)),
        ("/alarms_required/process", json!(true)),
        ("/alarms_required/pull_plug", json!(true)),
        ("/alarms_required/status", json!(true)),
        ("/alarms_required/update", json!(true)),
        ("/alarms_required/manufacturer_specific", json!(true)),
        ("/channel_diag/20", json!({ "text": "dirty", "help": "wipe" })),
        ("/unit_diag/bits/5", json!({ "text": "five", "help": null })),
        ("/unit_diag/areas/0/values/3/text", json!("three")),
        ("/data_areas/0/related_cfg_identifier", json!(1)),
        ("/data_areas/0/io_direction", json!(1)),
        ("/data_areas/0/length", json!(4)),
        ("/data_areas/0/consistency", json!(1)),
        ("/data_areas/0/publisher_allowed", json!(true)),
        ("/data_areas/0/dp_master_allowed", json!(true)),
        ("/data_areas/0/data_type", json!([5, 6])),
    ];
    for (field, expected) in table {
        check(&[(MODULE, &at(field), expected)]);
    }
    // What stands in the module does not stand in the station.
    let gsd = with(MODULE).gsd;
    assert!(gsd.channel_diag.is_empty() && gsd.unit_diag.is_empty() && gsd.prm.is_empty());
    assert_eq!(gsd.general.info_text, None);
    // Inputs of four octets, special format: no outputs.
    let lengths = gsd.modules[1].lengths().unwrap();
    assert_eq!((lengths.inputs, lengths.outputs), (4, 0));
}

#[test]
fn parameters_of_set_ext_prm_and_profisafe_of_the_station() {
    let parameter = "ExtUserPrmData = 1 \"p\"\nUnsigned8 0\nEndExtUserPrmData\nExt_User_Prm_Data_Ref(0) = 1\n";
    check(&[
        (
            &format!("{parameter}X_Ext_User_Prm_Data_Const(7) = 1"),
            "/extended_prm/constants/0",
            json!({ "offset": 7, "octets": [1] }),
        ),
        (
            &format!("{parameter}X_Ext_User_Prm_Data_Ref(8) = 1"),
            "/extended_prm/places/0",
            json!({ "offset": 8, "reference": 1 }),
        ),
        (
            &format!("{parameter}F_Ext_User_Prm_Data_Const(9) = 1"),
            "/failsafe_prm/constants/0",
            json!({ "offset": 9, "octets": [1] }),
        ),
        (
            &format!("{parameter}F_Ext_User_Prm_Data_Ref(10) = 1"),
            "/failsafe_prm/places/0",
            json!({ "offset": 10, "reference": 1 }),
        ),
    ]);
}

#[test]
fn slots() {
    let slots = "\
Module = \"second\" 0x20
2
EndModule
Module = \"third\" 0x20
3
EndModule
SlotDefinition
Slot(1) = \"Left\" 2 2-3
Slot(2) = \"Right\" 3 2,3
EndSlotDefinition
";
    check(&[
        (
            slots,
            "/slots/0",
            json!({ "number": 1, "name": "Left", "default": 2, "allowed": [[2, 3]] }),
        ),
        (
            slots,
            "/slots/1",
            json!({ "number": 2, "name": "Right", "default": 3, "allowed": [[2, 2], [3, 3]] }),
        ),
    ]);
}

#[test]
fn texts_of_the_diagnosis() {
    let area = "Unit_Diag_Area = 16-23\nValue(0) = \"fine\"\nValue(17) = \"bad\"\nValue_Help(17) = \"mend\"\nUnit_Diag_Area_End";
    let kind = "\
UnitDiagType = 129
X_Unit_Diag_Bit(24) = \"on\"
X_Unit_Diag_Bit_Help(24) = \"why\"
X_Unit_Diag_Not_Bit(25) = \"off\"
X_Unit_Diag_Not_Bit_Help(25) = \"why not\"
X_Unit_Diag_Area = 32-33
X_Value(2) = \"two\"
X_Value_Help(2) = \"to do\"
X_Unit_Diag_Area_End
EndUnitDiagType
";
    let text = |text: &str, help: &str| json!({ "text": text, "help": help });
    check(&[
        ("Unit_Diag_Bit(0) = \"zero\"", "/unit_diag/bits/0/text", json!("zero")),
        (
            "Unit_Diag_Bit_Help(0) = \"help\"",
            "/unit_diag/bits/0/help",
            json!("help"),
        ),
        (
            "Unit_Diag_Not_Bit(1) = \"not\"",
            "/unit_diag/not_bits/1/text",
            json!("not"),
        ),
        (
            "Unit_Diag_Not_Bit_Help(1) = \"help\"",
            "/unit_diag/not_bits/1/help",
            json!("help"),
        ),
        ("X_Unit_Diag_Bit(2) = \"x\"", "/unit_diag/bits/2/text", json!("x")),
        (area, "/unit_diag/areas/0/first", json!(16)),
        (area, "/unit_diag/areas/0/last", json!(23)),
        (area, "/unit_diag/areas/0/values/0/text", json!("fine")),
        (area, "/unit_diag/areas/0/values/17", text("bad", "mend")),
        ("Channel_Diag(16) = \"first\"", "/channel_diag/16/text", json!("first")),
        (
            "Channel_Diag_Help(31) = \"help\"",
            "/channel_diag/31/help",
            json!("help"),
        ),
        (kind, "/unit_diag_types/129/bits/24", text("on", "why")),
        (kind, "/unit_diag_types/129/not_bits/25", text("off", "why not")),
        (kind, "/unit_diag_types/129/areas/0/first", json!(32)),
        (kind, "/unit_diag_types/129/areas/0/values/2", text("two", "to do")),
    ]);
}

#[test]
fn blocks_that_are_kept_by_name() {
    let gsd = clean(
        "Jokerblock_Type = 5\nAnything(1) = 2\nMax_Module = 3\nEnd_Jokerblock_Type\n\
         Version_Firmware_Download\nNext\nEnd_Version_Firmware_Download\n",
    );
    let kept: Vec<_> = gsd
        .other
        .iter()
        .map(|other| (other.block.as_deref(), other.keyword.as_str(), other.value.as_deref()))
        .collect();
    assert_eq!(
        kept,
        [
            (Some("Jokerblock_Type"), "Anything(1)", Some("2")),
            (Some("Jokerblock_Type"), "Max_Module", Some("3")),
            (Some("Version_Firmware_Download"), "Next", None),
        ]
    );
    assert_eq!(gsd.slave.max_module, Some(8));
}

#[test]
fn keywords_that_are_younger_than_the_file_are_told() {
    let text = SLAVE.replace("GSD_Revision = 5", "GSD_Revision = 1");
    let complaint = |statement: &str| {
        let reading = gsd::parse(format!("{text}{statement}").as_bytes());
        reading
            .diagnostics
            .into_iter()
            .map(|remark| remark.message)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        complaint("DPV1_Slave = 1"),
        ["`DPV1_Slave` came with GSD revision 2, the file says 1"]
    );
    assert_eq!(
        complaint("WD_Base_1ms_supp = 1"),
        ["`WD_Base_1ms_supp` came with GSD revision 3, the file says 1"]
    );
    assert_eq!(complaint("Fail_Safe = 1"), [""; 0]);
    assert_eq!(complaints("DPV1_Slave = 1"), [""; 0]);
}

/// Main families of `Slave_Family`: GSD specification, revision 5, table of main families.
#[test]
fn main_families_have_their_numbers() {
    let families = [
        (MainFamily::General, "general"),
        (MainFamily::Drives, "drives"),
        (MainFamily::SwitchingDevices, "switching devices"),
        (MainFamily::Io, "I/O"),
        (MainFamily::Valves, "valves"),
        (MainFamily::Controllers, "controllers"),
        (MainFamily::Hmi, "operating and monitoring"),
        (MainFamily::Encoders, "encoders"),
        (MainFamily::NcRc, "NC/RC"),
        (MainFamily::Gateway, "gateway"),
        (MainFamily::Plc, "PLC"),
        (MainFamily::IdentSystems, "ident systems"),
        (MainFamily::Pa, "PROFIBUS PA"),
        (MainFamily::Other(13), "family 13"),
    ];
    for (number, (family, shown)) in (0..).zip(families) {
        assert_eq!(MainFamily::from_number(number), family);
        assert_eq!(family.to_string(), shown);
    }
}

#[test]
fn a_module_is_found_by_its_name() {
    let gsd = crate::bench::read(crate::bench::MODULAR);
    assert_eq!(gsd.module("DI 8").map(|module| module.name.as_str()), Some("DI 8"));
    assert!(gsd.module("DI 9").is_none());
}

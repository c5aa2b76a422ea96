//! The keywords with one value: name, first revision, type, range, and the field they fill.
//!
//! Source: guideline "Specification for PROFIBUS Device Description and Device Integration, Volume 1: GSD", versions 4.1 and 5.1.

use super::device::{Gsd, Pins24V, ProtocolIdent, RepeaterCtrlSig, StationType};

/// A keyword with one value, outside of blocks.
pub(super) struct Keyword {
    pub(super) name: &'static str,
    /// First revision of the language with it; 0 also where the revision is not known for certain.
    pub(super) since: u8,
    pub(super) kind: Kind,
}

/// Type and range of the value, and where it goes.
pub(super) enum Kind {
    /// 0 or 1.
    Flag(fn(&mut Gsd) -> &mut bool),
    U8(u8, u8, fn(&mut Gsd) -> &mut Option<u8>),
    U16(u16, u16, fn(&mut Gsd) -> &mut Option<u16>),
    U32(fn(&mut Gsd) -> &mut Option<u32>),
    /// A number up to this one with a meaning.
    Code(u8, fn(&mut Gsd, u8)),
    /// A text of so many characters at most.
    Text(usize, fn(&mut Gsd) -> &mut Option<String>),
    /// A list of octets.
    Octets(fn(&mut Gsd) -> &mut Option<Vec<u8>>),
    /// Number and names of the slave family.
    Family,
}

/// The keyword of this name, in any case.
pub(super) fn find(name: &str) -> Option<&'static Keyword> {
    KEYWORDS.iter().find(|keyword| keyword.name.eq_ignore_ascii_case(name))
}

const fn keyword(name: &'static str, since: u8, kind: Kind) -> Keyword {
    Keyword { name, since, kind }
}

use Kind::{Code, Family, Flag, Octets, Text, U8, U16, U32};

#[rustfmt::skip]
static KEYWORDS: &[Keyword] = &[
    // General
    keyword("GSD_Revision", 1, U8(0, u8::MAX, |gsd| &mut gsd.general.gsd_revision)),
    keyword("Vendor_Name", 0, Text(32, |gsd| &mut gsd.general.vendor_name)),
    keyword("Model_Name", 0, Text(32, |gsd| &mut gsd.general.model_name)),
    keyword("Revision", 0, Text(32, |gsd| &mut gsd.general.revision)),
    keyword("Revision_Number", 1, U8(1, 63, |gsd| &mut gsd.general.revision_number)),
    keyword("Ident_Number", 0, U16(0, u16::MAX, |gsd| &mut gsd.general.ident_number)),
    keyword("Protocol_Ident", 0, Code(u8::MAX, |gsd, code| gsd.general.protocol_ident = match code {
        0 => ProtocolIdent::Dp,
        other => ProtocolIdent::Other(other),
    })),
    keyword("Station_Type", 0, Code(u8::MAX, |gsd, code| gsd.general.station_type = match code {
        0 => StationType::Slave,
        1 => StationType::Master,
        other => StationType::Other(other),
    })),
    keyword("FMS_supp", 0, Flag(|gsd| &mut gsd.general.fms_supp)),
    keyword("Hardware_Release", 0, Text(32, |gsd| &mut gsd.general.hardware_release)),
    keyword("Software_Release", 0, Text(32, |gsd| &mut gsd.general.software_release)),
    keyword("Redundancy", 0, Flag(|gsd| &mut gsd.general.redundancy)),
    keyword("Repeater_Ctrl_Sig", 0, Code(2, |gsd, code| gsd.general.repeater_ctrl_sig = match code {
        0 => RepeaterCtrlSig::NotConnected,
        1 => RepeaterCtrlSig::Rs485,
        _ => RepeaterCtrlSig::Ttl,
    })),
    keyword("24V_Pins", 0, Code(2, |gsd, code| gsd.general.pins_24v = match code {
        0 => Pins24V::NotConnected,
        1 => Pins24V::Input,
        _ => Pins24V::Output,
    })),
    keyword("Implementation_Type", 1, Text(32, |gsd| &mut gsd.general.implementation_type)),
    keyword("Bitmap_Device", 1, Text(8, |gsd| &mut gsd.general.bitmap_device)),
    keyword("Bitmap_Diag", 1, Text(8, |gsd| &mut gsd.general.bitmap_diag)),
    keyword("Bitmap_SF", 1, Text(8, |gsd| &mut gsd.general.bitmap_sf)),
    keyword("OrderNumber", 0, Text(32, |gsd| &mut gsd.general.order_number)),
    keyword("Info_Text", 3, Text(256, |gsd| &mut gsd.general.info_text)),
    keyword("Family_Name", 0, Text(32, |gsd| &mut gsd.general.family_name)),
    keyword("Physical_Layer", 2, U8(0, u8::MAX, |gsd| &mut gsd.general.physical_layer)),

    // Master
    keyword("Master_Freeze_Mode_supp", 3, Flag(|gsd| &mut gsd.master.master_freeze_mode_supp)),
    keyword("Master_Sync_Mode_supp", 3, Flag(|gsd| &mut gsd.master.master_sync_mode_supp)),
    keyword("Master_Fail_Safe_supp", 3, Flag(|gsd| &mut gsd.master.master_fail_safe_supp)),
    keyword("Download_supp", 0, Flag(|gsd| &mut gsd.master.download_supp)),
    keyword("Upload_supp", 0, Flag(|gsd| &mut gsd.master.upload_supp)),
    keyword("Act_Para_Brct_supp", 0, Flag(|gsd| &mut gsd.master.act_para_brct_supp)),
    keyword("Act_Param_supp", 0, Flag(|gsd| &mut gsd.master.act_param_supp)),
    keyword("Max_MPS_Length", 0, U32(|gsd| &mut gsd.master.max_mps_length)),
    keyword("Max_Lsdu_MS", 0, U8(0, u8::MAX, |gsd| &mut gsd.master.max_lsdu_ms)),
    keyword("Max_Lsdu_MM", 0, U8(0, u8::MAX, |gsd| &mut gsd.master.max_lsdu_mm)),
    keyword("Min_Poll_Timeout", 0, U16(0, u16::MAX, |gsd| &mut gsd.master.min_poll_timeout)),
    keyword("LAS_Len", 0, U8(0, u8::MAX, |gsd| &mut gsd.master.las_len)),
    keyword("Max_Slaves_supp", 0, U8(0, u8::MAX, |gsd| &mut gsd.master.max_slaves_supp)),
    keyword("Max_Master_Input_Len", 1, U8(0, 244, |gsd| &mut gsd.master.max_master_input_len)),
    keyword("Max_Master_Output_Len", 1, U8(0, 244, |gsd| &mut gsd.master.max_master_output_len)),
    keyword("Max_Master_Data_Len", 1, U16(0, 488, |gsd| &mut gsd.master.max_master_data_len)),
    keyword("DPV1_Master", 2, Flag(|gsd| &mut gsd.master.dpv1_master)),
    keyword("DPV1_Conformance_Class", 3, U8(0, u8::MAX, |gsd| &mut gsd.master.dpv1_conformance_class)),
    keyword("C1_Master_Read_Write_supp", 3, Flag(|gsd| &mut gsd.master.c1_master_read_write_supp)),
    keyword("Master_DPV1_Alarm_supp", 3, Flag(|gsd| &mut gsd.master.master_dpv1_alarm_supp)),
    keyword("Master_Diagnostic_Alarm_supp", 3, Flag(|gsd| &mut gsd.master.alarms.diagnostic)),
    keyword("Master_Process_Alarm_supp", 3, Flag(|gsd| &mut gsd.master.alarms.process)),
    keyword("Master_Pull_Plug_Alarm_supp", 3, Flag(|gsd| &mut gsd.master.alarms.pull_plug)),
    keyword("Master_Status_Alarm_supp", 3, Flag(|gsd| &mut gsd.master.alarms.status)),
    keyword("Master_Update_Alarm_supp", 3, Flag(|gsd| &mut gsd.master.alarms.update)),
    keyword("Master_Manufacturer_Specific_Alarm_supp", 3, Flag(|gsd| &mut gsd.master.alarms.manufacturer_specific)),
    keyword("Master_Extra_Alarm_SAP_supp", 3, Flag(|gsd| &mut gsd.master.master_extra_alarm_sap_supp)),
    keyword("Master_Alarm_Sequence_Mode", 3, U8(0, 32, |gsd| &mut gsd.master.master_alarm_sequence_mode)),
    keyword("Master_Alarm_Type_Mode_supp", 3, Flag(|gsd| &mut gsd.master.master_alarm_type_mode_supp)),
    keyword("Isochron_Mode_Synchronised", 0, U8(0, u8::MAX, |gsd| &mut gsd.master.isochron_mode_synchronised)),
    keyword("DXB_Master_supp", 0, Flag(|gsd| &mut gsd.master.dxb_master_supp)),
    keyword("X_Master_Prm_SAP_supp", 0, Flag(|gsd| &mut gsd.master.x_master_prm_sap_supp)),

    // Slave, DP-V0
    keyword("Freeze_Mode_supp", 0, Flag(|gsd| &mut gsd.slave.freeze_mode_supp)),
    keyword("Sync_Mode_supp", 0, Flag(|gsd| &mut gsd.slave.sync_mode_supp)),
    keyword("Auto_Baud_supp", 0, Flag(|gsd| &mut gsd.slave.auto_baud_supp)),
    keyword("Set_Slave_Add_supp", 0, Flag(|gsd| &mut gsd.slave.set_slave_add_supp)),
    keyword("User_Prm_Data_Len", 0, U8(0, 237, |gsd| &mut gsd.slave.user_prm_data_len)),
    keyword("User_Prm_Data", 0, Octets(|gsd| &mut gsd.slave.user_prm_data)),
    keyword("Min_Slave_Intervall", 0, U16(0, u16::MAX, |gsd| &mut gsd.slave.min_slave_intervall)),
    keyword("Modular_Station", 0, Flag(|gsd| &mut gsd.slave.modular_station)),
    keyword("FixPresetModules", 0, Flag(|gsd| &mut gsd.slave.fix_preset_modules)),
    keyword("Max_Module", 0, U8(0, u8::MAX, |gsd| &mut gsd.slave.max_module)),
    keyword("Max_Input_Len", 0, U8(0, 244, |gsd| &mut gsd.slave.max_input_len)),
    keyword("Max_Output_Len", 0, U8(0, 244, |gsd| &mut gsd.slave.max_output_len)),
    keyword("Max_Data_Len", 0, U16(0, 488, |gsd| &mut gsd.slave.max_data_len)),
    keyword("Fail_Safe", 1, Flag(|gsd| &mut gsd.slave.fail_safe)),
    keyword("Fail_Safe_required", 3, Flag(|gsd| &mut gsd.slave.fail_safe_required)),
    keyword("Max_Diag_Data_Len", 1, U8(6, 244, |gsd| &mut gsd.slave.max_diag_data_len)),
    keyword("Modul_Offset", 1, Code(u8::MAX, |gsd, code| gsd.slave.modul_offset = code)),
    keyword("Slave_Family", 1, Family),
    keyword("Diag_Update_Delay", 3, U8(0, u8::MAX, |gsd| &mut gsd.slave.diag_update_delay)),
    keyword("Max_User_Prm_Data_Len", 1, U8(0, 237, |gsd| &mut gsd.prm.len)),
    keyword("Ident_Maintenance_supp", 0, Flag(|gsd| &mut gsd.slave.ident_maintenance_supp)),
    keyword("Time_Sync_supp", 0, Flag(|gsd| &mut gsd.slave.time_sync_supp)),
    keyword("Max_iParameter_Size", 0, U32(|gsd| &mut gsd.slave.max_i_parameter_size)),
    keyword("Slave_Redundancy_supp", 0, U8(0, u8::MAX, |gsd| &mut gsd.slave.slave_redundancy_supp)),
    keyword("Slave_Max_Switch_Over_Time", 0, U16(0, u16::MAX, |gsd| &mut gsd.slave.slave_max_switch_over_time)),
    keyword("Prm_Block_Structure_supp", 0, Flag(|gsd| &mut gsd.slave.prm_block_structure_supp)),
    keyword("Prm_Block_Structure_req", 0, Flag(|gsd| &mut gsd.slave.prm_block_structure_req)),
    keyword("Jokerblock_Slot", 0, U8(0, u8::MAX, |gsd| &mut gsd.slave.jokerblock_slot)),
    keyword("Jokerblock_Location", 0, U8(0, u8::MAX, |gsd| &mut gsd.slave.jokerblock_location)),
    keyword("PrmCmd_supp", 0, Flag(|gsd| &mut gsd.slave.prm_cmd_supp)),
    keyword("X_Prm_SAP_supp", 0, Flag(|gsd| &mut gsd.slave.x_prm_sap_supp)),
    keyword("X_Max_User_Prm_Data_Len", 0, U8(0, 244, |gsd| &mut gsd.extended_prm.len)),
    keyword("X_Prm_Block_Structure_supp", 0, Flag(|gsd| &mut gsd.slave.x_prm_block_structure_supp)),
    keyword("Subsys_Dir_Index", 0, U16(0, u16::MAX, |gsd| &mut gsd.slave.subsys_dir_index)),

    // Slave, DP-V1
    keyword("DPV1_Slave", 2, Flag(|gsd| &mut gsd.dpv1.dpv1_slave)),
    keyword("C1_Read_Write_supp", 3, Flag(|gsd| &mut gsd.dpv1.c1_read_write_supp)),
    keyword("C1_Read_Write_required", 3, Flag(|gsd| &mut gsd.dpv1.c1_read_write_required)),
    keyword("C1_Max_Data_Len", 3, U8(0, 240, |gsd| &mut gsd.dpv1.c1_max_data_len)),
    keyword("C1_Response_Timeout", 3, U16(0, u16::MAX, |gsd| &mut gsd.dpv1.c1_response_timeout)),
    keyword("C2_Read_Write_supp", 3, Flag(|gsd| &mut gsd.dpv1.c2_read_write_supp)),
    keyword("C2_Read_Write_required", 3, Flag(|gsd| &mut gsd.dpv1.c2_read_write_required)),
    keyword("C2_Max_Data_Len", 3, U8(0, 240, |gsd| &mut gsd.dpv1.c2_max_data_len)),
    keyword("C2_Response_Timeout", 3, U16(0, u16::MAX, |gsd| &mut gsd.dpv1.c2_response_timeout)),
    keyword("C2_Max_Count_Channels", 3, U8(0, u8::MAX, |gsd| &mut gsd.dpv1.c2_max_count_channels)),
    keyword("Max_Initiate_PDU_Length", 3, U8(0, u8::MAX, |gsd| &mut gsd.dpv1.max_initiate_pdu_length)),
    keyword("Alarm_supported", 2, U8(0, u8::MAX, |gsd| &mut gsd.dpv1.alarm_supported)),
    keyword("Diagnostic_Alarm_supp", 3, Flag(|gsd| &mut gsd.dpv1.alarms_supp.diagnostic)),
    keyword("Process_Alarm_supp", 3, Flag(|gsd| &mut gsd.dpv1.alarms_supp.process)),
    keyword("Pull_Plug_Alarm_supp", 3, Flag(|gsd| &mut gsd.dpv1.alarms_supp.pull_plug)),
    keyword("Status_Alarm_supp", 3, Flag(|gsd| &mut gsd.dpv1.alarms_supp.status)),
    keyword("Update_Alarm_supp", 3, Flag(|gsd| &mut gsd.dpv1.alarms_supp.update)),
    keyword("Manufacturer_Specific_Alarm_supp", 3, Flag(|gsd| &mut gsd.dpv1.alarms_supp.manufacturer_specific)),
    keyword("Diagnostic_Alarm_required", 3, Flag(|gsd| &mut gsd.dpv1.alarms_required.diagnostic)),
    keyword("Process_Alarm_required", 3, Flag(|gsd| &mut gsd.dpv1.alarms_required.process)),
    keyword("Pull_Plug_Alarm_required", 3, Flag(|gsd| &mut gsd.dpv1.alarms_required.pull_plug)),
    keyword("Status_Alarm_required", 3, Flag(|gsd| &mut gsd.dpv1.alarms_required.status)),
    keyword("Update_Alarm_required", 3, Flag(|gsd| &mut gsd.dpv1.alarms_required.update)),
    keyword("Manufacturer_Specific_Alarm_required", 3, Flag(|gsd| &mut gsd.dpv1.alarms_required.manufacturer_specific)),
    keyword("Extra_Alarm_SAP_supp", 3, Flag(|gsd| &mut gsd.dpv1.extra_alarm_sap_supp)),
    keyword("Alarm_Sequence_Mode_Count", 3, U8(0, 32, |gsd| &mut gsd.dpv1.alarm_sequence_mode_count)),
    keyword("Alarm_Type_Mode_supp", 3, Flag(|gsd| &mut gsd.dpv1.alarm_type_mode_supp)),
    keyword("DPV1_Data_Types", 3, Flag(|gsd| &mut gsd.dpv1.dpv1_data_types)),
    keyword("WD_Base_1ms_supp", 3, Flag(|gsd| &mut gsd.dpv1.wd_base_1ms_supp)),
    keyword("Check_Cfg_Mode", 3, Flag(|gsd| &mut gsd.dpv1.check_cfg_mode)),

    // Slave, data exchange broadcast
    keyword("Publisher_supp", 0, Flag(|gsd| &mut gsd.dxb.publisher_supp)),
    keyword("Subscriber_supp", 0, Flag(|gsd| &mut gsd.dxb.subscriber_supp)),
    keyword("DXB_Max_Link_Count", 0, U8(0, 125, |gsd| &mut gsd.dxb.dxb_max_link_count)),
    keyword("DXB_Max_Data_Length", 0, U8(0, 244, |gsd| &mut gsd.dxb.dxb_max_data_length)),
    keyword("DXB_Subscribertable_Block_Location", 0, U8(0, 1, |gsd| &mut gsd.dxb.dxb_subscribertable_block_location)),

    // Slave, isochronous mode
    keyword("Isochron_Mode_supp", 0, Flag(|gsd| &mut gsd.isochron.isochron_mode_supp)),
    keyword("Isochron_Mode_required", 0, Flag(|gsd| &mut gsd.isochron.isochron_mode_required)),
    keyword("TBASE_DP", 0, U32(|gsd| &mut gsd.isochron.tbase_dp)),
    keyword("TDP_MIN", 0, U16(0, u16::MAX, |gsd| &mut gsd.isochron.tdp_min)),
    keyword("TDP_MAX", 0, U16(0, u16::MAX, |gsd| &mut gsd.isochron.tdp_max)),
    keyword("T_PLL_W_MIN", 0, U16(0, u16::MAX, |gsd| &mut gsd.isochron.t_pll_w_min)),
    keyword("T_PLL_W_MAX", 0, U16(0, u16::MAX, |gsd| &mut gsd.isochron.t_pll_w_max)),
    keyword("TBASE_IO", 0, U32(|gsd| &mut gsd.isochron.tbase_io)),
    keyword("TI_MIN", 0, U16(0, u16::MAX, |gsd| &mut gsd.isochron.ti_min)),
    keyword("TO_MIN", 0, U16(0, u16::MAX, |gsd| &mut gsd.isochron.to_min)),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_keyword_is_in_the_table_twice() {
        for (place, keyword) in KEYWORDS.iter().enumerate() {
            let first = KEYWORDS
                .iter()
                .position(|other| other.name.eq_ignore_ascii_case(keyword.name));
            assert_eq!(first, Some(place), "{}", keyword.name);
        }
    }
}

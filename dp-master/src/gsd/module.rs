//! Modules and the slots they go into.

use std::collections::BTreeMap;

use serde::Serialize;

use super::diagnostic::Position;
use super::prm::{PrmLayout, ValueSet};
use super::unit_diag::{DiagText, UnitDiag};
use crate::dp::v1::AlarmTypes;
use crate::dp::{CfgError, IoLengths, io_lengths};

/// A module, or for a slave that is not modular the whole device (`Module`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Module {
    /// Name; the key by which people choose it.
    pub name: String,
    /// Number by which slots refer to it (`Module_Reference`).
    pub reference: Option<u16>,
    /// Identifier octets for Chk_Cfg.
    pub config: Vec<u8>,
    /// What it is.
    pub info_text: Option<String>,
    /// Order number.
    pub order_number: Option<String>,
    /// Its part of the user parameters.
    pub prm: PrmLayout,
    /// Its part of Set_Ext_Prm (`X_Ext_User_Prm_Data_…`).
    pub extended_prm: PrmLayout,
    /// Its PROFIsafe parameters (`F_Ext_User_Prm_Data_…`).
    pub failsafe_prm: PrmLayout,
    /// Checksum over the description of the PROFIsafe parameters.
    pub f_param_desc_crc: Option<u16>,
    /// Checksum over the description of the PROFIsafe process data.
    pub f_io_structure_desc_crc: Option<u32>,
    /// Texts of its channel faults, 16…31.
    pub channel_diag: BTreeMap<u8, DiagText>,
    /// Texts of its diagnosis.
    pub unit_diag: UnitDiag,
    /// Its process data for data exchange broadcast.
    pub data_areas: Vec<DataArea>,
    /// Alarms without which it does not work.
    pub alarms_required: AlarmKinds,
    /// It is plugged when a station is put into a project (`Preset`).
    pub preset: bool,
    /// It has identification and maintenance data.
    pub ident_maintenance_supp: bool,
    /// Index of its subsystem directory.
    pub subsys_module_dir_index: Option<u16>,
    #[serde(skip)]
    pub(super) at: Position,
}

impl Module {
    pub(super) fn new(name: String, config: Vec<u8>, at: Position) -> Self {
        Self {
            name,
            reference: None,
            config,
            info_text: None,
            order_number: None,
            prm: PrmLayout::default(),
            extended_prm: PrmLayout::default(),
            failsafe_prm: PrmLayout::default(),
            f_param_desc_crc: None,
            f_io_structure_desc_crc: None,
            channel_diag: BTreeMap::new(),
            unit_diag: UnitDiag::default(),
            data_areas: Vec::new(),
            alarms_required: AlarmKinds::default(),
            preset: false,
            ident_maintenance_supp: false,
            subsys_module_dir_index: None,
            at,
        }
    }

    /// Input and output lengths in octets.
    ///
    /// # Errors
    ///
    /// [`CfgError`] when the identifier octets are none; the reader has reported it.
    pub fn lengths(&self) -> Result<IoLengths, CfgError> {
        io_lengths(&self.config)
    }
}

/// Kinds of alarms of DP-V1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct AlarmKinds {
    /// Diagnostic_Alarm.
    pub diagnostic: bool,
    /// Process_Alarm.
    pub process: bool,
    /// Pull_Alarm and Plug_Alarm.
    pub pull_plug: bool,
    /// Status_Alarm.
    pub status: bool,
    /// Update_Alarm.
    pub update: bool,
    /// Alarms of the manufacturer.
    pub manufacturer_specific: bool,
}

impl AlarmKinds {
    /// The bits of DPV1_Status_2 that enable them.
    pub fn types(&self) -> AlarmTypes {
        let bits = [
            (self.diagnostic, AlarmTypes::DIAGNOSIS),
            (self.process, AlarmTypes::PROCESS),
            (self.pull_plug, AlarmTypes::PULL_PLUG),
            (self.status, AlarmTypes::STATUS),
            (self.update, AlarmTypes::UPDATE),
            (self.manufacturer_specific, AlarmTypes::VENDOR),
        ];
        let set = bits.into_iter().filter(|&(is_set, _)| is_set);
        set.fold(AlarmTypes::NONE, |sum, (_, bit)| sum.with(bit))
    }

    /// The kinds that these bits of DPV1_Status_2 enable.
    pub fn of_types(types: AlarmTypes) -> Self {
        Self {
            diagnostic: types.contains_all(AlarmTypes::DIAGNOSIS),
            process: types.contains_all(AlarmTypes::PROCESS),
            pull_plug: types.contains_all(AlarmTypes::PULL_PLUG),
            status: types.contains_all(AlarmTypes::STATUS),
            update: types.contains_all(AlarmTypes::UPDATE),
            manufacturer_specific: types.contains_all(AlarmTypes::VENDOR),
        }
    }
}

/// Process data of a module that other slaves may receive (`Data_Area_Beg`).
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct DataArea {
    /// Identifier octet of the module it belongs to, counted from 1.
    pub related_cfg_identifier: Option<u8>,
    /// 0 output, 1 input.
    pub io_direction: Option<u8>,
    /// Octets.
    pub length: Option<u8>,
    /// 0 by octet or word, 1 over the whole length.
    pub consistency: Option<u8>,
    /// Other slaves may be its source.
    pub publisher_allowed: bool,
    /// The master may be its source.
    pub dp_master_allowed: bool,
    /// Data types in their order.
    pub data_type: Vec<u8>,
}

/// A slot and the modules that go into it (`Slot`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Slot {
    /// Number, from 1.
    pub number: u8,
    /// Name.
    pub name: String,
    /// Reference of the module that is in it unless another one is chosen.
    pub default: u16,
    /// References of the modules that may be in it.
    pub allowed: ValueSet,
    #[serde(skip)]
    pub(super) at: Position,
}

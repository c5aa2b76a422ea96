//! The description of a device: everything a GSD file says, by subject.
//!
//! Fields are named as their keywords. A keyword with a default in the guideline (a Boolean is 0) is a plain field, others are `None` when
//! the file does not say them.

use core::fmt;
use std::collections::BTreeMap;

use serde::Serialize;

use super::diagnostic::Position;
use super::module::{AlarmKinds, Module, Slot};
use super::prm::{Parameter, PrmLayout, PrmText};
use super::unit_diag::{DiagText, UnitDiag};
use crate::fdl::BusParams;
use crate::time::{Baud, BitTimes};

/// A device as its GSD file describes it.
///
/// [`parse`](super::parse) makes one, [`configure`](Self::configure) starts a project with it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Gsd {
    /// Who it is.
    pub general: General,
    /// The baud rates the file mentions.
    pub rates: BTreeMap<Rate, RateFeatures>,
    /// Physical interfaces beside the usual one.
    pub physical_interfaces: Vec<PhysicalInterface>,
    /// What a master can do.
    pub master: MasterFeatures,
    /// What a slave can do, DP-V0.
    pub slave: SlaveFeatures,
    /// What a slave can do with DP-V1.
    pub dpv1: Dpv1Features,
    /// Data exchange broadcast.
    pub dxb: DxbFeatures,
    /// Isochronous mode.
    pub isochron: IsochronFeatures,
    /// The station's part of the user parameters.
    pub prm: PrmLayout,
    /// The station's part of Set_Ext_Prm.
    pub extended_prm: PrmLayout,
    /// The station's PROFIsafe parameters.
    pub failsafe_prm: PrmLayout,
    /// Texts for values of parameters, by reference.
    pub prm_texts: BTreeMap<u16, PrmText>,
    /// Parameters, by reference.
    pub parameters: BTreeMap<u16, Parameter>,
    /// Modules in the file's order.
    pub modules: Vec<Module>,
    /// Slots in the file's order; empty when any module may be anywhere.
    pub slots: Vec<Slot>,
    /// Texts of the device-related diagnosis.
    pub unit_diag: UnitDiag,
    /// The same for a kind of alarm or status (`UnitDiagType`), by the first octet of a DP-V1 block.
    pub unit_diag_types: BTreeMap<u16, UnitDiag>,
    /// Texts of channel faults of the manufacturer, 16…31.
    pub channel_diag: BTreeMap<u8, DiagText>,
    /// Keywords that the guideline does not know, and those of blocks that are kept as they are.
    pub other: Vec<OtherKeyword>,
    /// What follows other `#` lines.
    pub sections: Vec<Section>,
}

impl Gsd {
    /// Whether the device is a slave.
    pub fn is_slave(&self) -> bool {
        !matches!(self.general.station_type, StationType::Master)
    }

    /// The longest time from a request to its reply at `baud`: the file's, else the standard's.
    pub fn max_tsdr(&self, baud: Baud) -> BitTimes {
        self.rates
            .get(&Rate::from(baud))
            .and_then(|rate| rate.max_tsdr)
            .map_or(BusParams::standard(baud).t_sdr_max, |bits| BitTimes(bits.into()))
    }

    /// Whether the device works at `baud`.
    pub fn supports(&self, baud: Baud) -> bool {
        self.rates.get(&Rate::from(baud)).is_some_and(|rate| rate.supported)
    }

    /// The first module with this name.
    pub fn module(&self, name: &str) -> Option<&Module> {
        self.modules.iter().find(|module| module.name == name)
    }

    /// The text for a value of a parameter.
    pub fn text_of(&self, parameter: &Parameter, value: i64) -> Option<&str> {
        let texts = self.prm_texts.get(&parameter.text?)?;
        texts.texts.get(&value).map(String::as_str)
    }
}

/// Identity of the device.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct General {
    /// Revision of the GSD language the file is written in; `None` in files older than revision 1.
    pub gsd_revision: Option<u8>,
    /// Maker.
    pub vendor_name: Option<String>,
    /// Device.
    pub model_name: Option<String>,
    /// Revision of the device as text.
    pub revision: Option<String>,
    /// The same as a number.
    pub revision_number: Option<u8>,
    /// Ident number, assigned by the PROFIBUS organisation.
    pub ident_number: Option<u16>,
    /// Protocol.
    pub protocol_ident: ProtocolIdent,
    /// Master or slave.
    pub station_type: StationType,
    /// The device also speaks FMS.
    pub fms_supp: bool,
    /// Hardware release.
    pub hardware_release: Option<String>,
    /// Software release.
    pub software_release: Option<String>,
    /// Redundant transmission.
    pub redundancy: bool,
    /// Level of the connector's pin 4.
    pub repeater_ctrl_sig: RepeaterCtrlSig,
    /// Use of the connector's pins 2 and 7.
    pub pins_24v: Pins24V,
    /// The chip or software it is made with.
    pub implementation_type: Option<String>,
    /// Name of the bitmap of the device.
    pub bitmap_device: Option<String>,
    /// Name of the bitmap of the device with diagnosis.
    pub bitmap_diag: Option<String>,
    /// Name of the bitmap of the device in a special mode.
    pub bitmap_sf: Option<String>,
    /// Order number.
    pub order_number: Option<String>,
    /// What it is.
    pub info_text: Option<String>,
    /// Name of its product family.
    pub family_name: Option<String>,
    /// Physical layer (revision 2): 0 RS 485, 1 IEC 61158-2.
    pub physical_layer: Option<u8>,
}

/// `Protocol_Ident`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum ProtocolIdent {
    /// 0: PROFIBUS DP.
    #[default]
    Dp,
    /// 16…255: of the manufacturer. Others are reserved.
    Other(u8),
}

/// `Station_Type`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum StationType {
    /// 0.
    #[default]
    Slave,
    /// 1: DP master of class 1.
    Master,
    /// Reserved.
    Other(u8),
}

/// `Repeater_Ctrl_Sig`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum RepeaterCtrlSig {
    /// 0.
    #[default]
    NotConnected,
    /// 1.
    Rs485,
    /// 2.
    Ttl,
}

/// `24V_Pins`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum Pins24V {
    /// 0.
    #[default]
    NotConnected,
    /// 1: the device takes 24 V from the connector.
    Input,
    /// 2: the device gives 24 V to the connector.
    Output,
}

/// A baud rate a GSD file can name: the ten of a DP line and that of PROFIBUS PA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Rate {
    /// 9.6 kbit/s.
    B9600,
    /// 19.2 kbit/s.
    B19200,
    /// 31.25 kbit/s, PROFIBUS PA.
    B31250,
    /// 45.45 kbit/s.
    B45450,
    /// 93.75 kbit/s.
    B93750,
    /// 187.5 kbit/s.
    B187500,
    /// 500 kbit/s.
    B500000,
    /// 1.5 Mbit/s.
    B1500000,
    /// 3 Mbit/s.
    B3000000,
    /// 6 Mbit/s.
    B6000000,
    /// 12 Mbit/s.
    B12000000,
}

impl Rate {
    /// All, slowest first.
    pub const ALL: [Self; 11] = [
        Self::B9600,
        Self::B19200,
        Self::B31250,
        Self::B45450,
        Self::B93750,
        Self::B187500,
        Self::B500000,
        Self::B1500000,
        Self::B3000000,
        Self::B6000000,
        Self::B12000000,
    ];

    /// As keywords write it: `9.6`, `1.5M`.
    pub const fn keyword(self) -> &'static str {
        match self {
            Self::B9600 => "9.6",
            Self::B19200 => "19.2",
            Self::B31250 => "31.25",
            Self::B45450 => "45.45",
            Self::B93750 => "93.75",
            Self::B187500 => "187.5",
            Self::B500000 => "500",
            Self::B1500000 => "1.5M",
            Self::B3000000 => "3M",
            Self::B6000000 => "6M",
            Self::B12000000 => "12M",
        }
    }

    /// The baud rate of a DP line; `None` for PROFIBUS PA.
    pub fn baud(self) -> Option<Baud> {
        Baud::ALL.into_iter().find(|&baud| Self::from(baud) == self)
    }
}

impl From<Baud> for Rate {
    fn from(baud: Baud) -> Self {
        match baud {
            Baud::B9600 => Self::B9600,
            Baud::B19200 => Self::B19200,
            Baud::B45450 => Self::B45450,
            Baud::B93750 => Self::B93750,
            Baud::B187500 => Self::B187500,
            Baud::B500000 => Self::B500000,
            Baud::B1500000 => Self::B1500000,
            Baud::B3000000 => Self::B3000000,
            Baud::B6000000 => Self::B6000000,
            Baud::B12000000 => Self::B12000000,
        }
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.keyword().strip_suffix('M') {
            Some(mega) => write!(f, "{mega} Mbit/s"),
            None => write!(f, "{} kbit/s", self.keyword()),
        }
    }
}

/// What the file says about one baud rate; times in tBIT.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct RateFeatures {
    /// `…_supp`.
    pub supported: bool,
    /// `MaxTsdr_…`.
    pub max_tsdr: Option<u16>,
    /// `Trdy_…` of a master.
    pub trdy: Option<u8>,
    /// `Tqui_…` of a master.
    pub tqui: Option<u8>,
    /// `Tset_…` of a master.
    pub tset: Option<u8>,
    /// `Tsdi_…` of a master.
    pub tsdi: Option<u16>,
}

/// A physical interface and the delays it brings (`Physical_Interface`).
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct PhysicalInterface {
    /// Kind as the file says it: 0 RS 485, others in the guideline.
    pub kind: u8,
    /// `Transmission_Delay_…` in tBIT.
    pub transmission_delay: BTreeMap<Rate, u16>,
    /// `Reaction_Delay_…` in tBIT.
    pub reaction_delay: BTreeMap<Rate, u16>,
}

/// What a master of class 1 can do.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct MasterFeatures {
    /// It can Freeze.
    pub master_freeze_mode_supp: bool,
    /// It can Sync.
    pub master_sync_mode_supp: bool,
    /// It can send empty outputs in Clear.
    pub master_fail_safe_supp: bool,
    /// Download.
    pub download_supp: bool,
    /// Upload.
    pub upload_supp: bool,
    /// Act_Para_Brct.
    pub act_para_brct_supp: bool,
    /// Act_Param.
    pub act_param_supp: bool,
    /// Memory for parameter sets in octets.
    pub max_mps_length: Option<u32>,
    /// Longest L_sdu towards slaves.
    pub max_lsdu_ms: Option<u8>,
    /// Longest L_sdu towards masters.
    pub max_lsdu_mm: Option<u8>,
    /// Shortest Poll_Timeout in 10 ms.
    pub min_poll_timeout: Option<u16>,
    /// Entries of the list of active stations.
    pub las_len: Option<u8>,
    /// Slaves it serves.
    pub max_slaves_supp: Option<u8>,
    /// Inputs of a slave it can take.
    pub max_master_input_len: Option<u8>,
    /// Outputs of a slave it can send.
    pub max_master_output_len: Option<u8>,
    /// Both together.
    pub max_master_data_len: Option<u16>,
    /// DP-V1.
    pub dpv1_master: bool,
    /// Conformance class of DP-V1.
    pub dpv1_conformance_class: Option<u8>,
    /// Acyclic reading and writing.
    pub c1_master_read_write_supp: bool,
    /// Alarms.
    pub master_dpv1_alarm_supp: bool,
    /// Which ones.
    pub alarms: AlarmKinds,
    /// Alarm acknowledgement over a service access point of its own.
    pub master_extra_alarm_sap_supp: bool,
    /// Alarms at a time.
    pub master_alarm_sequence_mode: Option<u8>,
    /// One alarm of a kind at a time.
    pub master_alarm_type_mode_supp: bool,
    /// Isochronous mode.
    pub isochron_mode_synchronised: Option<u8>,
    /// Data exchange broadcast.
    pub dxb_master_supp: bool,
    /// Set_Ext_Prm.
    pub x_master_prm_sap_supp: bool,
}

/// What a slave can do, DP-V0.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct SlaveFeatures {
    /// Freeze.
    pub freeze_mode_supp: bool,
    /// Sync.
    pub sync_mode_supp: bool,
    /// It finds the baud rate.
    pub auto_baud_supp: bool,
    /// Its address can be set over the bus.
    pub set_slave_add_supp: bool,
    /// Length of [`user_prm_data`](Self::user_prm_data).
    pub user_prm_data_len: Option<u8>,
    /// User parameters of a file without `Max_User_Prm_Data_Len`.
    pub user_prm_data: Option<Vec<u8>>,
    /// Least time between two polls in 100 µs.
    pub min_slave_intervall: Option<u16>,
    /// Modules can be chosen.
    pub modular_station: bool,
    /// Modules with `Preset` cannot be taken out.
    pub fix_preset_modules: bool,
    /// Most modules.
    pub max_module: Option<u8>,
    /// Most octets of inputs, 0…244.
    pub max_input_len: Option<u8>,
    /// Most octets of outputs, 0…244.
    pub max_output_len: Option<u8>,
    /// Most octets of both, 0…488.
    pub max_data_len: Option<u16>,
    /// Outputs of no octets mean zero.
    pub fail_safe: bool,
    /// The master must be able to send them.
    pub fail_safe_required: bool,
    /// Longest Slave_Diag, 6…244.
    pub max_diag_data_len: Option<u8>,
    /// Number of the first slot in tools (`Modul_Offset`).
    pub modul_offset: u8,
    /// Family for catalogues.
    pub slave_family: Option<SlaveFamily>,
    /// Most polls until Prm and Cfg show in the diagnosis.
    pub diag_update_delay: Option<u8>,
    /// Identification and maintenance data.
    pub ident_maintenance_supp: bool,
    /// Clock synchronisation.
    pub time_sync_supp: bool,
    /// Octets of iParameters (PROFIsafe).
    pub max_i_parameter_size: Option<u32>,
    /// Slave redundancy.
    pub slave_redundancy_supp: Option<u8>,
    /// Longest switch-over in 10 ms.
    pub slave_max_switch_over_time: Option<u16>,
    /// User parameters in blocks are understood.
    pub prm_block_structure_supp: bool,
    /// User parameters must be in blocks.
    pub prm_block_structure_req: bool,
    /// Slot of the joker block.
    pub jokerblock_slot: Option<u8>,
    /// Place of the joker block.
    pub jokerblock_location: Option<u8>,
    /// PrmCmd (redundancy).
    pub prm_cmd_supp: bool,
    /// Set_Ext_Prm.
    pub x_prm_sap_supp: bool,
    /// User parameters of Set_Ext_Prm in blocks.
    pub x_prm_block_structure_supp: bool,
    /// Index of the subsystem directory.
    pub subsys_dir_index: Option<u16>,
}

/// `Slave_Family`: a number and names of sub-families.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SlaveFamily {
    /// Main family.
    pub main: MainFamily,
    /// Names of sub-families, coarse first.
    pub sub: Vec<String>,
}

/// The main families of the guideline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum MainFamily {
    /// 0.
    General,
    /// 1.
    Drives,
    /// 2.
    SwitchingDevices,
    /// 3.
    Io,
    /// 4.
    Valves,
    /// 5.
    Controllers,
    /// 6: operating and monitoring.
    Hmi,
    /// 7.
    Encoders,
    /// 8.
    NcRc,
    /// 9.
    Gateway,
    /// 10.
    Plc,
    /// 11.
    IdentSystems,
    /// 12: profile PROFIBUS PA.
    Pa,
    /// Reserved.
    Other(u8),
}

impl MainFamily {
    /// The family of a number.
    pub const fn from_number(number: u8) -> Self {
        match number {
            0 => Self::General,
            1 => Self::Drives,
            2 => Self::SwitchingDevices,
            3 => Self::Io,
            4 => Self::Valves,
            5 => Self::Controllers,
            6 => Self::Hmi,
            7 => Self::Encoders,
            8 => Self::NcRc,
            9 => Self::Gateway,
            10 => Self::Plc,
            11 => Self::IdentSystems,
            12 => Self::Pa,
            other => Self::Other(other),
        }
    }
}

impl fmt::Display for MainFamily {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::General => "general",
            Self::Drives => "drives",
            Self::SwitchingDevices => "switching devices",
            Self::Io => "I/O",
            Self::Valves => "valves",
            Self::Controllers => "controllers",
            Self::Hmi => "operating and monitoring",
            Self::Encoders => "encoders",
            Self::NcRc => "NC/RC",
            Self::Gateway => "gateway",
            Self::Plc => "PLC",
            Self::IdentSystems => "ident systems",
            Self::Pa => "PROFIBUS PA",
            Self::Other(number) => return write!(f, "family {number}"),
        })
    }
}

/// What a slave can do with DP-V1; lengths in octets, times in 10 ms.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Dpv1Features {
    /// The first three user parameters are DPV1_Status_1…3.
    pub dpv1_slave: bool,
    /// Acyclic reading and writing by its master.
    pub c1_read_write_supp: bool,
    /// It does not work without.
    pub c1_read_write_required: bool,
    /// Most octets of data.
    pub c1_max_data_len: Option<u8>,
    /// Longest time to the answer.
    pub c1_response_timeout: Option<u16>,
    /// Acyclic reading and writing by masters of class 2.
    pub c2_read_write_supp: bool,
    /// It does not work without.
    pub c2_read_write_required: bool,
    /// Most octets of data.
    pub c2_max_data_len: Option<u8>,
    /// Longest time to the answer.
    pub c2_response_timeout: Option<u16>,
    /// Connections at a time.
    pub c2_max_count_channels: Option<u8>,
    /// Longest Initiate.
    pub max_initiate_pdu_length: Option<u8>,
    /// Alarms it can send.
    pub alarms_supp: AlarmKinds,
    /// Alarms without which it does not work.
    pub alarms_required: AlarmKinds,
    /// Alarms as a number (revision 2, `Alarm_supported`).
    pub alarm_supported: Option<u8>,
    /// Alarm acknowledgement over a service access point of its own.
    pub extra_alarm_sap_supp: bool,
    /// Alarms at a time.
    pub alarm_sequence_mode_count: Option<u8>,
    /// One alarm of a kind at a time.
    pub alarm_type_mode_supp: bool,
    /// Identifiers in the special format describe data types.
    pub dpv1_data_types: bool,
    /// Watchdog in units of 1 ms.
    pub wd_base_1ms_supp: bool,
    /// Reduced check of the configuration.
    pub check_cfg_mode: bool,
}

/// Data exchange broadcast.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct DxbFeatures {
    /// Its inputs can be received by other slaves.
    pub publisher_supp: bool,
    /// It can receive the inputs of others.
    pub subscriber_supp: bool,
    /// Most sources.
    pub dxb_max_link_count: Option<u8>,
    /// Most octets of one source.
    pub dxb_max_data_length: Option<u8>,
    /// Where the table of sources is sent: 0 Set_Prm, 1 Set_Ext_Prm.
    pub dxb_subscribertable_block_location: Option<u8>,
}

/// Isochronous mode. Time bases in units of 1/12 µs, other times in units of their base.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct IsochronFeatures {
    /// Supported.
    pub isochron_mode_supp: bool,
    /// It does not work without.
    pub isochron_mode_required: bool,
    /// Base of the cycle.
    pub tbase_dp: Option<u32>,
    /// Shortest cycle.
    pub tdp_min: Option<u16>,
    /// Longest cycle.
    pub tdp_max: Option<u16>,
    /// Smallest window of the clock control.
    pub t_pll_w_min: Option<u16>,
    /// Largest window of the clock control.
    pub t_pll_w_max: Option<u16>,
    /// Base of the times of inputs and outputs.
    pub tbase_io: Option<u32>,
    /// Least time from taking inputs to the end of the cycle.
    pub ti_min: Option<u16>,
    /// Least time from the start of the cycle to the outputs.
    pub to_min: Option<u16>,
}

/// A keyword that is kept by its name.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OtherKeyword {
    /// Keyword of the block it stands in, with its number; `None` outside of blocks.
    pub block: Option<String>,
    /// Name as written, with its index in parentheses.
    pub keyword: String,
    /// Value as written; `None` without `=`.
    pub value: Option<String>,
    /// Where it stands.
    #[serde(flatten)]
    pub at: Position,
}

/// What follows a `#` line other than `#Profibus_DP`: of other buses or of the manufacturer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Section {
    /// Name behind `#`.
    pub name: String,
    /// Its statements as written.
    pub statements: Vec<String>,
}

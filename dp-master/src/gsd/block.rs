//! Blocks: from a first line with a keyword to a last line with another, each with entries of its own.

use std::collections::BTreeMap;

use super::cursor::{Cursor, Fault};
use super::device::{Gsd, PhysicalInterface};
use super::diagnostic::{Position, Remarks};
use super::entry::{Entry, warn_long};
use super::grammar::Kind;
use super::keyword_family::{DelayFamily, DiagKeyword, PrmKeyword, PrmSet, delay_keyword};
use super::module::{AlarmKinds, DataArea, Module, Slot};
use super::prm::{Parameter, PrmText, PrmType, ValueSet};
use super::unit_diag::{UnitDiag, UnitDiagArea};
use crate::dp::MAX_EXT_DIAG;

/// The kinds of blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BlockKind {
    PrmText,
    Parameter,
    Module,
    DataArea,
    Slots,
    UnitDiagArea,
    UnitDiagType,
    PhysicalInterface,
    Jokerblock,
    FirmwareDownload,
}

/// First and last keyword of a kind of block.
#[derive(Debug)]
pub(super) struct Opener {
    pub(super) open: &'static str,
    pub(super) close: &'static str,
    pub(super) kind: BlockKind,
}

const fn opener(open: &'static str, close: &'static str, kind: BlockKind) -> Opener {
    Opener { open, close, kind }
}

static OPENERS: [Opener; 10] = [
    opener("PrmText", "EndPrmText", BlockKind::PrmText),
    opener("ExtUserPrmData", "EndExtUserPrmData", BlockKind::Parameter),
    opener("Module", "EndModule", BlockKind::Module),
    opener("Data_Area_Beg", "Data_Area_End", BlockKind::DataArea),
    opener("SlotDefinition", "EndSlotDefinition", BlockKind::Slots),
    opener("Unit_Diag_Area", "Unit_Diag_Area_End", BlockKind::UnitDiagArea),
    opener("UnitDiagType", "EndUnitDiagType", BlockKind::UnitDiagType),
    opener(
        "Physical_Interface",
        "End_Physical_Interface",
        BlockKind::PhysicalInterface,
    ),
    opener("Jokerblock_Type", "End_Jokerblock_Type", BlockKind::Jokerblock),
    opener(
        "Version_Firmware_Download",
        "End_Version_Firmware_Download",
        BlockKind::FirmwareDownload,
    ),
];

impl Opener {
    pub(super) fn opened_by(name: &str) -> Option<&'static Self> {
        let name = without_x(name);
        OPENERS.iter().find(|opener| opener.open.eq_ignore_ascii_case(name))
    }

    pub(super) fn closed_by(name: &str) -> Option<&'static Self> {
        let name = without_x(name);
        OPENERS.iter().find(|opener| opener.close.eq_ignore_ascii_case(name))
    }

    /// Whether such a block may stand in a block of kind `outer`.
    pub(super) fn may_be_in(&self, outer: BlockKind) -> bool {
        matches!(
            (outer, self.kind),
            (BlockKind::Module, BlockKind::DataArea | BlockKind::UnitDiagArea)
                | (BlockKind::UnitDiagType, BlockKind::UnitDiagArea)
        )
    }

    /// Whether such a block may stand outside of all others.
    pub(super) fn may_be_outside(&self) -> bool {
        self.kind != BlockKind::DataArea
    }
}

/// The block an entry belongs to, for an entry that stands outside of it.
pub(super) fn home(name: &str) -> Option<&'static str> {
    let entries: [(&str, &[&str]); 6] = [
        ("PrmText", &["Text"]),
        (
            "ExtUserPrmData",
            &[
                "Prm_Text_Ref",
                "Changeable",
                "Visible",
                "Bit",
                "BitArea",
                "Unsigned8",
                "Unsigned16",
                "Unsigned32",
                "Signed8",
                "Signed16",
                "Signed32",
            ],
        ),
        ("SlotDefinition", &["Slot"]),
        ("Unit_Diag_Area", &["Value", "Value_Help"]),
        (
            "Module",
            &[
                "Preset",
                "F_ParamDescCRC",
                "F_IO_StructureDescCRC",
                "Ext_Module_Prm_Data_Len",
                "X_Ext_Module_Prm_Data_Len",
                "F_Ext_Module_Prm_Data_Len",
                "Module_Reference",
                "Subsys_Module_Dir_Index",
            ],
        ),
        (
            "Data_Area_Beg",
            &[
                "Related_CFG_Identifier",
                "IO_Direction",
                "Length",
                "Consistency",
                "Publisher_allowed",
                "DP_Master_allowed",
                "Data_Type",
            ],
        ),
    ];
    if delay_keyword(name).is_some() {
        return Some("Physical_Interface");
    }
    let inner = |candidates: &[&str], name: &str| candidates.iter().any(|entry| entry.eq_ignore_ascii_case(name));
    entries
        .into_iter()
        .find(|(_, candidates)| inner(candidates, name) || inner(candidates, without_x(name)))
        .map(|(block, _)| block)
}

/// `X_Unit_Diag_Area` is `Unit_Diag_Area` in a `UnitDiagType`.
fn without_x(name: &str) -> &str {
    match name.get(..2) {
        Some("X_" | "x_") => name.get(2..).unwrap_or(name),
        _ => name,
    }
}

/// A block that is being read.
pub(super) enum Block {
    PrmText(u16, PrmText),
    Parameter(ParameterBlock),
    Module(Box<Module>),
    DataArea(DataArea),
    Slots(Vec<Slot>),
    UnitDiagArea(UnitDiagArea),
    UnitDiagType(u16, UnitDiag),
    PhysicalInterface(PhysicalInterface),
    /// Entries are kept by name.
    Kept,
}

impl Block {
    /// An empty block, for one whose first line is wrong.
    pub(super) fn empty(kind: BlockKind, at: Position) -> Self {
        match kind {
            BlockKind::PrmText => Self::PrmText(0, PrmText::default()),
            BlockKind::Parameter => Self::Parameter(ParameterBlock::new(0, String::new())),
            BlockKind::Module => Self::Module(Box::new(Module::new(String::new(), Vec::new(), at))),
            BlockKind::DataArea => Self::DataArea(DataArea::default()),
            BlockKind::Slots => Self::Slots(Vec::new()),
            BlockKind::UnitDiagArea => Self::UnitDiagArea(UnitDiagArea {
                first: 0,
                last: MAX_BIT,
                values: BTreeMap::new(),
                at,
            }),
            BlockKind::UnitDiagType => Self::UnitDiagType(0, UnitDiag::default()),
            BlockKind::PhysicalInterface => Self::PhysicalInterface(PhysicalInterface::default()),
            BlockKind::Jokerblock | BlockKind::FirmwareDownload => Self::Kept,
        }
    }

    /// A block from its first line, behind the keyword.
    pub(super) fn open(
        kind: BlockKind,
        at: Position,
        value: &mut Cursor<'_, '_>,
        remarks: &mut Remarks,
    ) -> Result<Self, Fault> {
        let mut block = Self::empty(kind, at);
        let mut name = |value: &mut Cursor<'_, '_>| {
            let at = value.position();
            let name = value.text()?.to_owned();
            warn_long(remarks, at, &name, 32);
            Ok(name)
        };
        match &mut block {
            Self::Kept => return Ok(block),
            Self::DataArea(_) | Self::Slots(_) => {}
            Self::PrmText(reference, text) => {
                value.sign('=')?;
                *reference = value.unsigned_16(0, u16::MAX)?;
                text.at = Some(at);
            }
            Self::Parameter(parameter) => {
                value.sign('=')?;
                let reference = value.unsigned_16(0, u16::MAX)?;
                *parameter = ParameterBlock::new(reference, name(value)?);
            }
            Self::Module(module) => {
                value.sign('=')?;
                module.name = name(value)?;
                module.config = value.octets()?;
            }
            Self::UnitDiagArea(area) => {
                value.sign('=')?;
                area.first = value.unsigned_16(0, MAX_BIT)?;
                value.sign('-')?;
                area.last = value.unsigned_16(area.first, MAX_BIT)?;
            }
            Self::UnitDiagType(number, _) => {
                value.sign('=')?;
                *number = value.unsigned_16(0, u16::MAX)?;
            }
            Self::PhysicalInterface(interface) => {
                value.sign('=')?;
                interface.kind = value.unsigned_8(0, u8::MAX)?;
            }
        }
        value.done()?;
        Ok(block)
    }

    /// Takes an entry; `false` when the block has none of this name.
    pub(super) fn entry(&mut self, entry: &mut Entry<'_, '_, '_>) -> Result<bool, Fault> {
        match self {
            Self::PrmText(_, text) => prm_text_entry(text, entry),
            Self::Parameter(parameter) => parameter.entry(entry),
            Self::Module(module) => module_entry(module, entry),
            Self::DataArea(area) => data_area_entry(area, entry),
            Self::Slots(slots) => slot_entry(slots, entry),
            Self::UnitDiagArea(area) => area_entry(area, entry),
            Self::UnitDiagType(_, diag) => match DiagKeyword::of(entry.head.name) {
                Some(keyword) if keyword.is_of_unit() => entry.diag(keyword, diag, &mut BTreeMap::new()).map(|()| true),
                _ => Ok(false),
            },
            Self::PhysicalInterface(interface) => interface_entry(interface, entry),
            Self::Kept => Ok(false),
        }
    }

    /// Puts the finished block into the block around it or into the description.
    pub(super) fn finish(self, at: Position, outer: Option<&mut Self>, gsd: &mut Gsd, remarks: &mut Remarks) {
        match self {
            Self::PrmText(reference, text) => {
                if text.texts.is_empty() {
                    remarks.warning(at, format!("`PrmText` {reference} has no texts"));
                }
                if let Some(first) = gsd.prm_texts.insert(reference, text) {
                    twice(remarks, at, &format!("`PrmText` {reference}"), first.at);
                }
            }
            Self::Parameter(block) => {
                if let Some(parameter) = block.finish(at, remarks)
                    && let Some(first) = gsd.parameters.insert(parameter.reference, parameter)
                {
                    let what = format!("`ExtUserPrmData` {}", first.reference);
                    twice(remarks, at, &what, Some(first.at));
                }
            }
            Self::Module(module) => gsd.modules.push(*module),
            Self::Slots(slots) => {
                for slot in slots {
                    if let Some(first) = gsd.slots.iter_mut().find(|first| first.number == slot.number) {
                        twice(remarks, slot.at, &format!("`Slot({})`", slot.number), Some(first.at));
                        *first = slot;
                    } else {
                        gsd.slots.push(slot);
                    }
                }
            }
            Self::DataArea(area) => {
                if let Some(Self::Module(module)) = outer {
                    module.data_areas.push(area);
                }
            }
            Self::UnitDiagArea(area) => match outer {
                Some(Self::Module(module)) => module.unit_diag.areas.push(area),
                Some(Self::UnitDiagType(_, diag)) => diag.areas.push(area),
                _ => gsd.unit_diag.areas.push(area),
            },
            Self::UnitDiagType(number, diag) => {
                if gsd.unit_diag_types.insert(number, diag).is_some() {
                    twice(remarks, at, &format!("`UnitDiagType` {number}"), None);
                }
            }
            Self::PhysicalInterface(interface) => gsd.physical_interfaces.push(interface),
            Self::Kept => {}
        }
    }
}

/// The highest bit of a device-related diagnosis: 237 octets follow a header.
pub(super) const MAX_BIT: u16 = 8 * (MAX_EXT_DIAG as u16 - 1) - 1;

fn twice(remarks: &mut Remarks, at: Position, what: &str, first: Option<Position>) {
    let place = match first {
        Some(first) => format!(" in line {}", first.line),
        None => String::new(),
    };
    remarks.error(at, format!("{what} is defined already{place}, the last one counts"));
}

fn prm_text_entry(text: &mut PrmText, entry: &mut Entry<'_, '_, '_>) -> Result<bool, Fault> {
    if !entry.is("Text") {
        return Ok(false);
    }
    let value = entry.signed_index()?;
    let at = entry.head.at;
    let words = entry.text(32)?;
    if text.texts.insert(value, words).is_some() {
        entry.remarks.warning(
            at,
            format!("`Text({value})` stands already in this `PrmText`, the last one counts"),
        );
    }
    Ok(true)
}

/// A parameter that is being read.
pub(super) struct ParameterBlock {
    reference: u16,
    name: String,
    coding: Option<(PrmType, i64, ValueSet)>,
    text: Option<u16>,
    changeable: bool,
    visible: bool,
    /// Its type line was wrong and has been reported.
    reported: bool,
}

impl ParameterBlock {
    fn new(reference: u16, name: String) -> Self {
        Self {
            reference,
            name,
            coding: None,
            text: None,
            changeable: true,
            visible: true,
            reported: false,
        }
    }

    /// Whether this statement should be the line with the type: it assigns nothing and closes nothing.
    pub(super) fn is_type_line(&self, cursor: &Cursor<'_, '_>) -> bool {
        match cursor.peek() {
            Some(Kind::Word(word)) => {
                !cursor.has('=') && Opener::closed_by(word).is_none() && Opener::opened_by(word).is_none()
            }
            _ => false,
        }
    }

    /// Type, default value and allowed values.
    pub(super) fn type_line(&mut self, line: &mut Cursor<'_, '_>, remarks: &mut Remarks) -> Result<(), Fault> {
        let at = line.position();
        if self.coding.is_some() {
            remarks.warning(at, "the parameter has two types, the last one counts");
        }
        self.reported = true;
        let data_type = prm_type(line)?;
        let range = data_type.range();
        let place = line.position();
        let default = line.number(ANY_VALUE)?;
        let values = line.value_set(ANY_VALUE)?;
        let allowed = |value: i64| range.contains(&value);
        if !values.0.iter().all(|&(min, max)| allowed(min) && allowed(max)) {
            remarks.error(
                place,
                format!("{data_type} holds {} to {}, not {values}", range.start(), range.end()),
            );
        } else if !(allowed(default) && values.contains(default)) {
            let allowed = match values.is_any() {
                true => format!("{} to {}", range.start(), range.end()),
                false => values.to_string(),
            };
            remarks.error(
                place,
                format!("the default value {default} is not allowed, these are: {allowed}"),
            );
        }
        self.coding = Some((data_type, default, values));
        Ok(())
    }

    fn entry(&mut self, entry: &mut Entry<'_, '_, '_>) -> Result<bool, Fault> {
        // `PrmTextRef` is how some tools write it.
        let is_text = entry.is("Prm_Text_Ref") || entry.is("PrmTextRef");
        let (is_changeable, is_visible) = (entry.is("Changeable"), entry.is("Visible"));
        if !(is_text || is_changeable || is_visible) {
            return Ok(false);
        }
        entry.equals()?;
        entry.once(None);
        if is_text {
            self.text = Some(entry.value.unsigned_16(0, u16::MAX)?);
        } else if is_changeable {
            self.changeable = entry.value.flag()?;
        } else {
            self.visible = entry.value.flag()?;
        }
        entry.value.done()?;
        Ok(true)
    }

    fn finish(self, at: Position, remarks: &mut Remarks) -> Option<Parameter> {
        let Some((data_type, default, values)) = self.coding else {
            if !self.reported {
                remarks.error(at, format!("parameter `{}` has no line with its type", self.name));
            }
            return None;
        };
        Some(Parameter {
            reference: self.reference,
            name: self.name,
            data_type,
            default,
            values,
            text: self.text,
            changeable: self.changeable,
            visible: self.visible,
            at,
        })
    }
}

/// What a value may be before its type is looked at.
const ANY_VALUE: core::ops::RangeInclusive<i64> = i32::MIN as i64..=u32::MAX as i64;

fn prm_type(line: &mut Cursor<'_, '_>) -> Result<PrmType, Fault> {
    const WANTED: &str = "a type (Bit, BitArea, Unsigned8, Unsigned16, Unsigned32, Signed8, Signed16, Signed32)";
    let simple = [
        ("Unsigned8", PrmType::Unsigned8),
        ("Unsigned16", PrmType::Unsigned16),
        ("Unsigned32", PrmType::Unsigned32),
        ("Signed8", PrmType::Signed8),
        ("Signed16", PrmType::Signed16),
        ("Signed32", PrmType::Signed32),
    ];
    let Some(Kind::Word(word)) = line.peek() else {
        return line.expected(WANTED);
    };
    if let Some((_, data_type)) = simple.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(word)) {
        line.advance();
        return Ok(data_type);
    }
    let is_area = word.eq_ignore_ascii_case("BitArea");
    if !is_area && !word.eq_ignore_ascii_case("Bit") {
        return line.expected(WANTED);
    }
    line.advance();
    line.sign('(')?;
    let first = line.unsigned_8(0, 7)?;
    let data_type = if is_area {
        line.sign('-')?;
        let last = line.unsigned_8(first, 7)?;
        PrmType::BitArea { first, last }
    } else {
        PrmType::Bit(first)
    };
    line.sign(')')?;
    Ok(data_type)
}

fn module_entry(module: &mut Module, entry: &mut Entry<'_, '_, '_>) -> Result<bool, Fault> {
    if let Some(keyword) = PrmKeyword::in_module(entry.head.name) {
        let layout = match keyword.set {
            PrmSet::Usual => &mut module.prm,
            PrmSet::Extended => &mut module.extended_prm,
            PrmSet::Failsafe => &mut module.failsafe_prm,
        };
        entry.prm(keyword, layout)?;
        return Ok(true);
    }
    if let Some(keyword) = DiagKeyword::of(entry.head.name) {
        entry.diag(keyword, &mut module.unit_diag, &mut module.channel_diag)?;
        return Ok(true);
    }
    let Some(field) = ModuleField::of(module, entry.head.name) else {
        return Ok(false);
    };
    entry.equals()?;
    entry.once(None);
    match field {
        ModuleField::Flag(field) => *field = entry.value.flag()?,
        ModuleField::U16(field) => *field = Some(entry.value.unsigned_16(0, u16::MAX)?),
        ModuleField::U32(field) => *field = Some(entry.value.unsigned_32()?),
        ModuleField::Text(most, field) => *field = Some(entry.text(most)?),
    }
    entry.value.done()?;
    Ok(true)
}

/// A keyword of a module with one value.
enum ModuleField<'m> {
    Flag(&'m mut bool),
    U16(&'m mut Option<u16>),
    U32(&'m mut Option<u32>),
    Text(usize, &'m mut Option<String>),
}

impl<'m> ModuleField<'m> {
    fn of(module: &'m mut Module, name: &str) -> Option<Self> {
        let AlarmKinds {
            diagnostic,
            process,
            pull_plug,
            status,
            update,
            manufacturer_specific,
        } = &mut module.alarms_required;
        Some(match name.to_ascii_lowercase().as_str() {
            "module_reference" => Self::U16(&mut module.reference),
            "info_text" => Self::Text(256, &mut module.info_text),
            "ordernumber" => Self::Text(32, &mut module.order_number),
            "preset" => Self::Flag(&mut module.preset),
            "ident_maintenance_supp" => Self::Flag(&mut module.ident_maintenance_supp),
            "f_paramdesccrc" => Self::U16(&mut module.f_param_desc_crc),
            "f_io_structuredesccrc" => Self::U32(&mut module.f_io_structure_desc_crc),
            "subsys_module_dir_index" => Self::U16(&mut module.subsys_module_dir_index),
            "diagnostic_alarm_required" => Self::Flag(diagnostic),
            "process_alarm_required" => Self::Flag(process),
            "pull_plug_alarm_required" => Self::Flag(pull_plug),
            "status_alarm_required" => Self::Flag(status),
            "update_alarm_required" => Self::Flag(update),
            "manufacturer_specific_alarm_required" => Self::Flag(manufacturer_specific),
            _ => return None,
        })
    }
}

fn data_area_entry(area: &mut DataArea, entry: &mut Entry<'_, '_, '_>) -> Result<bool, Fault> {
    match entry.head.name.to_ascii_lowercase().as_str() {
        "related_cfg_identifier" => area.related_cfg_identifier = Some(entry.only_u8(u8::MAX)?),
        "io_direction" => area.io_direction = Some(entry.only_u8(1)?),
        "length" => area.length = Some(entry.only_u8(244)?),
        "consistency" => area.consistency = Some(entry.only_u8(1)?),
        "publisher_allowed" => area.publisher_allowed = entry.only_u8(1)? == 1,
        "dp_master_allowed" => area.dp_master_allowed = entry.only_u8(1)? == 1,
        "data_type" => {
            entry.equals()?;
            area.data_type = entry.value.octets()?;
        }
        _ => return Ok(false),
    }
    Ok(true)
}

fn slot_entry(slots: &mut Vec<Slot>, entry: &mut Entry<'_, '_, '_>) -> Result<bool, Fault> {
    if !entry.is("Slot") {
        return Ok(false);
    }
    let at = entry.head.at;
    let number = entry.index(u8::MAX.into())? as u8;
    let name_at = entry.value.position();
    let name = entry.value.text()?.to_owned();
    warn_long(entry.remarks, name_at, &name, 32);
    let default = entry.value.unsigned_16(0, u16::MAX)?;
    let mut allowed = entry.value.value_set(0..=u16::MAX.into())?;
    if allowed.is_any() {
        entry.remarks.warning(
            at,
            format!("`Slot({number})` names no allowed modules, only its default is allowed"),
        );
        allowed = ValueSet(vec![(default.into(), default.into())]);
    }
    slots.push(Slot {
        number,
        name,
        default,
        allowed,
        at,
    });
    Ok(true)
}

fn area_entry(area: &mut UnitDiagArea, entry: &mut Entry<'_, '_, '_>) -> Result<bool, Fault> {
    let is_text = entry.is("Value") || entry.is("X_Value");
    if !is_text && !entry.is("Value_Help") && !entry.is("X_Value_Help") {
        return Ok(false);
    }
    let value = u32::from(entry.index(u16::MAX)?);
    if value > area.max() {
        entry.remarks.error(
            entry.head.at,
            format!(
                "bits {} to {} hold 0 to {}, not {value}",
                area.first,
                area.last,
                area.max()
            ),
        );
    }
    entry.once(Some(value));
    let words = entry.text(if is_text { 32 } else { 256 })?;
    let text = area.values.entry(value).or_default();
    if is_text {
        text.text = words;
    } else {
        text.help = Some(words);
    }
    Ok(true)
}

fn interface_entry(interface: &mut PhysicalInterface, entry: &mut Entry<'_, '_, '_>) -> Result<bool, Fault> {
    let Some((family, rate)) = delay_keyword(entry.head.name) else {
        return Ok(false);
    };
    entry.equals()?;
    entry.once(None);
    let delay = entry.value.unsigned_16(0, u16::MAX)?;
    entry.value.done()?;
    let delays = match family {
        DelayFamily::Transmission => &mut interface.transmission_delay,
        DelayFamily::Reaction => &mut interface.reaction_delay,
    };
    delays.insert(rate, delay);
    Ok(true)
}

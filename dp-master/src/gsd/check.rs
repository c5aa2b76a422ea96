//! What only the whole file shows: keywords that are missing, references into nothing, places that overlap, lengths that do not fit.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::device::Gsd;
use super::diagnostic::{Position, Remarks};
use super::keywords;
use super::module::{AlarmKinds, Module};
use super::prm::{PrmLayout, PrmPlace};
use super::unit_diag::UnitDiag;
use crate::dp::{MAX_USER_PRM, SLAVE_DIAG_LEN};

/// Checks the description as a whole.
pub(super) struct Checks<'c> {
    pub(super) gsd: &'c Gsd,
    pub(super) seen: &'c HashMap<String, Position>,
    pub(super) start: Position,
    pub(super) remarks: &'c mut Remarks,
}

impl Checks<'_> {
    pub(super) fn run(&mut self) {
        self.mandatory();
        self.revision();
        self.rates();
        self.lengths();
        self.station_prm();
        self.modules();
        self.slots();
        self.unused();
        self.unit_diag(&self.gsd.unit_diag);
        for diag in self.gsd.unit_diag_types.values() {
            self.unit_diag(diag);
        }
        self.contradictions();
    }

    /// Where a keyword outside of blocks stands, or else where the description starts.
    fn place(&self, keyword: &str) -> Position {
        self.seen
            .get(&keyword.to_ascii_lowercase())
            .copied()
            .unwrap_or(self.start)
    }

    fn has(&self, keyword: &str) -> bool {
        self.seen.contains_key(&keyword.to_ascii_lowercase())
    }

    fn mandatory(&mut self) {
        let revision = self.gsd.general.gsd_revision;
        if revision.is_none() && !self.has("GSD_Revision") {
            self.remarks.warning(
                self.start,
                "`GSD_Revision` is missing, the file is taken for one from before revision 1",
            );
        }
        let general: &[&str] = &[
            "Vendor_Name",
            "Model_Name",
            "Revision",
            "Ident_Number",
            "Protocol_Ident",
            "Station_Type",
            "Hardware_Release",
            "Software_Release",
        ];
        let slave: &[&str] = &["Min_Slave_Intervall"];
        // Revision 1 brought them.
        let slave_1: &[&str] = &["Max_Diag_Data_Len", "Slave_Family"];
        let modular: &[&str] = &["Max_Module", "Max_Input_Len", "Max_Output_Len"];
        let master: &[&str] = &[
            "Max_MPS_Length",
            "Max_Lsdu_MS",
            "Max_Lsdu_MM",
            "Min_Poll_Timeout",
            "LAS_Len",
            "Max_Slaves_supp",
        ];
        let is_slave = self.gsd.is_slave();
        let groups = [
            (true, general, ""),
            (is_slave, slave, ""),
            (is_slave && revision >= Some(1), slave_1, ""),
            (
                is_slave && self.gsd.slave.modular_station,
                modular,
                ", a modular station needs it",
            ),
            (!is_slave, master, ", a master needs it"),
        ];
        for (applies, keywords, why) in groups {
            for keyword in keywords {
                if applies && !self.has(keyword) {
                    self.remarks.error(self.start, format!("`{keyword}` is missing{why}"));
                }
            }
        }
        if is_slave && self.gsd.modules.is_empty() {
            self.remarks
                .error(self.start, "there is no `Module`, so the slave has no configuration");
        }
    }

    fn revision(&mut self) {
        let Some(revision) = self.gsd.general.gsd_revision else {
            return;
        };
        for (name, &at) in self.seen {
            if let Some(keyword) = keywords::find(name)
                && keyword.since > revision
            {
                self.remarks.warning(
                    at,
                    format!(
                        "`{}` came with GSD revision {}, the file says {revision}",
                        keyword.name, keyword.since
                    ),
                );
            }
        }
    }

    fn rates(&mut self) {
        if !self.gsd.rates.values().any(|rate| rate.supported) {
            self.remarks.error(self.start, "no baud rate is supported");
        }
        for (rate, features) in &self.gsd.rates {
            let keyword = rate.keyword();
            match (features.supported, features.max_tsdr) {
                (true, None) => {
                    let at = self.place(&format!("{keyword}_supp"));
                    self.remarks
                        .error(at, format!("`MaxTsdr_{keyword}` is missing, {rate} is supported"));
                }
                (false, Some(_)) if !self.has(&format!("{keyword}_supp")) => {
                    let at = self.place(&format!("MaxTsdr_{keyword}"));
                    self.remarks
                        .warning(at, format!("`{keyword}_supp` is missing, so {rate} is not supported"));
                }
                _ => {}
            }
        }
    }

    fn lengths(&mut self) {
        let slave = &self.gsd.slave;
        if let (Some(data), Some(len)) = (&slave.user_prm_data, slave.user_prm_data_len)
            && data.len() != usize::from(len)
        {
            let message = format!(
                "`User_Prm_Data` has {} octets, `User_Prm_Data_Len` says {len}",
                data.len()
            );
            self.remarks.error(self.place("User_Prm_Data"), message);
        }
        if slave.user_prm_data.is_some() && self.gsd.prm.len.is_some() && self.gsd.prm.is_empty() {
            let message =
                "`Max_User_Prm_Data_Len` stands beside `User_Prm_Data`, which is used because there is nothing else";
            self.remarks.warning(self.place("User_Prm_Data"), message);
        }
        if let Some(len @ 1..) = slave.user_prm_data_len
            && !self.has("User_Prm_Data")
        {
            let message = format!("`User_Prm_Data` is missing, `User_Prm_Data_Len` says {len}");
            self.remarks.error(self.place("User_Prm_Data_Len"), message);
        }
        if let Some(data) = &slave.user_prm_data
            && data.len() > MAX_USER_PRM
        {
            let message = format!("`User_Prm_Data` has {} octets, {MAX_USER_PRM} are possible", data.len());
            self.remarks.error(self.place("User_Prm_Data"), message);
        }
        if let (Some(inputs), Some(outputs), Some(data)) =
            (slave.max_input_len, slave.max_output_len, slave.max_data_len)
            && data > u16::from(inputs) + u16::from(outputs)
        {
            let message = format!("`Max_Data_Len` {data} is more than {inputs} of inputs and {outputs} of outputs");
            self.remarks.warning(self.place("Max_Data_Len"), message);
        }
    }

    fn station_prm(&mut self) {
        let gsd = self.gsd;
        let most = gsd.prm.len.map_or(MAX_USER_PRM, usize::from);
        self.layout(&gsd.prm, most, "`Max_User_Prm_Data_Len`");
        self.layout(
            &gsd.extended_prm,
            gsd.extended_prm.len.map_or(244, usize::from),
            "`X_Max_User_Prm_Data_Len`",
        );
        if !gsd.prm.is_empty() && gsd.prm.len.is_none() {
            let first = gsd.prm.constants.iter().map(|constant| constant.at);
            let first = first.chain(gsd.prm.places.iter().map(|place| place.at)).min();
            self.remarks.warning(
                first.unwrap_or(self.start),
                "`Max_User_Prm_Data_Len` is missing, there are user parameters",
            );
        }
    }

    /// References, lengths and overlaps of the station's or a module's parameters.
    fn layout(&mut self, layout: &PrmLayout, most: usize, limit: &str) {
        for constant in &layout.constants {
            let end = usize::from(constant.offset) + constant.octets.len();
            if end > most {
                self.remarks.error(
                    constant.at,
                    format!("the constant ends at octet {end}, {limit} says {most}"),
                );
            }
        }
        // Bits taken so far by octet, and by which parameter.
        let mut taken: BTreeMap<usize, Vec<(u8, u16)>> = BTreeMap::new();
        for place in &layout.places {
            let Some(parameter) = self.gsd.parameters.get(&place.reference) else {
                self.remarks
                    .error(place.at, format!("there is no `ExtUserPrmData` {}", place.reference));
                continue;
            };
            let offset = usize::from(place.offset);
            let len = parameter.data_type.octets();
            if offset + len > most {
                let message = format!(
                    "parameter `{}` ends at octet {}, {limit} says {most}",
                    parameter.name,
                    offset + len
                );
                self.remarks.error(place.at, message);
            }
            // Makers put headings between parameters: a bit with one possible value.
            if parameter.values.only().is_some() {
                continue;
            }
            let mask = parameter.data_type.mask().to_be_bytes();
            let mut other = None;
            for (octet, &mask) in mask.iter().skip(4 - len).enumerate() {
                let users = taken.entry(offset + octet).or_default();
                let user = users.iter().find(|(bits, _)| bits & mask != 0);
                other = other.or(user.map(|&(_, reference)| reference));
                users.push((mask, place.reference));
            }
            if let Some(other) = other {
                self.overlap(place, other);
            }
        }
    }

    fn overlap(&mut self, place: &PrmPlace, other: u16) {
        let name = |reference: u16| match self.gsd.parameters.get(&reference) {
            Some(parameter) => parameter.name.as_str(),
            None => "",
        };
        let message = format!("parameter `{}` overlaps `{}`", name(place.reference), name(other));
        self.remarks.warning(place.at, message);
    }

    fn modules(&mut self) {
        let gsd = self.gsd;
        let mut names: HashMap<&str, Position> = HashMap::new();
        let mut references: HashMap<u16, Position> = HashMap::new();
        for module in &gsd.modules {
            if let Some(first) = names.insert(&module.name, module.at) {
                let message = format!("a module `{}` stands already in line {}", module.name, first.line);
                self.remarks.warning(module.at, message);
            }
            if let Some(reference) = module.reference
                && let Some(first) = references.insert(reference, module.at)
            {
                let message = format!(
                    "a module with reference {reference} stands already in line {}",
                    first.line
                );
                self.remarks.error(module.at, message);
            }
            self.module(module);
        }
        if !gsd.slave.modular_station
            && let Some(second) = gsd.modules.get(1)
        {
            self.remarks.warning(
                second.at,
                "the station is not modular, so the file should describe it with one module",
            );
        }
    }

    fn module(&mut self, module: &Module) {
        let slave = &self.gsd.slave;
        match module.lengths() {
            Err(error) => self
                .remarks
                .error(module.at, format!("module `{}`: {error}", module.name)),
            Ok(lengths) => {
                for (what, got, most) in [
                    ("Max_Input_Len", lengths.inputs, slave.max_input_len),
                    ("Max_Output_Len", lengths.outputs, slave.max_output_len),
                ] {
                    if let Some(most) = most
                        && slave.modular_station
                        && got > usize::from(most)
                    {
                        let message = format!("module `{}` has {got} octets, `{what}` allows {most}", module.name);
                        self.remarks.warning(module.at, message);
                    }
                }
            }
        }
        let sets = [
            (&module.prm, "Ext_Module_Prm_Data_Len"),
            (&module.extended_prm, "X_Ext_Module_Prm_Data_Len"),
            (&module.failsafe_prm, "F_Ext_Module_Prm_Data_Len"),
        ];
        for (layout, limit) in sets {
            let most = layout.len.map_or(MAX_USER_PRM, usize::from);
            self.layout(layout, most, &format!("`{limit}`"));
            if layout.len.is_none() && !layout.is_empty() {
                let message = format!("`{limit}` is missing, module `{}` has parameters", module.name);
                self.remarks.error(module.at, message);
            }
        }
        self.unit_diag(&module.unit_diag);
    }

    fn slots(&mut self) {
        let gsd = self.gsd;
        let references: BTreeSet<u16> = gsd.modules.iter().filter_map(|module| module.reference).collect();
        for slot in &gsd.slots {
            let number = slot.number;
            if !references.contains(&slot.default) {
                let message = format!(
                    "there is no module with reference {}, the default of slot {number}",
                    slot.default
                );
                self.remarks.error(slot.at, message);
            } else if !slot.allowed.contains(slot.default.into()) {
                let message = format!(
                    "the default of slot {number}, {}, is not among its allowed modules",
                    slot.default
                );
                self.remarks.warning(slot.at, message);
            }
            for &(min, max) in &slot.allowed.0 {
                let (min, max) = (min as u16, max as u16);
                if references.range(min..=max).next().is_none() {
                    let which = if min == max {
                        min.to_string()
                    } else {
                        format!("{min} to {max}")
                    };
                    let message =
                        format!("slot {number} allows module {which}, but there is none with such a reference");
                    self.remarks.error(slot.at, message);
                }
            }
            if let Some(most) = gsd.slave.max_module
                && number > most
                && gsd.slave.modular_station
            {
                let message = format!("slot {number} is beyond `Max_Module` {most}");
                self.remarks.warning(slot.at, message);
            }
        }
    }

    fn unused(&mut self) {
        let gsd = self.gsd;
        for parameter in gsd.parameters.values() {
            if let Some(text) = parameter.text
                && !gsd.prm_texts.contains_key(&text)
            {
                let message = format!(
                    "parameter `{}` refers to `PrmText` {text}, which there is not",
                    parameter.name
                );
                self.remarks.error(parameter.at, message);
            }
        }
        let used: BTreeSet<u16> = gsd.parameters.values().filter_map(|parameter| parameter.text).collect();
        for (reference, text) in &gsd.prm_texts {
            if !used.contains(reference) {
                let at = text.at.unwrap_or(self.start);
                self.remarks
                    .warning(at, format!("`PrmText` {reference} is not used by any parameter"));
            }
        }
        let layouts = [&gsd.prm, &gsd.extended_prm, &gsd.failsafe_prm].into_iter().chain(
            gsd.modules
                .iter()
                .flat_map(|module| [&module.prm, &module.extended_prm, &module.failsafe_prm]),
        );
        let placed: BTreeSet<u16> = layouts
            .flat_map(|layout| layout.places.iter().map(|place| place.reference))
            .collect();
        for (reference, parameter) in &gsd.parameters {
            if !placed.contains(reference) {
                let message = format!(
                    "parameter `{}` ({reference}) is not used by station or module",
                    parameter.name
                );
                self.remarks.warning(parameter.at, message);
            }
        }
    }

    fn unit_diag(&mut self, diag: &UnitDiag) {
        let mut areas: Vec<_> = diag.areas.iter().collect();
        areas.sort_by_key(|area| area.first);
        let mut end: Option<u16> = None;
        for area in areas {
            if end.is_some_and(|end| area.first <= end) {
                let message = format!("bits {} to {} overlap another `Unit_Diag_Area`", area.first, area.last);
                self.remarks.warning(area.at, message);
            }
            end = end.max(Some(area.last));
        }
        let bits = diag.bits.keys().chain(diag.not_bits.keys()).copied();
        let highest = bits.chain(diag.areas.iter().map(|area| area.last)).max();
        if let (Some(bit), Some(most)) = (highest, self.gsd.slave.max_diag_data_len) {
            // The six standard octets, the header, and the octets up to that of the bit.
            let needed = SLAVE_DIAG_LEN + 1 + usize::from(bit / 8) + 1;
            if needed > usize::from(most) {
                let message =
                    format!("bit {bit} of the diagnosis needs {needed} octets, `Max_Diag_Data_Len` says {most}");
                self.remarks.warning(self.place("Max_Diag_Data_Len"), message);
            }
        }
    }

    fn contradictions(&mut self) {
        let gsd = self.gsd;
        if gsd.slave.fail_safe_required && !gsd.slave.fail_safe {
            let message = "`Fail_Safe_required` is set, but `Fail_Safe` is not";
            self.remarks.warning(self.place("Fail_Safe_required"), message);
        }
        for (name, supported, required) in alarm_pairs(&gsd.dpv1.alarms_supp, &gsd.dpv1.alarms_required) {
            if required && !supported {
                let keyword = format!("{name}_Alarm_required");
                let message = format!("`{keyword}` is set, but `{name}_Alarm_supp` is not");
                self.remarks.warning(self.place(&keyword), message);
            }
        }
        for (required, supported, is) in [
            (
                "C1_Read_Write_required",
                "C1_Read_Write_supp",
                gsd.dpv1.c1_read_write_required && !gsd.dpv1.c1_read_write_supp,
            ),
            (
                "C2_Read_Write_required",
                "C2_Read_Write_supp",
                gsd.dpv1.c2_read_write_required && !gsd.dpv1.c2_read_write_supp,
            ),
            (
                "Isochron_Mode_required",
                "Isochron_Mode_supp",
                gsd.isochron.isochron_mode_required && !gsd.isochron.isochron_mode_supp,
            ),
        ] {
            if is {
                let message = format!("`{required}` is set, but `{supported}` is not");
                self.remarks.warning(self.place(required), message);
            }
        }
    }
}

/// Names of the kinds of alarms as keywords have them, with two sets.
pub(super) fn alarm_pairs(first: &AlarmKinds, second: &AlarmKinds) -> [(&'static str, bool, bool); 6] {
    [
        ("Diagnostic", first.diagnostic, second.diagnostic),
        ("Process", first.process, second.process),
        ("Pull_Plug", first.pull_plug, second.pull_plug),
        ("Status", first.status, second.status),
        ("Update", first.update, second.update),
        (
            "Manufacturer_Specific",
            first.manufacturer_specific,
            second.manufacturer_specific,
        ),
    ]
}

//! A project for one slave: modules in slots and values of parameters, and the octets of Chk_Cfg and Set_Prm that follow from them.
//!
//! ```text
//! user parameters   station: constants, then parameters over them; DPV1_Status_1…3 are its first three octets
//!                   then each module in the order of the slots: constants, then parameters over them
//! identifiers       those of the modules in the order of the slots
//! ```
//!
//! Source: guideline "Volume 1: GSD" (Ext_User_Prm_Data, Ext_Module_Prm_Data_Len, SlotDefinition); IEC 61158-6-3, coding of Set_Prm.

use std::collections::BTreeMap;

use super::check::alarm_pairs;
use super::device::Gsd;
use super::module::{AlarmKinds, Module, Slot};
use super::prm::{Parameter, PrmLayout, PrmPlace};
use super::setup_error::{Part, SetupError, listed};
use crate::address::Address;
use crate::dp::v1::{AlarmTypes, V1Status};
use crate::dp::{
    ClearOutputs, Configuration, Demand, IoLengths, MAX_USER_PRM, SlaveConfig, Watchdog, io_lengths, places,
};
use crate::time::Duration;

impl Gsd {
    /// Starts a project with this device.
    ///
    /// What the file puts into slots by itself is there: the defaults of the slots, preset modules, or the only module of a station that is
    /// not modular.
    ///
    /// # Example
    ///
    /// ```
    /// use dp_master::address::Address;
    /// use dp_master::gsd;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let reading = gsd::parse(b"#Profibus_DP
    /// Ident_Number = 0x0BAD
    /// Modular_Station = 1
    /// Max_Module = 2
    /// Max_User_Prm_Data_Len = 1
    /// PrmText = 1
    /// Text(0) = \"off\"
    /// Text(3) = \"on\"
    /// EndPrmText
    /// ExtUserPrmData = 1 \"Filter\"
    /// BitArea(4-5) 0 0,3
    /// Prm_Text_Ref = 1
    /// EndExtUserPrmData
    /// Ext_User_Prm_Data_Const(0) = 0x81
    /// Ext_User_Prm_Data_Ref(0) = 1
    /// Module = \"8 in\" 0x10
    /// EndModule
    /// Module = \"8 out\" 0x20
    /// EndModule");
    /// let mut lamp = reading.gsd.configure();
    /// lamp.plug("8 out")?;
    /// lamp.plug("8 in")?;
    /// lamp.set("Filter", "on")?;
    /// assert_eq!(lamp.identifiers()?, [0x20, 0x10]);
    /// assert_eq!(lamp.user_prm()?, [0xB1]);
    /// let slave = lamp.slave_config(Address::new(3)?)?;
    /// assert_eq!(slave.ident, 0x0BAD);
    /// # Ok(())
    /// # }
    /// ```
    pub fn configure(&self) -> Setup<'_> {
        let mut setup = Setup {
            gsd: self,
            slots: BTreeMap::new(),
            station: Values::new(),
            v1: None,
            clear_outputs: match self.slave.fail_safe {
                true => ClearOutputs::Empty,
                false => ClearOutputs::Zeros,
            },
            watchdog: None,
            sync: Demand::No,
            freeze: Demand::No,
        };
        if !self.slots.is_empty() {
            for slot in &self.slots {
                if let Some(module) = by_reference(self, slot.default) {
                    setup.slots.insert(slot.number, Plugged::new(module));
                }
            }
        } else {
            let only = !self.slave.modular_station && self.modules.len() == 1;
            let present = self.modules.iter().filter(|module| only || module.preset);
            for (number, module) in (1..=u8::MAX).zip(present) {
                setup.slots.insert(number, Plugged::new(module));
            }
        }
        setup
    }
}

/// Modules and values chosen for one slave, see [`Gsd::configure`].
///
/// Every choice is checked when it is made, and the whole when octets are asked for.
#[derive(Debug, Clone)]
pub struct Setup<'g> {
    gsd: &'g Gsd,
    slots: BTreeMap<u8, Plugged<'g>>,
    station: Values,
    v1: Option<V1Status>,
    clear_outputs: ClearOutputs,
    watchdog: Option<Duration>,
    sync: Demand,
    freeze: Demand,
}

/// Values that were set, by the number of the place in its layout.
type Values = BTreeMap<usize, i64>;

#[derive(Debug, Clone)]
struct Plugged<'g> {
    module: &'g Module,
    values: Values,
}

impl<'g> Plugged<'g> {
    fn new(module: &'g Module) -> Self {
        Self {
            module,
            values: Values::new(),
        }
    }
}

/// How a module is named: by its name or its reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModuleKey<'a> {
    /// Its name, without blanks around it.
    Name(&'a str),
    /// Its reference.
    Reference(u16),
}

impl<'a> From<&'a str> for ModuleKey<'a> {
    fn from(name: &'a str) -> Self {
        Self::Name(name)
    }
}

impl From<u16> for ModuleKey<'_> {
    fn from(reference: u16) -> Self {
        Self::Reference(reference)
    }
}

/// How a parameter is named: by its name, its reference, or its place when both are used several times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKey<'a> {
    /// Its name, without blanks around it.
    Name(&'a str),
    /// Its reference.
    Reference(u16),
    /// Octet where it stands in its part, and its reference.
    Place(u8, u16),
}

impl<'a> From<&'a str> for ParameterKey<'a> {
    fn from(name: &'a str) -> Self {
        Self::Name(name)
    }
}

impl From<u16> for ParameterKey<'_> {
    fn from(reference: u16) -> Self {
        Self::Reference(reference)
    }
}

impl From<(u8, u16)> for ParameterKey<'_> {
    fn from((offset, reference): (u8, u16)) -> Self {
        Self::Place(offset, reference)
    }
}

/// A value for a parameter: a number, or one of its texts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PrmValue<'a> {
    /// A number.
    Number(i64),
    /// A text of its `PrmText`.
    Text(&'a str),
}

impl From<i64> for PrmValue<'_> {
    fn from(number: i64) -> Self {
        Self::Number(number)
    }
}

impl<'a> From<&'a str> for PrmValue<'a> {
    fn from(text: &'a str) -> Self {
        Self::Text(text)
    }
}

/// A parameter of the station or a module with the value it has now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Setting<'g> {
    /// The parameter.
    pub parameter: &'g Parameter,
    /// Octet where it stands in its part.
    pub offset: u8,
    /// Its value.
    pub value: i64,
    /// The text of its value.
    pub text: Option<&'g str>,
}

impl<'g> Setup<'g> {
    /// The description it is made with.
    pub fn gsd(&self) -> &'g Gsd {
        self.gsd
    }

    /// The modules by slot.
    pub fn modules(&self) -> impl Iterator<Item = (u8, &'g Module)> {
        self.slots.iter().map(|(&slot, plugged)| (slot, plugged.module))
    }

    /// Puts a module into the first free slot where it may be; returns the slot.
    ///
    /// # Errors
    ///
    /// [`SetupError`]: there is no such module, or no free slot for it.
    pub fn plug<'k>(&mut self, module: impl Into<ModuleKey<'k>>) -> Result<u8, SetupError> {
        let module = self.find_module(module.into())?;
        let may_be_in = |slot: &Slot| module.reference.is_some_and(|own| slot.allowed.contains(own.into()));
        let free = match &self.gsd.slots[..] {
            [] => (1..=self.max_module()).find(|slot| !self.slots.contains_key(slot)),
            slots => {
                let free = slots.iter().filter(|slot| !self.slots.contains_key(&slot.number));
                free.filter(|slot| may_be_in(slot)).map(|slot| slot.number).min()
            }
        };
        let slot = free.ok_or_else(|| SetupError::NoFreeSlot {
            module: module.name.clone(),
            taken: self.slots.len(),
        })?;
        self.slots.insert(slot, Plugged::new(module));
        Ok(slot)
    }

    /// Puts a module into a slot, in place of the one that is there.
    ///
    /// # Errors
    ///
    /// [`SetupError`]: there is no such module or slot, or the module may not be there.
    pub fn plug_at<'k>(&mut self, slot: u8, module: impl Into<ModuleKey<'k>>) -> Result<(), SetupError> {
        let module = self.find_module(module.into())?;
        self.check_not_fixed(slot)?;
        match &self.gsd.slots[..] {
            [] => {
                let most = self.max_module();
                if !(1..=most).contains(&slot) {
                    return Err(SetupError::NoSuchSlot {
                        slot,
                        slots: format!("1 to {most}"),
                    });
                }
            }
            slots => {
                let Some(rule) = slots.iter().find(|rule| rule.number == slot) else {
                    let slots = listed(slots.iter().map(|slot| slot.number.to_string()));
                    return Err(SetupError::NoSuchSlot { slot, slots });
                };
                let is_allowed = module.reference.is_some_and(|own| rule.allowed.contains(own.into()));
                if !is_allowed {
                    let allowed = self.gsd.modules.iter().filter(|module| {
                        module
                            .reference
                            .is_some_and(|reference| rule.allowed.contains(reference.into()))
                    });
                    return Err(SetupError::ModuleNotAllowed {
                        slot,
                        module: module.name.clone(),
                        allowed: listed(allowed.map(|module| format!("`{}`", module.name))),
                    });
                }
            }
        }
        self.slots.insert(slot, Plugged::new(module));
        Ok(())
    }

    /// Takes the module out of a slot, with its values; nothing happens when the slot is empty.
    ///
    /// # Errors
    ///
    /// [`SetupError::Fixed`] for a preset module that must stay.
    pub fn unplug(&mut self, slot: u8) -> Result<(), SetupError> {
        self.check_not_fixed(slot)?;
        self.slots.remove(&slot);
        Ok(())
    }

    /// Sets a parameter of the station.
    ///
    /// # Errors
    ///
    /// [`SetupError`]: no such parameter, several with this name, or a value that is not allowed.
    pub fn set<'k, 'v>(
        &mut self,
        parameter: impl Into<ParameterKey<'k>>,
        value: impl Into<PrmValue<'v>>,
    ) -> Result<(), SetupError> {
        let (place, value) = self.chosen(Part::Station, &self.gsd.prm, parameter.into(), value.into())?;
        self.station.insert(place, value);
        Ok(())
    }

    /// Sets a parameter of the module in a slot.
    ///
    /// # Errors
    ///
    /// As [`set`](Self::set), and [`SetupError::Empty`] when no module is there.
    pub fn set_in<'k, 'v>(
        &mut self,
        slot: u8,
        parameter: impl Into<ParameterKey<'k>>,
        value: impl Into<PrmValue<'v>>,
    ) -> Result<(), SetupError> {
        let module = self.module_in(slot)?;
        let (place, value) = self.chosen(Part::Slot(slot), &module.prm, parameter.into(), value.into())?;
        if let Some(plugged) = self.slots.get_mut(&slot) {
            plugged.values.insert(place, value);
        }
        Ok(())
    }

    /// The parameters of the station or a module with their values, in the file's order.
    ///
    /// # Errors
    ///
    /// [`SetupError::Empty`] when no module is in the slot.
    pub fn settings(&self, part: Part) -> Result<Vec<Setting<'g>>, SetupError> {
        let (layout, values) = match part {
            Part::Station => (&self.gsd.prm, &self.station),
            Part::Slot(slot) => (&self.module_in(slot)?.prm, &self.plugged(slot)?.values),
        };
        let setting = |(number, place): (usize, &PrmPlace)| {
            let parameter = self.gsd.parameters.get(&place.reference)?;
            let value = value_of(part, parameter, values.get(&number));
            Some(Setting {
                parameter,
                offset: place.offset,
                value,
                text: self.gsd.text_of(parameter, value),
            })
        };
        Ok(layout.places.iter().enumerate().filter_map(setting).collect())
    }

    /// Uses DP-V1 this way; without it the file's own octets hold, with what it says is required.
    ///
    /// # Errors
    ///
    /// [`SetupError::NotSupported`] for a slave without DP-V1, without an alarm that is asked for, or without a watchdog in 1 ms.
    pub fn use_v1(&mut self, status: V1Status) -> Result<(), SetupError> {
        let dpv1 = &self.gsd.dpv1;
        let needs = [
            (true, dpv1.dpv1_slave, "DPV1_Slave"),
            (status.watchdog_1ms(), dpv1.wd_base_1ms_supp, "WD_Base_1ms_supp"),
            (status.fail_safe(), self.gsd.slave.fail_safe, "Fail_Safe"),
        ];
        for (asked, supported, keyword) in needs {
            if asked && !supported {
                return Err(SetupError::NotSupported {
                    keyword: keyword.to_owned(),
                });
            }
        }
        for (name, asked, supported) in alarm_pairs(&kinds(status.alarms()), &dpv1.alarms_supp) {
            if asked && !supported {
                return Err(SetupError::NotSupported {
                    keyword: format!("{name}_Alarm_supp"),
                });
            }
        }
        self.v1 = Some(status);
        Ok(())
    }

    /// What the slave gets in Clear.
    ///
    /// # Errors
    ///
    /// [`SetupError::NotSupported`] for empty outputs without `Fail_Safe`, [`SetupError::Required`] for zeros with `Fail_Safe_required`.
    pub fn clear_outputs(&mut self, outputs: ClearOutputs) -> Result<(), SetupError> {
        let slave = &self.gsd.slave;
        match outputs {
            ClearOutputs::Empty if !slave.fail_safe => Err(not_supported("Fail_Safe")),
            ClearOutputs::Zeros if slave.fail_safe_required => Err(SetupError::Required {
                keyword: "Fail_Safe_required",
            }),
            _ => {
                self.clear_outputs = outputs;
                Ok(())
            }
        }
    }

    /// Watches the slave with at least this time.
    pub fn watchdog(&mut self, time: Duration) {
        self.watchdog = Some(time);
    }

    /// Lets the slave obey Sync.
    ///
    /// # Errors
    ///
    /// [`SetupError::NotSupported`] without `Sync_Mode_supp`.
    pub fn sync(&mut self) -> Result<(), SetupError> {
        if !self.gsd.slave.sync_mode_supp {
            return Err(not_supported("Sync_Mode_supp"));
        }
        self.sync = Demand::Yes;
        Ok(())
    }

    /// Lets the slave obey Freeze.
    ///
    /// # Errors
    ///
    /// [`SetupError::NotSupported`] without `Freeze_Mode_supp`.
    pub fn freeze(&mut self) -> Result<(), SetupError> {
        if !self.gsd.slave.freeze_mode_supp {
            return Err(not_supported("Freeze_Mode_supp"));
        }
        self.freeze = Demand::Yes;
        Ok(())
    }

    /// The data unit of Chk_Cfg.
    ///
    /// # Errors
    ///
    /// [`SetupError`]: no modules, an empty slot before a used one, more modules or data than the slave takes.
    pub fn identifiers(&self) -> Result<Vec<u8>, SetupError> {
        let Some(&last) = self.slots.keys().next_back() else {
            return Err(SetupError::NoModules);
        };
        let empty = match &self.gsd.slots[..] {
            [] => (1..last).find(|slot| !self.slots.contains_key(slot)),
            slots => {
                let before = slots.iter().map(|slot| slot.number).filter(|&slot| slot < last);
                before.filter(|slot| !self.slots.contains_key(slot)).min()
            }
        };
        if let Some(slot) = empty {
            return Err(SetupError::Empty { slot });
        }
        let slave = &self.gsd.slave;
        if let Some(max) = slave.max_module
            && slave.modular_station
            && self.slots.len() > usize::from(max)
        {
            return Err(SetupError::TooMany {
                what: "modules",
                got: self.slots.len(),
                max: max.into(),
                keyword: "Max_Module",
            });
        }
        let config: Vec<u8> = self
            .slots
            .values()
            .flat_map(|plugged| plugged.module.config.iter().copied())
            .collect();
        let IoLengths { inputs, outputs } = io_lengths(&config)?;
        let limits = [
            (
                "octets of inputs",
                inputs,
                slave.max_input_len.map(usize::from),
                "Max_Input_Len",
            ),
            (
                "octets of outputs",
                outputs,
                slave.max_output_len.map(usize::from),
                "Max_Output_Len",
            ),
            (
                "octets of data",
                inputs + outputs,
                slave.max_data_len.map(usize::from),
                "Max_Data_Len",
            ),
        ];
        for (what, got, max, keyword) in limits {
            if let Some(max) = max
                && slave.modular_station
                && got > max
            {
                return Err(SetupError::TooMany {
                    what,
                    got,
                    max,
                    keyword,
                });
            }
        }
        Ok(config)
    }

    /// The user parameters of Set_Prm, which follow its seven fixed octets.
    ///
    /// # Errors
    ///
    /// [`SetupError`]: a description that contradicts itself, PROFIsafe modules, more octets than the slave takes.
    pub fn user_prm(&self) -> Result<Vec<u8>, SetupError> {
        let mut octets = self.station_prm()?;
        for (&slot, plugged) in &self.slots {
            let module = plugged.module;
            if !module.failsafe_prm.is_empty() || module.f_param_desc_crc.is_some() {
                return Err(SetupError::Failsafe {
                    module: module.name.clone(),
                });
            }
            let len = match module.prm.len {
                Some(len) => len.into(),
                None => self.end(&module.prm),
            };
            octets.extend(self.part(Part::Slot(slot), &module.prm, len, &plugged.values)?);
        }
        let (max, keyword) = match self.gsd.prm.len {
            Some(max) => (usize::from(max).min(MAX_USER_PRM), "Max_User_Prm_Data_Len"),
            None => (MAX_USER_PRM, "Set_Prm"),
        };
        if octets.len() > max {
            return Err(SetupError::TooMany {
                what: "octets of user parameters",
                got: octets.len(),
                max,
                keyword,
            });
        }
        Ok(octets)
    }

    /// What a master has to know about the slave at this address.
    ///
    /// # Errors
    ///
    /// As [`identifiers`](Self::identifiers) and [`user_prm`](Self::user_prm); [`SetupError::NoIdent`]; [`SetupError::Watchdog`].
    pub fn slave_config(&self, address: Address) -> Result<SlaveConfig, SetupError> {
        let ident = self.gsd.general.ident_number.ok_or(SetupError::NoIdent)?;
        let user_prm = self.user_prm()?;
        let in_milliseconds =
            self.gsd.dpv1.dpv1_slave && V1Status::from_user_prm(&user_prm).is_some_and(V1Status::watchdog_1ms);
        let mut slave = SlaveConfig::new(address, ident, &self.identifiers()?)?.with_user_prm(&user_prm)?;
        slave.watchdog = match self.watchdog {
            // The factors count milliseconds: ten times the time in their usual unit.
            Some(time) if in_milliseconds => {
                let scaled = Duration::from_nanos(time.as_nanos().saturating_mul(10));
                Some(Watchdog::at_least(scaled).map_err(|_| SetupError::Watchdog { time })?)
            }
            Some(time) => Some(Watchdog::at_least(time).map_err(|_| SetupError::Watchdog { time })?),
            None => None,
        };
        slave.sync = self.sync;
        slave.freeze = self.freeze;
        let interval = self.gsd.slave.min_slave_intervall.unwrap_or(0);
        slave.min_slave_interval = Duration::from_micros(100 * u64::from(interval));
        slave.clear_outputs = self.clear_outputs;
        Ok(slave)
    }

    /// The configuration, checked: identifiers and their lengths.
    ///
    /// # Errors
    ///
    /// As [`identifiers`](Self::identifiers).
    pub fn configuration(&self) -> Result<Configuration, SetupError> {
        Ok(Configuration::new(&self.identifiers()?)?)
    }

    /// Slot and module of an identifier, counted from 0 as in identifier-related diagnosis; a module may have several.
    pub fn module_at(&self, place: usize) -> Option<(u8, &'g Module)> {
        let counted = self
            .modules()
            .flat_map(|(slot, module)| places(&module.config).map(move |_| (slot, module)));
        counted.into_iter().nth(place)
    }

    fn station_prm(&self) -> Result<Vec<u8>, SetupError> {
        let gsd = self.gsd;
        if !gsd.failsafe_prm.is_empty() {
            let module = gsd.general.model_name.clone().unwrap_or_default();
            return Err(SetupError::Failsafe { module });
        }
        let mut octets = match &gsd.slave.user_prm_data {
            Some(data) if gsd.prm.is_empty() => data.clone(),
            _ => self.part(Part::Station, &gsd.prm, self.end(&gsd.prm), &self.station)?,
        };
        if gsd.dpv1.dpv1_slave {
            self.write_v1(&mut octets);
        }
        Ok(octets)
    }

    /// DPV1_Status_1…3: bits of the file stay, what is asked for or required comes to them.
    fn write_v1(&self, octets: &mut Vec<u8>) {
        let mut status = self.v1.unwrap_or_default();
        if self.v1.is_none() {
            let modules = self
                .slots
                .values()
                .map(|plugged| alarms(&plugged.module.alarms_required));
            let required = modules.fold(alarms(&self.gsd.dpv1.alarms_required), AlarmTypes::with);
            let [_, _, mode] = status.octets();
            if required != AlarmTypes::NONE || self.gsd.dpv1.c1_read_write_required {
                status = V1Status([V1Status::ENABLED.octets()[0], required.0, mode]);
            }
        }
        let [mut first, second, third] = status.octets();
        if self.clear_outputs == ClearOutputs::Empty {
            first |= FAIL_SAFE;
        }
        let fits = self.gsd.prm.len.is_none_or(|max| usize::from(max) >= 3);
        if octets.len() < 3 && ([first, second, third] != [0; 3] || !octets.is_empty()) && fits {
            octets.resize(3, 0);
        }
        if let Some([octet_1, octet_2, octet_3]) = octets.first_chunk_mut() {
            *octet_1 |= first;
            *octet_2 |= second;
            if self.v1.is_some() {
                *octet_3 = *octet_3 & !ALARM_MODE | third;
            }
        }
    }

    /// Octets of the station's or a module's part.
    fn part(&self, part: Part, layout: &PrmLayout, len: usize, values: &Values) -> Result<Vec<u8>, SetupError> {
        let mut octets = vec![0; len];
        let broken = |what: String| SetupError::Broken { part, what };
        for constant in &layout.constants {
            let start = usize::from(constant.offset);
            let end = start + constant.octets.len();
            match octets.get_mut(start..end) {
                Some(target) => target.copy_from_slice(&constant.octets),
                None => return Err(broken(format!("a constant ends at octet {end} of {len}"))),
            }
        }
        for (number, place) in layout.places.iter().enumerate() {
            let Some(parameter) = self.gsd.parameters.get(&place.reference) else {
                return Err(broken(format!("there is no parameter {}", place.reference)));
            };
            let value = value_of(part, parameter, values.get(&number));
            if !parameter.data_type.write(value, &mut octets, place.offset.into()) {
                let Parameter { name, data_type, .. } = parameter;
                return Err(broken(format!(
                    "parameter `{name}` ({data_type}) at octet {} of {len} cannot hold {value}",
                    place.offset
                )));
            }
        }
        Ok(octets)
    }

    /// Octets up to the end of the last constant or parameter.
    fn end(&self, layout: &PrmLayout) -> usize {
        let constants = layout
            .constants
            .iter()
            .map(|constant| usize::from(constant.offset) + constant.octets.len());
        let places = layout.places.iter().filter_map(|place| {
            let parameter = self.gsd.parameters.get(&place.reference)?;
            Some(usize::from(place.offset) + parameter.data_type.octets())
        });
        constants.chain(places).max().unwrap_or(0)
    }

    /// Place and number of a value that someone chose.
    fn chosen(
        &self,
        part: Part,
        layout: &PrmLayout,
        key: ParameterKey<'_>,
        value: PrmValue<'_>,
    ) -> Result<(usize, i64), SetupError> {
        let (number, parameter) = self.find_parameter(part, layout, key)?;
        let name = || parameter.name.clone();
        let value = match value {
            PrmValue::Number(value) => value,
            PrmValue::Text(text) => {
                let texts = parameter.text.and_then(|text| self.gsd.prm_texts.get(&text));
                let all = texts.into_iter().flat_map(|texts| &texts.texts);
                let all = all.filter(|&(&value, _)| parameter.allows(value));
                match all.clone().find(|(_, known)| known.trim() == text.trim()) {
                    Some((&value, _)) => value,
                    None => {
                        return Err(SetupError::NoSuchText {
                            part,
                            name: name(),
                            text: text.to_owned(),
                            allowed: listed(all.map(|(_, text)| format!("`{text}`"))),
                        });
                    }
                }
            }
        };
        if !parameter.allows(value) {
            let range = parameter.data_type.range();
            let allowed = match parameter.values.is_any() {
                true => format!("{} to {}", range.start(), range.end()),
                false => parameter.values.to_string(),
            };
            return Err(SetupError::ValueNotAllowed {
                part,
                name: name(),
                value,
                allowed,
            });
        }
        if !parameter.changeable && value != parameter.default {
            return Err(SetupError::NotChangeable { part, name: name() });
        }
        Ok((number, value))
    }

    fn find_parameter(
        &self,
        part: Part,
        layout: &PrmLayout,
        key: ParameterKey<'_>,
    ) -> Result<(usize, &'g Parameter), SetupError> {
        let matches = |place: &PrmPlace, parameter: &Parameter| match key {
            ParameterKey::Name(name) => parameter.name.trim() == name.trim(),
            ParameterKey::Reference(reference) => place.reference == reference,
            ParameterKey::Place(offset, reference) => place.reference == reference && place.offset == offset,
        };
        let found: Vec<(usize, &PrmPlace, &'g Parameter)> = layout
            .places
            .iter()
            .enumerate()
            .filter_map(|(number, place)| {
                let parameter = self.gsd.parameters.get(&place.reference)?;
                matches(place, parameter).then_some((number, place, parameter))
            })
            .collect();
        let key = match key {
            ParameterKey::Name(name) => format!("`{}`", name.trim()),
            ParameterKey::Reference(reference) => reference.to_string(),
            ParameterKey::Place(offset, reference) => format!("{reference} at octet {offset}"),
        };
        match found[..] {
            [(number, _, parameter)] => Ok((number, parameter)),
            [] => {
                let settable = layout
                    .places
                    .iter()
                    .filter_map(|place| self.gsd.parameters.get(&place.reference));
                let settable = settable.filter(|parameter| parameter.values.only().is_none());
                let known = listed(settable.map(|parameter| format!("`{}`", parameter.name)));
                Err(SetupError::NoSuchParameter { part, key, known })
            }
            _ => {
                let places = found
                    .iter()
                    .map(|(_, place, _)| format!("{} at octet {}", place.reference, place.offset));
                Err(SetupError::Ambiguous {
                    part,
                    key,
                    places: listed(places),
                })
            }
        }
    }

    fn find_module(&self, key: ModuleKey<'_>) -> Result<&'g Module, SetupError> {
        let found = match key {
            ModuleKey::Name(name) => self.gsd.modules.iter().find(|module| module.name.trim() == name.trim()),
            ModuleKey::Reference(reference) => by_reference(self.gsd, reference),
        };
        found.ok_or_else(|| SetupError::NoSuchModule {
            key: match key {
                ModuleKey::Name(name) => format!("`{}`", name.trim()),
                ModuleKey::Reference(reference) => format!("with reference {reference}"),
            },
            known: listed(self.gsd.modules.iter().map(|module| format!("`{}`", module.name))),
        })
    }

    fn plugged(&self, slot: u8) -> Result<&Plugged<'g>, SetupError> {
        self.slots.get(&slot).ok_or(SetupError::Empty { slot })
    }

    fn module_in(&self, slot: u8) -> Result<&'g Module, SetupError> {
        self.plugged(slot).map(|plugged| plugged.module)
    }

    fn check_not_fixed(&self, slot: u8) -> Result<(), SetupError> {
        match self.slots.get(&slot) {
            Some(Plugged { module, .. }) if self.gsd.slave.fix_preset_modules && module.preset => {
                let module = module.name.clone();
                Err(SetupError::Fixed { slot, module })
            }
            _ => Ok(()),
        }
    }

    /// Most modules; a station that is not modular has one.
    fn max_module(&self) -> u8 {
        match (self.gsd.slave.modular_station, self.gsd.slave.max_module) {
            (true, Some(max)) => max,
            (true, None) => u8::MAX,
            (false, _) => 1,
        }
    }
}

fn value_of(part: Part, parameter: &Parameter, set: Option<&i64>) -> i64 {
    match (set, part) {
        (Some(&value), _) => value,
        (None, Part::Slot(slot)) if parameter.is_slot_number() => slot.into(),
        (None, _) => parameter.default,
    }
}

fn by_reference(gsd: &Gsd, reference: u16) -> Option<&Module> {
    gsd.modules.iter().find(|module| module.reference == Some(reference))
}

fn not_supported(keyword: &str) -> SetupError {
    SetupError::NotSupported {
        keyword: keyword.to_owned(),
    }
}

/// Bits of DPV1_Status_2 with their kinds.
fn alarms(kinds: &AlarmKinds) -> AlarmTypes {
    let bits = [
        (kinds.diagnostic, AlarmTypes::DIAGNOSIS),
        (kinds.process, AlarmTypes::PROCESS),
        (kinds.pull_plug, AlarmTypes::PULL_PLUG),
        (kinds.status, AlarmTypes::STATUS),
        (kinds.update, AlarmTypes::UPDATE),
        (kinds.manufacturer_specific, AlarmTypes::VENDOR),
    ];
    let set = bits.into_iter().filter_map(|(is_set, bit)| is_set.then_some(bit));
    set.fold(AlarmTypes::NONE, AlarmTypes::with)
}

fn kinds(alarms: AlarmTypes) -> AlarmKinds {
    AlarmKinds {
        diagnostic: alarms.contains_all(AlarmTypes::DIAGNOSIS),
        process: alarms.contains_all(AlarmTypes::PROCESS),
        pull_plug: alarms.contains_all(AlarmTypes::PULL_PLUG),
        status: alarms.contains_all(AlarmTypes::STATUS),
        update: alarms.contains_all(AlarmTypes::UPDATE),
        manufacturer_specific: alarms.contains_all(AlarmTypes::VENDOR),
    }
}

/// Fail_Safe in DPV1_Status_1.
const FAIL_SAFE: u8 = 0x40;
/// Alarm_Mode in DPV1_Status_3.
const ALARM_MODE: u8 = 0x07;

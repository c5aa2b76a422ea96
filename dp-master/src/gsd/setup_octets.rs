//! The octets of Chk_Cfg and Set_Prm that follow from a project.
//!
//! ```text
//! user parameters   station: constants, then parameters over them; DPV1_Status_1…3 are its first three octets
//!                   then each module in the order of the slots: constants, then parameters over them
//! identifiers       those of the modules in the order of the slots
//! ```
//!
//! Source: guideline "Volume 1: GSD" (Ext_User_Prm_Data, Ext_Module_Prm_Data_Len); IEC 61158-6-3, coding of Set_Prm.

use super::prm::{Parameter, PrmLayout};
use super::setup::Setup;
use super::setup_error::{Part, SetupError};
use super::setup_values::{Values, value_of};
use crate::address::Address;
use crate::dp::v1::{AlarmTypes, V1Status};
use crate::dp::{ClearOutputs, Configuration, IoLengths, MAX_USER_PRM, SlaveConfig, Watchdog, io_lengths};
use crate::time::Duration;

impl Setup<'_> {
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

    /// The configuration, checked: identifiers and their lengths.
    ///
    /// # Errors
    ///
    /// As [`identifiers`](Self::identifiers).
    pub fn configuration(&self) -> Result<Configuration, SetupError> {
        Ok(Configuration::new(&self.identifiers()?)?)
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
                .map(|plugged| plugged.module.alarms_required.types());
            let required = modules.fold(self.gsd.dpv1.alarms_required.types(), AlarmTypes::with);
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
}

/// Fail_Safe in DPV1_Status_1.
const FAIL_SAFE: u8 = 0x40;
/// Alarm_Mode in DPV1_Status_3.
const ALARM_MODE: u8 = 0x07;

//! A project for one slave: which modules are in its slots, and what else is asked of it.
//!
//! Values of parameters are in `setup_values`, the octets that follow from both in `setup_octets`.
//!
//! Source: guideline "Volume 1: GSD" (SlotDefinition, Preset, Max_Module).

use std::collections::BTreeMap;

use super::check::alarm_pairs;
use super::device::Gsd;
use super::module::{AlarmKinds, Module, Slot};
use super::setup_error::{SetupError, listed};
use super::setup_values::Values;
use crate::dp::v1::V1Status;
use crate::dp::{ClearOutputs, Demand, places};
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
    pub(super) gsd: &'g Gsd,
    pub(super) slots: BTreeMap<u8, Plugged<'g>>,
    pub(super) station: Values,
    pub(super) v1: Option<V1Status>,
    pub(super) clear_outputs: ClearOutputs,
    pub(super) watchdog: Option<Duration>,
    pub(super) sync: Demand,
    pub(super) freeze: Demand,
}

/// A module in its slot.
#[derive(Debug, Clone)]
pub(super) struct Plugged<'g> {
    pub(super) module: &'g Module,
    pub(super) values: Values,
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
        for (name, asked, supported) in alarm_pairs(&AlarmKinds::of_types(status.alarms()), &dpv1.alarms_supp) {
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

    /// Slot and module of an identifier, counted from 0 as in identifier-related diagnosis; a module may have several.
    pub fn module_at(&self, place: usize) -> Option<(u8, &'g Module)> {
        let counted = self
            .modules()
            .flat_map(|(slot, module)| places(&module.config).map(move |_| (slot, module)));
        counted.into_iter().nth(place)
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

    pub(super) fn plugged(&self, slot: u8) -> Result<&Plugged<'g>, SetupError> {
        self.slots.get(&slot).ok_or(SetupError::Empty { slot })
    }

    pub(super) fn module_in(&self, slot: u8) -> Result<&'g Module, SetupError> {
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

fn by_reference(gsd: &Gsd, reference: u16) -> Option<&Module> {
    gsd.modules.iter().find(|module| module.reference == Some(reference))
}

fn not_supported(keyword: &str) -> SetupError {
    SetupError::NotSupported {
        keyword: keyword.to_owned(),
    }
}

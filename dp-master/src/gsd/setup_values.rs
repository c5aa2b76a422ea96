//! Values of parameters in a project: chosen by name, checked against the file.

use std::collections::BTreeMap;

use super::prm::{Parameter, PrmLayout, PrmPlace};
use super::setup::Setup;
use super::setup_error::{Part, SetupError, listed};

/// Values that were set, by the number of the place in its layout.
pub(super) type Values = BTreeMap<usize, i64>;

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
}

/// The value that was set, the number of the slot where the file asks for it, or the default.
pub(super) fn value_of(part: Part, parameter: &Parameter, set: Option<&i64>) -> i64 {
    match (set, part) {
        (Some(&value), _) => value,
        (None, Part::Slot(slot)) if parameter.is_slot_number() => slot.into(),
        (None, _) => parameter.default,
    }
}

//! A diagnosis in words: the texts of the GSD file for what a slave sends.

use core::fmt;
use serde::Serialize;

use super::device::Gsd;
use super::module::Module;
use super::setup::Setup;
use super::unit_diag::{DiagText, UnitDiag};
use crate::dp::v1::{AlarmType, V1Block, V1Status};
use crate::dp::{Block, ChannelDiag, Diagnosis};

/// What a text is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// Bits of a device-related block, counted from the octet after its header.
    Device {
        /// Lowest bit.
        first_bit: u16,
        /// Highest bit.
        last_bit: u16,
    },
    /// An alarm or a status message of DP-V1 as a whole.
    Message {
        /// Slot it names.
        slot: u8,
    },
    /// A module, counted from 0 as on the bus.
    Module {
        /// Its place.
        place: u16,
    },
    /// A channel of a module.
    Channel {
        /// Place of the module.
        place: u16,
        /// Channel.
        channel: u8,
    },
    /// The revision the slave names.
    Revision,
    /// Octets that cannot be divided into blocks.
    Malformed,
}

/// One statement of a diagnosis in words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DiagnosisText {
    /// What it is about.
    pub origin: Origin,
    /// The text.
    pub text: String,
    /// What the maker says about it.
    pub help: Option<String>,
}

impl fmt::Display for DiagnosisText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Gsd {
    /// The extended diagnosis in words, when nothing is known of the modules that are plugged.
    pub fn diagnosis_texts(&self, diagnosis: &Diagnosis) -> Vec<DiagnosisText> {
        texts(self, None, diagnosis)
    }
}

impl Setup<'_> {
    /// The extended diagnosis in words, with the names of the modules.
    ///
    /// # Example
    ///
    /// ```
    /// use dp_master::{dp::Diagnosis, gsd};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let reading = gsd::parse(b"#Profibus_DP
    /// Modular_Station = 1
    /// Max_Module = 8
    /// Unit_Diag_Bit(9) = \"fuse blown\"
    /// Channel_Diag(17) = \"sensor dirty\"
    /// Module = \"AI 4\" 0x43
    /// EndModule");
    /// let mut station = reading.gsd.configure();
    /// station.plug("AI 4")?;
    /// station.plug("AI 4")?;
    /// // Six standard octets; device-related; identifier-related, module 1; channel 3 of it.
    /// let diagnosis = Diagnosis::parse(&[0x08, 0x0C, 0, 2, 0, 1, 0x03, 0x00, 0x02, 0x42, 0x02, 0x81, 0x43, 0xB1])?;
    /// let texts: Vec<String> = station.diagnosis_texts(&diagnosis).iter().map(|text| text.to_string()).collect();
    /// assert_eq!(texts, [
    ///     "fuse blown",
    ///     "slot 2 `AI 4` has a diagnosis",
    ///     "slot 2 `AI 4`: input channel 3 (word): sensor dirty",
    /// ]);
    /// # Ok(())
    /// # }
    /// ```
    pub fn diagnosis_texts(&self, diagnosis: &Diagnosis) -> Vec<DiagnosisText> {
        texts(self.gsd(), Some(self), diagnosis)
    }
}

fn texts(gsd: &Gsd, setup: Option<&Setup<'_>>, diagnosis: &Diagnosis) -> Vec<DiagnosisText> {
    let mut texts = Vec::new();
    for block in diagnosis.blocks() {
        match block {
            Block::Device(octets) => device(gsd, setup, octets, &mut texts),
            Block::Identifiers(modules) => texts.extend(modules.iter().map(|place| DiagnosisText {
                origin: Origin::Module { place: place as u16 },
                text: format!("{} has a diagnosis", Named::at(setup, place)),
                help: None,
            })),
            Block::Channel(channel) => texts.push(channel_text(gsd, setup, channel)),
            Block::Revision(revision) => texts.push(DiagnosisText {
                origin: Origin::Revision,
                text: format!("revision {revision}"),
                help: None,
            }),
            Block::Malformed { fault, .. } => texts.push(DiagnosisText {
                origin: Origin::Malformed,
                text: fault.to_string(),
                help: None,
            }),
        }
    }
    texts
}

/// A module as a reader would call it.
struct Named<'g> {
    place: usize,
    module: Option<(u8, &'g Module)>,
}

impl<'g> Named<'g> {
    fn at(setup: Option<&Setup<'g>>, place: usize) -> Self {
        let module = setup.and_then(|setup| setup.module_at(place));
        Self { place, module }
    }
}

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.module {
            Some((slot, module)) => write!(f, "slot {slot} `{}`", module.name),
            None => write!(f, "module {} on the bus", self.place),
        }
    }
}

fn channel_text(gsd: &Gsd, setup: Option<&Setup<'_>>, channel: ChannelDiag) -> DiagnosisText {
    let place = usize::from(channel.module);
    let named = Named::at(setup, place);
    let own = named
        .module
        .and_then(|(_, module)| module.channel_diag.get(&channel.error.0));
    let known = own.or_else(|| gsd.channel_diag.get(&channel.error.0));
    let fault = match (channel.error.text(), known) {
        (Some(text), _) => text.to_owned(),
        (None, Some(known)) => known.text.clone(),
        (None, None) => format!("error {}", channel.error.0),
    };
    let (direction, unit) = (channel.direction.text(), channel.unit.text());
    DiagnosisText {
        origin: Origin::Channel {
            place: place as u16,
            channel: channel.channel,
        },
        text: format!("{named}: {direction} channel {} ({unit}): {fault}", channel.channel),
        help: known.and_then(|known| known.help.clone()),
    }
}

fn device(gsd: &Gsd, setup: Option<&Setup<'_>>, octets: &[u8], texts: &mut Vec<DiagnosisText>) {
    let kind = octets.first().map_or(0, |&kind| u16::from(kind));
    let typed = gsd.unit_diag_types.get(&kind).filter(|_| gsd.dpv1.dpv1_slave);
    // With DP-V1 the block names kind, slot and specifier first.
    let in_v1 = setup.is_some_and(|setup| {
        let user = setup.user_prm().unwrap_or_default();
        gsd.dpv1.dpv1_slave && V1Status::from_user_prm(&user).is_some_and(V1Status::enabled)
    });
    let mut own = None;
    let mut from = 0;
    if (in_v1 || typed.is_some())
        && let Some(message) = V1Block::parse(octets)
    {
        let (slot, what) = message_text(message);
        let module = setup.and_then(|setup| setup.modules().find(|&(number, _)| number == slot));
        let place = match module {
            Some((_, module)) => format!("slot {slot} `{}`", module.name),
            None => format!("slot {slot}"),
        };
        texts.push(DiagnosisText {
            origin: Origin::Message { slot },
            text: format!("{place}: {what}"),
            help: None,
        });
        own = module
            .map(|(_, module)| &module.unit_diag)
            .filter(|diag| !diag.is_empty());
        from = 24;
    }
    let diag = typed.or(own).unwrap_or(&gsd.unit_diag);
    if diag.is_empty() {
        let rest = octets.get(usize::from(from / 8)..).unwrap_or(&[]);
        if !rest.is_empty() {
            let hex: Vec<String> = rest.iter().map(|octet| format!("{octet:02X}")).collect();
            texts.push(DiagnosisText {
                origin: Origin::Device {
                    first_bit: from,
                    last_bit: (8 * octets.len() - 1) as u16,
                },
                text: format!("of the device: {}", hex.join(" ")),
                help: None,
            });
        }
        return;
    }
    bits(diag, octets, from, texts);
}

fn message_text(message: V1Block<'_>) -> (u8, String) {
    match message {
        V1Block::Alarm(alarm) => {
            let name = match alarm.alarm_type {
                AlarmType::DIAGNOSIS => "diagnosis alarm".to_owned(),
                AlarmType::PROCESS => "process alarm".to_owned(),
                AlarmType::PULL => "pull alarm".to_owned(),
                AlarmType::PLUG => "plug alarm".to_owned(),
                AlarmType::STATUS => "status alarm".to_owned(),
                AlarmType::UPDATE => "update alarm".to_owned(),
                AlarmType(other) => format!("alarm {other}"),
            };
            (alarm.slot, name)
        }
        V1Block::Status { status_type, slot, .. } => {
            let name = match status_type {
                1 => "status message".to_owned(),
                2 => "module status".to_owned(),
                other => format!("status {other}"),
            };
            (slot, name)
        }
    }
}

/// The texts of bits and areas in their order, and the bits without text that are set.
fn bits(diag: &UnitDiag, octets: &[u8], from: u16, texts: &mut Vec<DiagnosisText>) {
    let bit = |number: u16| {
        let octet = octets.get(usize::from(number / 8))?;
        Some(octet >> (number % 8) & 1 == 1)
    };
    let mut found: Vec<(u16, DiagnosisText)> = Vec::new();
    let mut say = |first_bit: u16, last_bit: u16, text: String, help: Option<String>| {
        let origin = Origin::Device { first_bit, last_bit };
        found.push((first_bit, DiagnosisText { origin, text, help }));
    };
    for area in &diag.areas {
        let set = (area.first..=area.last).filter(|&number| bit(number) == Some(true));
        let value = set
            .filter(|number| number - area.first < 32)
            .fold(0_u32, |sum, number| sum | 1 << (number - area.first));
        let is_there = bit(area.first).is_some();
        match area.values.get(&value) {
            Some(DiagText { text, help }) if is_there => say(area.first, area.last, text.clone(), help.clone()),
            None if value != 0 => {
                let text = format!("bits {} to {} are {value}", area.first, area.last);
                say(area.first, area.last, text, None);
            }
            _ => {}
        }
    }
    let end = u16::try_from(8 * octets.len()).unwrap_or(u16::MAX);
    for number in 0..end {
        let in_area = diag.areas.iter().any(|area| (area.first..=area.last).contains(&number));
        let (is_set, known) = match bit(number) {
            Some(true) => (true, diag.bits.get(&number)),
            _ => (false, diag.not_bits.get(&number)),
        };
        match known {
            Some(DiagText { text, help }) => say(number, number, text.clone(), help.clone()),
            None if is_set && !in_area && number >= from && !diag.not_bits.contains_key(&number) => {
                say(number, number, format!("bit {number} is set"), None);
            }
            None => {}
        }
    }
    found.sort_by_key(|&(first_bit, _)| first_bit);
    texts.extend(found.into_iter().map(|(_, text)| text));
}

//! Keywords that come in families: one for each baud rate, one for each kind of user parameters, one for each kind of diagnosis.

use super::device::Rate;

/// Keywords that exist once for each baud rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RateFamily {
    Supported,
    MaxTsdr,
    Trdy,
    Tqui,
    Tset,
    Tsdi,
}

/// Family and baud rate of such a keyword.
pub(super) fn rate_keyword(name: &str) -> Option<(RateFamily, Rate)> {
    let name = name.to_ascii_lowercase();
    if let Some(rate) = name.strip_suffix("_supp") {
        return Some((RateFamily::Supported, rate_of(rate)?));
    }
    let prefixes = [
        ("maxtsdr_", RateFamily::MaxTsdr),
        ("trdy_", RateFamily::Trdy),
        ("tqui_", RateFamily::Tqui),
        ("tset_", RateFamily::Tset),
        ("tsdi_", RateFamily::Tsdi),
    ];
    prefixes
        .into_iter()
        .find_map(|(prefix, family)| Some((family, rate_of(name.strip_prefix(prefix)?)?)))
}

/// Delays of a physical interface, which exist once for each baud rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DelayFamily {
    Transmission,
    Reaction,
}

/// Kind and baud rate of the keyword of a delay.
pub(super) fn delay_keyword(name: &str) -> Option<(DelayFamily, Rate)> {
    let name = name.to_ascii_lowercase();
    let prefixes = [
        ("transmission_delay_", DelayFamily::Transmission),
        ("reaction_delay_", DelayFamily::Reaction),
    ];
    prefixes
        .into_iter()
        .find_map(|(prefix, family)| Some((family, rate_of(name.strip_prefix(prefix)?)?)))
}

fn rate_of(rate: &str) -> Option<Rate> {
    Rate::ALL
        .into_iter()
        .find(|known| known.keyword().eq_ignore_ascii_case(rate))
}

/// A keyword about user parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct PrmKeyword {
    pub(super) set: PrmSet,
    pub(super) what: PrmWhat,
}

/// Which user parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PrmSet {
    Usual,
    Extended,
    Failsafe,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum PrmWhat {
    Len,
    Constant,
    Reference,
}

impl PrmKeyword {
    /// The keyword of this name outside of blocks.
    pub(super) fn of(name: &str) -> Option<Self> {
        Self::in_module(name).filter(|keyword| !matches!(keyword.what, PrmWhat::Len))
    }

    /// The keyword of this name in a module, which has a length too.
    pub(super) fn in_module(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let (set, name) = match name.get(..2) {
            Some("x_") => (PrmSet::Extended, name.get(2..)?),
            Some("f_") => (PrmSet::Failsafe, name.get(2..)?),
            _ => (PrmSet::Usual, name.as_str()),
        };
        let what = match name {
            "ext_module_prm_data_len" => PrmWhat::Len,
            "ext_user_prm_data_const" => PrmWhat::Constant,
            "ext_user_prm_data_ref" => PrmWhat::Reference,
            _ => return None,
        };
        Some(Self { set, what })
    }
}

/// A keyword with a text for diagnosis.
#[derive(Debug, Clone, Copy)]
pub(super) struct DiagKeyword {
    pub(super) what: DiagWhat,
    pub(super) help: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DiagWhat {
    Bit,
    NotBit,
    Channel,
}

impl DiagKeyword {
    /// The keyword of this name; with `X_` it is the same for a `UnitDiagType`.
    pub(super) fn of(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let name = name.strip_prefix("x_").unwrap_or(&name);
        let (name, help) = match name.strip_suffix("_help") {
            Some(name) => (name, true),
            None => (name, false),
        };
        let what = match name {
            "unit_diag_bit" => DiagWhat::Bit,
            "unit_diag_not_bit" => DiagWhat::NotBit,
            "channel_diag" => DiagWhat::Channel,
            _ => return None,
        };
        Some(Self { what, help })
    }

    /// Whether it is about device-related diagnosis.
    pub(super) fn is_of_unit(self) -> bool {
        self.what != DiagWhat::Channel
    }
}

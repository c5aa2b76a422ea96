//! What a user types while `dp run` runs.
//!
//! | command | does |
//! |---|---|
//! | `set drive 8 0x0076 0x01` | outputs of a slave from an octet on |
//! | `stop`, `clear`, `operate` | the mode |
//! | `sync`, `unsync`, `freeze`, `unfreeze`, with a group 1…8 or without | Global_Control |
//! | `show` | everything once |
//! | `quit` | ends in good order |

use dp_master::dp::{ControlCommand, GlobalControl, Mode};

/// A command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum RunCommand {
    /// Outputs of a slave from this octet on.
    Set {
        slave: String,
        offset: usize,
        octets: Vec<u8>,
    },
    /// A mode.
    Mode(Mode),
    /// Sync, Freeze and their ends.
    Control(GlobalControl),
    /// Show everything once.
    Show,
    /// End.
    Quit,
}

impl RunCommand {
    /// Reads a line; `None` for one that says nothing.
    ///
    /// # Errors
    ///
    /// One sentence that says what is allowed.
    pub(crate) fn parse(line: &str) -> Result<Option<Self>, String> {
        let mut words = line.split_whitespace();
        let Some(first) = words.next() else {
            return Ok(None);
        };
        let rest: Vec<&str> = words.collect();
        let command = match (first, rest.as_slice()) {
            ("set", [slave, offset, values @ ..]) if !values.is_empty() => {
                let mut octets = Vec::new();
                for value in values {
                    octets.extend(value_octets(value)?);
                }
                Self::Set {
                    slave: (*slave).to_owned(),
                    offset: offset
                        .parse()
                        .map_err(|_| format!("`{offset}` is no octet of the outputs, count from 0"))?,
                    octets,
                }
            }
            ("set", _) => {
                return Err("`set` needs a slave, the first octet and values, such as `set drive 8 0x0076`".to_owned());
            }
            ("stop", []) => Self::Mode(Mode::Stop),
            ("clear", []) => Self::Mode(Mode::Clear),
            ("operate", []) => Self::Mode(Mode::Operate),
            ("sync", group) => Self::control(ControlCommand::SYNC, group)?,
            ("unsync", group) => Self::control(ControlCommand::UNSYNC, group)?,
            ("freeze", group) => Self::control(ControlCommand::FREEZE, group)?,
            ("unfreeze", group) => Self::control(ControlCommand::UNFREEZE, group)?,
            ("show", []) => Self::Show,
            ("quit" | "exit", []) => Self::Quit,
            _ => return Err(format!("`{line}` is no command, {ALLOWED}")),
        };
        Ok(Some(command))
    }

    fn control(command: ControlCommand, group: &[&str]) -> Result<Self, String> {
        let group_select = match group {
            [] => 0,
            [group] => match group.parse() {
                Ok(number @ 1..=8_u8) => 1 << (number - 1),
                _ => return Err(format!("`{group}` is no group, allowed are 1…8")),
            },
            _ => return Err("one group 1…8 or none is allowed".to_owned()),
        };
        Ok(Self::Control(GlobalControl { command, group_select }))
    }
}

/// A value: hexadecimal digits are as many octets as they are written with, a decimal number is one octet, or so many as its type says.
fn value_octets(text: &str) -> Result<Vec<u8>, String> {
    let wrong =
        || format!("`{text}` is no value, allowed are 0x0076, an octet 0…255, u16:1234, i16:-5, u32:… and i32:…");
    if let Some(digits) = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        return crate::decode::octets_of_words(digits)
            .ok()
            .filter(|octets| !octets.is_empty())
            .ok_or_else(wrong);
    }
    let octets = match text.split_once(':') {
        None => text.parse().map(|octet: u8| vec![octet]).ok(),
        Some(("u16", number)) => number.parse().map(|number: u16| number.to_be_bytes().to_vec()).ok(),
        Some(("i16", number)) => number.parse().map(|number: i16| number.to_be_bytes().to_vec()).ok(),
        Some(("u32", number)) => number.parse().map(|number: u32| number.to_be_bytes().to_vec()).ok(),
        Some(("i32", number)) => number.parse().map(|number: i32| number.to_be_bytes().to_vec()).ok(),
        Some(_) => None,
    };
    octets.ok_or_else(wrong)
}

/// What may be typed.
pub(crate) const ALLOWED: &str =
    "allowed are set SLAVE OCTET VALUE…, stop, clear, operate, sync, unsync, freeze, unfreeze, show, quit";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_has_as_many_octets_as_it_is_written_with() {
        // PROFIBUS sends the high octet first.
        for (text, octets) in [
            ("0x76", &[0x76][..]),
            ("0x0076", &[0x00, 0x76]),
            ("0x00010203", &[0, 1, 2, 3]),
            ("118", &[118]),
            ("u16:1234", &[0x04, 0xD2]),
            ("i16:-1", &[0xFF, 0xFF]),
            ("i32:-2", &[0xFF, 0xFF, 0xFF, 0xFE]),
        ] {
            assert_eq!(value_octets(text).as_deref(), Ok(octets), "{text}");
        }
        for text in ["256", "-1", "0x", "0x7", "u8:1", "u16:65536", "abc"] {
            assert!(value_octets(text).is_err(), "{text}");
        }
    }

    #[test]
    fn commands_are_read_and_what_is_none_says_what_is_allowed() {
        let set = RunCommand::Set {
            slave: "drive".to_owned(),
            offset: 8,
            octets: vec![0x00, 0x76, 0x01],
        };
        assert_eq!(RunCommand::parse("set drive 8 0x0076 1"), Ok(Some(set)));
        assert_eq!(RunCommand::parse("  "), Ok(None));
        let group_3 = GlobalControl {
            command: ControlCommand::SYNC,
            group_select: 0b100,
        };
        assert_eq!(RunCommand::parse("sync 3"), Ok(Some(RunCommand::Control(group_3))));
        assert!(RunCommand::parse("sync 9").is_err());
        let refused = RunCommand::parse("dance").unwrap_err();
        assert_eq!(refused, format!("`dance` is no command, {ALLOWED}"));
    }
}

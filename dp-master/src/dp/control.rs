//! Global_Control: commands to groups of slaves at once, sent without acknowledgement.
//!
//! ```text
//! octet 1  5 Sync, 4 Unsync, 3 Freeze, 2 Unfreeze, 1 Clear_Data; 7, 6, 0 reserved
//! octet 2  group select, one bit a group; 0 = all slaves
//! ```
//!
//! Source: IEC 61158-6-3, coding of Global_Control.

/// The data unit of Global_Control, lossless both ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GlobalControl {
    /// Octet 1.
    pub command: ControlCommand,
    /// Octet 2: addressed groups, one bit a group; 0 addresses every slave.
    pub group_select: u8,
}

impl GlobalControl {
    /// Reads the data unit; `None` when it is not two octets long.
    pub fn parse(data: &[u8]) -> Option<Self> {
        match *data {
            [command, group_select] => Some(Self {
                command: ControlCommand(command),
                group_select,
            }),
            _ => None,
        }
    }

    /// The data unit.
    pub const fn octets(self) -> [u8; 2] {
        [self.command.0, self.group_select]
    }

    /// The command is meant for a slave of these groups.
    pub const fn addresses(self, group: u8) -> bool {
        self.group_select == 0 || self.group_select & group != 0
    }
}

/// The command octet of Global_Control; reserved bits are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ControlCommand(pub u8);

impl ControlCommand {
    /// No command: the master says that it operates.
    pub const OPERATE: Self = Self(0);
    /// Outputs become zero.
    pub const CLEAR_DATA: Self = Self(0x02);
    /// Inputs follow the process again.
    pub const UNFREEZE: Self = Self(0x04);
    /// Inputs are held as they are now.
    pub const FREEZE: Self = Self(0x08);
    /// Outputs follow the bus again.
    pub const UNSYNC: Self = Self(0x10);
    /// Outputs take over the last received values and hold them.
    pub const SYNC: Self = Self(0x20);

    /// All bits of `other` are set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0 && other.0 != 0
    }

    /// Both commands in one octet.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bits_are_those_of_the_standard() {
        // IEC 61158-6-3: Sync 0x20, Unsync 0x10, Freeze 0x08, Unfreeze 0x04, Clear_Data 0x02
        let control = GlobalControl::parse(&[0x2A, 0x81]).unwrap();
        assert!(control.command.contains(ControlCommand::SYNC));
        assert!(control.command.contains(ControlCommand::FREEZE));
        assert!(control.command.contains(ControlCommand::CLEAR_DATA));
        assert!(!control.command.contains(ControlCommand::UNSYNC));
        assert!(!control.command.contains(ControlCommand::UNFREEZE));
        assert_eq!(control.octets(), [0x2A, 0x81]);
    }

    #[test]
    fn group_zero_addresses_every_slave() {
        let to = |group_select| GlobalControl {
            command: ControlCommand::SYNC,
            group_select,
        };
        assert!(to(0).addresses(0));
        assert!(to(0x06).addresses(0x02));
        assert!(!to(0x06).addresses(0x01));
        assert!(!to(0x06).addresses(0));
    }

    #[test]
    fn any_other_length_is_no_global_control() {
        assert_eq!(GlobalControl::parse(&[0]), None);
        assert_eq!(GlobalControl::parse(&[0, 0, 0]), None);
    }
}

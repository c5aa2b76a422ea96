use super::CanFrame;

/// A command of network management: identifier 0, two octets, command and node; node 0 means all.
///
/// Source: 9300 facts 5 (CANopen DS301).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Nmt {
    /// 0x01: process data are exchanged.
    Operational,
    /// 0x02: neither process data nor parameters.
    Stopped,
    /// 0x80: parameters only.
    PreOperational,
    /// 0x81: as after power-up.
    ResetNode,
    /// 0x82: only the bus starts anew.
    ResetCommunication,
}

impl Nmt {
    const ALL: [(u8, Self); 5] = [
        (0x01, Self::Operational),
        (0x02, Self::Stopped),
        (0x80, Self::PreOperational),
        (0x81, Self::ResetNode),
        (0x82, Self::ResetCommunication),
    ];

    /// Octet of the command.
    #[must_use]
    pub const fn octet(self) -> u8 {
        match self {
            Self::Operational => 0x01,
            Self::Stopped => 0x02,
            Self::PreOperational => 0x80,
            Self::ResetNode => 0x81,
            Self::ResetCommunication => 0x82,
        }
    }

    /// The frame for a node, or for all with 0.
    ///
    /// ```
    /// use lenze9300_model::bus::can::Nmt;
    ///
    /// assert_eq!(Nmt::Operational.frame(0).data(), [0x01, 0x00]);
    /// ```
    #[must_use]
    pub fn frame(self, node: u8) -> CanFrame {
        CanFrame::of(0, [self.octet(), node, 0, 0, 0, 0, 0, 0], 2)
    }

    /// The command for this node in the octets of a frame with identifier 0; `None` if there is none.
    #[must_use]
    pub fn for_node(octets: &[u8], node: u8) -> Option<Self> {
        let [command, addressed] = *octets else {
            return None;
        };
        if addressed != 0 && addressed != node {
            return None;
        }
        Self::ALL
            .into_iter()
            .find_map(|(octet, nmt)| (octet == command).then_some(nmt))
    }
}

/// State of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum NmtState {
    /// Parameters only; so every node starts.
    #[default]
    PreOperational,
    /// Process data and parameters.
    Operational,
    /// Network management only.
    Stopped,
}

use crate::code::CodeStore;
use crate::code::table::number::{C0350, C0353, C0354, C0367, C0368};

/// Identifiers of one drive, as its codes set them.
///
/// # Example
///
/// ```
/// use lenze9300_model::bus::can::{Identifiers, Object, SdoChannel};
/// use lenze9300_model::code::CodeStore;
///
/// let identifiers = Identifiers::from_codes(&CodeStore::factory());
/// assert_eq!(identifiers.id(Object::Out1), 385);
/// assert_eq!(identifiers.object(0x601), Some(Object::SdoRequest(SdoChannel::First)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Identifiers {
    node: u8,
    /// In the order of [`Object::PROCESS`].
    process: [u16; 6],
    sync_received: u16,
    sync_sent: u16,
}

/// What an identifier stands for, seen from one drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Object {
    /// Network management, to the drive.
    Nmt,
    /// Sync, to the drive.
    Sync,
    /// Process data 1 to the drive.
    #[doc(alias = "CAN-IN1")]
    In1,
    /// Process data 1 from the drive.
    #[doc(alias = "CAN-OUT1")]
    Out1,
    /// Process data 2 to the drive.
    In2,
    /// Process data 2 from the drive.
    Out2,
    /// Process data 3 to the drive.
    In3,
    /// Process data 3 from the drive.
    Out3,
    /// A job of a parameter channel, to the drive.
    SdoRequest(SdoChannel),
    /// An answer of a parameter channel, from the drive.
    SdoResponse(SdoChannel),
}

impl Object {
    /// The process objects in the order of C0354 and C0355.
    pub const PROCESS: [Self; 6] = [Self::In1, Self::Out1, Self::In2, Self::Out2, Self::In3, Self::Out3];

    /// Whether the drive sends it: from anybody else it means that the node address is there twice.
    #[must_use]
    pub const fn is_sent_by_the_drive(self) -> bool {
        matches!(self, Self::Out1 | Self::Out2 | Self::Out3 | Self::SdoResponse(_))
    }
}

/// One of the two parameter channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum SdoChannel {
    /// 1536 and 1408.
    #[default]
    First,
    /// 1600 and 1472.
    Second,
}

impl SdoChannel {
    /// Both.
    pub const ALL: [Self; 2] = [Self::First, Self::Second];

    const fn offset(self) -> u16 {
        match self {
            Self::First => 0,
            Self::Second => 64,
        }
    }

    /// Identifier of jobs to a node.
    #[must_use]
    pub const fn request_id(self, node: u8) -> u16 {
        1536 + self.offset() + node as u16
    }

    /// Identifier of the answers of a node.
    #[must_use]
    pub const fn response_id(self, node: u8) -> u16 {
        1408 + self.offset() + node as u16
    }
}

/// Identifiers of node 0 for the objects of [`Object::PROCESS`]. Source: 9300 facts 5; OUT2 and OUT3 lie one above IN2 and IN3.
const BASES: [u16; 6] = [512, 384, 640, 641, 768, 769];

/// What C0354 counts from. Source: 9300 facts 5 (it reproduces the factory table for node 1).
const FREE_BASE: u16 = 384;

impl Identifiers {
    /// The identifiers that C0350, C0353, C0354, C0367 and C0368 ask for.
    #[must_use]
    pub fn from_codes(codes: &CodeStore) -> Self {
        let whole = |code, subcode| codes.number(code, subcode) as u16;
        let node = whole(C0350, 0) as u8;
        let mut process = BASES.map(|base| base + u16::from(node));
        for (place, id) in process.iter_mut().enumerate() {
            // One switch for each pair.
            let pair = place as u8 / 2 + 1;
            if whole(C0353, pair) == 1 {
                *id = FREE_BASE + whole(C0354, place as u8 + 1);
            }
        }
        Self {
            node,
            process,
            sync_received: whole(C0367, 0),
            sync_sent: whole(C0368, 0),
        }
    }

    /// Node address, 1…63.
    #[must_use]
    pub const fn node(&self) -> u8 {
        self.node
    }

    /// Identifier of a sync that the drive sends.
    #[must_use]
    pub const fn sync_sent(&self) -> u16 {
        self.sync_sent
    }

    /// Identifier of an object.
    #[must_use]
    pub fn id(&self, object: Object) -> u16 {
        match object {
            Object::Nmt => 0,
            Object::Sync => self.sync_received,
            Object::In1 => self.process[0],
            Object::Out1 => self.process[1],
            Object::In2 => self.process[2],
            Object::Out2 => self.process[3],
            Object::In3 => self.process[4],
            Object::Out3 => self.process[5],
            Object::SdoRequest(channel) => channel.request_id(self.node),
            Object::SdoResponse(channel) => channel.response_id(self.node),
        }
    }

    /// What an identifier stands for; `None` for one that is not this drive's. Where two objects share one, the first of this list:
    /// NMT, sync, parameter channels, process data.
    #[must_use]
    pub fn object(&self, id: u16) -> Option<Object> {
        let channels = SdoChannel::ALL
            .into_iter()
            .flat_map(|channel| [Object::SdoRequest(channel), Object::SdoResponse(channel)]);
        [Object::Nmt, Object::Sync]
            .into_iter()
            .chain(channels)
            .chain(Object::PROCESS)
            .find(|object| self.id(*object) == id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::Inhibit;

    #[test]
    fn node_1_has_the_identifiers_of_the_table() {
        // Source: 9300 facts 5, column "id for n = 1".
        let identifiers = Identifiers::from_codes(&CodeStore::factory());
        let expected = [
            (Object::Nmt, 0),
            (Object::Sync, 128),
            (Object::In1, 513),
            (Object::Out1, 385),
            (Object::In2, 641),
            (Object::Out2, 642),
            (Object::In3, 769),
            (Object::Out3, 770),
            (Object::SdoRequest(SdoChannel::First), 1537),
            (Object::SdoResponse(SdoChannel::First), 1409),
            (Object::SdoRequest(SdoChannel::Second), 1601),
            (Object::SdoResponse(SdoChannel::Second), 1473),
        ];
        for (object, id) in expected {
            assert_eq!(identifiers.id(object), id, "{object:?}");
            assert_eq!(identifiers.object(id), Some(object), "{id}");
        }
        assert_eq!(identifiers.object(1793), None);
    }

    #[test]
    fn free_identifiers_count_from_384_pair_by_pair() {
        // Source: 9300 facts 5: the factory values of C0354 give the same identifiers as node 1.
        let mut codes = CodeStore::factory();
        let mut write = |code, subcode, value| {
            codes
                .write(code, subcode, value * 10_000, Inhibit::Active)
                .expect("inside the range");
        };
        write(350, 0, 7);
        write(353, 1, 1);
        write(354, 2, 100);
        let identifiers = Identifiers::from_codes(&codes);
        assert_eq!(identifiers.id(Object::In1), 513, "C0354/1 = 129, whatever the node");
        assert_eq!(identifiers.id(Object::Out1), 484);
        assert_eq!(identifiers.id(Object::In2), 647, "C0353/2 = 0: from the node");
    }
}

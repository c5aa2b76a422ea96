//! A frame as a port carries it.

/// A frame with an 11-bit identifier and up to eight octets, or a request for one.
///
/// # Example
///
/// ```
/// use lenze9300_model::bus::can_port::PortFrame;
///
/// let frame = PortFrame::new(0x601, &[0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0]).unwrap();
/// assert_eq!((frame.id(), frame.data().len()), (0x601, 8));
/// assert!(PortFrame::new(0x800, &[]).is_none(), "11 bits");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PortFrame {
    id: u16,
    len: u8,
    data: [u8; 8],
    remote: bool,
}

impl PortFrame {
    /// A data frame; `None` for an identifier above 0x7FF or more than eight octets.
    #[must_use]
    pub fn new(id: u16, octets: &[u8]) -> Option<Self> {
        let mut data = [0; 8];
        data.get_mut(..octets.len())?.copy_from_slice(octets);
        let len = u8::try_from(octets.len()).ok()?;
        (id <= 0x7FF).then_some(Self {
            id,
            len,
            data,
            remote: false,
        })
    }

    /// A remote frame that asks for `len` octets; `None` for an identifier above 0x7FF or more than eight octets.
    #[must_use]
    pub fn new_remote(id: u16, len: u8) -> Option<Self> {
        (id <= 0x7FF && len <= 8).then_some(Self {
            id,
            len,
            data: [0; 8],
            remote: true,
        })
    }

    /// The identifier, 0…0x7FF.
    #[must_use]
    pub const fn id(&self) -> u16 {
        self.id
    }

    /// The data length code, 0…8.
    #[must_use]
    pub const fn dlc(&self) -> u8 {
        self.len
    }

    /// The octets; none in a remote frame.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        if self.remote {
            &[]
        } else {
            &self.data[..usize::from(self.len)]
        }
    }

    /// Whether it asks for a frame instead of being one.
    #[must_use]
    pub const fn is_remote(&self) -> bool {
        self.remote
    }
}

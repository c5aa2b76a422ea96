//! The PLC around the block: its cycle and its view of the periphery.

use crate::block::Periphery;

/// The periphery as SFC 14 and SFC 15 see it: two consistent 8-octet areas of one slave.
///
/// The process data stand at the module's address, the parameter channel 8 below (film-feed specification,
/// section 2). A slave that is not in data exchange has no periphery: reading and writing fail and leave everything
/// as it was, as the system functions do.
#[derive(Debug)]
pub struct DpPeriphery<'a> {
    /// Peripheral address of the process data.
    pub module_address: u16,
    /// The slave's inputs: parameter channel, process data. Absent while it is not in data exchange.
    pub inputs: Option<&'a [u8; IMAGE]>,
    /// The slave's outputs in the same order.
    pub outputs: &'a mut [u8; IMAGE],
}

/// Octets of the slave's image in each direction.
pub const IMAGE: usize = 16;

/// Octets of one consistent area.
const AREA: usize = 8;

impl DpPeriphery<'_> {
    fn area(&self, address: u16) -> Option<std::ops::Range<usize>> {
        if address == self.module_address {
            Some(AREA..IMAGE)
        } else if address == self.module_address.wrapping_sub(AREA as u16) {
            Some(0..AREA)
        } else {
            None
        }
    }
}

impl Periphery for DpPeriphery<'_> {
    fn dprd_dat(&mut self, address: u16, record: &mut [u8; 8]) -> bool {
        let (Some(area), Some(inputs)) = (self.area(address), self.inputs) else {
            return false;
        };
        record.copy_from_slice(&inputs[area]);
        true
    }

    fn dpwr_dat(&mut self, address: u16, record: &[u8; 8]) -> bool {
        let (Some(area), Some(_)) = (self.area(address), self.inputs) else {
            return false;
        };
        self.outputs[area].copy_from_slice(record);
        true
    }
}

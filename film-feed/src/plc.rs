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

#[cfg(test)]
mod tests {
    use super::*;

    const PZD: u16 = 0x0118;

    #[test]
    fn process_data_stand_behind_the_parameter_channel_in_the_image_and_above_it_in_the_address_space() {
        let inputs: [u8; IMAGE] = std::array::from_fn(|octet| octet as u8);
        let mut outputs = [0; IMAGE];
        let mut periphery = DpPeriphery {
            module_address: PZD,
            inputs: Some(&inputs),
            outputs: &mut outputs,
        };
        let mut record = [0; 8];
        assert!(periphery.dprd_dat(PZD, &mut record));
        assert_eq!(record, [8, 9, 10, 11, 12, 13, 14, 15]);
        assert!(periphery.dprd_dat(PZD - 8, &mut record));
        assert_eq!(record, [0, 1, 2, 3, 4, 5, 6, 7]);
        assert!(periphery.dpwr_dat(PZD, &[7; 8]) && periphery.dpwr_dat(PZD - 8, &[5; 8]));
        assert_eq!(outputs, [5, 5, 5, 5, 5, 5, 5, 5, 7, 7, 7, 7, 7, 7, 7, 7]);
    }

    #[test]
    fn a_slave_out_of_data_exchange_or_a_wrong_address_leaves_everything_as_it_was() {
        let inputs = [9; IMAGE];
        for (given, address) in [(None, PZD), (Some(&inputs), PZD + 8), (Some(&inputs), PZD - 1)] {
            let mut outputs = [1; IMAGE];
            let mut periphery = DpPeriphery {
                module_address: PZD,
                inputs: given,
                outputs: &mut outputs,
            };
            let mut record = [3; 8];
            assert!(!periphery.dprd_dat(address, &mut record) && !periphery.dpwr_dat(address, &[4; 8]));
            assert_eq!((record, outputs), ([3; 8], [1; IMAGE]));
        }
    }
}

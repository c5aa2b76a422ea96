//! A slave on a pseudo-terminal, in a thread of the test.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration as StdDuration;

use dp_master::address::Address;
use dp_master::dp::{AcceptedConfigurations, AddressChange, DpSlave, ExtDiag, Overflow, SlaveIdentity};
use dp_master::driver::Driver;
use dp_master::phy::PseudoTerminal;
use dp_master::time::{Baud, Duration};

use super::Scratch;

/// Ident number of the slave.
pub(crate) const IDENT: u16 = 0x0BAD;

/// Answers until it is dropped; its line is at `link`.
pub(crate) struct RunningSlave {
    pub(crate) link: Scratch,
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<DpSlave>>,
}

impl RunningSlave {
    /// A slave with 2 + 2 octets at this address, whose address may be changed. Its inputs are the complement of its outputs.
    pub(crate) fn start(address: u8, ext_diag: &'static [u8]) -> Self {
        let link = Scratch::new("line");
        let (mut port, _) = PseudoTerminal::open(Baud::B1500000).unwrap();
        port.link(&link.0).unwrap();
        let accepted = AcceptedConfigurations::Table(&[&[0x31]]);
        let mut slave = DpSlave::new(SlaveIdentity {
            address_change: AddressChange::Allowed,
            latency_allowance: Duration::from_millis(20),
            real_configuration: &[0x31],
            ..SlaveIdentity::new(Address::new(address).unwrap(), IDENT, Baud::B1500000, accepted)
        })
        .unwrap();
        if !ext_diag.is_empty() {
            slave
                .set_ext_diag(ExtDiag::Fault, ext_diag, Overflow::Complete)
                .unwrap();
        }
        let end = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&end);
        let thread = std::thread::spawn(move || {
            let mut driver = Driver::new(port);
            while !ended.load(Ordering::Relaxed) {
                driver.step(&mut slave, StdDuration::from_millis(5)).unwrap();
                let inputs: Vec<u8> = slave.outputs().iter().map(|octet| !octet).collect();
                slave.set_inputs(&inputs);
            }
            slave
        });
        Self {
            link,
            end,
            thread: Some(thread),
        }
    }

    /// Ends it and gives the slave as it was left.
    pub(crate) fn stop(mut self) -> DpSlave {
        self.end.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

impl Drop for RunningSlave {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

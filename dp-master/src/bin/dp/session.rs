//! A master of class 2 on a line, for the commands that ask stations.

use std::time::{Duration as StdDuration, Instant as StdInstant};

use clap::Args;
use dp_master::address::Address;
use dp_master::dp::class2::{Pending, Service, ServiceError};
use dp_master::dp::{DpMaster, JobFailure, MasterConfig, MasterEvent};
use dp_master::driver::Driver;
use dp_master::fdl::{BusParams, Membership, RingEvent};
use dp_master::phy::{PortName, ReopeningPort, request_real_time};
use dp_master::time::{Baud, Duration, Instant};

use crate::interrupt::{self, interrupted};
use crate::line_args::{SwitchArgs, parse_station};
use crate::output::{Trouble, note};

/// The line, and who we are on it.
#[derive(Debug, Args)]
pub(crate) struct LineArgs {
    /// Line to speak on: a serial device, or tcp://host:port of a serial-device server.
    #[arg(long, value_name = "PATH")]
    pub(crate) port: PortName,
    /// Baud rate in bit/s.
    #[arg(long, value_name = "RATE", default_value = "1500000")]
    pub(crate) baud: Baud,
    /// Our own address; no other station may have it.
    #[arg(long, value_name = "N", default_value = "0", value_parser = parse_station)]
    pub(crate) own_address: Address,
    /// What adapter and system may add to an answer, 0…1000 ms.
    #[arg(long, value_name = "MS", default_value_t = 50, value_parser = clap::value_parser!(u64).range(0..=1000))]
    pub(crate) latency: u64,
    /// Ask for real-time priority; a note says if it is refused.
    #[arg(long)]
    pub(crate) real_time: bool,
    #[command(flatten)]
    pub(crate) switch: SwitchArgs,
}

impl LineArgs {
    /// Bus parameters of profile DP with the latency of this line.
    pub(crate) fn params(&self) -> BusParams {
        BusParams::standard(self.baud).with_latency_allowance(Duration::from_millis(self.latency))
    }

    /// Opens the port, and tells what should be known about it.
    pub(crate) fn open(&self) -> Result<ReopeningPort, Trouble> {
        interrupt::watch();
        let opened = ReopeningPort::open(&self.port, self.baud, self.switch.options()).map_err(Trouble::given)?;
        opened.notes.iter().for_each(note);
        if self.real_time
            && let Err(refused) = request_real_time()
        {
            note(refused);
        }
        Ok(opened.port.with_limit(GONE_LIMIT))
    }
}

/// A master of class 2 alone, on an open port.
pub(crate) struct Session {
    address: Address,
    driver: Driver<ReopeningPort>,
    pub(crate) master: DpMaster<0>,
}

impl Session {
    /// Opens the line.
    pub(crate) fn open(args: &LineArgs) -> Result<Self, Trouble> {
        let config = MasterConfig::new(args.own_address, args.params());
        Ok(Self {
            address: args.own_address,
            driver: Driver::new(args.open()?),
            master: DpMaster::new(config).map_err(Trouble::given)?,
        })
    }

    /// The time of the master.
    pub(crate) fn now(&self) -> Instant {
        self.driver.now()
    }

    /// Lets the master work for a moment.
    pub(crate) fn step(&mut self) -> Result<(), Trouble> {
        if interrupted() {
            return Err(Trouble::failed("interrupted"));
        }
        self.driver.step(&mut self.master, TICK).map_err(Trouble::failed)?;
        while let Some(event) = self.driver.port_mut().poll_event() {
            note(event);
        }
        while let Some(event) = self.master.poll_event() {
            if event == MasterEvent::Ring(RingEvent::DuplicateAddress) {
                return Err(Trouble::failed(format_args!(
                    "another station has our address {}, choose a free one with --own-address",
                    self.address
                )));
            }
        }
        Ok(())
    }

    /// Leaves the ring in good order, so that no other master has to look for the token.
    pub(crate) fn leave(mut self) {
        self.master.set_membership(Membership::Passive);
        let begun = StdInstant::now();
        while self.master.is_in_ring() && begun.elapsed() < LEAVING {
            if self.driver.step(&mut self.master, TICK).is_err() {
                return;
            }
        }
    }

    /// Asks a station; the answer of the service, or why there was none.
    pub(crate) fn ask<S: Service>(&mut self, service: S) -> Result<Result<S::Answer, ServiceError>, Trouble> {
        let pending = Pending::start(service, self.master.jobs()).map_err(Trouble::given)?;
        let begun = StdInstant::now();
        loop {
            if let Some(answer) = pending.poll(self.master.jobs()) {
                return Ok(answer);
            }
            if begun.elapsed() > LONGEST_WAIT {
                pending.cancel(self.master.jobs());
                return Err(self.no_token());
            }
            self.step()?;
        }
    }

    /// Asks a station that must answer.
    pub(crate) fn need<S: Service>(&mut self, address: Address, service: S) -> Result<S::Answer, Trouble> {
        self.ask(service)?.map_err(|error| match error {
            ServiceError::Failed(JobFailure::NoAnswer) => {
                Trouble::failed(format_args!("station {address} does not answer"))
            }
            error => Trouble::failed(format_args!("station {address}: {error}")),
        })
    }

    /// The sentence for a line where we never get to speak.
    pub(crate) fn no_token(&self) -> Trouble {
        Trouble::failed(format_args!(
            "no token in {} s: other masters admit us when our address {} is free and not above their HSA",
            LONGEST_WAIT.as_secs(),
            self.address
        ))
    }
}

/// How long a wish to end may go unnoticed.
const TICK: StdDuration = StdDuration::from_millis(50);
/// The token timeout, some GAP rounds of a slow ring, and all repetitions.
pub(crate) const LONGEST_WAIT: StdDuration = StdDuration::from_secs(10);
/// A token comes round in this time, or the ring is broken anyway.
const LEAVING: StdDuration = StdDuration::from_millis(500);
/// A port that is gone for longer ends the command.
const GONE_LIMIT: StdDuration = StdDuration::from_secs(10);

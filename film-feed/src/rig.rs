//! The whole chain in virtual time: block, master, line, bus module, drive, film.
//!
//! The rig asks every part for its next wake-up and jumps there. At one instant the order is fixed: line and stations,
//! then the drive's tick with the film, then the PLC cycle.

use dp_master::address::{Address, AddressError};
use dp_master::dp::{
    AddSlaveError, CfgError, DpMaster, MasterConfig, MasterError, SlaveIndex, SlaveState, WatchdogError,
};
use dp_master::fdl::BusParams;
use dp_master::phy::{Disturbance, DisturbanceError, PortId, Tap, Trace, VirtualBus, pump};
use dp_master::station::Station;
use dp_master::time::{Baud, Duration, Instant};
use lenze9300_model::bus::dp::{Emf2133, Emf2133Config, ModuleError, PAR_AND_FOUR_WORDS};
use lenze9300_model::device::{Drive, DriveConfig};
use lenze9300_model::plant::ShaftAngle;
use thiserror::Error;

use crate::block::{FilmFeedBlock, Inputs, Outputs};
use crate::bus_config;
use crate::machine::{Film, FilmConfig, MarkConfig, ReaderDelay, ReaderParams};
use crate::parameter_watch::{self, ParameterWatch};
use crate::plc::{DpPeriphery, IMAGE};

/// What the chain is made of.
#[derive(Debug, Clone)]
pub struct RigConfig {
    /// Baud rate of the line.
    pub baud: Baud,
    /// Period of the PLC cycle, ns. Assumed 5 ms: a CPU 314C with this block alone.
    pub plc_cycle_ns: u64,
    /// Shortest DP cycle, ns; 0 polls as fast as the bus parameters and the slave's minimum interval allow.
    ///
    /// 1 ms by default: the drive takes process data over once a millisecond. In the pause the master passes the token
    /// to itself often enough that no other would take it for lost.
    pub dp_cycle_ns: u64,
    /// Probability that a bit on the line is wrong.
    pub bit_error_rate: f64,
    /// Seed of bit errors and processing times.
    pub seed: u64,
    /// DP address of the drive.
    pub slave_address: u8,
    /// Configuration the master asks the module for: PAR(Cons.) + PZD(4W Cons.) in the thesis. With another of other
    /// lengths the block finds no periphery.
    pub identifiers: &'static [u8],
    /// Peripheral address of the process data in the PLC (thesis ch. 9: 0x0118).
    pub pzd_address: u16,
    /// Torque of the film's pull at the motor's shaft, Nm, against the feed.
    pub load_torque_nm: f64,
    /// The drive.
    pub drive: DriveConfig,
    /// The bus module.
    pub module: Emf2133Config,
    /// The machine.
    pub film: FilmConfig,
    /// The print-mark reader.
    pub reader: ReaderParams,
}

impl Default for RigConfig {
    fn default() -> Self {
        RigConfig {
            baud: Baud::B12000000,
            plc_cycle_ns: 5_000_000,
            dp_cycle_ns: 1_000_000,
            bit_error_rate: 0.0,
            seed: 1,
            slave_address: 3,
            identifiers: PAR_AND_FOUR_WORDS,
            pzd_address: 0x0118,
            load_torque_nm: 0.0,
            drive: DriveConfig::default(),
            module: Emf2133Config::default(),
            film: FilmConfig::default(),
            reader: ReaderParams::default(),
        }
    }
}

/// The chain. Call [`cycle`](Self::cycle) for one PLC cycle after the other; between the calls every part is open to
/// be looked at and disturbed.
#[derive(Debug, Clone)]
pub struct Rig {
    now: Instant,
    line: VirtualBus,
    master_port: PortId,
    module_port: PortId,
    master: DpMaster<1>,
    slave: SlaveIndex,
    /// The master as it comes up, to be restarted from.
    fresh_master: DpMaster<1>,
    module: Emf2133,
    /// What the module is at power-up.
    module_config: Emf2133Config,
    drive: Drive,
    film: Film,
    /// `None`: the output switches with the mark.
    reader: Option<ReaderDelay>,
    block: FilmFeedBlock,
    inputs: Inputs,
    pzd_address: u16,
    /// What the block wrote last: the slave's outputs.
    outputs: [u8; IMAGE],
    watch: ParameterWatch,
    plc_cycle: Duration,
    next_plc: Instant,
    next_tick: Instant,
    tick: Duration,
    ticks_per_ms: u64,
    /// Before this moment line and stations have nothing to do; `None`: never again by themselves.
    line_due: Option<Instant>,
    ear: Ear,
    /// Another master in the ring, without slaves.
    second_master: Option<(PortId, DpMaster<0>)>,
    ticks: u64,
}

/// Who listens on the line, if anybody does. A clone of a rig is not listened to.
#[derive(Default)]
struct Ear(Option<(PortId, Tap<Listener>)>);

/// Takes what went over the line.
pub type Listener = Box<dyn FnMut(Trace<'_>) + Send>;

impl Clone for Ear {
    fn clone(&self) -> Self {
        Ear(None)
    }
}

impl std::fmt::Debug for Ear {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Ear").field(&self.0.is_some()).finish()
    }
}

/// One tick of the drive, as an observer sees it.
#[derive(Debug)]
pub struct TickView<'a> {
    /// End of the tick, ns since power-up.
    pub now_ns: u64,
    /// Whether it was the last tick before the next 1 ms task.
    pub ends_millisecond: bool,
    /// The drive after the tick.
    pub drive: &'a mut Drive,
    /// The film after the tick.
    pub film: &'a mut Film,
    /// The bus module.
    pub module: &'a Emf2133,
}

/// Looks at every tick of the drive.
pub trait TickObserver {
    /// Called after a tick and after the film has followed it.
    fn tick(&mut self, view: &mut TickView<'_>);
}

/// Nobody looks.
impl TickObserver for () {
    fn tick(&mut self, _: &mut TickView<'_>) {}
}

impl<F: FnMut(&mut TickView<'_>)> TickObserver for F {
    fn tick(&mut self, view: &mut TickView<'_>) {
        self(view);
    }
}

impl Rig {
    /// The chain at power-up: mains on, terminal 28 high, the film threaded, the block's inputs all 0 but the address.
    ///
    /// # Errors
    /// When the bus parameters, the bit error rate or the addresses are impossible.
    pub fn new(config: &RigConfig) -> Result<Self, RigError> {
        let mut line = VirtualBus::new(config.baud);
        if config.bit_error_rate > 0.0 {
            line.set_disturbance(Some(Disturbance::new(config.seed, config.bit_error_rate)?));
        }
        let slave_address = Address::new(config.slave_address)?;
        let (master, slave) = bus_config::master(
            config.baud,
            slave_address,
            config.identifiers,
            Duration::from_nanos(config.dp_cycle_ns),
            Duration::ZERO,
        )?;
        let module_config = Emf2133Config {
            address: config.slave_address,
            seed: config.seed,
            ..config.module.clone()
        };
        let module = Emf2133::new(module_config.clone(), config.baud)?;
        let mut drive = Drive::new(config.drive.clone());
        drive.set_load_torque(config.load_torque_nm);
        let master_port = line.attach();
        let module_port = line.attach();
        let film = Film::new(config.film.clone(), ShaftAngle::default());
        let now = Instant::ZERO;
        let tick = Duration::from_nanos(config.drive.axis.tick_ns);
        Ok(Rig {
            now,
            line,
            master_port,
            module_port,
            fresh_master: master.clone(),
            master,
            slave,
            module,
            module_config,
            drive,
            film,
            reader: (config.reader.delay_us > 0.0 || config.reader.jitter_us > 0.0 || config.reader.bounces > 0)
                .then(|| ReaderDelay::new(config.reader)),
            block: FilmFeedBlock::new(),
            inputs: Inputs {
                pzd_adr: config.pzd_address,
                ..Inputs::default()
            },
            pzd_address: config.pzd_address,
            outputs: [0; IMAGE],
            watch: ParameterWatch::new(PARAMETER_LIMIT_NS, 0),
            plc_cycle: Duration::from_nanos(config.plc_cycle_ns),
            next_plc: now + Duration::from_nanos(config.plc_cycle_ns),
            next_tick: now + tick,
            tick,
            ticks_per_ms: config.drive.axis.ticks_per_position_period(),
            line_due: Some(now),
            ear: Ear(None),
            second_master: None,
            ticks: 0,
        })
    }

    /// Time since power-up, ns.
    pub fn now_ns(&self) -> u64 {
        self.now.as_nanos()
    }

    /// Runs line, drive and film up to the next PLC cycle, which [`plc_cycle`](Self::plc_cycle) then works.
    pub fn advance_to_plc_cycle(&mut self, observer: &mut impl TickObserver) {
        while self.next_tick <= self.next_plc {
            self.pump_line(self.next_tick);
            self.drive_tick(observer);
            self.next_tick += self.tick;
        }
        self.pump_line(self.next_plc);
    }

    /// Works the PLC cycle that is due: periphery in, block, periphery out.
    pub fn plc_cycle(&mut self) {
        let exchanging = self.slave_state() == SlaveState::DataExchange;
        // SFC 14 refuses an area of another length than configured.
        let inputs = self.master.inputs(self.slave).try_into().ok().filter(|_| exchanging);
        let presence = match inputs {
            Some(_) => parameter_watch::Periphery::Present,
            None => parameter_watch::Periphery::Absent,
        };
        let mut periphery = DpPeriphery {
            module_address: self.pzd_address,
            inputs,
            outputs: &mut self.outputs,
        };
        self.block.cycle(&mut self.inputs, &mut periphery);
        // Nor does SFC 15 write one.
        let _ = self.master.set_outputs(self.slave, &self.outputs);
        self.watch
            .observe(self.now.as_nanos(), &self.block, self.inputs.error_reset, presence);
        self.next_plc += self.plc_cycle;
    }

    /// Lets the PLC cycle that is due go by: the PLC is in STOP, and the master goes on sending what it has.
    pub fn skip_plc_cycle(&mut self) {
        self.next_plc += self.plc_cycle;
    }

    /// One PLC cycle with everything that happens up to it.
    pub fn cycle(&mut self, observer: &mut impl TickObserver) {
        self.advance_to_plc_cycle(observer);
        self.plc_cycle();
    }

    /// Runs PLC cycles until `until` says so, for at most `limit_ns`; tells whether it did.
    pub fn run_until(&mut self, limit_ns: u64, mut until: impl FnMut(&Rig) -> bool) -> bool {
        let end = self.now_ns() + limit_ns;
        while self.now_ns() < end {
            self.cycle(&mut ());
            if until(self) {
                return true;
            }
        }
        false
    }

    /// What PLC and drive hand over in between waits for the next exchange: it makes no station speak before its time.
    fn pump_line(&mut self, now: Instant) {
        self.now = now;
        if self.line_due.is_none_or(|due| due > now) {
            return;
        }
        let master: (PortId, &mut dyn Station) = (self.master_port, &mut self.master);
        let module: (PortId, &mut dyn Station) = (self.module_port, &mut self.module);
        let second = self
            .second_master
            .as_mut()
            .map(|(port, master)| (*port, master as &mut dyn Station));
        let ear = self.ear.0.as_mut().map(|(port, ear)| (*port, ear as &mut dyn Station));
        self.line_due = match (second, ear) {
            (None, None) => pump(&mut self.line, now, &mut [master, module]),
            (Some(third), None) | (None, Some(third)) => pump(&mut self.line, now, &mut [master, module, third]),
            (Some(third), Some(fourth)) => pump(&mut self.line, now, &mut [master, module, third, fourth]),
        };
    }

    fn drive_tick(&mut self, observer: &mut impl TickObserver) {
        if self.ticks.is_multiple_of(self.ticks_per_ms) {
            self.module.cycle_1ms(&mut self.drive);
        }
        self.ticks += 1;
        let shaft = self.drive.tick();
        let edge = self.film.follow(&shaft);
        match &mut self.reader {
            None => {
                if let Some(edge) = edge {
                    self.drive.edge_e1(&shaft, edge.fraction, edge.level);
                }
            }
            Some(reader) => {
                let (end_ns, tick_ns) = (self.now.as_nanos() as f64, self.tick.as_nanos() as f64);
                let start_ns = end_ns - tick_ns;
                if let Some(edge) = edge {
                    reader.push(start_ns + edge.fraction * tick_ns, edge.level);
                }
                while let Some((at_ns, level)) = reader.pop(end_ns) {
                    self.drive.edge_e1(&shaft, (at_ns - start_ns) / tick_ns, level);
                }
            }
        }
        if self.film.tension_n().is_some() {
            self.drive.set_film_torque(self.film.torque_at_motor_nm());
        }
        observer.tick(&mut TickView {
            now_ns: self.now.as_nanos(),
            ends_millisecond: self.ticks.is_multiple_of(self.ticks_per_ms),
            drive: &mut self.drive,
            film: &mut self.film,
            module: &self.module,
        });
    }

    /// The block's inputs, to be set before the next PLC cycle.
    pub fn inputs_mut(&mut self) -> &mut Inputs {
        &mut self.inputs
    }

    /// The block's outputs after the last PLC cycle.
    pub fn outputs(&self) -> &Outputs {
        self.block.outputs()
    }

    /// The block.
    pub fn block(&self) -> &FilmFeedBlock {
        &self.block
    }

    /// What the parameter channel did.
    pub fn parameter_watch(&self) -> &ParameterWatch {
        &self.watch
    }

    /// The drive.
    pub fn drive(&self) -> &Drive {
        &self.drive
    }

    /// The drive, to work its terminals, its mains, its load.
    pub fn drive_mut(&mut self) -> &mut Drive {
        &mut self.drive
    }

    /// The bus module.
    pub fn module(&self) -> &Emf2133 {
        &self.module
    }

    /// The film.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The print of the next mark before the reader fails: the reader will not see it.
    pub fn blank_next_mark(&mut self) {
        self.film.blank_next_mark();
    }

    /// Threads the film anew: mark 0 lies 50 mm behind the reader.
    pub fn rethread_film(&mut self, marks: MarkConfig) {
        self.film.rethread(marks);
    }

    /// The line, to disturb it and to ask for violations of its rules.
    pub fn line_mut(&mut self) -> &mut VirtualBus {
        self.line_due = Some(self.now);
        &mut self.line
    }

    /// The line.
    pub fn line(&self) -> &VirtualBus {
        &self.line
    }

    /// The master.
    pub fn master(&self) -> &DpMaster<1> {
        &self.master
    }

    /// Where the drive's slave stands, seen from the master.
    pub fn slave_state(&self) -> SlaveState {
        self.master.state(self.slave)
    }

    /// Extended diagnosis of the drive's slave as the master read it last.
    pub fn extended_diagnosis(&self) -> Option<&[u8]> {
        self.master
            .diagnosis(self.slave)
            .map(|diagnosis| diagnosis.extended.as_slice())
    }

    /// Lets somebody hear every telegram from now on.
    pub fn listen(&mut self, listener: Listener) {
        let baud = self.line.baud();
        let port = self.ear.0.take().map_or_else(|| self.line.attach(), |(port, _)| port);
        self.ear = Ear(Some((port, Tap::new(baud, listener))));
        self.line_due = Some(self.now);
    }

    /// Lets another master, at address 1 and without slaves, enter the ring, or switches it off as if its plug were pulled.
    ///
    /// # Errors
    /// When it cannot be built at this baud rate.
    pub fn set_second_master(&mut self, present: bool) -> Result<(), RigError> {
        self.line_due = Some(self.now);
        match (&mut self.second_master, present) {
            (Some((port, _)), false) => {
                self.line.disconnect(*port);
                self.second_master = None;
            }
            (None, true) => {
                let config = MasterConfig::new(Address::new(1)?, BusParams::standard(self.line.baud()));
                let master = DpMaster::new(config)?;
                self.second_master = Some((self.line.attach(), master));
            }
            _ => {}
        }
        Ok(())
    }

    /// Whether another master is there.
    pub fn has_second_master(&self) -> bool {
        self.second_master.is_some()
    }

    /// Pulls the module off the line.
    pub fn disconnect_module(&mut self) {
        self.line.disconnect(self.module_port);
    }

    /// Plugs the module in again.
    pub fn reconnect_module(&mut self) {
        self.line.reconnect(self.module_port);
    }

    /// Kills the master: it falls silent and forgets everything.
    pub fn kill_master(&mut self) {
        self.master = self.fresh_master.clone();
        let port = self.master_port;
        self.line_mut().disconnect(port);
    }

    /// Lets a killed master come up anew.
    pub fn restart_master(&mut self) {
        self.master = self.fresh_master.clone();
        let port = self.master_port;
        self.line_mut().reconnect(port);
    }

    /// Takes the supply from the bus module and gives it back at once. The drive goes on.
    ///
    /// # Errors
    /// When the module is impossible, which it was not before.
    pub fn power_cycle_module(&mut self) -> Result<(), RigError> {
        self.module = Emf2133::new(self.module_config.clone(), self.line.baud())?;
        self.line_due = Some(self.now);
        Ok(())
    }

    /// The master, to change its mode.
    pub fn master_mut(&mut self) -> &mut DpMaster<1> {
        self.line_due = Some(self.now);
        &mut self.master
    }
}

/// Why there is no such chain.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RigError {
    /// An address is none.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// The bus parameters are impossible.
    #[error(transparent)]
    Master(#[from] MasterError),
    /// The slave cannot be added.
    #[error(transparent)]
    Slave(#[from] AddSlaveError),
    /// The configuration of the slave is none.
    #[error(transparent)]
    Configuration(#[from] CfgError),
    /// The watchdog time is out of range.
    #[error(transparent)]
    Watchdog(#[from] WatchdogError),
    /// The bus module is impossible.
    #[error(transparent)]
    Module(#[from] ModuleError),
    /// The bit error rate is none.
    #[error(transparent)]
    Disturbance(#[from] DisturbanceError),
}

/// An exchange of the parameter channel that takes longer is reported as unanswered: the module takes 30 to 50 ms
/// (9300 fact sheet, section 1.6), the slowest baud rate adds four DP cycles of 0.1 s.
const PARAMETER_LIMIT_NS: u64 = 1_000_000_000;

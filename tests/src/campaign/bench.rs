//! A rig under the safety rules, and the operator's hands on it.

use dp_master::dp::SlaveState;
use film_feed::report::TOLERANCE_MM;
use film_feed::rig::{Rig, RigConfig};

use crate::safety_monitor::SafetyMonitor;
use crate::{MILLISECOND, SECOND};

/// Length of the feeds, mm: the shortest that the block allows.
pub const LENGTH_MM: f64 = 200.0;

/// How a feed ended, as the block's outputs tell it, held against the film.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FeedEnd {
    /// JOB_FIN, and the film moved its length.
    Landed,
    /// JOB_FIN did not come: the operator sees a feed that is not finished.
    NotFinished,
}

/// The machine of one case.
#[derive(Debug)]
pub struct Bench {
    /// The machine.
    pub rig: Rig,
    /// The rules.
    pub monitor: SafetyMonitor,
    before_mm: f64,
}

impl Bench {
    /// At power-up, with the values for short feeds at the block and the enable given.
    ///
    /// # Errors
    /// When the configuration is impossible.
    pub fn powered_up(config: &RigConfig) -> Result<Self, String> {
        let mut rig = Rig::new(config).map_err(|error| error.to_string())?;
        let inputs = rig.inputs_mut();
        inputs.enable = true;
        inputs.velocity = 10_000;
        inputs.mark_velocity = 2_000;
        inputs.acceleration = 10_000;
        inputs.distance = 2_000;
        Ok(Bench {
            rig,
            monitor: SafetyMonitor::default(),
            before_mm: 0.0,
        })
    }

    /// Ready for its first feed.
    ///
    /// # Errors
    /// When it does not become ready within 10 s.
    pub fn ready(config: &RigConfig) -> Result<Self, String> {
        let mut bench = Self::powered_up(config)?;
        bench.wait_for_parameters()?;
        Ok(bench)
    }

    /// Waits until the drive is ready and has all parameters.
    ///
    /// # Errors
    /// When that takes more than 10 s.
    pub fn wait_for_parameters(&mut self) -> Result<(), String> {
        let rounds = self.rig.parameter_watch().rounds() + 2;
        let ready =
            |rig: &Rig| rig.outputs().drive_ready && !rig.outputs().error && rig.parameter_watch().rounds() >= rounds;
        if self.monitor.watch_until(&mut self.rig, 10 * SECOND, ready) {
            Ok(())
        } else {
            Err(format!("not ready after 10 s: {:?}", self.rig.outputs()))
        }
    }

    /// Runs on.
    pub fn run_ms(&mut self, ms: u64) {
        self.monitor.watch(&mut self.rig, ms * MILLISECOND);
    }

    /// Raises POS_START until RUNNING comes, for half a second at most.
    pub fn start(&mut self) -> bool {
        self.before_mm = self.rig.film().position_mm();
        self.rig.inputs_mut().pos_start = true;
        let taken = self
            .monitor
            .watch_until(&mut self.rig, SECOND / 2, |rig| rig.outputs().running);
        self.rig.inputs_mut().pos_start = false;
        taken
    }

    /// Waits for JOB_FIN, for 3 s at most, and lets the film come to rest.
    ///
    /// # Errors
    /// When JOB_FIN tells of a feed that did not land.
    pub fn finish(&mut self) -> Result<FeedEnd, String> {
        let finished = self.monitor.watch_until(&mut self.rig, 3 * SECOND, |rig| {
            rig.outputs().job_finished && !rig.outputs().running
        });
        self.run_ms(150);
        if !finished {
            return Ok(FeedEnd::NotFinished);
        }
        let error_mm = self.moved_mm() - LENGTH_MM;
        if error_mm.abs() <= TOLERANCE_MM {
            Ok(FeedEnd::Landed)
        } else {
            Err(format!("JOB_FIN, but the feed is {error_mm} mm off"))
        }
    }

    /// Way of the film since the start, mm.
    pub fn moved_mm(&self) -> f64 {
        self.rig.film().position_mm() - self.before_mm
    }

    /// A feed that nothing disturbs any more.
    ///
    /// # Errors
    /// When it does not land.
    pub fn whole_feed(&mut self) -> Result<(), String> {
        if !self.start() {
            return Err(format!("a start was not taken: {:?}", self.rig.outputs()));
        }
        match self.finish()? {
            FeedEnd::Landed => Ok(()),
            FeedEnd::NotFinished => Err(format!("a feed did not finish: {:?}", self.rig.outputs())),
        }
    }

    /// The cause is gone: waits for the bus, acknowledges, stops what is left of the program.
    ///
    /// # Errors
    /// When the bus is not back or the drive not ready within `limit_ms` each.
    pub fn recover(&mut self, limit_ms: u64) -> Result<(), String> {
        let limit = limit_ms * MILLISECOND;
        if !self.monitor.watch_until(&mut self.rig, limit, |rig| {
            rig.slave_state() == SlaveState::DataExchange
        }) {
            return Err(format!(
                "no data exchange {limit_ms} ms after the cause went: {:?}",
                self.rig.slave_state()
            ));
        }
        self.run_ms(50);
        // Stop first: it dominates whatever edge the acknowledgement makes.
        self.rig.inputs_mut().pos_stop = true;
        self.run_ms(1_500);
        self.rig.inputs_mut().error_reset = true;
        self.run_ms(100);
        self.rig.inputs_mut().error_reset = false;
        self.run_ms(100);
        self.rig.inputs_mut().pos_stop = false;
        self.run_ms(50);
        let ready = |rig: &Rig| rig.outputs().drive_ready && !rig.outputs().error && !rig.outputs().running;
        if self.monitor.watch_until(&mut self.rig, limit, ready) {
            Ok(())
        } else {
            Err(format!(
                "not ready {limit_ms} ms after the acknowledgement: {:?}",
                self.rig.outputs()
            ))
        }
    }

    /// Recovers, and a feed must land; then all rules must have held.
    ///
    /// # Errors
    /// What did not.
    pub fn end_well(&mut self, limit_ms: u64) -> Result<(), String> {
        self.recover(limit_ms)?;
        self.wait_for_parameters()?;
        self.whole_feed()?;
        self.rules_held()
    }

    /// Whether all safety rules held.
    ///
    /// # Errors
    /// The first that did not.
    pub fn rules_held(&self) -> Result<(), String> {
        match self.monitor.violation() {
            None => Ok(()),
            Some(violation) => Err(violation.to_string()),
        }
    }
}

//! Runs a feed plan, in virtual time or against a real line, and reports.

use dp_master::dp::SlaveState;

use crate::bus_config;
use crate::feed_probe::{FeedProbe, Reading};
use crate::operator::{FeedPlan, Operator, OperatorEvent};
use lenze9300_model::units::{INC_PER_REV, Rpm};

use crate::report::{BusReport, EnergyReport, ErrorKnown, FeedMode, FeedReport, FilmReport, RunReport, TOLERANCE_MM};
use crate::rig::{Rig, RigConfig, RigError, TickObserver, TickView};
use crate::scope::Sample;

/// What a simulated run keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Observation {
    /// The report only.
    FeedsOnly,
    /// All signals, once a millisecond.
    Samples,
}

/// Runs `plan` in virtual time. `feed_done` is called after each feed.
///
/// # Errors
/// [`RigError`] when the configuration is impossible.
///
/// Times of the outside world (`wall_s`, `speedup`) are left at 0: the run itself knows no clock.
pub fn simulated(
    config: &RigConfig,
    plan: FeedPlan,
    observation: Observation,
    feed_done: impl FnMut(),
) -> Result<(RunReport, Vec<Sample>), RigError> {
    observed(config, plan, observation, &mut (), feed_done)
}

/// [`simulated`], with another observer of every tick.
///
/// # Errors
/// [`RigError`] when the configuration is impossible.
pub fn observed(
    config: &RigConfig,
    plan: FeedPlan,
    observation: Observation,
    observer: &mut impl TickObserver,
    mut feed_done: impl FnMut(),
) -> Result<(RunReport, Vec<Sample>), RigError> {
    let mut rig = Rig::new(config)?;
    let length_mm = f64::from(plan.length_tenth_mm) / 10.0;
    let mut operator = Operator::new(plan, rig.now_ns());
    let mut recorder = Recorder::new(observation);
    let mut feeds: Vec<FeedReport> = Vec::new();
    let mut warnings = Vec::new();
    let mut aborted = None;
    let mut last_trouble = None;
    loop {
        rig.advance_to_plc_cycle(&mut |view: &mut TickView<'_>| {
            recorder.tick(view);
            observer.tick(view);
        });
        while let Some(event) = rig.master_mut().poll_event() {
            last_trouble = bus_config::trouble(&event).or(last_trouble);
        }
        let (now_ns, outputs, rounds) = (rig.now_ns(), *rig.outputs(), rig.parameter_watch().rounds());
        let event = operator.scan(now_ns, &outputs, rounds, rig.inputs_mut());
        match event {
            None => {}
            Some(OperatorEvent::SeriesReady(FeedMode::Length)) => {}
            // The operator threads the film so that a mark lies where a finished feed leaves it.
            Some(OperatorEvent::SeriesReady(FeedMode::Mark)) => rig.rethread_film(config.film.marks.clone()),
            Some(OperatorEvent::FeedStarted(mode)) => {
                let commanded_mm = (mode == FeedMode::Length).then_some(length_mm);
                recorder.start_feed(feeds.len() + 1, rig.film().position_mm(), commanded_mm);
            }
            Some(OperatorEvent::FeedOver { mode, job_ns }) => {
                let n = feeds.len() + 1;
                let pos_act_mm = f64::from(rig.outputs().position_mm);
                let probe = recorder.end_feed();
                let feed = probe.report(n, mode, rig.film().position_mm(), pos_act_mm, job_ns);
                if probe.no_mark_found() {
                    warnings.push(format!("feed {n}: no mark was found up to the end of the search"));
                }
                if feed.reversed {
                    warnings.push(format!(
                        "feed {n}: the film ran backwards by more than {TOLERANCE_MM} mm; the residual path was too short to brake, or the axis swung behind its set-value"
                    ));
                }
                feeds.push(feed);
                feed_done();
            }
            Some(OperatorEvent::Finished) => break,
            Some(OperatorEvent::Aborted(reason)) => {
                aborted = Some(match last_trouble.take() {
                    Some(trouble) if rig.slave_state() != SlaveState::DataExchange => format!("{reason}; {trouble}"),
                    _ => reason,
                });
                break;
            }
        }
        rig.plc_cycle();
    }
    let simulated_s = rig.now_ns() as f64 / 1e9;
    let ok = aborted.is_none() && feeds.iter().all(|feed| feed.landed(ErrorKnown::Always));
    let report = RunReport {
        feeds,
        bus: BusReport::new(
            config.baud,
            &rig.master().statistics(),
            rig.module().slave().statistics().fdl.discarded,
        ),
        parameters: rig.parameter_watch().troubles().to_vec(),
        film: FilmReport::new(rig.film()),
        energy: Some(EnergyReport::from(&rig.drive().axis().energy())),
        warnings,
        aborted,
        simulated_s,
        wall_s: 0.0,
        speedup: 0.0,
        ok,
    };
    Ok((report, recorder.samples))
}

/// Looks at every tick of the drive for the feed under way and, if asked, for the oscilloscope.
#[derive(Debug)]
struct Recorder {
    observation: Observation,
    probe: FeedProbe,
    /// Number of the feed under way; 0 between feeds.
    feed: usize,
    samples: Vec<Sample>,
    /// Torque of the ticks of this millisecond.
    torque_sum_nm: f64,
    torque_ticks: u32,
}

impl Recorder {
    fn new(observation: Observation) -> Self {
        Recorder {
            observation,
            probe: FeedProbe::default(),
            feed: 0,
            samples: Vec::new(),
            torque_sum_nm: 0.0,
            torque_ticks: 0,
        }
    }

    fn start_feed(&mut self, n: usize, film_mm: f64, commanded_mm: Option<f64>) {
        self.feed = n;
        self.probe.start(film_mm, commanded_mm);
    }

    fn end_feed(&mut self) -> &FeedProbe {
        self.feed = 0;
        &self.probe
    }
}

impl TickObserver for Recorder {
    fn tick(&mut self, view: &mut TickView<'_>) {
        while let Some(event) = view.drive.poll_traverse_event() {
            self.probe.event(&event, view.film.last_mark_mm());
        }
        if self.feed == 0 && self.observation == Observation::FeedsOnly {
            return;
        }
        let axis = view.drive.axis().sample();
        self.torque_sum_nm += axis.torque;
        self.torque_ticks += 1;
        if self.feed != 0 {
            self.probe.tick(&Reading {
                film_mm: view.film.position_mm(),
                rpm: Rpm::from_rad_s(axis.omega_true).0,
                torque_nm: axis.torque,
                // Not hypot: that is the platform's mathematics, a root is exact everywhere.
                current_a_peak: (axis.i_d * axis.i_d + axis.i_q * axis.i_q).sqrt(),
                following_error_mm: view.drive.following_error() as f64 * view.film.mm_per_increment(),
            });
        }
        if view.ends_millisecond {
            self.probe.millisecond(view.film.position_mm());
            if self.observation == Observation::Samples {
                self.samples.push(self.sample(view));
            }
            (self.torque_sum_nm, self.torque_ticks) = (0.0, 0);
        }
    }
}

impl Recorder {
    fn sample(&self, view: &mut TickView<'_>) -> Sample {
        let axis = *view.drive.axis().sample();
        let setpoint = view.drive.setpoint();
        let mm = view.film.mm_per_increment();
        Sample {
            time_s: view.now_ns as f64 / 1e9,
            feed: self.feed,
            record: view.drive.traverse_status().record,
            position_set_mm: setpoint.position as f64 * mm,
            position_act_mm: view.drive.position() as f64 * mm,
            film_mm: view.film.position_mm(),
            speed_set_rpm: setpoint.velocity * 1000.0 * 60.0 / INC_PER_REV as f64,
            speed_act_rpm: Rpm::from_rad_s(axis.omega_true).0,
            speed_demand_rpm: Rpm::from_rad_s(view.drive.speed_set_value()).0,
            torque_nm: axis.torque,
            torque_mean_nm: self.torque_sum_nm / self.torque_ticks.max(1) as f64,
            current_a_rms: axis.i_q * std::f64::consts::FRAC_1_SQRT_2,
            dc_link_v: axis.u_dc,
            control_word: view.module.control_word().0,
            status_word: view.module.status_word().0,
        }
    }
}

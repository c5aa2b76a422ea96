use nalgebra::SVector;

use super::drive_train::{DriveTrain, Passed, passing};
use super::solver::rk4_step_with_integral;
use super::{Contact, Dq, Interval, MechanicsParams, ShaftAngle, ShaftSegment, Terminals};

/// The driven side of an elastic drive train, and what couples it to the rotor.
#[derive(Debug, Clone)]
pub(super) struct Elastic {
    stiffness: f64,
    damping: f64,
    half_play_rad: f64,
    inv_j: f64,
    coulomb_nm: f64,
    omega: f64,
    /// Angle of the rotor less that of the driven side, rad.
    twist_rad: f64,
    contact: Contact,
    flank: Flank,
    rotor: ShaftSegment,
}

/// Which flank of the teeth carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Flank {
    /// None: the rotor is inside the free play.
    Free,
    /// The rotor drives in the positive direction.
    Positive,
    /// The rotor drives in the negative direction.
    Negative,
    /// There is no play: the spring pushes and pulls.
    Both,
}

/// `[i_d A, i_q A, ω of the rotor rad/s, its angle since the start of the tick rad, ω of the load rad/s, twist rad]`.
type State = SVector<f64, 6>;

/// What [`Passed`] counts, then the square of the speed of twist, rad²/s.
type ElasticPassed = SVector<f64, 5>;

/// What does not change during a piece of a tick.
#[derive(Debug, Clone, Copy)]
struct Mode {
    inv_l: Dq,
    rotor: Contact,
    load: Contact,
    flank: Flank,
}

impl Elastic {
    /// The driven side at rest in the middle of its play; `None` for a rigid shaft.
    pub(super) fn new(mechanics: &MechanicsParams) -> Option<Self> {
        let coupling = mechanics.coupling?;
        let standing = ShaftSegment {
            start: ShaftAngle::default(),
            end: ShaftAngle::default(),
            omega_start: 0.0,
            omega_end: 0.0,
            dt_s: 0.0,
        };
        Some(Self {
            stiffness: coupling.stiffness_nm_per_rad,
            damping: coupling.damping_nm_s,
            half_play_rad: 0.5 * coupling.backlash_rad.max(0.0),
            inv_j: 1.0 / mechanics.j_load_kg_m2,
            coulomb_nm: mechanics.coulomb_nm * coupling.friction_share.clamp(0.0, 1.0),
            omega: 0.0,
            twist_rad: 0.0,
            contact: Contact::Stuck,
            flank: if coupling.backlash_rad > 0.0 {
                Flank::Free
            } else {
                Flank::Both
            },
            rotor: standing,
        })
    }

    /// Coulomb friction of the driven side, Nm.
    pub(super) fn coulomb_nm(&self) -> f64 {
        self.coulomb_nm
    }

    /// Bound of the fastest mode of the two masses, 1/s.
    pub(super) fn spectral_radius(&self, j_rotor_kg_m2: f64) -> f64 {
        let inverse = 1.0 / j_rotor_kg_m2 + self.inv_j;
        (self.stiffness * inverse).sqrt().max(self.damping * inverse)
    }

    pub(super) fn omega(&self) -> f64 {
        self.omega
    }

    pub(super) fn set_omega(&mut self, omega: f64) {
        self.omega = omega;
        self.contact = Contact::sliding_at(omega);
    }

    /// Angle of the driven side for one of the rotor.
    pub(super) fn angle(&self, rotor: ShaftAngle) -> ShaftAngle {
        rotor.advanced_by_radians(-self.twist_rad)
    }

    /// Motion of the rotor in the last tick.
    pub(super) fn rotor_segment(&self) -> &ShaftSegment {
        &self.rotor
    }

    pub(super) fn kinetic_energy_j(&self) -> f64 {
        0.5 * self.omega * self.omega / self.inv_j
    }

    pub(super) fn stored_energy_j(&self) -> f64 {
        self.spring_energy_j(self.flank, self.twist_rad)
    }

    /// How far the spring is pressed, rad; its sign is that of the torque.
    fn pressed_rad(&self, flank: Flank, twist_rad: f64) -> f64 {
        match flank {
            Flank::Free => 0.0,
            Flank::Both => twist_rad,
            Flank::Positive => twist_rad - self.half_play_rad,
            Flank::Negative => twist_rad + self.half_play_rad,
        }
    }

    fn spring_energy_j(&self, flank: Flank, twist_rad: f64) -> f64 {
        let pressed = self.pressed_rad(flank, twist_rad);
        0.5 * self.stiffness * pressed * pressed
    }

    /// Torque from the rotor to the load, Nm.
    fn torque(&self, flank: Flank, x: &State) -> f64 {
        if flank == Flank::Free {
            return 0.0;
        }
        self.stiffness * self.pressed_rad(flank, x[5]) + self.damping * (x[2] - x[4])
    }

    /// How far a flank is from carrying: negative while it does not touch or would have to pull.
    fn pressure(&self, flank: Flank, x: &State) -> f64 {
        let towards = if flank == Flank::Negative { -1.0 } else { 1.0 };
        let pressed = towards * self.pressed_rad(flank, x[5]) * self.stiffness;
        let torque = towards * self.torque(flank, x);
        pressed.min(torque)
    }

    /// The flank that carries from here on.
    fn flank_at(&self, flank: Flank, x: &State) -> Flank {
        match flank {
            Flank::Both => Flank::Both,
            Flank::Positive if self.torque(Flank::Positive, x) > TOUCHING_NM => Flank::Positive,
            Flank::Negative if self.torque(Flank::Negative, x) < -TOUCHING_NM => Flank::Negative,
            Flank::Positive | Flank::Negative | Flank::Free => {
                if self.pressure(Flank::Positive, x) >= 0.0 && x[2] > x[4] {
                    Flank::Positive
                } else if self.pressure(Flank::Negative, x) >= 0.0 && x[2] < x[4] {
                    Flank::Negative
                } else {
                    Flank::Free
                }
            }
        }
    }
}

/// Torque below which a flank counts as left, Nm: far below friction, far above rounding.
const TOUCHING_NM: f64 = 1e-12;

/// Speed in the direction of sliding, or torque that friction still has in reserve while it holds.
fn margin(contact: Contact, omega: f64, drive_nm: f64, coulomb_nm: f64) -> f64 {
    match contact {
        Contact::Stuck => coulomb_nm - drive_nm.abs(),
        Contact::Positive | Contact::Negative => omega * contact.sign(),
    }
}

impl DriveTrain {
    /// [`advance_through`](Self::advance_through) with two masses.
    #[cold]
    #[inline(never)]
    pub(super) fn advance_elastic<T: Terminals>(
        &mut self,
        inv_l: Dq,
        intervals: impl IntoIterator<Item = Interval<T>>,
    ) -> ShaftSegment {
        let Some(mut elastic) = self.elastic.take() else {
            return ShaftSegment {
                start: self.angle,
                end: self.angle,
                omega_start: self.omega,
                omega_end: self.omega,
                dt_s: self.dt_s,
            };
        };
        let (rotor_start, rotor_omega_start) = (self.angle, self.omega);
        let (driven_start, driven_omega_start) = (elastic.angle(self.angle), elastic.omega);
        let mut mode = Mode {
            inv_l,
            rotor: self.contact,
            load: elastic.contact,
            flank: elastic.flank,
        };
        let mut x = State::from([
            self.current.d,
            self.current.q,
            self.omega,
            0.0,
            elastic.omega,
            elastic.twist_rad,
        ]);
        self.settle(&elastic, &mut mode, &mut x);
        let twist_start_rad = x[5];
        let mut electrical_j = 0.0;
        for interval in intervals {
            let mut remaining_s = interval.duration_s;
            let mut passed = Passed::zeros();
            for piece in 0..=MAX_PIECES {
                // The last piece runs to the end, whatever happens in it.
                let (after, part, taken_s) = self.elastic_piece(
                    &elastic,
                    &mode,
                    &x,
                    remaining_s,
                    piece == MAX_PIECES,
                    &interval.terminals,
                );
                self.count_elastic(&elastic, &mode, &x, &after, &part);
                passed += part.fixed_rows::<4>(0);
                x = after;
                remaining_s -= taken_s;
                if remaining_s <= 0.0 {
                    break;
                }
                self.settle(&elastic, &mut mode, &mut x);
            }
            electrical_j += self.count(&interval, &passed);
        }
        self.counted.load_j += self.load_nm * (x[3] - (x[5] - twist_start_rad));
        // A mode that ended with the tick is left here, so that nothing starts the next one on the wrong side.
        self.settle(&elastic, &mut mode, &mut x);
        self.end_tick(Dq::new(x[0], x[1]), x[2], x[3], electrical_j);
        self.contact = mode.rotor;
        elastic.omega = x[4];
        elastic.twist_rad = x[5];
        elastic.contact = mode.load;
        elastic.flank = mode.flank;
        elastic.rotor = ShaftSegment {
            start: rotor_start,
            end: self.angle,
            omega_start: rotor_omega_start,
            omega_end: self.omega,
            dt_s: self.dt_s,
        };
        let driven = ShaftSegment {
            start: driven_start,
            end: elastic.angle(self.angle),
            omega_start: driven_omega_start,
            omega_end: elastic.omega,
            dt_s: self.dt_s,
        };
        self.elastic = Some(elastic);
        driven
    }

    /// Value that stays at or above zero as long as the mode lasts.
    fn lasting(&self, elastic: &Elastic, mode: &Mode, x: &State) -> f64 {
        let twist_nm = elastic.torque(mode.flank, x);
        let air_gap_nm = self.equations.torque(x[0], x[1]);
        let rotor = margin(mode.rotor, x[2], air_gap_nm - twist_nm, self.coulomb_nm);
        let load = margin(mode.load, x[4], twist_nm - self.load_nm, elastic.coulomb_nm);
        let flank = match mode.flank {
            Flank::Both => f64::INFINITY,
            Flank::Free => -elastic
                .pressure(Flank::Positive, x)
                .max(elastic.pressure(Flank::Negative, x)),
            Flank::Positive => twist_nm,
            Flank::Negative => -twist_nm,
        };
        rotor.min(load).min(flank)
    }

    /// Decides at a moment what holds, slides and carries from here on.
    fn settle(&mut self, elastic: &Elastic, mode: &mut Mode, x: &mut State) {
        let flank = elastic.flank_at(mode.flank, x);
        // A flank that lets go while it is still pressed (the damping held it) leaves that energy behind.
        self.counted.coupling_loss_j +=
            elastic.spring_energy_j(mode.flank, x[5]) - elastic.spring_energy_j(flank, x[5]);
        mode.flank = flank;
        let twist_nm = elastic.torque(flank, x);
        let air_gap_nm = self.equations.torque(x[0], x[1]);
        if x[2] * mode.rotor.sign() <= 0.0 {
            self.counted.friction_j += 0.5 * x[2] * x[2] / self.inv_j;
            x[2] = 0.0;
            mode.rotor = Contact::at_rest(air_gap_nm - twist_nm, self.coulomb_nm);
        }
        if x[4] * mode.load.sign() <= 0.0 {
            self.counted.friction_j += 0.5 * x[4] * x[4] / elastic.inv_j;
            x[4] = 0.0;
            mode.load = Contact::at_rest(twist_nm - self.load_nm, elastic.coulomb_nm);
        }
    }

    /// Integrates until the end of the interval or of the mode; returns the state, what passed, and the time it took.
    fn elastic_piece(
        &self,
        elastic: &Elastic,
        mode: &Mode,
        x: &State,
        duration_s: f64,
        to_the_end: bool,
        terminals: &impl Terminals,
    ) -> (State, ElasticPassed, f64) {
        let run = |until_s: f64| self.integrate_elastic(elastic, mode, x, until_s, terminals);
        let (after, passed) = run(duration_s);
        let at_end = self.lasting(elastic, mode, &after);
        if at_end >= 0.0 || to_the_end {
            return (after, passed, duration_s);
        }
        // The mode ends inside: regula falsi (Illinois), and halves from where something was just on the edge already.
        let (mut low_s, mut low) = (0.0, self.lasting(elastic, mode, x).max(0.0));
        let (mut high_s, mut high) = (duration_s, at_end);
        let mut last = (after, passed);
        for _ in 0..MAX_ROUNDS {
            if high_s - low_s <= LOCATED_TO * duration_s {
                break;
            }
            let middle_s = if low > 0.0 {
                low_s + (high_s - low_s) * low / (low - high)
            } else {
                0.5 * (low_s + high_s)
            };
            let middle_s = middle_s.clamp(low_s + LOCATED_TO * duration_s, high_s);
            let at_middle = run(middle_s);
            let value = self.lasting(elastic, mode, &at_middle.0);
            if value < 0.0 {
                (high_s, high) = (middle_s, value);
                last = at_middle;
                low *= 0.5;
            } else {
                (low_s, low) = (middle_s, value);
                high *= 0.5;
            }
        }
        (last.0, last.1, high_s)
    }

    fn integrate_elastic(
        &self,
        elastic: &Elastic,
        mode: &Mode,
        x: &State,
        duration_s: f64,
        terminals: &impl Terminals,
    ) -> (State, ElasticPassed) {
        let h_s = duration_s * self.step_share;
        let mut x = *x;
        let mut passed = ElasticPassed::zeros();
        for _ in 0..self.substeps {
            let (after, part) = rk4_step_with_integral(
                &x,
                h_s,
                |x| self.elastic_derivative(elastic, mode, x, terminals),
                |x| {
                    let [d, q, squared, omega] = passing(Dq::new(x[0], x[1]), x[2], x[3], terminals).into();
                    ElasticPassed::from([d, q, squared, omega, (x[2] - x[4]) * (x[2] - x[4])])
                },
            );
            x = after;
            passed += part;
        }
        (x, passed)
    }

    fn elastic_derivative(&self, elastic: &Elastic, mode: &Mode, x: &State, terminals: &impl Terminals) -> State {
        let current = Dq::new(x[0], x[1]);
        let (slope_d, slope_q) = self
            .equations
            .current_slopes(current, x[2], terminals.voltage(x[3]), mode.inv_l);
        let twist_nm = elastic.torque(mode.flank, x);
        let rotor_nm = self.equations.torque(x[0], x[1])
            - twist_nm
            - mode.rotor.sign() * self.coulomb_nm
            - self.viscous_nm_s * x[2];
        let load_nm = twist_nm - self.load_nm - mode.load.sign() * elastic.coulomb_nm;
        let free = |contact: Contact, slope: f64| if contact == Contact::Stuck { 0.0 } else { slope };
        State::from([
            slope_d,
            slope_q,
            free(mode.rotor, rotor_nm * self.inv_j),
            x[2],
            free(mode.load, load_nm * elastic.inv_j),
            x[2] - x[4],
        ])
    }

    /// Counts the heat of a piece beyond what [`count`](Self::count) does.
    fn count_elastic(&mut self, elastic: &Elastic, mode: &Mode, x: &State, after: &State, passed: &ElasticPassed) {
        let rotor_rad = after[3] - x[3];
        let load_rad = rotor_rad - (after[5] - x[5]);
        self.counted.friction_j +=
            mode.rotor.sign() * self.coulomb_nm * rotor_rad + mode.load.sign() * elastic.coulomb_nm * load_rad;
        if mode.flank != Flank::Free {
            self.counted.coupling_loss_j += elastic.damping * passed[4];
        }
    }
}

/// Pieces into which stops and flanks may divide an interval.
const MAX_PIECES: usize = 8;

/// Share of an interval to which a change is located: far above rounding, so that what made the change shows after it.
const LOCATED_TO: f64 = 1e-9;

/// Rounds in which the moment of a change is sought.
const MAX_ROUNDS: usize = 40;

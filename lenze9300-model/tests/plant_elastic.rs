//! Two masses, a spring and free play between them, against closed solutions.

use lenze9300_model::plant::{Contact, Coupling, Dq, DriveTrain, MechanicsParams, OutputStage, PmsmParams, ShaftAngle};
use lenze9300_model::units::INC_PER_REV;

const DT_S: f64 = 125e-6;
const J_ROTOR: f64 = 0.25e-4;
const J_LOAD: f64 = 0.664e-4;
const STIFFNESS: f64 = 20.0;

fn train(coupling: Coupling, coulomb_nm: f64) -> DriveTrain {
    let mechanics = MechanicsParams {
        j_rotor_kg_m2: J_ROTOR,
        j_load_kg_m2: J_LOAD,
        coulomb_nm,
        coupling: Some(coupling),
        ..MechanicsParams::default()
    };
    DriveTrain::new(&PmsmParams::MDSKS036_13, &mechanics, 100.0, DT_S)
}

fn spring(backlash_rad: f64) -> Coupling {
    Coupling {
        stiffness_nm_per_rad: STIFFNESS,
        damping_nm_s: 0.0,
        backlash_rad,
        friction_share: 0.5,
    }
}

fn radians(angle: ShaftAngle) -> f64 {
    angle.offset_from(ShaftAngle::default()) / INC_PER_REV as f64 * std::f64::consts::TAU
}

#[test]
fn a_torque_on_the_load_swings_both_masses_at_the_resonance() {
    // φ = θ_M − θ_L obeys φ'' = M/J_L − c φ/J_r with 1/J_r = 1/J_M + 1/J_L, so φ = M J_r/(J_L c) (1 − cos ω t), ω = √(c/J_r):
    // the two-mass system of every textbook on drives, free of friction. 0.1 Nm against the positive direction.
    let mut train = train(spring(0.0), 0.0);
    train.set_load_torque(0.1);
    let j_r = J_ROTOR * J_LOAD / (J_ROTOR + J_LOAD);
    let omega = (STIFFNESS / j_r).sqrt();
    let mut largest: f64 = 0.0;
    for tick in 1..=2000 {
        train.advance(OutputStage::Inhibited);
        let t = f64::from(tick) * DT_S;
        let expected = 0.1 * j_r / (J_LOAD * STIFFNESS) * (1.0 - (omega * t).cos());
        let twist = radians(train.angle()) - radians(train.driven_angle());
        largest = largest.max((twist - expected).abs());
        // Both together fall with the torque over both masses.
        let momentum = J_ROTOR * train.omega() + J_LOAD * train.driven_omega();
        assert!((momentum + 0.1 * t).abs() < 1e-12, "{momentum}");
    }
    // 43 periods at 171 Hz: the solver's phase errs by less than 1e-3.
    let amplitude = 0.1 * j_r / (J_LOAD * STIFFNESS);
    assert!(largest < 2e-3 * amplitude, "{largest:e} of {amplitude:e}");
}

#[test]
fn a_load_falls_freely_through_half_the_play_and_then_takes_the_rotor_along() {
    // From the middle of 0.02 rad of play: 0.01 rad at 0.05/0.664e-4 rad/s² take 5.15 ms (s = a t²/2). The rotor stands till then.
    let mut train = train(spring(0.02), 0.0);
    train.set_load_torque(0.05);
    let slope = 0.05 / J_LOAD;
    let meets_s = (2.0 * 0.01 / slope).sqrt();
    let mut met = None;
    for tick in 1..=400 {
        train.advance(OutputStage::Inhibited);
        let t = f64::from(tick) * DT_S;
        if t <= meets_s {
            assert_eq!(train.omega(), 0.0, "{t}");
            assert!((train.driven_omega() + slope * t).abs() < 1e-9, "{t}");
        } else if met.is_none() {
            met = Some(tick);
            assert!(train.omega() < 0.0);
        }
        // Momentum knows no spring.
        let momentum = J_ROTOR * train.omega() + J_LOAD * train.driven_omega();
        assert!((momentum + 0.05 * t).abs() < 1e-12, "{momentum}");
    }
    assert_eq!(met, Some((meets_s / DT_S).ceil() as u32));
}

#[test]
fn without_losses_energy_stays_whatever_the_flanks_do() {
    // Rotor and load start at 20 rad/s against each other's play; nothing takes energy away.
    let mut train = train(spring(0.05), 0.0);
    train.set_load_torque(0.05);
    for _ in 0..300 {
        train.advance(OutputStage::Inhibited);
    }
    train.set_load_torque(0.0);
    let energy = |train: &DriveTrain| train.kinetic_energy_j() + train.elastic_energy_j();
    let before = energy(&train);
    let (mut crossings, mut sign) = (0, 0.0);
    for _ in 0..8000 {
        train.advance(OutputStage::Inhibited);
        let relative = train.omega() - train.driven_omega();
        if relative * sign < 0.0 {
            crossings += 1;
        }
        sign = relative.signum();
    }
    assert!(crossings > 20, "the masses hit each other again and again: {crossings}");
    assert!(
        (energy(&train) / before - 1.0).abs() < 1e-6,
        "{} {before}",
        energy(&train)
    );
}

#[test]
fn friction_holds_each_side_by_itself() {
    // Half of 0.05 Nm holds the load, which 0.02 Nm do not move; 0.03 Nm move it against the spring, and the rotor's half holds that:
    // it comes to rest pressed by what is above its own friction at most.
    let mut train = train(spring(0.0), 0.05);
    train.set_load_torque(0.02);
    for _ in 0..100 {
        train.advance(OutputStage::Inhibited);
    }
    assert_eq!((train.omega(), train.driven_omega()), (0.0, 0.0));
    assert_eq!(train.driven_angle(), ShaftAngle::default());
    train.set_load_torque(0.03);
    for _ in 0..80_000 {
        train.advance(OutputStage::Inhibited);
    }
    assert_eq!((train.omega(), train.driven_omega()), (0.0, 0.0));
    assert_eq!(train.contact(), Contact::Stuck);
    assert_eq!(train.angle(), ShaftAngle::default(), "the rotor never moved");
    let twist = -radians(train.driven_angle());
    assert!(twist > 0.0 && STIFFNESS * twist <= 0.03 + 0.025, "{twist}");
    let rest = train.driven_angle();
    for _ in 0..10_000 {
        train.advance(OutputStage::Inhibited);
    }
    assert_eq!(train.driven_angle(), rest, "what stands does not creep");
}

#[test]
fn a_stiff_coupling_moves_like_one_mass() {
    // 2000 Nm/rad twist by 0.5e-3 rad at 1 Nm; apart from that both trains see the same voltages and turn alike.
    let stiff = Coupling {
        stiffness_nm_per_rad: 2000.0,
        damping_nm_s: 0.02,
        ..spring(0.0)
    };
    let mut elastic = train(stiff, 0.05);
    let rigid = MechanicsParams::default();
    let mut rigid = DriveTrain::new(&PmsmParams::MDSKS036_13, &rigid, 100.0, DT_S);
    for _ in 0..1600 {
        elastic.advance(OutputStage::Active(Dq::new(0.0, 30.0)));
        rigid.advance(OutputStage::Active(Dq::new(0.0, 30.0)));
    }
    assert!(
        (elastic.omega() / rigid.omega() - 1.0).abs() < 1e-3,
        "{} {}",
        elastic.omega(),
        rigid.omega()
    );
    let apart = radians(elastic.angle()) - radians(rigid.angle());
    assert!(apart.abs() < 2e-3, "{apart}");
}

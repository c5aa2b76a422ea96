use nalgebra::SVector;

/// Product of step and spectral radius above which a step is divided.
///
/// RK4 then errs by less than (h·ρ)^5/120, some 1e-5 of the fastest mode, per step. Source: design, section 5.
pub const MAX_STEP_TIMES_RADIUS: f64 = 0.25;

/// Number of equal sub-steps that keeps `h_s · rho_per_s` at or below [`MAX_STEP_TIMES_RADIUS`]; at least 1, at most 64.
///
/// Chosen once per parameter set and never adapted, so that the same inputs give the same bits.
#[must_use]
pub fn substeps(h_s: f64, rho_per_s: f64) -> u32 {
    let needed = (h_s * rho_per_s / MAX_STEP_TIMES_RADIUS).ceil();
    // A float-to-integer cast saturates; a NaN becomes 0 and then 1.
    (needed as u32).clamp(1, 64)
}

/// One classical Runge-Kutta step of fourth order.
///
/// An explicit step with fixed coefficients and without iteration: it costs four derivatives and is repeatable to the bit.
#[inline]
#[must_use]
pub fn rk4_step<const N: usize>(
    x: &SVector<f64, N>,
    h_s: f64,
    derivative: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
) -> SVector<f64, N> {
    let half = 0.5 * h_s;
    let k1 = derivative(x);
    let k2 = derivative(&(x + k1 * half));
    let k3 = derivative(&(x + k2 * half));
    let k4 = derivative(&(x + k3 * h_s));
    x + (k1 + (k2 + k3) * 2.0 + k4) * (h_s / 6.0)
}

/// [`rk4_step`], and with it the integral of a function of the state over the step.
///
/// The integral is what the same method would give for further states that nothing depends on: stages weighted 1, 2, 2, 1. It
/// costs the function four times and no further derivative.
#[inline]
#[must_use]
pub fn rk4_step_with_integral<const N: usize, const M: usize>(
    x: &SVector<f64, N>,
    h_s: f64,
    derivative: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
    integrand: impl Fn(&SVector<f64, N>) -> SVector<f64, M>,
) -> (SVector<f64, N>, SVector<f64, M>) {
    let half = 0.5 * h_s;
    let k1 = derivative(x);
    let x2 = x + k1 * half;
    let k2 = derivative(&x2);
    let x3 = x + k2 * half;
    let k3 = derivative(&x3);
    let x4 = x + k3 * h_s;
    let k4 = derivative(&x4);
    let integral = integrand(x) + (integrand(&x2) + integrand(&x3)) * 2.0 + integrand(&x4);
    (x + (k1 + (k2 + k3) * 2.0 + k4) * (h_s / 6.0), integral * (h_s / 6.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    #[test]
    fn the_thesis_axis_needs_one_step_a_tick() {
        // R/L = 649 1/s, 5500 rpm electrical 1728 1/s: h·ρ = 0.23.
        assert_eq!(substeps(125e-6, 1864.0), 1);
    }

    #[test]
    fn a_fast_mode_divides_the_step() {
        assert_eq!(substeps(125e-6, 2001.0), 2);
        assert_eq!(substeps(125e-6, 20_000.0), 10);
        assert_eq!(substeps(125e-6, f64::INFINITY), 64);
        assert_eq!(substeps(125e-6, f64::NAN), 1);
    }

    #[test]
    fn halving_the_step_divides_the_error_by_about_16() {
        // The order of the method: global error proportional to h^4. Oracle: the closed solution exp(-t).
        let error = |steps: u32| {
            let h = 1.0 / f64::from(steps);
            let mut x = SVector::<f64, 1>::new(1.0);
            for _ in 0..steps {
                x = rk4_step(&x, h, |x| -x);
            }
            (x[0] - (-1.0_f64).exp()).abs()
        };
        let ratio = error(8) / error(16);
        assert!((15.0..18.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn an_integral_is_as_exact_as_the_state_it_belongs_to() {
        // d(x²)/dt = −2 x² for x = exp(−t): ∫ 2 x² dt over 0…1 is 1 − exp(−2).
        let error = |steps: u32| {
            let h = 1.0 / f64::from(steps);
            let mut x = SVector::<f64, 1>::new(1.0);
            let mut sum = 0.0;
            for _ in 0..steps {
                let (next, part) = rk4_step_with_integral(&x, h, |x| -x, |x| SVector::<f64, 1>::new(2.0 * x[0] * x[0]));
                assert_eq!(next, rk4_step(&x, h, |x| -x));
                x = next;
                sum += part[0];
            }
            (sum - (1.0 - (-2.0_f64).exp())).abs()
        };
        let ratio = error(8) / error(16);
        assert!((14.0..19.0).contains(&ratio), "{ratio}");
    }
}

use crate::plant::Dq;

/// Values of the three phases U, V, W; for currents of a star without neutral they sum to zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Phases(pub(crate) [f64; 3]);

impl Phases {
    /// From a vector of the stator-fixed frame, peak-valued: U = α, V and W at ±120°.
    pub(crate) fn from_stator(vector: Dq) -> Self {
        let (along, across) = (-0.5 * vector.d, 0.5 * SQRT_3 * vector.q);
        Self([vector.d, along + across, along - across])
    }

    /// The vector in the stator-fixed frame; what is common to all three has no effect on a motor in star and falls out.
    pub(crate) fn to_stator(self) -> Dq {
        let [u, v, w] = self.0;
        Dq::new((2.0 * u - v - w) / 3.0, (v - w) / SQRT_3)
    }

    pub(crate) fn map(self, f: impl FnMut(f64) -> f64) -> Self {
        Self(self.0.map(f))
    }
}

pub(crate) const SQRT_3: f64 = 1.732_050_807_568_877_2;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_is_the_same_vector_whatever_is_common() {
        let vector = Dq::new(3.0, -1.5);
        let phases = Phases::from_stator(vector);
        assert!(phases.0.iter().sum::<f64>().abs() < 1e-15);
        let back = phases.map(|value| value + 100.0).to_stator();
        assert!((back.d - vector.d).abs() < 1e-12 && (back.q - vector.q).abs() < 1e-12);
    }
}

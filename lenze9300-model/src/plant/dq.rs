use core::ops::{Add, Mul, Sub};

/// A space vector in the rotor-fixed frame, peak-valued (amplitude-invariant).
///
/// `d` points along the magnet flux, `q` leads it by 90 degrees electrical; a positive `q` current turns the shaft in the
/// positive direction. Divide by √2 for the rms value of a phase.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Dq {
    /// Component along the magnet flux.
    pub d: f64,
    /// Component that makes torque.
    pub q: f64,
}

impl Dq {
    /// The zero vector.
    pub const ZERO: Self = Self { d: 0.0, q: 0.0 };

    /// A vector from its components.
    #[must_use]
    pub const fn new(d: f64, q: f64) -> Self {
        Self { d, q }
    }

    /// Scalar product; `1.5 · u.dot(i)` is the electrical power of a three-phase machine.
    #[must_use]
    pub fn dot(self, other: Self) -> f64 {
        self.d * other.d + self.q * other.q
    }

    /// The vector turned counter-clockwise by an angle, rad.
    ///
    /// With `libm`'s sine and cosine, which are the same bits on every machine.
    #[must_use]
    pub fn turned_by(self, angle_rad: f64) -> Self {
        let (sin, cos) = libm::sincos(angle_rad);
        Self::new(self.d * cos - self.q * sin, self.d * sin + self.q * cos)
    }

    /// Peak value of the phase quantity.
    #[must_use]
    pub fn magnitude(self) -> f64 {
        self.dot(self).sqrt()
    }

    /// Rms value of the phase quantity.
    #[must_use]
    pub fn phase_rms(self) -> f64 {
        (0.5 * self.dot(self)).sqrt()
    }

    /// Rms value between two lines: √3 times that of a phase. Meant for voltages.
    #[must_use]
    pub fn line_to_line_rms(self) -> f64 {
        (1.5 * self.dot(self)).sqrt()
    }
}

impl Add for Dq {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.d + other.d, self.q + other.q)
    }
}

impl Sub for Dq {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::new(self.d - other.d, self.q - other.q)
    }
}

impl Mul<f64> for Dq {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self::new(self.d * factor, self.q * factor)
    }
}

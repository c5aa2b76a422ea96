//! How much torque motor and drive can give at a speed.

use crate::machine_file::MachineFile;

/// The torque-speed curve of a motor on a drive.
#[derive(Debug, Clone, Copy)]
#[doc(alias = "Drehzahl-Drehmoment-Kennlinie")]
pub struct TorqueLimits<'m> {
    machine: &'m MachineFile,
}

impl<'m> TorqueLimits<'m> {
    /// The curve of a machine's motor on its drive.
    pub fn of(machine: &'m MachineFile) -> Self {
        Self { machine }
    }

    /// Line-line voltage that the drive can give at the lowest mains, V rms.
    ///
    /// The DC link stands at √2·U_mains, the largest sinusoidal voltage vector is U_link/√3: line-line that is U_mains again.
    pub fn available_v(&self) -> f64 {
        self.machine.mains.lowest_v
    }

    /// Torque at the current that drive and motor can give for a moment and C0022 allows, Nm.
    pub fn current_limit_nm(&self) -> f64 {
        let machine = self.machine;
        let current_a = machine
            .current_limit_a
            .min(peak_current_a(machine))
            .min(machine.motor.peak_current_a);
        machine.motor.torque_nm(current_a).min(machine.motor.peak_torque_nm)
    }

    /// Greatest motoring torque that the voltage allows at a speed, Nm; 0 where the back EMF alone is above it (thesis 5.6,
    /// "Spannungsgrenzkurve").
    #[doc(alias = "Spannungsgrenzkurve")]
    pub fn voltage_limit_nm(&self, rpm: f64) -> f64 {
        let (motor, available_v) = (&self.machine.motor, self.available_v());
        let fits = |torque_nm: f64| motor.voltage_v(rpm.abs(), torque_nm) <= available_v;
        if !fits(0.0) {
            return 0.0;
        }
        let (mut low, mut high) = (0.0, motor.peak_torque_nm);
        if fits(high) {
            return high;
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if fits(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Greatest motoring torque at a speed, Nm: the least of all limits.
    pub fn peak_nm(&self, rpm: f64) -> f64 {
        self.voltage_limit_nm(rpm).min(self.current_limit_nm())
    }
}

/// Greatest current of the drive at the chopping frequency of C0018, A rms.
pub(super) fn peak_current_a(machine: &MachineFile) -> f64 {
    if chops_at_16_khz(machine) {
        machine.drive.peak_current_16_khz_a
    } else {
        machine.drive.peak_current_a
    }
}

/// Rated current of the drive at the chopping frequency of C0018, A rms.
pub(super) fn rated_current_a(machine: &MachineFile) -> f64 {
    if chops_at_16_khz(machine) {
        machine.drive.rated_current_16_khz_a
    } else {
        machine.drive.rated_current_a
    }
}

/// C0018 = 0 chops at 16 kHz and falls back to 8 kHz by itself, so it is not counted.
fn chops_at_16_khz(machine: &MachineFile) -> bool {
    machine.codes.number(lenze9300_model::code::table::number::C0018, 0) == 2.0
}

/// Halvings of the torque: 3 Nm come down to less than a nanonewton metre.
const BISECTIONS: u32 = 40;

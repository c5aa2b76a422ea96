//! I×t: how much of what the drive may give it has given in the last three minutes (C0064, OC5).

/// Seconds that count. Source: 9300 facts 4.4, C0064.
const WINDOW_S: usize = 180;

/// Mean of the motor current over the last 180 s, as a share of 1.05 times the rated current.
///
/// Interpretation: 100 % is what the drive may give for ever. "I×t > 100 %, permanent > 1.05·I_N" (9300 facts 4.9) makes that
/// 1.05·I_N; the permitted cycle of 1 min at 150 % and 2 min at 75 % (9300 facts 4.10) then comes to 95 %.
#[derive(Debug, Clone)]
pub(super) struct Utilisation {
    /// Mean currents of the last seconds, A rms.
    seconds: [f64; WINDOW_S],
    next: usize,
    /// Sum of the milliseconds of this second, A rms.
    sum_a: f64,
    count: u32,
    limit_a: f64,
    exceeded: bool,
}

impl Utilisation {
    /// Before the first current; `rated_a` is the rated current of the drive, A rms.
    pub(super) fn new(rated_a: f64) -> Self {
        Self {
            seconds: [0.0; WINDOW_S],
            next: 0,
            sum_a: 0.0,
            count: 0,
            limit_a: 1.05 * rated_a,
            exceeded: false,
        }
    }

    /// A millisecond with this current, A rms.
    pub(super) fn pass_1ms(&mut self, current_a_rms: f64) {
        self.sum_a += current_a_rms;
        self.count += 1;
        if self.count < 1000 {
            return;
        }
        if let Some(place) = self.seconds.get_mut(self.next) {
            *place = self.sum_a / 1000.0;
        }
        self.next = (self.next + 1) % WINDOW_S;
        (self.sum_a, self.count) = (0.0, 0);
        let percent = self.percent();
        // OC5 comes above 100 % and can be reset below 95 % (9300 facts 4.9).
        self.exceeded = percent > 100.0 || (self.exceeded && percent >= 95.0);
    }

    /// C0064, %.
    pub(super) fn percent(&self) -> f64 {
        let sum: f64 = self.seconds.iter().sum();
        100.0 * sum / (WINDOW_S as f64 * self.limit_a)
    }

    /// Whether the cause of OC5 is there.
    pub(super) fn exceeded(&self) -> bool {
        self.exceeded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of the rated current for so many seconds.
    fn pass(utilisation: &mut Utilisation, share: f64, seconds: u32) {
        for _ in 0..seconds * 1000 {
            utilisation.pass_1ms(2.5 * share);
        }
    }

    #[test]
    fn one_minute_at_150_and_two_at_75_percent_can_be_repeated_for_ever() {
        // Source: 9300 facts 4.10.
        let mut utilisation = Utilisation::new(2.5);
        for _ in 0..5 {
            pass(&mut utilisation, 1.5, 60);
            pass(&mut utilisation, 0.75, 120);
            assert!(!utilisation.exceeded(), "{}", utilisation.percent());
        }
        // (60 · 1.5 + 120 · 0.75) / (180 · 1.05) = 95.24 %.
        assert!((utilisation.percent() - 95.238).abs() < 0.01);
    }

    #[test]
    fn more_than_105_percent_for_ever_is_too_much_and_105_is_not() {
        let mut utilisation = Utilisation::new(2.5);
        pass(&mut utilisation, 1.049, 400);
        assert!(!utilisation.exceeded());
        pass(&mut utilisation, 1.06, 400);
        assert!(utilisation.exceeded());
    }

    #[test]
    fn what_was_too_much_has_gone_below_95_percent() {
        let mut utilisation = Utilisation::new(2.5);
        pass(&mut utilisation, 1.5, 127);
        assert!(utilisation.exceeded(), "127 s of 150 % are 100.8 %");
        // The seconds at 150 % still count: 99 % after two more at nothing would still hold it.
        let mut seconds = 0;
        while utilisation.exceeded() {
            pass(&mut utilisation, 0.0, 1);
            seconds += 1;
        }
        assert!(utilisation.percent() < 95.0);
        // They begin to leave the window 53 s later.
        assert!((54..70).contains(&seconds), "{seconds} s");
    }
}

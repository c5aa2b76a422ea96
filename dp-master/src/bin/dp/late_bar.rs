//! A progress bar for what lasts longer than two seconds, on a terminal only.

use std::io::{IsTerminal, Read};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar on standard error that shows itself late.
#[derive(Debug)]
pub(crate) struct LateBar {
    bar: ProgressBar,
    begun: Instant,
}

impl LateBar {
    /// A bar of this length, hidden at first; `template` is one of `indicatif`.
    pub(crate) fn new(length: u64, template: &str) -> Self {
        let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::hidden());
        bar.set_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self {
            bar,
            begun: Instant::now(),
        }
    }

    /// One step further.
    pub(crate) fn step(&self) {
        self.advance(1);
    }

    /// Several steps further.
    pub(crate) fn advance(&self, steps: u64) {
        self.bar.inc(steps);
        if self.bar.is_hidden() && self.begun.elapsed() > LATE && std::io::stderr().is_terminal() {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
    }

    /// Stands at this place, with a text.
    pub(crate) fn show(&self, place: u64, text: &str) {
        self.bar.set_message(text.to_owned());
        self.bar.set_position(place);
        self.advance(0);
    }

    /// No step, but time has passed.
    pub(crate) fn tick(&self) {
        self.advance(0);
    }

    /// A reader whose octets move the bar.
    pub(crate) const fn reading<R>(&self, reader: R) -> Reading<'_, R> {
        Reading { bar: self, reader }
    }

    /// The bar goes away.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// See [`LateBar::reading`].
#[derive(Debug)]
pub(crate) struct Reading<'a, R> {
    bar: &'a LateBar,
    reader: R,
}

impl<R: Read> Read for Reading<'_, R> {
    fn read(&mut self, buf: &mut [u8]) -> std::io::Result<usize> {
        let octets = self.reader.read(buf)?;
        self.bar.advance(octets as u64);
        Ok(octets)
    }
}

const LATE: Duration = Duration::from_secs(2);

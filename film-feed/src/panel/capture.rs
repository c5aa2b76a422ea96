//! The last telegrams of the line, to be taken home as a capture file.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use dp_master::phy::{CaptureError, CaptureWriter, Direction, Trace};
use dp_master::time::{Baud, Duration, Instant};

/// Telegrams that are kept: some 25 s at a DP cycle of 1 ms.
const KEPT: usize = 100_000;

/// A ring of telegrams, shared between the line and whoever asks for the file.
#[derive(Debug, Clone)]
pub(super) struct Capture {
    baud: Baud,
    kept: Arc<Mutex<VecDeque<Kept>>>,
}

#[derive(Debug)]
struct Kept {
    start: Instant,
    end: Instant,
    octets: Box<[u8]>,
}

impl Capture {
    pub(super) fn new(baud: Baud) -> Self {
        Self {
            baud,
            kept: Arc::default(),
        }
    }

    pub(super) fn keep(&self, trace: &Trace<'_>) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() == KEPT {
            kept.pop_front();
        }
        kept.push_back(Kept {
            start: trace.start,
            end: trace.end,
            octets: trace.octets.into(),
        });
    }

    /// What is kept as pcapng, in virtual time.
    pub(super) fn file(&self) -> Result<Vec<u8>, CaptureError> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let mut file = CaptureWriter::new(Vec::new(), self.baud, Duration::ZERO)?;
        for Kept { start, end, octets } in kept.iter() {
            file.write(&Trace::of(*start, *end, Direction::Received, octets))?;
        }
        file.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dp_master::phy::CaptureReader;

    #[test]
    fn what_was_heard_last_is_in_the_file() {
        let capture = Capture::new(Baud::B12000000);
        for n in 0..(KEPT as u64 + 10) {
            let start = Instant::from_nanos(1000 * n);
            let trace = Trace::of(
                start,
                Instant::from_nanos(1000 * n + 500),
                Direction::Received,
                &[0xDC, 2, 1],
            );
            capture.keep(&trace);
        }
        let file = capture.file().expect("a vector takes everything");
        let mut packets = CaptureReader::new(file.as_slice()).expect("a capture");
        let first = packets.next().expect("a telegram").expect("whole");
        assert_eq!(
            (first.start, first.octets.as_slice()),
            (Instant::from_nanos(10_000), &[0xDC, 2, 1][..])
        );
        assert_eq!(packets.count(), KEPT - 1);
    }
}

//! A print-mark reader at E1, for a drive that runs without a machine around it.

use lenze9300_model::code::CodeStore;
use lenze9300_model::device::Drive;
use lenze9300_model::plant::{ShaftAngle, ShaftSegment};
use lenze9300_model::traverse::Resolution;

/// Marks at equal distances on an endless film: E1 is high while one is under the reader.
///
/// The first mark lies one distance less 50 mm ahead, where the next one lies after a finished feed (film-feed
/// specification, section 6).
#[derive(Debug)]
pub(crate) struct MarkReader {
    every_inc: i64,
    width_inc: i64,
    /// Shaft angle, increments, at which the leading edge of mark 0 is under the reader.
    first_inc: i64,
    level: bool,
}

/// Length of a mark. Assumed.
const WIDTH_MM_E4: i32 = 5_0000;
/// What a finished feed leaves between mark and reader.
const BEHIND_READER_MM_E4: i32 = 50_0000;

impl MarkReader {
    /// A reader over marks `every_mm_e4` apart, mm ×10000, with the gear and roller that `codes` describe.
    pub(crate) fn new(every_mm_e4: i32, codes: &CodeStore) -> Self {
        let resolution = Resolution::from_codes(codes);
        let increments = |mm_e4| resolution.whole_increments(mm_e4);
        MarkReader {
            every_inc: increments(every_mm_e4),
            width_inc: increments(WIDTH_MM_E4),
            first_inc: -increments(BEHIND_READER_MM_E4),
            level: false,
        }
    }

    /// Follows the shaft by one tick; at most one edge lies in it.
    pub(crate) fn follow(&mut self, shaft: &ShaftSegment, drive: &mut Drive) {
        let (start, end) = (self.within_pattern(shaft.start), self.within_pattern(shaft.end));
        let level = end < self.width_inc;
        if level == self.level {
            return;
        }
        self.level = level;
        // The edge passed is a leading one when the mark was entered forwards or left backwards.
        let forwards = shaft.travel() >= 0.0;
        let mark = shaft.end.increments() - end;
        let edge = match (level, forwards) {
            (true, true) => mark,
            (true, false) => mark + self.width_inc,
            (false, true) => shaft.start.increments() - start + self.width_inc,
            (false, false) => shaft.start.increments() - start,
        };
        drive.edge_e1(shaft, shaft.crossing(ShaftAngle::new(edge, 0.0)).unwrap_or(1.0), level);
    }

    /// Increments since the last leading edge.
    fn within_pattern(&self, angle: ShaftAngle) -> i64 {
        (angle.increments() - self.first_inc).rem_euclid(self.every_inc)
    }
}

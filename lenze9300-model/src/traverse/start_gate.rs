//! The start edge.

use super::signals::StartRefusal;

/// Takes a rising edge only after the level was low for a tick in the state "ready to start".
///
/// Source: 9300 facts 4.3 (a start raised right after the previous program ended can be lost).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StartGate {
    armed: bool,
    level: bool,
}

impl StartGate {
    /// `None` without a rising edge; otherwise whether it is taken.
    pub(super) fn tick(&mut self, level: bool, ready: bool, dominated: bool) -> Option<Result<(), StartRefusal>> {
        let rising = !std::mem::replace(&mut self.level, level) && level;
        let armed = std::mem::replace(&mut self.armed, ready && !level);
        if !rising {
            return None;
        }
        Some(match (ready, armed, dominated) {
            (_, _, true) => Err(StartRefusal::Dominated),
            (false, _, _) => Err(StartRefusal::NotReady),
            (true, false, false) => Err(StartRefusal::NotArmed),
            (true, true, false) => Ok(()),
        })
    }
}

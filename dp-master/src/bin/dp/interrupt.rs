//! Ctrl-C and the request to terminate: commands end in good order.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::output::note;

/// A process has one ctrl-C, so this is the one global.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on ctrl-C is a wish; a second one ends the process at once.
pub(crate) fn watch() {
    let watched = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    if let Err(error) = watched {
        note(format_args!("ctrl-C ends at once, without good order: {error}"));
    }
}

/// Whether the user wishes to end.
pub(crate) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

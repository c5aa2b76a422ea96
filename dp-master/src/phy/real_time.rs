//! Real-time priority for the thread that runs a station, where the system allows it.

use super::linux::set_real_time;

/// Why a thread stays at its ordinary priority: a note, nothing that keeps a station from working.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no real-time priority ({reason}), answers may come some milliseconds late; \
     `setcap cap_sys_nice=ep PROGRAM` or an rtprio line in /etc/security/limits.conf allows it"
)]
pub struct RealTimeRefused {
    reason: String,
}

/// Asks for real-time priority for the calling thread: on Linux policy FIFO with the least priority, which is above everything ordinary and
/// below the drivers of the system.
///
/// A thread with it that never sleeps takes the processor from everything else; a [`Driver`](crate::driver::Driver) sleeps in its port.
///
/// # Errors
///
/// [`RealTimeRefused`]; everything goes on as before then.
pub fn request_real_time() -> Result<(), RealTimeRefused> {
    set_real_time().map_err(|error| RealTimeRefused {
        reason: error.to_string(),
    })
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;

    /// Scheduling policy of this thread: field 41 of its `stat`, 1 is FIFO. Source: proc_pid_stat(5).
    fn policy() -> u32 {
        let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
        // The name in field 2 may contain spaces; it ends with the last parenthesis.
        let (_, rest) = stat.rsplit_once(')').unwrap();
        rest.split_whitespace().nth(41 - 3).unwrap().parse().unwrap()
    }

    #[test]
    fn the_thread_gets_the_priority_or_a_note_says_why_not() {
        std::thread::spawn(|| match request_real_time() {
            Ok(()) => assert_eq!(policy(), 1),
            Err(refused) => {
                assert_eq!(policy(), 0);
                let note = refused.to_string();
                assert!(
                    note.starts_with("no real-time priority (") && note.contains("cap_sys_nice"),
                    "{note}"
                );
            }
        })
        .join()
        .unwrap();
    }
}

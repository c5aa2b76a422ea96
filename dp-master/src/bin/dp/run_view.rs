//! What `dp run` shows: a screen that is drawn again and again, lines, or JSON.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::time::Duration as StdDuration;

use dp_master::dp::{Mode, SlaveIndex, SlaveState};
use dp_master::time::Duration;
use dp_master::wire::{Hex, StatusBits};
use serde_json::json;

use crate::output::Output;
use crate::run::{Master, state_name};
use crate::run_command::ALLOWED;
use crate::run_config::RunConfig;

/// How it is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Style {
    /// A terminal: everything at its place, what is typed at the bottom.
    Screen,
    /// A pipe: events as they come, everything at the end or with `show`.
    Lines,
    /// One JSON object a second, and one for each event.
    Json,
}

/// The view of a run.
#[derive(Debug)]
pub(crate) struct RunView {
    style: Style,
    out: Output,
    names: Vec<(String, u8)>,
    head: String,
    events: VecDeque<String>,
    due: StdDuration,
    drawn: bool,
}

impl RunView {
    pub(crate) fn new(style: Style, config: &RunConfig) -> Self {
        Self {
            style,
            out: Output::new(),
            names: config
                .slaves
                .iter()
                .map(|slave| (slave.name.clone(), slave.config.address.value()))
                .collect(),
            head: format!("master {} at {} bit/s", config.address, config.baud.bits_per_second()),
            events: VecDeque::new(),
            due: StdDuration::ZERO,
            drawn: false,
        }
    }

    /// Something happened.
    pub(crate) fn tell(&mut self, at: StdDuration, what: &str) {
        let time_s = at.as_secs_f64();
        match self.style {
            Style::Json => self
                .out
                .json(&json!({ "type": "event", "time_s": time_s, "text": what })),
            Style::Lines => self.out.line(format_args!("{time_s:10.3}  {what}")),
            Style::Screen => {
                if self.events.len() == EVENTS {
                    self.events.pop_front();
                }
                self.events.push_back(format!("{time_s:10.3}  {what}"));
                self.due = at;
            }
        }
        if self.style != Style::Screen {
            self.out.flush();
        }
    }

    /// Draws when it is time to.
    pub(crate) fn refresh(&mut self, at: StdDuration, master: &Master, slaves: &[SlaveIndex]) {
        if at < self.due || self.style == Style::Lines {
            return;
        }
        let period = if self.style == Style::Json { SECOND } else { FRAME };
        self.due = at + period;
        self.show(at, master, slaves);
    }

    /// A line was typed: the cursor stands below the input line.
    pub(crate) fn typed(&mut self) {
        if self.style == Style::Screen {
            self.drawn = false;
        }
    }

    /// Shows everything now.
    pub(crate) fn show(&mut self, at: StdDuration, master: &Master, slaves: &[SlaveIndex]) {
        match self.style {
            Style::Json => self.json(at, master, slaves),
            Style::Lines => {
                let page = self.page(at, master, slaves, Detail::Full);
                self.out.text(page);
            }
            Style::Screen => self.draw(at, master, slaves),
        }
        self.out.flush();
    }

    /// Leaves the screen as it is, with the cursor below.
    pub(crate) fn end(&mut self) {
        if self.style == Style::Screen {
            self.out.line("");
        }
        self.out.flush();
    }

    /// The page from the top, each line over the old one, with what is being typed left alone.
    fn draw(&mut self, at: StdDuration, master: &Master, slaves: &[SlaveIndex]) {
        let room = screen_rows().saturating_sub(EVENTS + 4);
        let mut page = self.page(at, master, slaves, Detail::Full);
        if page.lines().count() > room {
            page = self.page(at, master, slaves, Detail::LineEach);
        }
        if page.lines().count() > room {
            let kept: Vec<&str> = page.lines().take(room.saturating_sub(1)).collect();
            page = format!("{}\n… the screen is too low for the rest\n", kept.join("\n"));
        }
        page.push('\n');
        for event in &self.events {
            page.push_str(event);
            page.push('\n');
        }
        for _ in self.events.len()..EVENTS {
            page.push('\n');
        }
        let mut frame = String::new();
        // Cursor kept (DECSC), home, each line cleared to its end (EL). Source: ECMA-48; DEC VT510.
        frame.push_str(if self.drawn { "\x1b7\x1b[H" } else { "\x1b[2J\x1b[H" });
        for line in page.lines() {
            frame.push_str(line);
            frame.push_str("\x1b[K\r\n");
        }
        if self.drawn {
            frame.push_str("\x1b8");
        } else {
            let _ = write!(frame, "\x1b[K{ALLOWED}\r\n> ");
            self.drawn = true;
        }
        self.out.text(frame);
    }

    fn page(&self, at: StdDuration, master: &Master, slaves: &[SlaveIndex], detail: Detail) -> String {
        let statistics = master.statistics();
        let mut page = String::new();
        let ring: Vec<String> = master.las().iter().map(|address| address.to_string()).collect();
        // Writing to a string does not fail.
        let _ = writeln!(
            page,
            "{}, {}, {:.1} s, ring of masters: {}",
            self.head,
            mode_name(master.mode()),
            at.as_secs_f64(),
            if ring.is_empty() {
                "none".to_owned()
            } else {
                ring.join(" ")
            }
        );
        let _ = writeln!(
            page,
            "{} cycles, last {} ms, least {} / mean {} / most {}, {} late; {} retries, {} timeouts, {} refused, {} discarded",
            statistics.cycles,
            millis(statistics.last_cycle),
            millis(statistics.least_cycle),
            millis(statistics.mean_cycle),
            millis(statistics.longest_cycle),
            statistics.overruns,
            statistics.retries,
            statistics.timeouts,
            statistics.rejected,
            statistics.discarded
        );
        for (slave, (name, address)) in slaves.iter().zip(&self.names) {
            if detail == Detail::LineEach {
                let octets = |image: &[u8]| Hex(image.get(..4).unwrap_or(image)).to_string();
                let _ = writeln!(
                    page,
                    "{address:>3} {name:<12.12} {:<14} in {:<11} out {:<11}",
                    state_name(master.state(*slave)),
                    octets(master.inputs(*slave)),
                    octets(master.outputs(*slave))
                );
                continue;
            }
            let _ = writeln!(
                page,
                "\n{address:>3} {name}  {}, {} exchanges",
                state_name(master.state(*slave)),
                master.exchanges(*slave)
            );
            let _ = writeln!(page, "    in   {}", image(master.inputs(*slave)));
            let _ = writeln!(page, "    out  {}", image(master.outputs(*slave)));
            if let Some(diagnosis) = master.diagnosis(*slave) {
                let _ = write!(page, "    diag {}", StatusBits(diagnosis.standard.status));
                if diagnosis.extended.is_empty() {
                    page.push('\n');
                } else {
                    let _ = writeln!(page, " {}", Hex(&diagnosis.extended));
                }
            }
        }
        page
    }

    fn json(&mut self, at: StdDuration, master: &Master, slaves: &[SlaveIndex]) {
        let statistics = master.statistics();
        let slaves: Vec<_> = slaves
            .iter()
            .zip(&self.names)
            .map(|(slave, (name, address))| {
                json!({
                    "name": name,
                    "address": address,
                    "state": state_name(master.state(*slave)),
                    "exchanging": master.state(*slave) == SlaveState::DataExchange,
                    "exchanges": master.exchanges(*slave),
                    "inputs": Hex(master.inputs(*slave)).to_string(),
                    "outputs": Hex(master.outputs(*slave)).to_string(),
                    "diagnosis": master.diagnosis(*slave).map(|diagnosis| StatusBits(diagnosis.standard.status).to_string()),
                    "extended": master.diagnosis(*slave).map(|diagnosis| Hex(&diagnosis.extended).to_string()),
                })
            })
            .collect();
        let ring: Vec<u8> = master.las().iter().map(|address| address.value()).collect();
        self.out.json(&json!({
            "type": "status",
            "time_s": at.as_secs_f64(),
            "mode": mode_name(master.mode()),
            "ring": ring,
            "cycles": statistics.cycles,
            "cycle_ms": {
                "last": millis_f64(statistics.last_cycle),
                "least": millis_f64(statistics.least_cycle),
                "mean": millis_f64(statistics.mean_cycle),
                "most": millis_f64(statistics.longest_cycle),
            },
            "late_cycles": statistics.overruns,
            "retries": statistics.retries,
            "timeouts": statistics.timeouts,
            "refused": statistics.rejected,
            "discarded": statistics.discarded,
            "slaves": slaves,
        }));
    }
}

/// How much of a slave is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Detail {
    /// Everything, over some lines.
    Full,
    /// One line with the first octets.
    LineEach,
}

/// Rows of the terminal.
fn screen_rows() -> usize {
    #[cfg(unix)]
    if let Ok(size) = rustix::termios::tcgetwinsize(std::io::stdout())
        && size.ws_row > 0
    {
        return size.ws_row.into();
    }
    USUAL_ROWS
}

/// Octets in groups of eight.
fn image(octets: &[u8]) -> String {
    if octets.is_empty() {
        return "none".to_owned();
    }
    let groups: Vec<String> = octets.chunks(8).map(|group| Hex(group).to_string()).collect();
    groups.join("   ")
}

const fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Stop => "stop",
        Mode::Clear => "clear",
        Mode::Operate => "operate",
    }
}

fn millis(span: Duration) -> String {
    format!("{:.3}", millis_f64(span))
}

fn millis_f64(span: Duration) -> f64 {
    span.as_nanos() as f64 / 1e6
}

/// Rows of a terminal that does not tell.
const USUAL_ROWS: usize = 24;
/// Events that stay on the screen.
const EVENTS: usize = 6;
const FRAME: StdDuration = StdDuration::from_millis(250);
const SECOND: StdDuration = StdDuration::from_secs(1);

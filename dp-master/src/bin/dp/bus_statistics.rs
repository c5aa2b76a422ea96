//! What a listener can count and measure on a line.
//!
//! | figure | from … to |
//! |---|---|
//! | reply | last bit of a request … first bit of its reply |
//! | cycle | first bit of a Data_Exchange request … of the next to the same slave, repetitions left out |
//! | rotation | first bit of the token to a master … of the next token to it |
//! | retry | a request with the FCB of the one before to the same station; a first one (FCV = 0) when it follows itself unanswered |
//! | unanswered | a request that expects a reply, and another telegram or nothing follows; not the FDL_Status to an address where nobody is |

use std::collections::BTreeMap;
use std::fmt;

use dp_master::phy::{Content, Trace};
use dp_master::time::{Baud, Duration, Instant};
use dp_master::wire::{DiscardReason, Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, Service, Telegram};
use serde::Serialize;

/// Everything counted since the first telegram.
#[derive(Debug)]
pub(crate) struct BusStatistics {
    baud: Baud,
    first: Option<Instant>,
    last_end: Instant,
    busy: Duration,
    telegrams: u64,
    discarded: BTreeMap<&'static str, u64>,
    retries: u64,
    unanswered: u64,
    services: BTreeMap<Service, ServiceCount>,
    stations: BTreeMap<u8, StationCount>,
    rotations: BTreeMap<u8, (Instant, Spread)>,
    /// The request whose reply comes next, if one does.
    open: Option<Request>,
    /// The last request of each master to each station.
    last: BTreeMap<(u8, u8), Last>,
    /// Who asked whom last; nobody after a token.
    last_call: Option<(u8, u8)>,
}

#[derive(Debug, Default, Clone, Copy)]
struct ServiceCount {
    requests: u64,
    replies: u64,
}

#[derive(Debug, Default)]
struct StationCount {
    is_master: bool,
    sent: u64,
    asked: u64,
    retries: u64,
    unanswered: u64,
    negative: u64,
    reply: Spread,
    cycle: Spread,
    last_exchange: Option<Instant>,
}

#[derive(Debug)]
struct Request {
    sa: u8,
    da: u8,
    service: Service,
    end: Instant,
}

#[derive(Debug)]
struct Last {
    fcb: Fcb,
    octets: Vec<u8>,
    answered: bool,
}

/// Least, mean and most of some spans.
#[derive(Debug, Default, Clone, Copy)]
struct Spread {
    count: u64,
    least: Duration,
    most: Duration,
    sum: Duration,
}

impl Spread {
    fn add(&mut self, span: Duration) {
        self.least = if self.count == 0 { span } else { self.least.min(span) };
        self.most = self.most.max(span);
        self.sum += span;
        self.count += 1;
    }

    fn mean(&self) -> Duration {
        Duration::from_nanos(self.sum.as_nanos().checked_div(self.count).unwrap_or(0))
    }

    /// Least, mean and most, each by `each`; nothing when nothing was measured.
    fn map<T>(&self, each: impl Fn(Duration) -> T) -> Option<[T; 3]> {
        (self.count > 0).then(|| [each(self.least), each(self.mean()), each(self.most)])
    }
}

impl BusStatistics {
    /// Nothing counted yet, on a line of this baud rate.
    pub(crate) fn new(baud: Baud) -> Self {
        Self {
            baud,
            first: None,
            last_end: Instant::ZERO,
            busy: Duration::ZERO,
            telegrams: 0,
            discarded: BTreeMap::new(),
            retries: 0,
            unanswered: 0,
            services: BTreeMap::new(),
            stations: BTreeMap::new(),
            rotations: BTreeMap::new(),
            open: None,
            last: BTreeMap::new(),
            last_call: None,
        }
    }

    /// When the first telegram began.
    pub(crate) const fn first(&self) -> Option<Instant> {
        self.first
    }

    /// Telegrams so far, valid ones only.
    pub(crate) const fn telegrams(&self) -> u64 {
        self.telegrams
    }

    /// Counts what went over the line; `true` for a repeated request.
    pub(crate) fn count(&mut self, trace: &Trace<'_>) -> bool {
        self.first.get_or_insert(trace.start);
        self.last_end = self.last_end.max(trace.end);
        self.busy += trace.end - trace.start;
        let telegram = match trace.content {
            Content::Telegram(telegram) => telegram,
            Content::Discarded { reason, .. } => {
                *self.discarded.entry(kind_of(reason)).or_default() += 1;
                return false;
            }
        };
        self.telegrams += 1;
        match telegram {
            Telegram::ShortAck => {
                self.answer(trace, None, None);
                false
            }
            Telegram::Token { da, sa } => {
                self.give_up();
                self.count_token(trace.start, sa.value(), da.value());
                false
            }
            Telegram::Data { header, .. } => match header.fc {
                FunctionCode::Response { function, .. } => {
                    self.station(header.sa.value()).sent += 1;
                    self.answer(trace, Some(&header), Some(function));
                    false
                }
                FunctionCode::Request { fcb, function } => {
                    self.give_up();
                    self.ask(trace, &header, fcb, function, Service::of(&telegram))
                }
            },
        }
    }

    /// The recording ends: a request without a reply stays without one.
    pub(crate) fn finish(&mut self) {
        self.give_up();
    }

    fn station(&mut self, address: u8) -> &mut StationCount {
        self.stations.entry(address).or_default()
    }

    fn count_token(&mut self, start: Instant, sa: u8, da: u8) {
        self.last_call = None;
        let service = self.services.entry(Service::Token).or_default();
        service.requests += 1;
        let from = self.station(sa);
        from.is_master = true;
        from.sent += 1;
        match self.rotations.get_mut(&da) {
            Some((last, spread)) => {
                spread.add(start - *last);
                *last = start;
            }
            None => drop(self.rotations.insert(da, (start, Spread::default()))),
        }
    }

    fn ask(
        &mut self,
        trace: &Trace<'_>,
        header: &Header,
        fcb: Fcb,
        function: RequestFunction,
        service: Service,
    ) -> bool {
        let (sa, da) = (header.sa.value(), header.da.value());
        let retry = match (self.last.get(&(sa, da)), fcb) {
            (None, _) | (_, Fcb::Inactive) => false,
            (Some(last), Fcb::First) => {
                self.last_call == Some((sa, da)) && !last.answered && last.octets == trace.octets
            }
            (Some(last), fcb) => last.fcb == fcb,
        };
        let asker = self.station(sa);
        asker.is_master = true;
        asker.sent += 1;
        self.services.entry(service).or_default().requests += 1;
        let expects_reply = header.fc.expects_reply();
        if !header.da.is_broadcast() && function != RequestFunction::FdlStatus {
            let asked = self.station(da);
            asked.asked += 1;
            if service == Service::DataExchange
                && !retry
                && let Some(last) = asked.last_exchange.replace(trace.start)
            {
                asked.cycle.add(trace.start - last);
            }
            if retry {
                asked.retries += 1;
                self.retries += 1;
            }
        }
        let last = Last {
            fcb,
            octets: trace.octets.to_vec(),
            answered: false,
        };
        self.last.insert((sa, da), last);
        self.last_call = Some((sa, da));
        self.open = expects_reply.then_some(Request {
            sa,
            da,
            service,
            end: trace.end,
        });
        retry
    }

    /// A reply, by its header; a short acknowledgement has none and belongs to whoever was asked.
    fn answer(&mut self, trace: &Trace<'_>, header: Option<&Header>, function: Option<ResponseFunction>) {
        let Some(request) = self.open.take() else {
            return;
        };
        if header.is_some_and(|header| header.sa.value() != request.da || header.da.value() != request.sa) {
            self.open = Some(request);
            self.give_up();
            return;
        }
        self.services.entry(request.service).or_default().replies += 1;
        if let Some(last) = self.last.get_mut(&(request.sa, request.da)) {
            last.answered = true;
        }
        let station = self.stations.entry(request.da).or_default();
        if header.is_none() {
            station.sent += 1;
        }
        station.reply.add(trace.start - request.end);
        let refused = matches!(
            function,
            Some(
                ResponseFunction::UserError
                    | ResponseFunction::NoResource
                    | ResponseFunction::NoService
                    | ResponseFunction::DataLowNoResource
                    | ResponseFunction::DataHighNoResource
            )
        );
        station.negative += u64::from(refused);
    }

    /// The request that is open will not be answered any more.
    fn give_up(&mut self) {
        if let Some(request) = self.open.take()
            && request.service != Service::FdlStatus
        {
            self.unanswered += 1;
            self.station(request.da).unanswered += 1;
        }
    }

    /// The figures, for machines.
    pub(crate) fn report(&self) -> StatisticsReport {
        let millis = |span: Duration| span.as_nanos() as f64 / 1e6;
        let bits = |span: Duration| self.baud.bits(span) as f64;
        let seconds = self
            .first
            .map_or(0.0, |first| (self.last_end - first).as_nanos() as f64 / 1e9);
        StatisticsReport {
            kind: "statistics",
            baud: self.baud.bits_per_second(),
            seconds,
            telegrams: self.telegrams,
            busy_percent: if seconds > 0.0 {
                self.busy.as_nanos() as f64 / 1e7 / seconds
            } else {
                0.0
            },
            discarded: self.discarded.clone(),
            retries: self.retries,
            unanswered: self.unanswered,
            services: self
                .services
                .iter()
                .map(|(service, count)| ServiceReport {
                    service: service.name(),
                    requests: count.requests,
                    replies: count.replies,
                })
                .collect(),
            stations: self
                .stations
                .iter()
                .map(|(address, count)| StationReport {
                    address: *address,
                    kind: if count.is_master { "master" } else { "slave" },
                    sent: count.sent,
                    asked: count.asked,
                    unanswered: count.unanswered,
                    retries: count.retries,
                    negative: count.negative,
                    reply_bits: count.reply.map(bits),
                    cycle_ms: count.cycle.map(millis),
                })
                .collect(),
            token_rotation_ms: self
                .rotations
                .iter()
                .filter_map(|(master, (_, spread))| Some((*master, spread.map(millis)?)))
                .collect(),
        }
    }
}

/// What a listener found; triples are least, mean and most.
#[derive(Debug, Serialize)]
pub(crate) struct StatisticsReport {
    #[serde(rename = "type")]
    kind: &'static str,
    baud: u32,
    seconds: f64,
    telegrams: u64,
    busy_percent: f64,
    discarded: BTreeMap<&'static str, u64>,
    retries: u64,
    unanswered: u64,
    services: Vec<ServiceReport>,
    stations: Vec<StationReport>,
    token_rotation_ms: BTreeMap<u8, [f64; 3]>,
}

#[derive(Debug, Serialize)]
struct ServiceReport {
    service: &'static str,
    requests: u64,
    replies: u64,
}

#[derive(Debug, Serialize)]
struct StationReport {
    address: u8,
    kind: &'static str,
    sent: u64,
    asked: u64,
    unanswered: u64,
    retries: u64,
    negative: u64,
    reply_bits: Option<[f64; 3]>,
    cycle_ms: Option<[f64; 3]>,
}

impl fmt::Display for StatisticsReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} telegrams in {:.3} s at {} bit/s, the line was busy {:.1} % of the time",
            self.telegrams, self.seconds, self.baud, self.busy_percent
        )?;
        write!(f, "{} retries, {} unanswered", self.retries, self.unanswered)?;
        let discarded: u64 = self.discarded.values().sum();
        write!(f, ", {discarded} times octets that are no telegram")?;
        for (index, (reason, count)) in self.discarded.iter().enumerate() {
            write!(f, "{}{count} {reason}", if index == 0 { ": " } else { ", " })?;
        }
        writeln!(f)?;
        if !self.services.is_empty() {
            writeln!(f, "\n{:<16} {:>10} {:>10}", "service", "requests", "replies")?;
        }
        for service in &self.services {
            write!(f, "{:<16} {:>10}", service.service, service.requests)?;
            // A token and what goes to all have no replies.
            if matches!(service.service, "Token" | "Global_Control") {
                writeln!(f)?;
            } else {
                writeln!(f, " {:>10}", service.replies)?;
            }
        }
        if !self.stations.is_empty() {
            writeln!(
                f,
                "\n{:<8} {:<7} {:>8} {:>8} {:>11} {:>8} {:>8}  {:<22} cycle ms",
                "station", "", "sent", "asked", "unanswered", "retries", "refused", "reply tBIT"
            )?;
        }
        for station in &self.stations {
            let line = format!(
                "{:<8} {:<7} {:>8} {:>8} {:>11} {:>8} {:>8}  {:<22} {}",
                station.address,
                station.kind,
                station.sent,
                station.asked,
                station.unanswered,
                station.retries,
                station.negative,
                triple(station.reply_bits, 0),
                triple(station.cycle_ms, 3),
            );
            writeln!(f, "{}", line.trim_end())?;
        }
        for (index, (master, rotation)) in self.token_rotation_ms.iter().enumerate() {
            let gap = if index == 0 { "\n" } else { "" };
            writeln!(
                f,
                "{gap}token of {master}: one rotation {} ms",
                triple(Some(*rotation), 3)
            )?;
        }
        if !self.stations.is_empty() {
            writeln!(f, "\nspans are least / mean / most")?;
        }
        Ok(())
    }
}

/// `least / mean / most`.
fn triple(spread: Option<[f64; 3]>, digits: usize) -> String {
    spread.map_or_else(String::new, |[least, mean, most]| {
        format!("{least:.digits$} / {mean:.digits$} / {most:.digits$}")
    })
}

/// The kind of a reason, without its octets.
const fn kind_of(reason: DiscardReason) -> &'static str {
    match reason {
        DiscardReason::StartDelimiter { .. } => "start delimiter",
        DiscardReason::SecondStartDelimiter { .. } => "second start delimiter",
        DiscardReason::Length { .. } | DiscardReason::LengthRepeat { .. } => "length",
        DiscardReason::Checksum { .. } => "check sum",
        DiscardReason::EndDelimiter { .. } => "end delimiter",
        DiscardReason::Truncated => "truncated",
        DiscardReason::Line(_) => "character error",
        _ => "other",
    }
}

//! `dp read` and `dp write`: data records of a DP-V1 slave over a connection of class 2 (MSAC2), whoever owns the slave.

use std::slice;
use std::time::Instant as StdInstant;

use clap::Args;
use dp_master::address::Address;
use dp_master::dp::v1::{Abort, Initiate, Msac2Client, Msac2Event, V1Answer};
use dp_master::wire::Hex;
use serde_json::json;

use crate::decode::octets_of_words;
use crate::line_args::parse_station;
use crate::output::{Outcome, Output, Trouble};
use crate::session::{LONGEST_WAIT, LineArgs, Session};

/// Where a data record is.
#[derive(Debug, Args)]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    line: LineArgs,
    /// The slave.
    #[arg(long, value_name = "N", value_parser = parse_station)]
    address: Address,
    /// Slot, 0…254.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=254))]
    slot: u8,
    /// Index, 0…255.
    #[arg(long, value_name = "N")]
    index: u8,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// What `dp read` takes.
#[derive(Debug, Args)]
pub(crate) struct ReadArgs {
    #[command(flatten)]
    record: RecordArgs,
    /// Most octets to read, 1…240.
    #[arg(long, value_name = "N", default_value_t = 240, value_parser = clap::value_parser!(u8).range(1..=240))]
    length: u8,
    /// Write these octets to the record first, over the same connection: records that answer a request, such as the parameters of a
    /// drive at index 47.
    #[arg(long, value_name = "HEX", value_parser = parse_data)]
    request: Option<Data>,
}

/// What `dp write` takes.
#[derive(Debug, Args)]
pub(crate) struct WriteArgs {
    #[command(flatten)]
    record: RecordArgs,
    /// The octets in hexadecimal, 1…240.
    #[arg(long, value_name = "HEX", value_parser = parse_data)]
    data: Data,
}

/// Octets of an argument; a type of its own, for `clap` takes a `Vec` for many arguments.
#[derive(Clone, Debug)]
struct Data(Vec<u8>);

/// Reads a data record.
pub(crate) fn read(args: &ReadArgs) -> Outcome {
    let record = &args.record;
    let read = Step::Read(args.length);
    let answer = match &args.request {
        Some(Data(octets)) => ask(record, &[Step::Write(octets), read])?,
        None => ask(record, slice::from_ref(&read))?,
    };
    let V1Answer::Data { data, .. } = answer else {
        return Err(Trouble::failed("the slave answered with something else than data"));
    };
    let mut out = Output::new();
    if record.json {
        out.json(&json!({
            "address": record.address.value(), "slot": record.slot, "index": record.index, "data": Hex(&data).to_string(),
        }));
    } else {
        for (row, octets) in data.chunks(16).enumerate() {
            out.line(format_args!("{:>4}  {}", row * 16, Hex(octets)));
        }
    }
    out.flush();
    Ok(())
}

/// Writes a data record.
pub(crate) fn write(args: &WriteArgs) -> Outcome {
    let record = &args.record;
    let answer = ask(record, &[Step::Write(&args.data.0)])?;
    let V1Answer::Written { length, .. } = answer else {
        return Err(Trouble::failed(
            "the slave answered with something else than an acknowledgement",
        ));
    };
    let mut out = Output::new();
    if record.json {
        out.json(&json!({
            "address": record.address.value(), "slot": record.slot, "index": record.index, "written": length,
        }));
    } else {
        out.line(format_args!("{length} octets written"));
    }
    out.flush();
    Ok(())
}

/// What is done with the record over a connection.
#[derive(Clone, Copy, Debug)]
enum Step<'a> {
    /// Read so many octets at the most.
    Read(u8),
    /// Write these.
    Write(&'a [u8]),
}

/// Opens a connection, takes the steps and ends it; the answer to the last one.
fn ask(args: &RecordArgs, steps: &[Step<'_>]) -> Result<V1Answer, Trouble> {
    let mut session = Session::open(&args.line)?;
    let mut client = Msac2Client::new(args.address);
    let initiate = Initiate::data_records(args.line.baud);
    client
        .connect(session.master.jobs(), &initiate)
        .map_err(Trouble::failed)?;
    let mut steps = steps.iter();
    let mut begun = StdInstant::now();
    let answer = loop {
        let now = session.now();
        match client.step(session.master.jobs(), now) {
            None => {}
            Some(Msac2Event::Opened(_)) => {
                begun = StdInstant::now();
                if let Some(step) = steps.next() {
                    take(*step, args, &mut client, &mut session)?;
                }
            }
            Some(Msac2Event::Answer(Ok(answer))) => {
                begun = StdInstant::now();
                match steps.next() {
                    Some(step) => take(*step, args, &mut client, &mut session)?,
                    None => break Ok(answer),
                }
            }
            Some(Msac2Event::Answer(Err(error))) => {
                break Err(Trouble::failed(format_args!(
                    "station {} refuses slot {} index {}: {error}",
                    args.address, args.slot, args.index
                )));
            }
            Some(Msac2Event::Rejected(error)) => {
                break Err(Trouble::failed(format_args!(
                    "station {} refuses a connection: {error}",
                    args.address
                )));
            }
            Some(Msac2Event::Closed(abort)) => {
                break Err(Trouble::failed(format_args!(
                    "no connection to station {}: {abort}; is it there, and does it speak DP-V1?",
                    args.address
                )));
            }
        }
        if begun.elapsed() > LONGEST_WAIT {
            break Err(session.no_token());
        }
        session.step()?;
    };
    // A connection that is open is ended at the slave too, which has few of them.
    if client.connected().is_some() {
        client.abort(session.master.jobs(), Abort::user(0));
        let begun = StdInstant::now();
        while begun.elapsed() < LONGEST_WAIT {
            let now = session.now();
            if let Some(Msac2Event::Closed(_)) = client.step(session.master.jobs(), now) {
                break;
            }
            session.step()?;
        }
    }
    session.leave();
    answer
}

fn take(step: Step<'_>, args: &RecordArgs, client: &mut Msac2Client, session: &mut Session) -> Result<(), Trouble> {
    let jobs = session.master.jobs();
    match step {
        Step::Read(length) => client.read(jobs, args.slot, args.index, length),
        Step::Write(octets) => client.write(jobs, args.slot, args.index, octets),
    }
    .map_err(Trouble::failed)
}

fn parse_data(text: &str) -> Result<Data, String> {
    let allowed = || "allowed are 1…240 octets in hexadecimal, such as 0102 or \"01 02\"".to_owned();
    let octets = octets_of_words(text).map_err(|_| allowed())?;
    if (1..=240).contains(&octets.len()) {
        Ok(Data(octets))
    } else {
        Err(allowed())
    }
}

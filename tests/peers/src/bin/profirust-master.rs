//! A DP master made of `profirust`: brings the drive into data exchange and reads a code through its parameter channel.
//!
//! The same options and events as `pyprofibus_master.py`. Run, say,
//! `profirust-master --port /dev/pts/5 --baud 19200 --values 4`; it expects the drive at address 3.

use std::io::{Read, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use profirust::dp::{DpMaster, Peripheral, PeripheralOptions};
use profirust::fdl::{FdlActiveStation, ParametersBuilder};
use profirust::phy::ProfibusPhy;
use profirust::time::Instant;
use serialport::{ClearBuffer, DataBits, Parity, SerialPort, StopBits};

/// An independent DP master for the drive.
#[derive(Debug, Parser)]
struct Arguments {
    /// Serial port.
    #[arg(long, value_name = "PATH")]
    port: PathBuf,
    /// Baud rate, bit/s.
    #[arg(long, value_name = "RATE")]
    baud: u32,
    /// Address of the drive.
    #[arg(long, value_name = "N", default_value_t = 3)]
    address: u8,
    /// Address of this master.
    #[arg(long, value_name = "N", default_value_t = 2)]
    master: u8,
    /// Ident number of the drive's module, decimal.
    #[arg(long, value_name = "N", default_value_t = 0x00DA)]
    ident: u16,
    /// Index to read, decimal: 24575 less the number of the code.
    #[arg(long, value_name = "N", default_value_t = 0x5B4B)]
    index: u16,
    /// So many values, then stop; 0 = for ever.
    #[arg(long, value_name = "N", default_value_t = 0)]
    values: u32,
    /// Give up after so many seconds.
    #[arg(long, value_name = "S", default_value_t = 60)]
    seconds: i64,
}

/// PAR(Cons.) + PZD(4W Cons.): twice four consistent words in and out (9300 fact sheet, section 1.2).
const IDENTIFIERS: &[u8] = &[0xF3, 0xF3];
/// The peer sleeps between polls as its manual advises; nobody needs it faster.
const SLEEP: Duration = Duration::from_micros(200);
/// Between request and answer lie two processes and their scheduling.
const SLOT_MS: u32 = 40;

const READ: u8 = 0x01;
const LENGTH_4: u8 = 0x30;
const HANDSHAKE: u8 = 0x40;
const ERROR: u8 = 0x80;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let Some(baud) = baudrate(arguments.baud) else {
        eprintln!("profirust-master: {} is no baud rate of PROFIBUS", arguments.baud);
        return ExitCode::from(2);
    };
    let mut phy = match TerminalPhy::open(&arguments) {
        Ok(phy) => phy,
        Err(error) => {
            eprintln!("profirust-master: {}: {error}", arguments.port.display());
            return ExitCode::from(2);
        }
    };

    let options = PeripheralOptions {
        ident_number: arguments.ident,
        max_tsdr: 60,
        user_parameters: Some(&[]),
        config: Some(IDENTIFIERS),
        ..Default::default()
    };
    let (mut inputs, mut outputs, mut diagnosis) = ([0; 16], [0; 16], [0; 32]);
    let mut storage: [profirust::dp::PeripheralStorage<'_>; 1] = Default::default();
    let mut master = DpMaster::new(&mut storage[..]);
    let drive = master.add(
        Peripheral::new(arguments.address, options, &mut inputs[..], &mut outputs[..])
            .with_diag_buffer(&mut diagnosis[..]),
    );
    // The slot time is 16 bits wide in the peer.
    let slot_bits = (arguments.baud / 1000 * SLOT_MS).clamp(1000, 60_000);
    let parameters = ParametersBuilder::new(arguments.master, baud)
        .slot_bits(u16::try_from(slot_bits).unwrap_or(u16::MAX))
        .max_retry_limit(3)
        .watchdog_timeout(profirust::time::Duration::from_secs(1))
        // Its target rotation time counts from its own last token; with one of a second it may always use the token.
        .token_rotation_bits(arguments.baud.clamp(256, 16_000_000))
        // Few addresses to look for masters at: each costs a slot time.
        .highest_station_address(arguments.master + 2)
        .build_verified(&master);
    let mut fdl = FdlActiveStation::new(parameters);
    fdl.set_online();
    master.enter_operate();

    let mut reader = ParameterReader::new(arguments.index);
    let (mut exchanging, mut exchanges, mut values) = (false, 0_u64, 0);
    let end = Instant::now() + profirust::time::Duration::from_secs(u64::try_from(arguments.seconds).unwrap_or(0));
    while Instant::now() < end {
        fdl.poll(Instant::now(), &mut phy, &mut master);
        if phy.gone {
            tell(&serde_json::json!({"event": "error", "text": "the port is gone"}));
            return ExitCode::FAILURE;
        }
        let events = master.take_last_events();
        let peripheral = master.get_mut(drive);
        if peripheral.is_running() != exchanging {
            exchanging = !exchanging;
            tell(&serde_json::json!({"event": if exchanging { "data exchange" } else { "left" }}));
            if !exchanging {
                // A drive that was away may have forgotten the job and its handshake.
                reader = ParameterReader::new(arguments.index);
                peripheral.pi_q_mut().fill(0);
            }
        }
        if let Some((_, profirust::dp::PeripheralEvent::DataExchanged)) = events.peripheral {
            exchanges += 1;
            let (inputs, outputs) = peripheral.pi_both();
            let mut answer = [0; 8];
            answer.copy_from_slice(&inputs[..8]);
            let finished = reader.next(answer);
            outputs[..8].copy_from_slice(&reader.request);
            if let Some(answer) = finished {
                values += 1;
                let data: String = answer[4..].iter().map(|octet| format!("{octet:02x}")).collect();
                tell(&serde_json::json!({
                    "event": "value",
                    "ok": answer[0] & ERROR == 0,
                    "index": u16::from_be_bytes([answer[2], answer[3]]),
                    "data": data,
                }));
                if values == arguments.values {
                    tell(&serde_json::json!({"event": "done", "exchanges": exchanges}));
                    return ExitCode::SUCCESS;
                }
            }
        }
        std::thread::sleep(SLEEP);
    }
    tell(&serde_json::json!({"event": "time is over", "exchanges": exchanges, "values": values}));
    ExitCode::FAILURE
}

fn tell(event: &serde_json::Value) {
    println!("{event}");
}

/// Reads one code again and again: a job begins when the handshake bit is inverted, and ends when the answer shows it.
///
/// Octets: service, subindex, index high, index low, four of data. The first request is all zero and takes the handshake
/// of whoever was there before back to 0.
struct ParameterReader {
    index: u16,
    request: [u8; 8],
}

impl ParameterReader {
    fn new(index: u16) -> Self {
        ParameterReader { index, request: [0; 8] }
    }

    /// Takes the present answer; returns the finished one.
    fn next(&mut self, answer: [u8; 8]) -> Option<[u8; 8]> {
        if (answer[0] ^ self.request[0]) & HANDSHAKE != 0 {
            return None;
        }
        let finished = (self.request[0] & READ != 0).then_some(answer);
        let handshake = !self.request[0] & HANDSHAKE;
        let [high, low] = self.index.to_be_bytes();
        self.request = [READ | LENGTH_4 | handshake, 0, high, low, 0, 0, 0, 0];
        finished
    }
}

/// The peer's own serial port needs a low-latency setting that a pseudo-terminal refuses, and a system library.
struct TerminalPhy {
    port: Box<dyn SerialPort>,
    received: Vec<u8>,
    gone: bool,
}

impl TerminalPhy {
    fn open(arguments: &Arguments) -> Result<Self, serialport::Error> {
        let port = serialport::new(arguments.port.to_string_lossy(), arguments.baud)
            .data_bits(DataBits::Eight)
            .parity(Parity::Even)
            .stop_bits(StopBits::One)
            .exclusive(false)
            .open()?;
        port.clear(ClearBuffer::Input)?;
        Ok(TerminalPhy {
            port,
            received: Vec::new(),
            gone: false,
        })
    }
}

impl ProfibusPhy for TerminalPhy {
    fn poll_transmission(&mut self, _: Instant) -> bool {
        self.port.bytes_to_write().is_ok_and(|waiting| waiting > 0)
    }

    fn transmit_data<F, R>(&mut self, _: Instant, fill: F) -> R
    where
        F: FnOnce(&mut [u8]) -> (usize, R),
    {
        let mut telegram = [0; 256];
        let (length, result) = fill(&mut telegram);
        self.gone |= self.port.write_all(&telegram[..length]).is_err();
        result
    }

    fn receive_data<F, R>(&mut self, _: Instant, take: F) -> R
    where
        F: FnOnce(&[u8]) -> (usize, R),
    {
        match self.port.bytes_to_read() {
            Ok(0) => {}
            Ok(waiting) => {
                let mut octets = vec![0; waiting as usize];
                match self.port.read(&mut octets) {
                    Ok(length) => self.received.extend_from_slice(&octets[..length]),
                    Err(_) => self.gone = true,
                }
            }
            Err(_) => self.gone = true,
        }
        let (taken, result) = take(&self.received);
        self.received.drain(..taken);
        result
    }
}

fn baudrate(bits_per_second: u32) -> Option<profirust::Baudrate> {
    use profirust::Baudrate;
    Some(match bits_per_second {
        9_600 => Baudrate::B9600,
        19_200 => Baudrate::B19200,
        45_450 => Baudrate::B45450,
        93_750 => Baudrate::B93750,
        187_500 => Baudrate::B187500,
        500_000 => Baudrate::B500000,
        1_500_000 => Baudrate::B1500000,
        3_000_000 => Baudrate::B3000000,
        6_000_000 => Baudrate::B6000000,
        12_000_000 => Baudrate::B12000000,
        _ => return None,
    })
}

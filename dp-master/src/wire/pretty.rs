//! Telegrams for people: one line, or one fact a line.
//!
//! [`Pretty`] is a [`Display`](fmt::Display): `{}` gives one line, `{:#}` several. Nothing is allocated.
//!
//! ```text
//! 2 → 3  SRD high first  Slave_Diag
//! 3 → 2  DL slave  Slave_Diag  [Prm_Req] master none ident 00DA
//! 2 → 3  SRD high FCB=0  Set_Prm  lock WD 50 ms min Tsdr 11 ident 00DA group 00 user C0 00 00
//! 2 → 3  SRD low FCB=1  Chk_Cfg  F3 = 4 words in+out whole, F3 = 4 words in+out whole
//! ```

use core::fmt;

use super::service::{Service, Side, sap_name};
use super::{Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, StationType, Telegram};
use crate::dp::{
    Block, ChannelDiag, ChannelUnit, ControlCommand, Diagnosis, Direction, GlobalControl, LockRequest, Overflow,
    SetPrm, StandardDiag, StationStatus,
};

/// A telegram for people: `{}` in one line, `{:#}` in several.
///
/// # Example
///
/// ```
/// use dp_master::wire::{Pretty, decode_one};
///
/// # fn main() -> Result<(), dp_master::wire::DecodeError> {
/// let (telegram, _) = decode_one(&[0x10, 0x03, 0x02, 0x49, 0x4E, 0x16])?;
/// assert_eq!(Pretty(&telegram).to_string(), "2 → 3  FDL_Status request");
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Pretty<'a>(pub &'a Telegram<'a>);

impl fmt::Display for Pretty<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self.0 {
            Telegram::ShortAck if f.alternate() => f.write_str("SC, 1 octet\n  service      Short_Ack\n"),
            Telegram::ShortAck => f.write_str("short acknowledgement"),
            Telegram::Token { da, sa } if f.alternate() => write!(
                f,
                "SD4, 3 octets\n  destination  {da}\n  source       {sa}\n  service      Token\n"
            ),
            Telegram::Token { da, sa } => write!(f, "{sa} → {da}  token"),
            Telegram::Data { header, data } if f.alternate() => lines(f, self.0, &header, data),
            Telegram::Data { header, data } => one_line(f, self.0, &header, data),
        }
    }
}

/// Octets in hexadecimal, separated by spaces.
#[derive(Clone, Copy, Debug)]
pub struct Hex<'a>(pub &'a [u8]);

impl fmt::Display for Hex<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, octet) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_str(" ")?;
            }
            write!(f, "{octet:02X}")?;
        }
        Ok(())
    }
}

/// The function code in words: `SRD high FCB=1`, `DL slave`.
#[derive(Clone, Copy, Debug)]
pub struct Function(pub FunctionCode);

impl fmt::Display for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            FunctionCode::Request { fcb, function } => {
                match function {
                    RequestFunction::TimeEvent => f.write_str("time event"),
                    RequestFunction::SdaLow => f.write_str("SDA low"),
                    RequestFunction::SdnLow => f.write_str("SDN low"),
                    RequestFunction::SdaHigh => f.write_str("SDA high"),
                    RequestFunction::SdnHigh => f.write_str("SDN high"),
                    RequestFunction::Msrd => f.write_str("MSRD"),
                    RequestFunction::FdlStatus => f.write_str("FDL status"),
                    RequestFunction::SrdLow => f.write_str("SRD low"),
                    RequestFunction::SrdHigh => f.write_str("SRD high"),
                    RequestFunction::Ident => f.write_str("ident"),
                    RequestFunction::LsapStatus => f.write_str("LSAP status"),
                    RequestFunction::ClockValue => f.write_str("clock value"),
                    RequestFunction::Unknown(code) => write!(f, "request {code:02X}"),
                }?;
                f.write_str(match fcb {
                    Fcb::First => " first",
                    Fcb::High => " FCB=1",
                    Fcb::Low => " FCB=0",
                    Fcb::Inactive => "",
                })
            }
            FunctionCode::Response { station, function } => {
                match function {
                    ResponseFunction::Ok => f.write_str("OK"),
                    ResponseFunction::UserError => f.write_str("UE (user error)"),
                    ResponseFunction::NoResource => f.write_str("RR (no resource)"),
                    ResponseFunction::NoService => f.write_str("RS (no service)"),
                    ResponseFunction::DataLow => f.write_str("DL"),
                    ResponseFunction::NoReplyData => f.write_str("NR (no data)"),
                    ResponseFunction::DataHigh => f.write_str("DH"),
                    ResponseFunction::DataLowNoResource => f.write_str("RDL (no resource)"),
                    ResponseFunction::DataHighNoResource => f.write_str("RDH (no resource)"),
                    ResponseFunction::Unknown(code) => write!(f, "response {code:02X}"),
                }?;
                write!(f, " {}", station_type(station))
            }
        }
    }
}

const fn station_type(station: StationType) -> &'static str {
    match station {
        StationType::Slave => "slave",
        StationType::MasterNotReady => "master not ready",
        StationType::MasterReady => "master ready",
        StationType::MasterInRing => "master in ring",
    }
}

fn one_line(f: &mut fmt::Formatter<'_>, telegram: &Telegram<'_>, header: &Header, data: &[u8]) -> fmt::Result {
    write!(f, "{} → ", header.sa)?;
    destination(f, header)?;
    let service = Service::of(telegram);
    match (service, header.fc) {
        (Service::FdlStatus | Service::Ident | Service::LsapStatus, FunctionCode::Request { .. }) => {
            write!(f, "  {service} request")?;
        }
        (Service::FdlStatus, FunctionCode::Response { station, .. }) => {
            write!(f, "  {service} {}", station_type(station))?;
        }
        (Service::Fdl, fc) => {
            write!(f, "  {}", Function(fc))?;
            if let Some(dsap) = header.dsap {
                write!(f, "  DSAP {dsap}")?;
            }
            if let Some(ssap) = header.ssap {
                write!(f, "  SSAP {ssap}")?;
            }
        }
        (_, fc) => write!(f, "  {}  {service}", Function(fc))?,
    }
    if data.is_empty() {
        return Ok(());
    }
    f.write_str("  ")?;
    content(f, service, header.fc, data)
}

/// The address of the destination, or what 127 means.
fn destination(f: &mut fmt::Formatter<'_>, header: &Header) -> fmt::Result {
    if header.da.is_broadcast() {
        f.write_str("all")
    } else {
        write!(f, "{}", header.da)
    }
}

/// The data of a telegram, decoded where the service says how, in one line.
fn content(f: &mut fmt::Formatter<'_>, service: Service, fc: FunctionCode, data: &[u8]) -> fmt::Result {
    match (service, fc.is_request()) {
        (Service::SlaveDiag, false) => match Diagnosis::parse(data) {
            Ok(diagnosis) => {
                write!(f, "{}", Standard(&diagnosis.standard))?;
                for block in diagnosis.blocks() {
                    write!(f, "; {}", DiagBlock(block))?;
                }
                Ok(())
            }
            Err(_) => write!(f, "malformed: {}", Hex(data)),
        },
        (Service::SetPrm, true) => match SetPrm::parse(data) {
            Ok(prm) => write!(f, "{}", Prm(&prm)),
            Err(_) => write!(f, "malformed: {}", Hex(data)),
        },
        (Service::ChkCfg, true) | (Service::GetCfg, false) => {
            for (index, module) in Modules(data).enumerate() {
                write!(f, "{}{module}", if index > 0 { ", " } else { "" })?;
            }
            Ok(())
        }
        (Service::GlobalControl, true) => match GlobalControl::parse(data) {
            Some(control) => write!(f, "{}", Control(control)),
            None => write!(f, "malformed: {}", Hex(data)),
        },
        (Service::SetSlaveAdd, true) => match *data {
            [address, high, low, lock, ref rest @ ..] => {
                write!(
                    f,
                    "new address {address} ident {high:02X}{low:02X} {}",
                    if lock == 0 { "changeable" } else { "locked" }
                )?;
                if rest.is_empty() {
                    Ok(())
                } else {
                    write!(f, " user {}", Hex(rest))
                }
            }
            _ => write!(f, "malformed: {}", Hex(data)),
        },
        (Service::Msac1 | Service::Msac2, _) => acyclic(f, data),
        _ => write!(f, "{} octet{}: {}", data.len(), plural(data.len()), Hex(data)),
    }
}

fn lines(f: &mut fmt::Formatter<'_>, telegram: &Telegram<'_>, header: &Header, data: &[u8]) -> fmt::Result {
    let length = telegram.encoded_len();
    let start = match length {
        6 => "SD1",
        14 => "SD3",
        _ => "SD2",
    };
    writeln!(f, "{start}, {length} octets")?;
    f.write_str("  destination  ")?;
    destination(f, header)?;
    writeln!(f, "\n  source       {}", header.sa)?;
    writeln!(f, "  function     {:02X} {}", header.fc.to_octet(), Function(header.fc))?;
    let (dsap_side, ssap_side) = if header.fc.is_request() {
        (Side::Responder, Side::Initiator)
    } else {
        (Side::Initiator, Side::Responder)
    };
    for (label, sap, side) in [("DSAP", header.dsap, dsap_side), ("SSAP", header.ssap, ssap_side)] {
        if let Some(sap) = sap {
            writeln!(f, "  {label}         {sap} {}", sap_name(sap, side).unwrap_or("user"))?;
        }
    }
    let service = Service::of(telegram);
    writeln!(f, "  service      {service}")?;
    if data.is_empty() {
        return Ok(());
    }
    match (service, header.fc.is_request()) {
        (Service::SlaveDiag, false) => {
            if let Ok(diagnosis) = Diagnosis::parse(data) {
                writeln!(f, "  standard     {}", Standard(&diagnosis.standard))?;
                for block in diagnosis.blocks() {
                    writeln!(f, "  block        {}", DiagBlock(block))?;
                }
            }
        }
        (Service::ChkCfg, true) | (Service::GetCfg, false) => {
            for module in Modules(data) {
                writeln!(f, "  module       {module}")?;
            }
        }
        (Service::SetPrm | Service::GlobalControl | Service::SetSlaveAdd | Service::Msac1 | Service::Msac2, _) => {
            f.write_str("  content      ")?;
            content(f, service, header.fc, data)?;
            f.write_str("\n")?;
        }
        _ => {}
    }
    writeln!(f, "  data         {} octet{}", data.len(), plural(data.len()))?;
    for (line, octets) in data.chunks(16).enumerate() {
        writeln!(f, "    {:3}  {}", line * 16, Hex(octets))?;
    }
    Ok(())
}

const fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

/// The station status by the names of its bits, in brackets.
#[derive(Clone, Copy, Debug)]
pub struct StatusBits(pub StationStatus);

impl fmt::Display for StatusBits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// Bit 2 of status 2 is always 1 and says nothing; its absence does.
        const NAMES: [(StationStatus, &str); 15] = [
            (StationStatus::STATION_NON_EXISTENT, "Station_Non_Existent"),
            (StationStatus::STATION_NOT_READY, "Station_Not_Ready"),
            (StationStatus::CFG_FAULT, "Cfg_Fault"),
            (StationStatus::EXT_DIAG, "Ext_Diag"),
            (StationStatus::NOT_SUPPORTED, "Not_Supported"),
            (StationStatus::INVALID_SLAVE_RESPONSE, "Invalid_Slave_Response"),
            (StationStatus::PRM_FAULT, "Prm_Fault"),
            (StationStatus::MASTER_LOCK, "Master_Lock"),
            (StationStatus::PRM_REQ, "Prm_Req"),
            (StationStatus::STAT_DIAG, "Stat_Diag"),
            (StationStatus::WD_ON, "WD_On"),
            (StationStatus::FREEZE_MODE, "Freeze_Mode"),
            (StationStatus::SYNC_MODE, "Sync_Mode"),
            (StationStatus(0x4000), "reserved"),
            (StationStatus::DEACTIVATED, "Deactivated"),
        ];
        f.write_str("[")?;
        let mut first = true;
        for (bit, name) in NAMES {
            if self.0.contains(bit) {
                write!(f, "{}{name}", if first { "" } else { " " })?;
                first = false;
            }
        }
        f.write_str("]")
    }
}

struct Standard<'a>(&'a StandardDiag);

impl fmt::Display for Standard<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let diag = self.0;
        write!(f, "{} master ", StatusBits(diag.status))?;
        if diag.master == StandardDiag::NO_MASTER {
            f.write_str("none")?;
        } else {
            write!(f, "{}", diag.master)?;
        }
        write!(f, " ident {:04X}", diag.ident)?;
        if diag.overflow() == Overflow::Truncated {
            f.write_str(" overflow")?;
        }
        Ok(())
    }
}

struct DiagBlock<'a>(Block<'a>);

impl fmt::Display for DiagBlock<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Block::Device(octets) => write!(f, "device {}", Hex(octets)),
            Block::Identifiers(modules) => {
                f.write_str("modules")?;
                let mut none = true;
                for module in modules.iter() {
                    write!(f, " {module}")?;
                    none = false;
                }
                if none { f.write_str(" none") } else { Ok(()) }
            }
            Block::Channel(ChannelDiag {
                module,
                direction,
                channel,
                unit,
                error,
            }) => {
                write!(f, "channel {channel} of module {module}")?;
                f.write_str(match direction {
                    Direction::Reserved => "",
                    Direction::Input => " in",
                    Direction::Output => " out",
                    Direction::InputOutput => " in+out",
                })?;
                if !matches!(unit, ChannelUnit::Reserved0 | ChannelUnit::Reserved7) {
                    write!(f, " ({})", unit.text())?;
                }
                match error.text() {
                    Some(text) => write!(f, ": {text}"),
                    None => write!(f, ": error {}", error.0),
                }
            }
            Block::Revision(revision) => write!(f, "revision {revision}"),
            Block::Malformed { octets, .. } => write!(f, "malformed {}", Hex(octets)),
        }
    }
}

struct Prm<'a>(&'a SetPrm<'a>);

impl fmt::Display for Prm<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let prm = self.0;
        f.write_str(match prm.lock_request() {
            LockRequest::Keep => "keep",
            LockRequest::Lock => "lock",
            LockRequest::Unlock => "unlock",
        })?;
        if prm.sync_requested() {
            f.write_str(" sync")?;
        }
        if prm.freeze_requested() {
            f.write_str(" freeze")?;
        }
        match (prm.watchdog_on(), prm.watchdog()) {
            (false, _) => f.write_str(" WD off")?,
            (true, Some(watchdog)) => write!(f, " WD {} ms", watchdog.time().as_nanos() / 1_000_000)?,
            (true, None) => f.write_str(" WD invalid")?,
        }
        write!(
            f,
            " min Tsdr {} ident {:04X} group {:02X}",
            prm.min_tsdr, prm.ident, prm.group
        )?;
        if prm.user.is_empty() {
            Ok(())
        } else {
            write!(f, " user {}", Hex(prm.user))
        }
    }
}

struct Control(GlobalControl);

impl fmt::Display for Control {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const NAMES: [(ControlCommand, &str); 5] = [
            (ControlCommand::CLEAR_DATA, "Clear_Data"),
            (ControlCommand::UNFREEZE, "Unfreeze"),
            (ControlCommand::FREEZE, "Freeze"),
            (ControlCommand::UNSYNC, "Unsync"),
            (ControlCommand::SYNC, "Sync"),
        ];
        if self.0.command == ControlCommand::OPERATE {
            f.write_str("Operate")?;
        }
        let mut first = true;
        for (command, name) in NAMES {
            if self.0.command.contains(command) {
                write!(f, "{}{name}", if first { "" } else { " " })?;
                first = false;
            }
        }
        let reserved = self.0.command.0 & 0xC1;
        if reserved != 0 {
            write!(f, "{}reserved {reserved:02X}", if first { "" } else { " " })?;
        }
        match self.0.group_select {
            0 => f.write_str(", all groups"),
            groups => {
                f.write_str(", groups")?;
                (0..8)
                    .filter(|bit| groups >> bit & 1 == 1)
                    .try_for_each(|bit| write!(f, " {}", bit + 1))
            }
        }
    }
}

/// One identifier of a configuration, in the general or special format, in words: `F3 = 4 words in+out whole`.
#[derive(Clone, Copy, Debug)]
pub struct ModuleText<'a>(&'a [u8]);

impl fmt::Display for ModuleText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = ", Hex(self.0))?;
        let Some((&identifier, rest)) = self.0.split_first() else {
            return Ok(());
        };
        if identifier & 0x30 != 0 {
            amount(f, identifier & 0x40 != 0, usize::from(identifier & 0x0F) + 1)?;
            f.write_str(match identifier & 0x30 {
                0x10 => " in",
                0x20 => " out",
                _ => " in+out",
            })?;
            return f.write_str(if identifier & 0x80 != 0 { " whole" } else { "" });
        }
        let (outputs, inputs) = (identifier & 0x80 != 0, identifier & 0x40 != 0);
        if rest.len() < special_len(identifier) - 1 {
            return f.write_str("incomplete");
        }
        if !outputs && !inputs {
            f.write_str("empty slot")?;
        }
        // Where both lengths follow, the outputs come first.
        let lengths = [("out", outputs), ("in", inputs)]
            .into_iter()
            .filter(|(_, there)| *there);
        let mut used = 0;
        for ((direction, _), &length) in lengths.zip(rest) {
            if used > 0 {
                f.write_str(" + ")?;
            }
            amount(f, length & 0x40 != 0, usize::from(length & 0x3F) + 1)?;
            write!(f, " {direction}{}", if length & 0x80 != 0 { " whole" } else { "" })?;
            used += 1;
        }
        match rest.get(used..) {
            Some(own) if !own.is_empty() => write!(f, " manufacturer {}", Hex(own)),
            _ => Ok(()),
        }
    }
}

fn amount(f: &mut fmt::Formatter<'_>, words: bool, count: usize) -> fmt::Result {
    let unit = if words { "word" } else { "octet" };
    write!(f, "{count} {unit}{}", plural(count))
}

/// Octets of a module in the special format: identifier, lengths, octets of the manufacturer (15 means none).
const fn special_len(identifier: u8) -> usize {
    let lengths = (identifier >> 7) + (identifier >> 6 & 1);
    let own = match identifier & 0x0F {
        15 => 0,
        own => own,
    };
    1 + lengths as usize + own as usize
}

/// The identifiers of a configuration, one by one.
#[derive(Clone, Copy, Debug)]
pub struct Modules<'a>(pub &'a [u8]);

impl<'a> Iterator for Modules<'a> {
    type Item = ModuleText<'a>;

    fn next(&mut self) -> Option<ModuleText<'a>> {
        let &identifier = self.0.first()?;
        let length = if identifier & 0x30 != 0 {
            1
        } else {
            special_len(identifier)
        };
        let (module, rest) = self.0.split_at(length.min(self.0.len()));
        self.0 = rest;
        Some(ModuleText(module))
    }
}

/// An acyclic service of DP-V1: function number, then slot, index and length.
fn acyclic(f: &mut fmt::Formatter<'_>, data: &[u8]) -> fmt::Result {
    let Some((&function, rest)) = data.split_first() else {
        return Ok(());
    };
    let name = match function & 0x7F {
        0x48 => "Idle",
        0x51 => "Data_Transport",
        0x56 => "RM",
        0x57 => "Initiate",
        0x58 => "Abort",
        0x5C => "Alarm_Ack",
        0x5E => "Read",
        0x5F => "Write",
        _ => return write!(f, "function {}", Hex(data)),
    };
    f.write_str(name)?;
    match (function, rest) {
        (0x51 | 0x5E | 0x5F, &[slot, index, length, ref rest @ ..]) => {
            write!(f, " slot {slot} index {index} length {length}")?;
            if rest.is_empty() {
                Ok(())
            } else {
                write!(f, ": {}", Hex(rest))
            }
        }
        (0x80.., &[decode, code_1, code_2, ..]) => {
            write!(f, " error decode {decode:02X} code {code_1:02X} {code_2:02X}")
        }
        (_, []) => Ok(()),
        _ => write!(f, " {}", Hex(rest)),
    }
}

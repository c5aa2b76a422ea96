//! `dp set-address`: an address for a slave without switches.

use clap::Args;
use dp_master::address::Address;
use dp_master::dp::class2::{AskStatus, ChangeAddress, ReadDiag, ServiceError};
use dp_master::dp::{AddressLock, JobFailure, SetSlaveAdd};

use crate::line_args::{parse_ident, parse_station};
use crate::output::{Outcome, Output, Trouble};
use crate::session::{LineArgs, Session};

/// What `dp set-address` takes.
#[derive(Debug, Args)]
pub(crate) struct SetAddressArgs {
    #[command(flatten)]
    line: LineArgs,
    /// The address the slave has now; 126 is what slaves are delivered with.
    #[arg(long, value_name = "N", value_parser = parse_station)]
    from: Address,
    /// The address it shall have, 0…125.
    #[arg(long, value_name = "N", value_parser = parse_station)]
    to: Address,
    /// Its ident number, such as 0x00DA; asked for if not given.
    #[arg(long, value_name = "HEX", value_parser = parse_ident)]
    ident: Option<u16>,
    /// It shall never be changed again.
    #[arg(long)]
    lock: bool,
}

/// Changes the address and looks whether it was changed.
pub(crate) fn set_address(args: &SetAddressArgs) -> Outcome {
    if args.to > MAX_NEW {
        return Err(Trouble::given(
            "--to must be 0…125: 126 is for slaves that wait for an address",
        ));
    }
    let mut session = Session::open(&args.line)?;
    if let Ok(station) = session.ask(AskStatus { peer: args.to })? {
        return Err(Trouble::failed(format_args!(
            "address {} is taken by a {}, nothing was changed",
            args.to,
            match station {
                dp_master::wire::StationType::Slave => "slave",
                _ => "master",
            }
        )));
    }
    let ident = match args.ident {
        Some(ident) => ident,
        None => session.need(args.from, ReadDiag { peer: args.from })?.standard.ident,
    };
    let request = SetSlaveAdd {
        new_address: args.to,
        ident,
        lock: if args.lock {
            AddressLock::Locked
        } else {
            AddressLock::Changeable
        },
        remaining: &[],
    };
    let change = ChangeAddress::new(args.from, &request).map_err(Trouble::given)?;
    match session.ask(change)? {
        // An answer that was lost may still mean that it has obeyed: the look below decides.
        Ok(()) | Err(ServiceError::Failed(JobFailure::NoAnswer)) => {}
        Err(error) => {
            return Err(Trouble::failed(format_args!(
                "station {} refuses another address: {error}",
                args.from
            )));
        }
    }
    let there = session.ask(ReadDiag { peer: args.to })?;
    session.leave();
    match there {
        Ok(diagnosis) => {
            let mut out = Output::new();
            out.line(format_args!(
                "station {} is station {} now, ident number {:04X}",
                args.from, args.to, diagnosis.standard.ident
            ));
            out.flush();
            Ok(())
        }
        Err(_) => Err(Trouble::failed(format_args!(
            "nobody answers at address {}: station {} keeps its address when it is parametrised, locked, or has another ident number than {ident:04X}",
            args.to, args.from
        ))),
    }
}

/// Highest address that can be given. Source: IEC 61158-6-3, Set_Slave_Add.
const MAX_NEW: Address = match Address::new(125) {
    Ok(address) => address,
    Err(_) => Address::MAX_STATION,
};

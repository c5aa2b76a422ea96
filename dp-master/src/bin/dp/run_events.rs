//! What happens to a master, in sentences.

use dp_master::dp::{LossCause, MasterEvent, SlaveIndex, StandardDiag};
use dp_master::fdl::{LeaveCause, RingEvent};
use dp_master::wire::StatusBits;

/// An event in one sentence; `name` names a slave.
pub(crate) fn sentence(event: &MasterEvent, name: impl Fn(SlaveIndex) -> String) -> String {
    let status = |diagnosis: &StandardDiag| StatusBits(diagnosis.status).to_string();
    match event {
        MasterEvent::Ring(event) => ring(event),
        MasterEvent::DataExchange { slave } => format!("{} exchanges data", name(*slave)),
        MasterEvent::Diagnosis { slave, diagnosis } => {
            format!("{} has a diagnosis {}", name(*slave), status(diagnosis))
        }
        MasterEvent::ParametersRefused { slave, diagnosis } => format!(
            "{} refuses the parameters {}, its ident number is {:04X}",
            name(*slave),
            status(diagnosis),
            diagnosis.ident
        ),
        MasterEvent::ConfigurationRefused { slave, diagnosis } => format!(
            "{} refuses the configuration {}; `dp get-cfg` shows its own",
            name(*slave),
            status(diagnosis)
        ),
        MasterEvent::OwnedByOther { slave, diagnosis } => {
            format!("{} belongs to master {}", name(*slave), diagnosis.master)
        }
        MasterEvent::StartUpRejected { slave, function } => {
            format!("{} rejects a service of the start-up ({function:?})", name(*slave))
        }
        MasterEvent::DiagnosisUnreadable { slave, got } => {
            format!("{} sends a diagnosis of {got} octets, 6 are needed", name(*slave))
        }
        MasterEvent::SlaveLost { slave, cause } => format!("{} is lost: {}", name(*slave), loss(cause)),
        MasterEvent::AutoCleared { slave } => format!("outputs of all slaves are cleared because of {}", name(*slave)),
        MasterEvent::OutputsReleased => "every slave exchanges data, outputs are released".to_owned(),
        MasterEvent::CycleOverrun { took } => {
            format!("a cycle took {:.3} ms, longer than set", took.as_nanos() as f64 / 1e6)
        }
        other => format!("{other:?}"),
    }
}

fn ring(event: &RingEvent) -> String {
    match event {
        RingEvent::Claimed => "the line was silent, the token is ours".to_owned(),
        RingEvent::TokenLost => "the token is lost".to_owned(),
        RingEvent::Entered => "we are in the ring of masters".to_owned(),
        RingEvent::Left(LeaveCause::Excluded) => "the other masters passed the token over us".to_owned(),
        RingEvent::Left(LeaveCause::DuplicateAddress) | RingEvent::DuplicateAddress => {
            "another station has our address, we are silent".to_owned()
        }
        RingEvent::Left(LeaveCause::Commanded) => "we left the ring".to_owned(),
        RingEvent::StationJoined(address) => format!("master {address} joined the ring"),
        RingEvent::StationLeft(address) => format!("master {address} left the ring"),
        RingEvent::SecondToken(address) => format!("master {address} has a token too, ours is given up"),
        #[allow(unreachable_patterns, reason = "the list may grow")]
        other => format!("{other:?}"),
    }
}

fn loss(cause: &LossCause) -> String {
    match cause {
        LossCause::NoAnswer => "it does not answer".to_owned(),
        LossCause::Rejected(function) => format!("it rejects the exchange ({function:?})"),
        LossCause::Diagnosis(diagnosis) => {
            format!("its diagnosis says {}", StatusBits(diagnosis.status))
        }
        LossCause::InputLength { expected, got } => format!("it sends {got} octets instead of {expected}"),
        LossCause::Stopped => "the master stopped".to_owned(),
        #[allow(unreachable_patterns, reason = "the list may grow")]
        other => format!("{other:?}"),
    }
}

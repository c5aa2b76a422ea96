//! The drive's parameters as a data record (DP-V1): written, a request for parameters; read, its response.
//!
//! Each way has a conversation of its own: the master that parametrised the module (MSAC1), and each connection of a master of class
//! 2 (MSAC2). A job takes as long for every parameter as one of the parameter channel; a master that reads before it is done
//! gets its answer when it is. (DEVIATION: PROFIdrive lets such a read fail; who waits is served by both.)
//!
//! Source: 9300 fact sheet, section 7.

use dp_master::dp::DpSlave;
use dp_master::dp::v1::{ErrorCode1, V1Channel, V1Error, V1Request, V1RequestId, V1Service};
use dp_master::time::Instant;
use drivecom::param::{
    DataLength, MAX_RECORD, RECORD_INDEX, RECORD_SLOT, RecordError, RecordJob, RecordRequest, RecordResponse,
    RecordResult,
};

use crate::code::{CodeError, DataLength as CodeLength, entry};
use crate::device::Drive;

/// All conversations; at most one for MSAC1 and one for each connection.
#[derive(Debug, Clone, Default)]
pub(super) struct Records {
    conversations: Vec<Conversation>,
}

#[derive(Debug, Clone)]
struct Conversation {
    channel: V1Channel,
    stage: Stage,
}

#[derive(Debug, Clone)]
enum Stage {
    /// The parameters are being worked on.
    Working {
        request: Octets,
        left_ms: u32,
        /// A read that waits for the response.
        reader: Option<V1RequestId>,
    },
    /// The response waits to be read.
    Answered(Octets),
}

/// A data record.
#[derive(Debug, Clone)]
struct Octets {
    octets: [u8; MAX_RECORD],
    len: usize,
}

impl Octets {
    fn of(octets: &[u8]) -> Self {
        let mut record = Self {
            octets: [0; MAX_RECORD],
            len: octets.len().min(MAX_RECORD),
        };
        let len = record.len;
        record.octets[..len].copy_from_slice(&octets[..len]);
        record
    }

    fn as_slice(&self) -> &[u8] {
        &self.octets[..self.len]
    }
}

impl Records {
    /// A millisecond of the module. `job_ms` tells how long the next parameter takes.
    pub(super) fn pass_1ms(
        &mut self,
        now: Instant,
        slave: &mut DpSlave,
        drive: &mut Drive,
        mut job_ms: impl FnMut() -> u32,
    ) {
        while let Some(request) = slave.poll_v1_request() {
            if let Some(answer) = self.take(&request, &mut job_ms) {
                // Who asked may be gone already.
                let _ = slave.respond_v1(
                    now,
                    request.id,
                    answer.as_ref().map(Octets::as_slice).map_err(|error| *error),
                );
            }
        }
        for conversation in &mut self.conversations {
            let Stage::Working {
                request,
                left_ms,
                reader,
            } = &mut conversation.stage
            else {
                continue;
            };
            *left_ms = left_ms.saturating_sub(1);
            if *left_ms > 0 {
                continue;
            }
            let (response, reader) = (carry_out(request.as_slice(), drive), *reader);
            // A reader that has gone leaves the response to the next.
            let delivered = reader.is_some_and(|id| slave.respond_v1(now, id, Ok(response.as_slice())).is_ok());
            conversation.stage = Stage::Answered(if delivered { Octets::of(&[]) } else { response });
        }
        self.conversations
            .retain(|conversation| !matches!(&conversation.stage, Stage::Answered(response) if response.len == 0));
    }

    /// The way has ended: nobody will fetch the response.
    pub(super) fn forget(&mut self, channel: V1Channel) {
        self.conversations
            .retain(|conversation| conversation.channel != channel);
    }

    /// The answer to a request, or `None` when it comes later.
    fn take(&mut self, request: &V1Request, job_ms: &mut impl FnMut() -> u32) -> Option<Result<Octets, V1Error>> {
        let refused = |code| Some(Err(V1Error::new(code)));
        let (slot, index) = request.service.place();
        if slot != RECORD_SLOT {
            return refused(ErrorCode1::INVALID_SLOT);
        }
        if index != RECORD_INDEX {
            return refused(ErrorCode1::INVALID_INDEX);
        }
        let channel = request.id.channel();
        let place = self
            .conversations
            .iter()
            .position(|conversation| conversation.channel == channel);
        match request.service {
            V1Service::DataTransport { .. } => refused(ErrorCode1::FEATURE_NOT_SUPPORTED),
            V1Service::Write { data, .. } => {
                let working =
                    place.is_some_and(|place| matches!(self.conversations[place].stage, Stage::Working { .. }));
                if working {
                    return refused(ErrorCode1::STATE_CONFLICT);
                }
                let Ok(parsed) = RecordRequest::parse(&data) else {
                    return refused(ErrorCode1::INVALID_PARAMETER);
                };
                self.forget(channel);
                self.conversations.push(Conversation {
                    channel,
                    stage: Stage::Working {
                        request: Octets::of(&data),
                        left_ms: (0..parsed.count()).map(|_| job_ms()).sum(),
                        reader: None,
                    },
                });
                Some(Ok(Octets::of(&[])))
            }
            V1Service::Read { .. } => match place.map(|place| &mut self.conversations[place].stage) {
                Some(Stage::Working { reader, .. }) => {
                    *reader = Some(request.id);
                    None
                }
                Some(Stage::Answered(response)) => {
                    let response = response.clone();
                    self.forget(channel);
                    Some(Ok(response))
                }
                // Nothing was asked.
                None => refused(ErrorCode1::STATE_CONFLICT),
            },
        }
    }
}

fn carry_out(request: &[u8], drive: &mut Drive) -> Octets {
    let Ok(request) = RecordRequest::parse(request) else {
        // It was parsed when it was taken.
        return Octets::of(&[]);
    };
    let mut response = RecordResponse::to(&request);
    for job in request.jobs() {
        response.push(parameter(job, drive));
    }
    Octets::of(response.octets())
}

fn parameter(job: RecordJob, drive: &mut Drive) -> RecordResult {
    let refuse = |error: CodeError| number_of(&error);
    match job {
        RecordJob::Refused(error) => Err(error),
        RecordJob::Read { code, subcode } => {
            let value = drive.read_code(code.number(), subcode.0).map_err(refuse)?;
            let length = match entry(code.number()).map(|entry| entry.length) {
                Some(CodeLength::Two) => DataLength::Two,
                _ => DataLength::Four,
            };
            Ok((length, value))
        }
        RecordJob::Write {
            code,
            subcode,
            length,
            value,
        } => {
            let code = code.number();
            drive.codes().check_length(code, length.octets()).map_err(refuse)?;
            drive.write_code(code, subcode.0, value).map_err(refuse)?;
            Ok((length, value))
        }
    }
}

/// Interpretation: which number of PROFIdrive stands for which refusal of the drive.
fn number_of(error: &CodeError) -> RecordError {
    match error {
        CodeError::UnknownCode { .. } => RecordError::NUMBER,
        CodeError::UnknownSubcode { .. } => RecordError::SUBINDEX,
        CodeError::ReadOnly { .. } => RecordError::NOT_CHANGEABLE,
        CodeError::DataTooLong { .. } | CodeError::DataTooShort { .. } => RecordError::DATA_TYPE,
        CodeError::TooHigh { .. } | CodeError::TooLow { .. } => RecordError::LIMITS,
        CodeError::OutsideSelection { .. } => RecordError::VALUE,
        CodeError::OnlyWhileInhibited { .. } | CodeError::TransferRunning | CodeError::ImpermissibleJob { .. } => {
            RecordError::STATE
        }
    }
}

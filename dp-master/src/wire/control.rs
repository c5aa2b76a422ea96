//! The function code octet (FC, also frame control): who speaks, what is asked or answered.
//!
//! | bit | request | response |
//! |---|---|---|
//! | 7 | 0, or part of the function (clock value) | 0 |
//! | 6 | 1 | 0 |
//! | 5, 4 | FCB, FCV | station type |
//! | 3…0 | function | function |
//!
//! Every octet has exactly one [`FunctionCode`] and comes back from it unchanged; codes without a name stay `Unknown`.
//!
//! Source: IEC 61158-4-3 (DL type 3).

/// A function code: a request of an initiator or a response of a responder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FunctionCode {
    /// Send, or send and request (bit 6 is 1): an action telegram.
    Request {
        /// Frame count bit and its validity.
        fcb: Fcb,
        /// What is asked for.
        function: RequestFunction,
    },
    /// Acknowledgement or response (bit 6 is 0).
    Response {
        /// What kind of station answers.
        station: StationType,
        /// The answer.
        function: ResponseFunction,
    },
}

impl FunctionCode {
    /// A request.
    #[inline]
    #[must_use]
    pub const fn request(fcb: Fcb, function: RequestFunction) -> Self {
        Self::Request { fcb, function }
    }

    /// A response.
    #[inline]
    #[must_use]
    pub const fn response(station: StationType, function: ResponseFunction) -> Self {
        Self::Response { station, function }
    }

    /// Reads an octet; every value has a meaning.
    #[inline]
    #[must_use]
    pub const fn from_octet(octet: u8) -> Self {
        MEANINGS[octet as usize]
    }

    /// Takes an octet apart, for [`MEANINGS`].
    const fn read(octet: u8) -> Self {
        let function = octet & FUNCTION;
        if octet & REQUEST != 0 {
            let fcb = match octet & UPPER {
                0x00 => Fcb::Inactive,
                0x10 => Fcb::Low,
                0x20 => Fcb::First,
                _ => Fcb::High,
            };
            Self::Request {
                fcb,
                function: RequestFunction::from_code(function),
            }
        } else {
            let station = match octet & UPPER {
                0x00 => StationType::Slave,
                0x10 => StationType::MasterNotReady,
                0x20 => StationType::MasterReady,
                _ => StationType::MasterInRing,
            };
            Self::Response {
                station,
                function: ResponseFunction::from_code(function),
            }
        }
    }

    /// The octet on the wire.
    #[inline]
    #[must_use]
    pub const fn to_octet(self) -> u8 {
        match self {
            Self::Request { fcb, function } => {
                let upper = match fcb {
                    Fcb::Inactive => 0x00,
                    Fcb::Low => 0x10,
                    Fcb::First => 0x20,
                    Fcb::High => 0x30,
                };
                REQUEST | upper | function.code()
            }
            Self::Response { station, function } => {
                let upper = match station {
                    StationType::Slave => 0x00,
                    StationType::MasterNotReady => 0x10,
                    StationType::MasterReady => 0x20,
                    StationType::MasterInRing => 0x30,
                };
                upper | function.code()
            }
        }
    }

    /// Whether this is an action telegram of an initiator.
    #[inline]
    #[must_use]
    pub const fn is_request(self) -> bool {
        matches!(self, Self::Request { .. })
    }

    /// Whether the addressed station has to answer.
    ///
    /// False for send data with no acknowledge (SDN), for clock telegrams and for every response; true for requests without a name.
    #[inline]
    #[must_use]
    pub const fn expects_reply(self) -> bool {
        match self {
            Self::Request { function, .. } => !matches!(
                function,
                RequestFunction::SdnLow
                    | RequestFunction::SdnHigh
                    | RequestFunction::TimeEvent
                    | RequestFunction::ClockValue
            ),
            Self::Response { .. } => false,
        }
    }

    /// Whether this is a request of high priority: SDA, SDN or SRD high.
    ///
    /// Everything else waits for hold time: the low ones, and the status requests that management makes.
    #[inline]
    #[must_use]
    pub const fn is_high_priority(self) -> bool {
        matches!(
            self,
            Self::Request {
                function: RequestFunction::SdaHigh | RequestFunction::SdnHigh | RequestFunction::SrdHigh,
                ..
            }
        )
    }
}

impl From<u8> for FunctionCode {
    fn from(octet: u8) -> Self {
        Self::from_octet(octet)
    }
}

impl From<FunctionCode> for u8 {
    fn from(fc: FunctionCode) -> Self {
        fc.to_octet()
    }
}

/// Frame count bit (FCB) together with its validity (FCV) in a request.
///
/// The initiator alternates [`High`](Self::High) and [`Low`](Self::Low) per responder; a responder that sees the same one twice repeats its
/// last answer instead of carrying the request out again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fcb {
    /// FCB = 1, FCV = 0: first contact, the responder takes whatever follows as new.
    First,
    /// FCB = 1, FCV = 1.
    High,
    /// FCB = 0, FCV = 1.
    Low,
    /// FCB = 0, FCV = 0: not counted (SDN, FDL status, ident, LSAP status).
    Inactive,
}

impl Fcb {
    /// The bit for the next new request to the same station: after first contact it is [`Fcb::Low`] because FCB was 1.
    ///
    /// An inactive bit stays inactive.
    #[inline]
    #[must_use]
    pub const fn next(self) -> Self {
        match self {
            Self::First | Self::High => Self::Low,
            Self::Low => Self::High,
            Self::Inactive => Self::Inactive,
        }
    }
}

/// What an initiator asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RequestFunction {
    /// 0: time event of the clock synchronisation.
    TimeEvent,
    /// 3: send data with acknowledge, low priority.
    SdaLow,
    /// 4: send data with no acknowledge, low priority.
    SdnLow,
    /// 5: send data with acknowledge, high priority.
    SdaHigh,
    /// 6: send data with no acknowledge, high priority.
    SdnHigh,
    /// 7: send and request data with multicast reply (DP-V2).
    Msrd,
    /// 9: request of the FDL status.
    FdlStatus,
    /// 12: send and request data, low priority.
    SrdLow,
    /// 13: send and request data, high priority.
    SrdHigh,
    /// 14: request of the ident data.
    Ident,
    /// 15: request of the LSAP status.
    LsapStatus,
    /// 0 with bit 7: clock value of the clock synchronisation.
    ClockValue,
    /// Any other code, bits 7 and 3…0; bits outside these are ignored when written.
    Unknown(u8),
}

impl RequestFunction {
    /// Reads bits 7 and 3…0 of the octet.
    #[inline]
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code & FUNCTION {
            0x00 => Self::TimeEvent,
            0x03 => Self::SdaLow,
            0x04 => Self::SdnLow,
            0x05 => Self::SdaHigh,
            0x06 => Self::SdnHigh,
            0x07 => Self::Msrd,
            0x09 => Self::FdlStatus,
            0x0C => Self::SrdLow,
            0x0D => Self::SrdHigh,
            0x0E => Self::Ident,
            0x0F => Self::LsapStatus,
            0x80 => Self::ClockValue,
            other => Self::Unknown(other),
        }
    }

    /// Bits 7 and 3…0 of the octet.
    #[inline]
    #[must_use]
    pub const fn code(self) -> u8 {
        // Apart, so that the others become one look into a table.
        if let Self::Unknown(code) = self {
            return code & FUNCTION;
        }
        match self {
            Self::TimeEvent => 0x00,
            Self::SdaLow => 0x03,
            Self::SdnLow => 0x04,
            Self::SdaHigh => 0x05,
            Self::SdnHigh => 0x06,
            Self::Msrd => 0x07,
            Self::FdlStatus => 0x09,
            Self::SrdLow => 0x0C,
            Self::SrdHigh => 0x0D,
            Self::Ident => 0x0E,
            Self::LsapStatus => 0x0F,
            Self::ClockValue => 0x80,
            Self::Unknown(_) => 0x00,
        }
    }
}

/// What kind of station answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StationType {
    /// Slave.
    Slave,
    /// Master, not ready to enter the token ring.
    MasterNotReady,
    /// Master, ready to enter the token ring.
    MasterReady,
    /// Master, in the token ring.
    MasterInRing,
}

/// What a responder answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ResponseFunction {
    /// 0, OK: positive acknowledgement.
    Ok,
    /// 1, UE: user error, negative acknowledgement.
    UserError,
    /// 2, RR: no resource for the sent data.
    NoResource,
    /// 3, RS: no service activated at this access point.
    NoService,
    /// 8, DL: response data, low priority.
    DataLow,
    /// 9, NR: acknowledgement without response data.
    NoReplyData,
    /// 10, DH: response data, high priority (DP: there is new diagnosis).
    DataHigh,
    /// 12, RDL: response data of low priority, no resource for the sent data.
    DataLowNoResource,
    /// 13, RDH: response data of high priority, no resource for the sent data.
    DataHighNoResource,
    /// Any other code, bits 7 and 3…0; bits outside these are ignored when written.
    Unknown(u8),
}

impl ResponseFunction {
    /// Reads bits 7 and 3…0 of the octet.
    #[inline]
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code & FUNCTION {
            0x00 => Self::Ok,
            0x01 => Self::UserError,
            0x02 => Self::NoResource,
            0x03 => Self::NoService,
            0x08 => Self::DataLow,
            0x09 => Self::NoReplyData,
            0x0A => Self::DataHigh,
            0x0C => Self::DataLowNoResource,
            0x0D => Self::DataHighNoResource,
            other => Self::Unknown(other),
        }
    }

    /// Bits 7 and 3…0 of the octet.
    #[inline]
    #[must_use]
    pub const fn code(self) -> u8 {
        // Apart, so that the others become one look into a table.
        if let Self::Unknown(code) = self {
            return code & FUNCTION;
        }
        match self {
            Self::Ok => 0x00,
            Self::UserError => 0x01,
            Self::NoResource => 0x02,
            Self::NoService => 0x03,
            Self::DataLow => 0x08,
            Self::NoReplyData => 0x09,
            Self::DataHigh => 0x0A,
            Self::DataLowNoResource => 0x0C,
            Self::DataHighNoResource => 0x0D,
            Self::Unknown(_) => 0x00,
        }
    }
}

/// Every octet taken apart: one look instead of three decisions for each telegram received.
static MEANINGS: [FunctionCode; 256] = {
    let mut meanings = [FunctionCode::read(0); 256];
    let mut octet = 0;
    while octet < meanings.len() {
        meanings[octet] = FunctionCode::read(octet as u8);
        octet += 1;
    }
    meanings
};

/// Bit 6: the telegram is a request.
const REQUEST: u8 = 0x40;
/// Bits 5 and 4: FCB and FCV, or the station type.
const UPPER: u8 = 0x30;
/// Bits 7 and 3…0: the function.
const FUNCTION: u8 = 0x8F;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_octet_survives_the_way_through_the_function_code() {
        for octet in 0..=u8::MAX {
            assert_eq!(FunctionCode::from_octet(octet).to_octet(), octet);
        }
    }

    #[test]
    fn the_codes_of_dp_are_those_of_the_standard() {
        // IEC 61158-4-3: SRD high with FCB alternating is 5D / 7D, first contact 6D (low: 4C…7C), FDL status 49, SDN high 46.
        let cases = [
            (0x5D, FunctionCode::request(Fcb::Low, RequestFunction::SrdHigh)),
            (0x7D, FunctionCode::request(Fcb::High, RequestFunction::SrdHigh)),
            (0x6D, FunctionCode::request(Fcb::First, RequestFunction::SrdHigh)),
            (0x5C, FunctionCode::request(Fcb::Low, RequestFunction::SrdLow)),
            (0x49, FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus)),
            (0x46, FunctionCode::request(Fcb::Inactive, RequestFunction::SdnHigh)),
            (
                0x08,
                FunctionCode::response(StationType::Slave, ResponseFunction::DataLow),
            ),
            (
                0x0A,
                FunctionCode::response(StationType::Slave, ResponseFunction::DataHigh),
            ),
            (0x00, FunctionCode::response(StationType::Slave, ResponseFunction::Ok)),
            (
                0x10,
                FunctionCode::response(StationType::MasterNotReady, ResponseFunction::Ok),
            ),
            (
                0x20,
                FunctionCode::response(StationType::MasterReady, ResponseFunction::Ok),
            ),
            (
                0x30,
                FunctionCode::response(StationType::MasterInRing, ResponseFunction::Ok),
            ),
            (0xC0, FunctionCode::request(Fcb::Inactive, RequestFunction::ClockValue)),
        ];
        for (octet, fc) in cases {
            assert_eq!(FunctionCode::from_octet(octet), fc);
            assert_eq!(fc.to_octet(), octet);
        }
    }

    #[test]
    fn an_unnamed_code_stays_a_value() {
        assert_eq!(
            FunctionCode::from_octet(0x41),
            FunctionCode::Request {
                fcb: Fcb::Inactive,
                function: RequestFunction::Unknown(0x01)
            }
        );
        assert_eq!(
            FunctionCode::from_octet(0x8F),
            FunctionCode::Response {
                station: StationType::Slave,
                function: ResponseFunction::Unknown(0x8F)
            }
        );
    }

    #[test]
    fn only_unacknowledged_requests_and_responses_need_no_reply() {
        assert!(FunctionCode::from_octet(0x5D).expects_reply());
        assert!(FunctionCode::from_octet(0x49).expects_reply());
        assert!(!FunctionCode::from_octet(0x46).expects_reply());
        assert!(!FunctionCode::from_octet(0x44).expects_reply());
        assert!(!FunctionCode::from_octet(0x08).expects_reply());
    }

    #[test]
    fn the_frame_count_bit_alternates_after_first_contact() {
        assert_eq!(Fcb::First.next(), Fcb::Low);
        assert_eq!(Fcb::Low.next(), Fcb::High);
        assert_eq!(Fcb::High.next(), Fcb::Low);
        assert_eq!(Fcb::Inactive.next(), Fcb::Inactive);
    }
}

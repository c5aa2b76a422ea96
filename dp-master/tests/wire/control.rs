//! The frame control octet: IEC 61158-4-3, coding of FC (EN 50170-2, part 4). Bit 6 is 1 in a request, bits 5 and 4 are FCB and FCV, or
//! the station type of a response; SDA, SDN and SRD high are of high priority; SDN and clock telegrams get no answer.

use dp_master::wire::{Fcb, FunctionCode, RequestFunction, ResponseFunction, StationType};

/// Octet without frame count bit, function, whether it wants an answer, whether its priority is high.
const REQUESTS: [(u8, RequestFunction, bool, bool); 13] = [
    (0x40, RequestFunction::TimeEvent, false, false),
    (0x41, RequestFunction::Unknown(1), true, false),
    (0x43, RequestFunction::SdaLow, true, false),
    (0x44, RequestFunction::SdnLow, false, false),
    (0x45, RequestFunction::SdaHigh, true, true),
    (0x46, RequestFunction::SdnHigh, false, true),
    (0x47, RequestFunction::Msrd, true, false),
    (0x49, RequestFunction::FdlStatus, true, false),
    (0x4C, RequestFunction::SrdLow, true, false),
    (0x4D, RequestFunction::SrdHigh, true, true),
    (0x4E, RequestFunction::Ident, true, false),
    (0x4F, RequestFunction::LsapStatus, true, false),
    (0xC0, RequestFunction::ClockValue, false, false),
];

const FRAME_COUNTS: [(u8, Fcb); 4] = [
    (0x00, Fcb::Inactive),
    (0x10, Fcb::Low),
    (0x20, Fcb::First),
    (0x30, Fcb::High),
];

const RESPONSES: [(u8, ResponseFunction); 10] = [
    (0x00, ResponseFunction::Ok),
    (0x01, ResponseFunction::UserError),
    (0x02, ResponseFunction::NoResource),
    (0x03, ResponseFunction::NoService),
    (0x07, ResponseFunction::Unknown(7)),
    (0x08, ResponseFunction::DataLow),
    (0x09, ResponseFunction::NoReplyData),
    (0x0A, ResponseFunction::DataHigh),
    (0x0C, ResponseFunction::DataLowNoResource),
    (0x0D, ResponseFunction::DataHighNoResource),
];

const STATIONS: [(u8, StationType); 4] = [
    (0x00, StationType::Slave),
    (0x10, StationType::MasterNotReady),
    (0x20, StationType::MasterReady),
    (0x30, StationType::MasterInRing),
];

#[test]
fn every_request_has_its_octet_answer_and_priority() {
    for (octet, function, expects_reply, is_high) in REQUESTS {
        for (bits, fcb) in FRAME_COUNTS {
            let fc = FunctionCode::request(fcb, function);
            assert_eq!(u8::from(fc), octet | bits, "{fc:?}");
            assert_eq!(FunctionCode::from(octet | bits), fc);
            assert!(fc.is_request(), "{fc:?}");
            assert_eq!(fc.expects_reply(), expects_reply, "{fc:?}");
            assert_eq!(fc.is_high_priority(), is_high, "{fc:?}");
        }
    }
}

#[test]
fn every_response_has_its_octet_and_wants_nothing() {
    for (octet, function) in RESPONSES {
        for (bits, station) in STATIONS {
            let fc = FunctionCode::response(station, function);
            assert_eq!(u8::from(fc), octet | bits, "{fc:?}");
            assert_eq!(FunctionCode::from(octet | bits), fc);
            assert!(
                !fc.is_request() && !fc.expects_reply() && !fc.is_high_priority(),
                "{fc:?}"
            );
        }
    }
}

/// First contact with FCB = 1, then alternating (EN 50170-2, part 4, frame count bit).
#[test]
fn the_frame_count_bit_alternates_after_first_contact() {
    for (now, next) in [
        (Fcb::First, Fcb::Low),
        (Fcb::Low, Fcb::High),
        (Fcb::High, Fcb::Low),
        (Fcb::Inactive, Fcb::Inactive),
    ] {
        assert_eq!(now.next(), next);
    }
}

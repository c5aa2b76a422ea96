//! The PDUs of DP-V1, octet by octet and as a property.
//!
//! Octets: IEC 61158-6-3 (coding of the MSAC PDUs); function codes, lengths and the order of fields were compared with the headers of
//! DP-V1 slave firmware, the refusals with the "DPV1 Error Codes" of the Beckhoff EL6731 manual.

use dp_master::dp::v1::{
    Abort, AddAck, Addresses, AlarmAck, AlarmSpecifier, AlarmType, DeviceAddress, EncodePduError, ErrorClass,
    ErrorCode1, Features, Function, Incident, Initiate, Initiated, PduError, Reply, Request, Resource, SendTimeout,
    V1Error, reason,
};
use proptest::collection::vec;
use proptest::prelude::*;

fn octets_of_request(request: &Request<'_>) -> Vec<u8> {
    let mut buf = [0; 244];
    let len = request.encode(&mut buf).unwrap();
    buf[..len].to_vec()
}

fn octets_of_reply(reply: &Reply<'_>) -> Vec<u8> {
    let mut buf = [0; 244];
    let len = reply.encode(&mut buf).unwrap();
    buf[..len].to_vec()
}

const ACK: AlarmAck = AlarmAck {
    slot: 3,
    alarm_type: AlarmType::DIAGNOSIS,
    specifier: AlarmSpecifier {
        sequence: 5,
        add_ack: AddAck::NotNeeded,
        incident: Incident::Appears,
    },
};

#[test]
fn requests_have_the_octets_of_the_standard() {
    let initiate = Initiate {
        send_timeout: SendTimeout(100),
        features: Features::READ_WRITE,
        profile_features: 0,
        profile_ident: 0x3B00,
        addresses: Addresses::DIRECT,
    };
    let table: [(Request<'_>, &[u8]); 8] = [
        (
            Request::Read {
                slot: 0,
                index: 47,
                length: 240,
            },
            &[0x5E, 0x00, 0x2F, 0xF0],
        ),
        (
            Request::Write {
                slot: 1,
                index: 47,
                data: &[0xAA, 0x55],
            },
            &[0x5F, 0x01, 0x2F, 0x02, 0xAA, 0x55],
        ),
        (
            Request::Write {
                slot: 1,
                index: 2,
                data: &[],
            },
            &[0x5F, 0x01, 0x02, 0x00],
        ),
        (
            Request::DataTransport {
                slot: 2,
                index: 9,
                data: &[7],
            },
            &[0x51, 0x02, 0x09, 0x01, 0x07],
        ),
        // Seq_Nr 5 in bits 7…3, appeared in bits 1…0.
        (Request::AlarmAck(ACK), &[0x5C, 0x03, 0x01, 0x29]),
        (Request::Idle, &[0x48]),
        (
            Request::Initiate(initiate),
            &[
                0x57, 0x00, 0x00, 0x00, 0x00, 0x64, 0x01, 0x00, 0x00, 0x00, 0x3B, 0x00, 0x00, 0x02, 0x00, 0x02, 0x00,
                0x00, 0x00, 0x00,
            ],
        ),
        (Request::Abort(Abort::msac2(reason::TIMEOUT)), &[0x58, 0x00, 0x13]),
    ];
    for (request, octets) in table {
        assert_eq!(octets_of_request(&request), octets, "{request:?}");
        assert_eq!(Request::parse(octets), Ok(request));
    }
}

#[test]
fn responses_have_the_octets_of_the_standard() {
    let initiated = Initiated {
        max_data: 240,
        features: Features::READ_WRITE,
        profile_features: 0x0102,
        profile_ident: 0x3B00,
        addresses: Addresses::DIRECT,
    };
    let table: [(Reply<'_>, &[u8]); 9] = [
        (
            Reply::Read {
                slot: 0,
                index: 47,
                data: &[1, 2, 3, 4],
            },
            &[0x5E, 0x00, 0x2F, 0x04, 1, 2, 3, 4],
        ),
        (
            Reply::Written {
                slot: 0,
                index: 47,
                length: 10,
            },
            &[0x5F, 0x00, 0x2F, 0x0A],
        ),
        (
            Reply::DataTransport {
                slot: 2,
                index: 9,
                data: &[],
            },
            &[0x51, 0x02, 0x09, 0x00],
        ),
        (Reply::AlarmAck(ACK), &[0x5C, 0x03, 0x01, 0x29]),
        (Reply::Idle, &[0x48]),
        (
            Reply::Resource(Resource {
                sap: 48,
                send_timeout: SendTimeout(400),
            }),
            &[0x56, 0x30, 0x01, 0x90],
        ),
        (
            Reply::Initiated(initiated),
            &[
                0x57, 0xF0, 0x01, 0x00, 0x01, 0x02, 0x3B, 0x00, 0x00, 0x02, 0x00, 0x02, 0x00, 0x00, 0x00, 0x00,
            ],
        ),
        (Reply::Abort(Abort::user(3)), &[0x58, 0x00, 0x23]),
        (
            Reply::Negative {
                function: Function::Read,
                error: V1Error::new(ErrorCode1::INVALID_INDEX),
            },
            &[0xDE, 0x80, 0xB0, 0x00],
        ),
    ];
    for (reply, octets) in table {
        assert_eq!(octets_of_reply(&reply), octets, "{reply:?}");
        assert_eq!(Reply::parse(octets), Ok(reply));
    }
}

#[test]
fn an_address_in_another_network_carries_network_and_mac_address() {
    let addresses = Addresses {
        source: DeviceAddress::Remote {
            api: 1,
            scl: 2,
            network: [0, 1, 2, 3, 4, 5],
            mac: &[9, 8],
        },
        destination: DeviceAddress::Local { api: 7, scl: 0 },
    };
    let request = Request::Initiate(Initiate {
        send_timeout: SendTimeout(1000),
        features: Features::READ_WRITE,
        profile_features: 0,
        profile_ident: 0,
        addresses,
    });
    let octets = octets_of_request(&request);
    // S-Type 1, S-Len 8 + 2, D-Type 0, D-Len 2; API and SCL first, then network and MAC address.
    assert_eq!(octets[12..], [1, 10, 0, 2, 1, 2, 0, 1, 2, 3, 4, 5, 9, 8, 7, 0]);
    assert_eq!(Request::parse(&octets), Ok(request));
}

#[test]
fn what_is_no_pdu_is_told_by_cause() {
    let length = |function, got| Err(PduError::Length { function, got });
    assert_eq!(Request::parse(&[]), Err(PduError::Empty));
    assert_eq!(Request::parse(&[0x5D, 1, 2, 3]), Err(PduError::Function { got: 0x5D }));
    // The resource manager only answers, and a negative response is no request.
    assert_eq!(Request::parse(&[0x56, 48, 0, 1]), Err(PduError::Function { got: 0x56 }));
    assert_eq!(
        Request::parse(&[0xDE, 0x80, 0xB0, 0]),
        Err(PduError::Function { got: 0xDE })
    );
    assert_eq!(Request::parse(&[0x5E, 0, 1]), length(Function::Read, 3));
    assert_eq!(Request::parse(&[0x5E, 0, 1, 2, 3]), length(Function::Read, 5));
    assert_eq!(Request::parse(&[0x5F, 0, 1, 3, 9]), length(Function::Write, 5));
    assert_eq!(Request::parse(&[0x5F, 0, 1, 0, 9]), length(Function::Write, 5));
    assert_eq!(Request::parse(&[0x58, 0]), length(Function::Abort, 2));
    let initiate = [0x57, 0, 0, 0, 0, 100, 1, 0, 0, 0, 0, 0, 0, 2, 0, 2, 0, 0, 0, 0];
    assert!(Request::parse(&initiate).is_ok());
    assert_eq!(Request::parse(&initiate[..11]), length(Function::Initiate, 11));
    assert_eq!(Request::parse(&initiate[..19]), Err(PduError::Addresses));
    // S-Type 0 has two octets.
    let mut wrong = initiate;
    wrong[13] = 3;
    assert_eq!(Request::parse(&wrong), Err(PduError::Addresses));
    // 49 is the resource manager itself.
    assert_eq!(Reply::parse(&[0x56, 49, 0, 1]), Err(PduError::Sap { got: 49 }));
    let function = Function::Read;
    assert_eq!(
        Reply::parse(&[0xDE, 0x80, 0xB0]),
        Err(PduError::Length { function, got: 3 })
    );
}

#[test]
fn two_hundred_and_forty_octets_of_data_are_the_most() {
    let data = [0x5A; 241];
    let write = |data| Request::Write {
        slot: 1,
        index: 1,
        data,
    };
    assert_eq!(octets_of_request(&write(&data[..240])).len(), 244);
    assert_eq!(
        write(&data).encode(&mut [0; 300]),
        Err(EncodePduError { max: 240, got: 241 })
    );
    assert!(write(&data[..1]).encode(&mut [0; 4]).is_err());
}

/// An Initiate has 12 octets, types and lengths of the addresses 4, and these ones 2 + 8 + the MAC address; a telegram has room for 244.
#[test]
fn addresses_may_be_as_long_as_a_telegram() {
    let mac = [0x5A; 219];
    let initiate = |length| {
        let source = DeviceAddress::Remote {
            api: 1,
            scl: 2,
            network: [0; 6],
            mac: &mac[..length],
        };
        let destination = DeviceAddress::DEVICE;
        Request::Initiate(Initiate {
            send_timeout: SendTimeout(1000),
            features: Features::READ_WRITE,
            profile_features: 0,
            profile_ident: 0,
            addresses: Addresses { source, destination },
        })
    };
    assert_eq!(initiate(218).encode(&mut [0; 300]), Ok(244));
    let too_long = EncodePduError { max: 244, got: 245 };
    assert_eq!(initiate(219).encode(&mut [0; 300]), Err(too_long));
}

/// API, SCL, and network and MAC address of one in another network.
type AnyAddress = (u8, u8, Option<([u8; 6], Vec<u8>)>);

fn address() -> impl Strategy<Value = AnyAddress> {
    let network = proptest::option::of((any::<[u8; 6]>(), vec(any::<u8>(), 0..20)));
    (any::<u8>(), any::<u8>(), network)
}

fn device((api, scl, network): &AnyAddress) -> DeviceAddress<'_> {
    match network {
        None => DeviceAddress::Local { api: *api, scl: *scl },
        Some((network, mac)) => DeviceAddress::Remote {
            api: *api,
            scl: *scl,
            network: *network,
            mac,
        },
    }
}

proptest! {
    #[test]
    fn what_was_written_is_read_back(
        slot: u8, index: u8, length: u8, data in vec(any::<u8>(), 0..=240), words: [u16; 4], source in address(), destination in address(),
    ) {
        let addresses = Addresses { source: device(&source), destination: device(&destination) };
        let [timeout, features, profile_features, profile_ident] = words;
        let requests = [
            Request::Read { slot, index, length },
            Request::Write { slot, index, data: &data },
            Request::DataTransport { slot, index, data: &data },
            Request::Initiate(Initiate {
                send_timeout: SendTimeout(timeout), features: Features(features), profile_features, profile_ident, addresses,
            }),
        ];
        for request in requests {
            let octets = octets_of_request(&request);
            prop_assert_eq!(Request::parse(&octets), Ok(request));
        }
        let replies = [
            Reply::Read { slot, index, data: &data },
            Reply::Written { slot, index, length },
            Reply::DataTransport { slot, index, data: &data },
            Reply::Initiated(Initiated {
                max_data: length, features: Features(features), profile_features, profile_ident, addresses,
            }),
        ];
        for reply in replies {
            let octets = octets_of_reply(&reply);
            prop_assert_eq!(Reply::parse(&octets), Ok(reply));
        }
    }

    #[test]
    fn no_octets_make_the_reader_fall(octets in vec(any::<u8>(), 0..=246), function in 0x40..=0x60u8) {
        for first in [None, Some(function), Some(function | 0x80)] {
            let mut octets = octets.clone();
            if let (Some(first), Some(place)) = (first, octets.first_mut()) {
                *place = first;
            }
            // What is accepted can be written again, unless a length octet announced more than a telegram takes.
            if let Ok(request) = Request::parse(&octets) {
                let _ = request.encode(&mut [0; 300]);
            }
            if let Ok(reply) = Reply::parse(&octets) {
                let _ = reply.encode(&mut [0; 300]);
            }
        }
    }
}

/// Codes and names: "DPV1 Error Codes" of the Beckhoff EL6731 manual; class in the upper four bits.
#[test]
fn each_error_code_has_its_name_and_class() {
    let known = [
        (0xA0, "read error"),
        (0xA1, "write error"),
        (0xA2, "module failure"),
        (0xA8, "version conflict"),
        (0xA9, "feature not supported"),
        (0xB0, "invalid index"),
        (0xB1, "write length error"),
        (0xB2, "invalid slot"),
        (0xB3, "type conflict"),
        (0xB4, "invalid area"),
        (0xB5, "state conflict"),
        (0xB6, "access denied"),
        (0xB7, "invalid range"),
        (0xB8, "invalid parameter"),
        (0xB9, "invalid type"),
        (0xC0, "read constrain conflict"),
        (0xC1, "write constrain conflict"),
        (0xC2, "resource busy"),
        (0xC3, "resource unavailable"),
    ];
    for octet in 0..=255 {
        let name = known.iter().find(|(code, _)| *code == octet).map(|(_, name)| *name);
        let code = ErrorCode1(octet);
        assert_eq!((code.name(), code.code()), (name, octet & 0x0F), "{octet:02X}");
        let class = match octet >> 4 {
            0xA => ErrorClass::Application,
            0xB => ErrorClass::Access,
            0xC => ErrorClass::Resource,
            0xD..=0xF => ErrorClass::User,
            _ => ErrorClass::Reserved,
        };
        assert_eq!(code.class(), class, "{octet:02X}");
    }
}

//! Telegrams and the decoder against octets from the standard, by hand, and by property.

use dp_master::address::Address;
use dp_master::station::{LineError, MAX_TELEGRAM};
use dp_master::wire::{
    DecodeError, Decoded, Decoder, DiscardReason, EncodeError, Fcb, FunctionCode, Header, RequestFunction,
    ResponseFunction, StationType, Telegram, decode_one,
};
use proptest::prelude::*;

fn address(value: u8) -> Address {
    Address::new(value).unwrap()
}

fn encode(telegram: &Telegram<'_>) -> Vec<u8> {
    let mut buf = [0; MAX_TELEGRAM];
    let length = telegram.encode(&mut buf).unwrap();
    assert_eq!(length, telegram.encoded_len());
    buf[..length].to_vec()
}

fn srd_high(fcb: Fcb) -> FunctionCode {
    FunctionCode::request(fcb, RequestFunction::SrdHigh)
}

fn data_low() -> FunctionCode {
    FunctionCode::response(StationType::Slave, ResponseFunction::DataLow)
}

/// What a decoder says about a stream, without borrowing.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Said {
    Telegram(Vec<u8>),
    Discarded(DiscardReason, usize),
}

fn note(said: &mut Vec<Said>, decoded: Decoded<'_>) {
    said.push(match decoded {
        Decoded::Telegram(telegram) => Said::Telegram(encode(&telegram)),
        Decoded::Discarded { reason, octets } => Said::Discarded(reason, octets),
    });
}

fn decode_all(pieces: &[&[u8]]) -> Vec<Said> {
    let mut decoder = Decoder::new();
    let mut said = Vec::new();
    for piece in pieces {
        decoder.push(piece, |decoded| note(&mut said, decoded));
    }
    said
}

// --- octets known beforehand --------------------------------------------------------------------------------------------------------------

#[test]
fn telegrams_have_the_octets_of_the_standard() {
    let (master, slave) = (address(2), address(3));
    // Source of all layouts: IEC 61158-4-3. FCS by hand beside each.
    let cases: [(Telegram<'_>, &[u8]); 8] = [
        (Telegram::Token { da: master, sa: master }, &[0xDC, 0x02, 0x02]),
        (Telegram::ShortAck, &[0xE5]),
        // FDL status: 03 + 02 + 49 = 4E.
        (
            Telegram::no_data(
                slave,
                master,
                FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus),
            ),
            &[0x10, 0x03, 0x02, 0x49, 0x4E, 0x16],
        ),
        // Slave_Diag request, SRD high, first contact: 83 + 82 + 6D + 3C + 3E = 1EC.
        (
            Telegram::Data {
                header: Header::new(slave, master, srd_high(Fcb::First)).with_saps(60, 62),
                data: &[],
            },
            &[0x68, 0x05, 0x05, 0x68, 0x83, 0x82, 0x6D, 0x3C, 0x3E, 0xEC, 0x16],
        ),
        // Slave_Diag answer with six octets: 82 + 83 + 08 + 3E + 3C + 02 + 05 + 00 + FF + 00 + DA = 367.
        (
            Telegram::Data {
                header: Header::new(master, slave, data_low()).with_saps(62, 60),
                data: &[0x02, 0x05, 0x00, 0xFF, 0x00, 0xDA],
            },
            &[
                0xA2, 0x82, 0x83, 0x08, 0x3E, 0x3C, 0x02, 0x05, 0x00, 0xFF, 0x00, 0xDA, 0x67, 0x16,
            ],
        ),
        // Data_Exchange with eight octets 1…8: 03 + 02 + 7D + 24 = A6.
        (
            Telegram::Data {
                header: Header::new(slave, master, srd_high(Fcb::High)),
                data: &[1, 2, 3, 4, 5, 6, 7, 8],
            },
            &[0xA2, 0x03, 0x02, 0x7D, 1, 2, 3, 4, 5, 6, 7, 8, 0xA6, 0x16],
        ),
        // Global_Control to all, Clear: FF + 82 + 46 + 3A + 3E + 02 + 00 = 241.
        (
            Telegram::Data {
                header: Header::new(
                    Address::BROADCAST,
                    master,
                    FunctionCode::request(Fcb::Inactive, RequestFunction::SdnHigh),
                )
                .with_saps(58, 62),
                data: &[0x02, 0x00],
            },
            &[
                0x68, 0x07, 0x07, 0x68, 0xFF, 0x82, 0x46, 0x3A, 0x3E, 0x02, 0x00, 0x41, 0x16,
            ],
        ),
        // One octet of data, LE at its minimum: 02 + 03 + 08 + FF = 10C.
        (
            Telegram::Data {
                header: Header::new(master, slave, data_low()),
                data: &[0xFF],
            },
            &[0x68, 0x04, 0x04, 0x68, 0x02, 0x03, 0x08, 0xFF, 0x0C, 0x16],
        ),
    ];
    for (telegram, octets) in cases {
        assert_eq!(encode(&telegram), octets);
        assert_eq!(decode_one(octets), Ok((telegram, octets.len())));
    }
}

#[test]
fn data_of_7_and_9_octets_use_sd2_and_only_8_use_sd3() {
    for (length, start, total) in [(7, 0x68, 16), (8, 0xA2, 14), (9, 0x68, 18)] {
        let data = vec![0xAA; length];
        let octets = encode(&Telegram::Data {
            header: Header::new(address(3), address(2), data_low()),
            data: &data,
        });
        assert_eq!((octets[0], octets.len()), (start, total));
    }
}

#[test]
fn eight_octets_in_an_sd2_telegram_are_the_same_telegram() {
    let telegram = Telegram::Data {
        header: Header::new(address(3), address(2), data_low()),
        data: &[9; 8],
    };
    let mut buf = [0; MAX_TELEGRAM];
    let length = telegram.encode_without_sd3(&mut buf).unwrap();
    assert_eq!((buf[0], buf[1], length), (0x68, 11, 17));
    assert_eq!(decode_one(&buf[..length]), Ok((telegram, 17)));
}

#[test]
fn a_telegram_is_at_most_255_octets_long() {
    let header = Header::new(address(3), address(2), data_low());
    let mut buf = [0; MAX_TELEGRAM];
    let data = [0x5A; 247];
    assert_eq!(
        Telegram::Data {
            header,
            data: &data[..246]
        }
        .encode(&mut buf),
        Ok(255)
    );
    assert_eq!((buf[1], buf[2]), (249, 249));
    assert_eq!(
        Telegram::Data { header, data: &data }.encode(&mut buf),
        Err(EncodeError::DataTooLong { max: 246, got: 247 })
    );
    let header = header.with_saps(51, 51);
    assert_eq!(
        Telegram::Data {
            header,
            data: &data[..244]
        }
        .encode(&mut buf),
        Ok(255)
    );
    assert_eq!(
        Telegram::Data {
            header,
            data: &data[..245]
        }
        .encode(&mut buf),
        Err(EncodeError::DataTooLong { max: 244, got: 245 })
    );
}

#[test]
fn a_telegram_knows_from_whom_to_whom_unless_it_is_a_short_acknowledgement() {
    let (da, sa) = (address(3), address(2));
    for telegram in [Telegram::no_data(da, sa, data_low()), Telegram::Token { da, sa }] {
        assert_eq!((telegram.destination(), telegram.source()), (Some(da), Some(sa)));
    }
    assert_eq!(
        (Telegram::ShortAck.destination(), Telegram::ShortAck.source()),
        (None, None)
    );
}

#[test]
fn what_cannot_stand_on_the_wire_is_not_encoded() {
    let mut buf = [0; MAX_TELEGRAM];
    let header = Header::new(address(3), address(2), data_low());
    assert_eq!(
        Telegram::Data {
            header: header.with_saps(64, 62),
            data: &[]
        }
        .encode(&mut buf),
        Err(EncodeError::Sap { got: 64 })
    );
    let from_all = Header {
        sa: Address::BROADCAST,
        ..header
    };
    assert_eq!(
        Telegram::Data {
            header: from_all,
            data: &[]
        }
        .encode(&mut buf),
        Err(EncodeError::Broadcast)
    );
    assert_eq!(
        Telegram::Token {
            da: Address::BROADCAST,
            sa: address(2)
        }
        .encode(&mut buf),
        Err(EncodeError::Broadcast)
    );
}

// --- what is refused ----------------------------------------------------------------------------------------------------------------------

#[test]
fn each_fault_of_a_telegram_has_its_own_cause() {
    let good: [u8; 11] = [0x68, 0x05, 0x05, 0x68, 0x83, 0x82, 0x6D, 0x3C, 0x3E, 0xEC, 0x16];
    let with = |index: usize, octet: u8| {
        let mut octets = good;
        octets[index] = octet;
        octets
    };
    let cases = [
        (with(0, 0x67), DiscardReason::StartDelimiter { got: 0x67 }),
        (with(1, 0x03), DiscardReason::Length { got: 3 }),
        (with(1, 0xFA), DiscardReason::Length { got: 250 }),
        (with(2, 0x06), DiscardReason::LengthRepeat { le: 5, repeated: 6 }),
        (with(3, 0x60), DiscardReason::SecondStartDelimiter { got: 0x60 }),
        (
            with(9, 0xED),
            DiscardReason::Checksum {
                expected: 0xEC,
                got: 0xED,
            },
        ),
        (
            with(7, 0x3D),
            DiscardReason::Checksum {
                expected: 0xED,
                got: 0xEC,
            },
        ),
        (with(10, 0x17), DiscardReason::EndDelimiter { got: 0x17 }),
    ];
    for (octets, reason) in cases {
        assert_eq!(decode_one(&octets), Err(DecodeError::Corrupt(reason)), "{octets:02X?}");
    }
}

#[test]
fn addresses_and_access_points_that_cannot_be_are_refused() {
    // An extension without data (SD1 with bit 7): 83 + 02 + 49 = CE.
    assert_eq!(
        decode_one(&[0x10, 0x83, 0x02, 0x49, 0xCE, 0x16]),
        Err(DiscardReason::Address { got: 0x83 }.into())
    );
    // Source 127: 03 + 7F + 49 = CB.
    assert_eq!(
        decode_one(&[0x10, 0x03, 0x7F, 0x49, 0xCB, 0x16]),
        Err(DiscardReason::Address { got: 0x7F }.into())
    );
    // A token to 127, and addresses above.
    assert_eq!(
        decode_one(&[0xDC, 0x7F, 0x02]),
        Err(DiscardReason::Address { got: 0x7F }.into())
    );
    assert_eq!(
        decode_one(&[0xDC, 0x80, 0x02]),
        Err(DiscardReason::Address { got: 0x80 }.into())
    );
    assert_eq!(
        decode_one(&[0xDC, 0x02, 0xFF]),
        Err(DiscardReason::Address { got: 0xFF }.into())
    );
    // Two access points announced, one octet of data: 83 + 82 + 6D + 3C = 1AE.
    assert_eq!(
        decode_one(&[0x68, 0x04, 0x04, 0x68, 0x83, 0x82, 0x6D, 0x3C, 0xAE, 0x16]),
        Err(DiscardReason::SapMissing {
            announced: 2,
            available: 1
        }
        .into())
    );
    // Access point 64 (the address of another segment): 83 + 02 + 6D + 40 = 132.
    assert_eq!(
        decode_one(&[0x68, 0x04, 0x04, 0x68, 0x83, 0x02, 0x6D, 0x40, 0x32, 0x16]),
        Err(DiscardReason::Sap { got: 0x40 }.into())
    );
}

#[test]
fn a_prefix_that_no_octet_can_save_is_corrupt_at_once() {
    assert_eq!(
        decode_one(&[0x68, 0x05, 0x06]),
        Err(DiscardReason::LengthRepeat { le: 5, repeated: 6 }.into())
    );
    assert_eq!(
        decode_one(&[0x68, 0xFF]),
        Err(DiscardReason::Length { got: 255 }.into())
    );
    assert_eq!(decode_one(&[]), Err(DecodeError::Incomplete));
}

// --- resynchronisation --------------------------------------------------------------------------------------------------------------------

#[test]
fn a_valid_telegram_right_after_a_broken_one_is_found_in_the_same_buffer() {
    let token = [0xDC, 0x02, 0x02];
    let status = [0x10, 0x03, 0x02, 0x49, 0x4E, 0x16];
    let broken = [0x10, 0x03, 0x02, 0x49, 0x4F, 0x16];
    let stream = [&broken[..], &token, &status].concat();
    let reason = DiscardReason::Checksum {
        expected: 0x4E,
        got: 0x4F,
    };
    let expected = [
        Said::Discarded(reason, 6),
        Said::Telegram(token.to_vec()),
        Said::Telegram(status.to_vec()),
    ];
    assert_eq!(decode_all(&[&stream]), expected);
    // The same when it comes octet by octet.
    let pieces: Vec<&[u8]> = stream.chunks(1).collect();
    assert_eq!(decode_all(&pieces), expected);
}

#[test]
fn a_lost_octet_costs_one_telegram_and_not_the_one_that_fills_its_place() {
    let status = [0x10, 0x03, 0x02, 0x49, 0x4E, 0x16];
    // The FC is missing: the start of the next telegram is taken as the end of this one.
    let stream = [&[0x10, 0x03, 0x02, 0x4E, 0x16][..], &status].concat();
    assert_eq!(
        decode_all(&[&stream]),
        [
            // Sum of 03 02 4E is 53, the octet there is 16.
            Said::Discarded(
                DiscardReason::Checksum {
                    expected: 0x53,
                    got: 0x16
                },
                5
            ),
            Said::Telegram(status.to_vec())
        ]
    );
}

#[test]
fn a_wrong_length_does_not_swallow_the_token_behind_it() {
    assert_eq!(
        decode_all(&[&[0x68], &[0xDC, 0x02, 0x02]]),
        [
            Said::Discarded(
                DiscardReason::LengthRepeat {
                    le: 0xDC,
                    repeated: 0x02
                },
                1
            ),
            Said::Telegram(vec![0xDC, 0x02, 0x02])
        ]
    );
}

#[test]
fn rubbish_is_named_in_one_piece_up_to_the_next_start_delimiter() {
    assert_eq!(
        decode_all(&[&[0x00, 0xFF, 0x01, 0xE5]]),
        [
            Said::Discarded(DiscardReason::StartDelimiter { got: 0x00 }, 3),
            Said::Telegram(vec![0xE5])
        ]
    );
}

#[test]
fn a_line_error_gives_up_what_has_begun_and_counts_the_spoiled_character() {
    let mut decoder = Decoder::new();
    let mut said = Vec::new();
    decoder.push(&[0x10, 0x03, 0x02], |decoded| note(&mut said, decoded));
    assert_eq!(decoder.pending(), 3);
    decoder.push_line_error(LineError::Parity, |decoded| note(&mut said, decoded));
    assert_eq!(said, [Said::Discarded(DiscardReason::Line(LineError::Parity), 4)]);
    assert!(!decoder.is_synchronised());
    said.clear();
    decoder.push_line_error(LineError::Framing, |decoded| note(&mut said, decoded));
    assert_eq!(said, [Said::Discarded(DiscardReason::Line(LineError::Framing), 1)]);
}

#[test]
fn a_line_error_does_not_cost_the_whole_telegram_inside_a_false_one() {
    let mut decoder = Decoder::new();
    let mut said = Vec::new();
    // A false SD2 header that would wait for 255 octets, then a token, then the beginning of a telegram that is spoiled.
    decoder.push(&[0x68, 0xF9, 0xF9, 0x68, 0xDC, 0x02, 0x03, 0x10, 0x03], |decoded| {
        note(&mut said, decoded)
    });
    assert!(said.is_empty());
    decoder.push_line_error(LineError::Framing, |decoded| note(&mut said, decoded));
    let line = DiscardReason::Line(LineError::Framing);
    assert_eq!(
        said,
        [
            Said::Discarded(line, 3),
            // The second start delimiter of the false header: LE would be DC, LEr 02.
            Said::Discarded(
                DiscardReason::LengthRepeat {
                    le: 0xDC,
                    repeated: 0x02
                },
                1
            ),
            Said::Telegram(vec![0xDC, 0x02, 0x03]),
            Said::Discarded(line, 3),
        ]
    );
}

#[test]
fn idle_drops_a_partial_telegram_and_restores_synchronism() {
    let mut decoder = Decoder::new();
    let mut said = Vec::new();
    decoder.push(&[0x00, 0x68, 0x05, 0x05], |decoded| note(&mut said, decoded));
    assert!(!decoder.is_synchronised());
    assert_eq!(decoder.idle(), 3);
    assert!(decoder.is_synchronised());
    said.clear();
    decoder.push(&[0xDC, 0x02, 0x02], |decoded| note(&mut said, decoded));
    assert_eq!(said, [Said::Telegram(vec![0xDC, 0x02, 0x02])]);
}

#[test]
fn the_end_of_a_stream_names_what_was_not_complete() {
    let mut decoder = Decoder::new();
    let mut said = Vec::new();
    decoder.push(&[0x68, 0xF9, 0xF9, 0x68, 0xE5, 0x01], |decoded| {
        note(&mut said, decoded)
    });
    decoder.finish(|decoded| note(&mut said, decoded));
    assert_eq!(
        said,
        [
            Said::Discarded(DiscardReason::Truncated, 3),
            Said::Discarded(
                DiscardReason::LengthRepeat {
                    le: 0xE5,
                    repeated: 0x01
                },
                1
            ),
            Said::Telegram(vec![0xE5]),
            Said::Discarded(DiscardReason::StartDelimiter { got: 0x01 }, 1),
        ]
    );
    assert_eq!(decoder.pending(), 0);
}

#[test]
fn no_false_telegram_with_one_or_two_flipped_bits_is_accepted() {
    // Every telegram kind, every pair of flipped bits in one or two octets. Where the parity bit would notice it is up to the receiver; what
    // is left for the octets is: never a different telegram of the same length.
    let telegrams: [&[u8]; 4] = [
        &[0x10, 0x03, 0x02, 0x49, 0x4E, 0x16],
        &[0x68, 0x05, 0x05, 0x68, 0x83, 0x82, 0x6D, 0x3C, 0x3E, 0xEC, 0x16],
        &[0xA2, 0x03, 0x02, 0x7D, 1, 2, 3, 4, 5, 6, 7, 8, 0xA6, 0x16],
        &[0x68, 0x04, 0x04, 0x68, 0x02, 0x03, 0x08, 0xFF, 0x0C, 0x16],
    ];
    for telegram in telegrams {
        let (original, _) = decode_one(telegram).unwrap();
        let bits = telegram.len() * 8;
        for first in 0..bits {
            for second in first..bits {
                let mut octets = telegram.to_vec();
                octets[first / 8] ^= 1 << (first % 8);
                if second != first {
                    octets[second / 8] ^= 1 << (second % 8);
                }
                // Two flips in different octets are each a parity error; the decoder never sees those octets.
                if first / 8 != second / 8 {
                    let mut decoder = Decoder::new();
                    let mut accepted = 0;
                    for (index, octet) in telegram.iter().enumerate() {
                        if index == first / 8 || index == second / 8 {
                            decoder.push_line_error(LineError::Parity, |_| ());
                        } else {
                            decoder.push(&[*octet], |decoded| {
                                accepted += usize::from(matches!(decoded, Decoded::Telegram(_)))
                            });
                        }
                    }
                    assert_eq!(accepted, 0, "{telegram:02X?} with bits {first} and {second}");
                    continue;
                }
                if let Ok((found, length)) = decode_one(&octets) {
                    assert!(
                        length < telegram.len() && found != original,
                        "{octets:02X?} is taken for {found:?}"
                    );
                    // Only a start delimiter that became another one could do that.
                    assert_eq!(first / 8, 0);
                }
            }
        }
    }
}

// --- properties ---------------------------------------------------------------------------------------------------------------------------

fn any_station() -> impl Strategy<Value = Address> {
    (0_u8..=126).prop_map(|value| Address::new(value).unwrap())
}

fn any_header() -> impl Strategy<Value = Header> {
    let sap = || prop::option::of(0_u8..=63);
    (0_u8..=127, any_station(), sap(), sap(), any::<u8>()).prop_map(|(da, sa, dsap, ssap, fc)| Header {
        da: Address::from_wire(da).unwrap(),
        sa,
        dsap,
        ssap,
        fc: FunctionCode::from_octet(fc),
    })
}

/// Octets of any valid telegram, short ones more often.
fn any_telegram() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        Just(vec![0xE5]),
        (any_station(), any_station()).prop_map(|(da, sa)| encode(&Telegram::Token { da, sa })),
        (
            any_header(),
            prop_oneof![
                prop::collection::vec(any::<u8>(), 0..=20),
                prop::collection::vec(any::<u8>(), 0..=244)
            ]
        )
            .prop_map(|(header, data)| encode(&Telegram::Data { header, data: &data })),
    ]
}

proptest! {
    #[test]
    fn decoding_an_encoded_telegram_gives_it_back(header in any_header(), data in prop::collection::vec(any::<u8>(), 0..=244)) {
        let telegram = Telegram::Data { header, data: &data };
        let octets = encode(&telegram);
        prop_assert_eq!(decode_one(&octets), Ok((telegram, octets.len())));
        let mut buf = [0; MAX_TELEGRAM];
        let length = telegram.encode_without_sd3(&mut buf).unwrap();
        prop_assert_eq!(decode_one(&buf[..length]), Ok((telegram, length)));
    }

    #[test]
    fn every_proper_prefix_of_a_valid_telegram_is_incomplete(octets in any_telegram()) {
        for length in 0..octets.len() {
            prop_assert_eq!(decode_one(&octets[..length]), Err(DecodeError::Incomplete), "first {} of {:02X?}", length, octets);
        }
    }

    #[test]
    fn octets_behind_a_telegram_do_not_change_it(octets in any_telegram(), tail in prop::collection::vec(any::<u8>(), 0..40)) {
        let whole = [&octets[..], &tail].concat();
        prop_assert_eq!(decode_one(&whole), decode_one(&octets));
    }

    #[test]
    fn a_single_wrong_octet_is_never_accepted_in_its_place(octets in any_telegram(), index in any::<prop::sample::Index>(), flip in 1_u8..) {
        let index = index.index(octets.len());
        // Tokens and SC have no check but their parity; another start delimiter is another telegram.
        prop_assume!(octets.len() > 3 && index > 0);
        let mut wrong = octets.clone();
        wrong[index] ^= flip;
        prop_assert!(matches!(decode_one(&wrong), Err(DecodeError::Corrupt(_)) | Err(DecodeError::Incomplete)), "{:02X?}", wrong);
    }

    #[test]
    fn a_stream_of_telegrams_is_decoded_alike_in_pieces_of_any_size(
        telegrams in prop::collection::vec(any_telegram(), 1..8),
        cuts in prop::collection::vec(1_usize..60, 1..8),
    ) {
        let stream = telegrams.concat();
        let mut pieces: Vec<&[u8]> = Vec::new();
        let mut rest = &stream[..];
        for cut in cuts.iter().cycle() {
            if rest.is_empty() { break; }
            let (piece, tail) = rest.split_at((*cut).min(rest.len()));
            pieces.push(piece);
            rest = tail;
        }
        let said = decode_all(&pieces);
        let expected: Vec<Said> = telegrams.iter().map(|octets| Said::Telegram(octets.clone())).collect();
        prop_assert_eq!(said, expected);
    }

    /// Every octet is accounted for exactly once, whatever comes in and however it is cut; and the pieces do not matter.
    #[test]
    fn rubbish_never_panics_and_every_octet_is_accounted_for(
        stream in prop::collection::vec(prop_oneof![
            any::<u8>(),
            prop::sample::select(&[0x10_u8, 0x68, 0xA2, 0xDC, 0xE5, 0x16, 0x04, 0x05][..]),
        ], 0..600),
        cut in 1_usize..50,
    ) {
        let run = |size: usize| {
            let mut decoder = Decoder::new();
            let mut accounted = 0;
            let mut telegrams = Vec::new();
            let mut count = |decoded: Decoded<'_>| match decoded {
                Decoded::Telegram(telegram) => {
                    let mut buf = [0; MAX_TELEGRAM];
                    // An SD2 with eight octets of data is written as SD3: count what the data say.
                    let length = telegram.encode(&mut buf).unwrap();
                    telegrams.push(buf[..length].to_vec());
                    accounted += if length == 14 { 0 } else { length };
                }
                Decoded::Discarded { octets, .. } => accounted += octets,
            };
            for piece in stream.chunks(size) {
                decoder.push(piece, &mut count);
            }
            decoder.finish(&mut count);
            (accounted, telegrams)
        };
        let (accounted, telegrams) = run(cut);
        let eights = telegrams.iter().filter(|telegram| telegram.len() == 14).count();
        prop_assert!(accounted + 14 * eights <= stream.len() && stream.len() <= accounted + 17 * eights);
        prop_assert_eq!(run(600).1, telegrams);
    }

    #[test]
    fn a_telegram_behind_a_broken_one_is_always_found_after_the_line_was_idle(
        broken in prop::collection::vec(any::<u8>(), 0..300),
        octets in any_telegram(),
    ) {
        let mut decoder = Decoder::new();
        decoder.push(&broken, |_| ());
        decoder.idle();
        let mut said = Vec::new();
        decoder.push(&octets, |decoded| note(&mut said, decoded));
        prop_assert_eq!(said, vec![Said::Telegram(octets)]);
    }
}

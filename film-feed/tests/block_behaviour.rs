//! What follows from the code of the block, cycle by cycle: one test for each point of the film-feed specification, section 8.1.

mod block_support;

use std::collections::BTreeSet;

use block_support::{Access, Bench, Drive, PAR, PZD, code};
use film_feed::block::ParameterTelegram;

/// REAL "not a number"; see `PARITY.md`.
const NAN: u32 = 0xFFFF_FFFF;

fn numbers(bench: &Bench) -> [i16; 4] {
    let inputs = &bench.inputs;
    [
        inputs.velocity,
        inputs.mark_velocity,
        inputs.acceleration,
        inputs.distance,
    ]
}

fn fired(bench: &Bench) -> Vec<u8> {
    bench.block.fired().iter().collect()
}

/// Code and subindex of the requests the drive has served.
fn served(bench: &Bench) -> Vec<(u16, u8)> {
    bench
        .drive
        .served
        .iter()
        .map(|request| (code(request), request.subindex))
        .collect()
}

/// One round: film-feed specification, section 8 step 11.
const ROUND: [(u16, u8); 7] = [
    (1302, 1),
    (1302, 2),
    (1303, 1),
    (1301, 1),
    (1204, 0),
    (1202, 0),
    (1203, 0),
];

/// Point 1.
#[test]
fn a_negative_distance_becomes_the_maximum_and_negative_percentages_the_minimum() {
    let mut bench = Bench::new();
    for negative in [-1, -12_000, i16::MIN] {
        bench.inputs.velocity = negative;
        bench.inputs.mark_velocity = negative;
        bench.inputs.acceleration = negative;
        bench.inputs.distance = negative;
        bench.step();
        assert_eq!(numbers(&bench), [1_000, 1_000, 1_000, 20_000]);
    }
}

/// Point 2.
#[test]
fn a_mark_velocity_once_cut_stays_cut_until_the_caller_writes_it_anew() {
    let mut bench = Bench::new();
    (bench.inputs.velocity, bench.inputs.mark_velocity) = (2_000, 5_000);
    bench.step();
    assert_eq!(bench.inputs.mark_velocity, 2_000);
    bench.inputs.velocity = 9_000;
    bench.step();
    assert_eq!(numbers(&bench)[..2], [9_000, 2_000]);
    bench.inputs.mark_velocity = 5_000;
    bench.step();
    assert_eq!(numbers(&bench)[..2], [9_000, 5_000]);
    // The bound is the clamped velocity, not the one written.
    (bench.inputs.velocity, bench.inputs.mark_velocity) = (20_000, 30_000);
    bench.step();
    assert_eq!(numbers(&bench)[..2], [10_000, 10_000]);
}

/// Point 3.
#[test]
fn inputs_never_written_send_the_minimum_from_the_first_cycle_on() {
    let mut bench = Bench::new();
    bench.step();
    assert_eq!(numbers(&bench), [1_000, 1_000, 1_000, 2_000]);
    // C1302/1, index 24575 − 1302 = 0x5AE9, 10.0000 % = 100 000; handshake 1.
    assert_eq!(
        bench.drive.request.to_bytes(),
        [0x72, 1, 0x5A, 0xE9, 0, 0x01, 0x86, 0xA0]
    );
    bench.run(12);
    let data: Vec<_> = bench.drive.served.iter().take(4).map(|request| request.data).collect();
    // 10 %, 10 %, 10 % and 200.0 mm, each with four decimals.
    assert_eq!(data, [100_000, 100_000, 100_000, 2_000_000]);
}

/// Point 4.
#[test]
fn the_seven_telegrams_go_round_for_ever_and_their_handshake_alternates_from_round_to_round() {
    let mut bench = Bench::new();
    bench.run(4 * 21 + 1);
    assert_eq!(served(&bench), ROUND.repeat(4));
    for (index, request) in bench.drive.served.iter().enumerate() {
        // Seven is odd: with handshake 1 first, telegram n of round r has handshake 1 if n + r is even.
        let handshake = (index % 7 + index / 7) % 2 == 0;
        // Section 3: 0x31 reads and 0x32 writes four octets, bit 6 is the handshake.
        let service = if index % 7 < 4 { 0x32 } else { 0x31 } | if handshake { 0x40 } else { 0 };
        assert_eq!(request.service, service, "request {index}");
    }
}

/// Point 5.
#[test]
fn an_exchange_takes_three_cycles_and_the_delay_of_the_answer() {
    let write_high: [&[u8]; 3] = [&[1, 2, 4, 6, 7, 13], &[2, 13], &[2, 9, 11, 12, 13]];
    let write_low: [&[u8]; 3] = [&[2, 4, 5, 7, 13], &[2, 13], &[2, 8, 11, 12, 13]];
    let read_high: [&[u8]; 3] = [&[2, 3, 6, 7, 13], &[2, 13], &[2, 9, 10, 12, 13]];
    let mut bench = Bench::new();
    for cycle in write_high.iter().chain(&write_low) {
        bench.step();
        assert_eq!(fired(&bench), **cycle, "cycle {}", bench.cycle);
    }
    bench.run_to(12);
    for cycle in read_high {
        bench.step();
        assert_eq!(fired(&bench), cycle, "cycle {}", bench.cycle);
    }
    for delay in 0..5 {
        let mut bench = Bench::with(Drive {
            delay,
            ..Drive::default()
        });
        for exchange in 1..=14 {
            bench.run_to(exchange * (3 + delay));
            assert!(bench.block.fired().fired(12), "exchange {exchange}, delay {delay}");
            assert_eq!(u32::from(bench.block.telegram_counter()), exchange % 7);
        }
    }
    // The counter shows 0 one cycle before the pointer returns to the first telegram (octet 22).
    let mut bench = Bench::new();
    bench.run(20);
    assert_eq!(
        (bench.block.telegram_counter(), bench.block.telegram_pointer()),
        (6, 22 + 6 * 8)
    );
    bench.step();
    assert_eq!(
        (bench.block.telegram_counter(), bench.block.telegram_pointer()),
        (0, 22 + 6 * 8)
    );
    bench.step();
    assert_eq!(
        (bench.block.telegram_counter(), bench.block.telegram_pointer()),
        (0, 22)
    );
}

/// Three cycles for an exchange, as above. Its last takes the answer and shows the next telegram; behind the seventh the pointer returns
/// one cycle later.
#[test]
fn the_telegram_at_work_is_the_one_that_is_exchanged() {
    let mut bench = Bench::new();
    assert_eq!(
        (bench.block.telegram_at_work(), bench.block.exchange_is_done()),
        (0, false)
    );
    for cycle in 1..=42 {
        bench.step();
        let shown = if cycle % 21 == 0 { 6 } else { cycle / 3 % 7 };
        let expected = (shown, cycle % 3 == 0);
        let got = (bench.block.telegram_at_work(), bench.block.exchange_is_done());
        assert_eq!(got, expected, "cycle {cycle}");
    }
}

/// Point 6.
#[test]
fn parameter_data_is_read_before_it_is_written_and_not_exchanged_under_error_reset() {
    use Access::{Read, Write};
    let mut bench = Bench::new();
    bench.step();
    assert_eq!(bench.drive.log, [Read(PZD), Write(PZD), Read(PAR), Write(PAR)]);
    let request = bench.drive.request;
    bench.inputs.error_reset = true;
    for _ in 0..3 {
        bench.step();
        assert_eq!(bench.drive.log, [Read(PZD), Write(PZD)]);
    }
    // The request stays on the bus, and the drive has answered; the received image is still that of power-up.
    assert_eq!(bench.drive.request, request);
    assert!(bench.drive.answer.handshake());
    assert_eq!(bench.block.parameter_received(), ParameterTelegram::default());
    bench.inputs.error_reset = false;
    bench.step();
    assert_eq!(bench.block.parameter_received(), bench.drive.answer);
    assert_eq!(bench.block.parameter_sent(), bench.drive.request);
    assert_ne!(bench.drive.answer, ParameterTelegram::default());
}

/// Point 7.
#[test]
fn after_an_error_reset_at_counter_k_the_round_has_seven_less_k_telegrams() {
    for k in 0..7_u16 {
        let mut bench = Bench::new();
        // The cycle in which the counter has just become k, with nothing on its way.
        bench.run_to(u32::from(k) * 3);
        assert_eq!(bench.block.telegram_counter(), k);
        bench.inputs.error_reset = true;
        bench.step();
        assert_eq!((bench.block.telegram_counter(), bench.places()), (k, vec![1, 10]));
        bench.inputs.error_reset = false;
        bench.drive.served.clear();
        bench.run(40);
        let length = usize::from(7 - k);
        let expected: Vec<_> = ROUND[..length].iter().chain(&ROUND).copied().collect();
        let count = expected.len().min(bench.drive.served.len());
        assert!(count > length, "counter {k}");
        assert_eq!(served(&bench)[..count], expected[..count], "counter {k}");
        // With k ≥ 3 the reads are left out of that round.
        assert_eq!(ROUND[..length].iter().any(|(_, subindex)| *subindex == 0), k < 3);
    }
    // A reset during a handshake: the drive has seen handshake 1 already, so telegram 0 is counted without being delivered.
    let mut bench = Bench::new();
    bench.run_to(3 * 2 + 1);
    bench.inputs.error_reset = true;
    bench.step();
    bench.inputs.error_reset = false;
    bench.drive.served.clear();
    bench.run(16);
    assert_eq!(served(&bench)[..4], ROUND[1..5]);
}

/// Point 8.
#[test]
fn a_drive_beginning_with_handshake_1_never_gets_telegram_0_and_a_swallowed_request_hangs() {
    let mut bench = Bench::with(Drive::beginning_with_handshake_1());
    bench.run(21);
    assert_eq!(served(&bench)[..6], ROUND[1..]);

    let mut bench = Bench::with(Drive {
        swallow: 1,
        ..Drive::default()
    });
    bench.run(1_000);
    assert_eq!((bench.places(), bench.block.telegram_counter()), (vec![6, 7, 10], 0));
    bench.inputs.error_reset = true;
    bench.step();
    assert_eq!(bench.places(), [1, 10]);
    bench.inputs.error_reset = false;
    bench.run(1_000);
    assert_eq!((bench.places(), bench.block.telegram_counter()), (vec![6, 7, 10], 0));
    assert!(bench.drive.served.is_empty());
}

/// Point 9.
#[test]
fn an_error_code_is_stored_as_the_constant_and_a_vanished_answer_as_zero() {
    let mut bench = Bench::with(Drive {
        error: Some((1204, 0x0605_0010)),
        ..Drive::default()
    });
    bench.run(15);
    assert_eq!(bench.block.telegrams()[4].data, 0x0605_0010);
    // Read requests carry the data of the last write: 200.0 mm.
    let (read, write) = (bench.drive.served[4], bench.drive.served[3]);
    assert_eq!((code(&read), read.data), (1204, 2_000_000));
    assert_eq!((code(&write), write.data), (1301, 2_000_000));

    // Telegram 5 (C1202) has handshake 0; an image of zeros passes for its answer.
    let mut bench = Bench::new();
    bench.run_to(16);
    assert_eq!(bench.places(), [5, 6, 10]);
    bench.drive.dead = true;
    bench.run(2);
    assert_eq!(bench.block.telegram_counter(), 6);
    assert_eq!(bench.block.telegrams()[5].data, 0);
}

/// Point 10.
#[test]
fn written_data_is_what_it_was_when_t4_fired() {
    let mut bench = Bench::with(Drive {
        delay: 5,
        ..Drive::default()
    });
    bench.inputs.velocity = 4_000;
    bench.step();
    assert!(bench.block.fired().fired(4));
    bench.inputs.velocity = 5_000;
    bench.run(3);
    assert_eq!(bench.block.telegrams()[0].data, 500_000);
    assert_eq!(bench.drive.request.data, 400_000);
    bench.run(5);
    assert_eq!(bench.drive.served[0].data, 400_000);
}

/// Point 11.
#[test]
fn a_constant_reaches_the_position_four_cycles_after_its_request() {
    let mut bench = Bench::with(Drive {
        position: 7 * 65_536,
        ..Drive::default()
    });
    // Telegram 6 (C1203), the last of the three, is requested in cycle 1 + 3·6.
    let k = 19;
    // C1202, requested three cycles before it, ends the 0/0; until C1203 arrives the position is a product with zero.
    bench.run_to(k);
    assert_eq!(bench.block.outputs().position_mm.to_bits(), NAN);
    assert_eq!(code(&bench.drive.request), 1203);
    bench.run_to(k + 1);
    assert_eq!(bench.block.telegrams()[6].data, 0);
    bench.run_to(k + 2);
    assert_eq!(bench.block.telegrams()[6].data, 10_000);
    assert_eq!(bench.block.constants().gear_denominator, 0.0);
    bench.run_to(k + 3);
    assert_eq!(bench.block.constants().gear_denominator, 1.0);
    assert_eq!(bench.block.outputs().position_mm, 0.0);
    // ((7 · 65536 / 65536) · 179.0708) / 7 · 1 with every step rounded to REAL (worked out apart from this program).
    assert_eq!(bench.step().position_mm.to_bits(), 0x4333_1220);
    for (position, bits) in [
        (3_074_216, 0x4495_FFFF),
        (-3_074_216, 0xC495_FFFF),
        (1, 0x39CC_A700),
        (i32::MAX, 0x494C_A700),
        // Above 2^24 the low bits go.
        (1 << 24, 0x45CC_A700),
        ((1 << 24) + 1, 0x45CC_A700),
    ] {
        bench.drive.position = position;
        assert_eq!(bench.step().position_mm.to_bits(), bits, "position {position}");
    }
}

/// Point 12.
#[test]
fn the_speed_word_is_sign_extended() {
    let mut bench = Bench::new();
    // 32767 / 16384 · 100 in REAL: 1.99993896484375 is exact, the product is rounded.
    for (word, percent) in [
        (0, 0.0),
        (0x4000, 100.0),
        (0xC000, -100.0),
        (0x8000, -200.0),
        (0x7FFF, 199.993_9),
        (0xFFFF, -0.006_103_515_6),
    ] {
        bench.drive.speed = word;
        assert_eq!(bench.step().speed_percent, percent, "word {word:#06x}");
    }
}

/// Point 13.
#[test]
fn switch_on_follows_ready_or_fault_and_a_start_held_at_power_up_makes_no_edge() {
    let mut bench = Bench::new();
    for status in [0x0000, 0x0001, 0x0008, 0x0009, 0x0240, 0x0231, 0xFFFF, 0xFFF6] {
        bench.drive.status = status;
        bench.step();
        assert_eq!(bench.control(0), status & 0x0009 != 0, "status {status:#06x}");
        assert!([1, 2, 4].iter().all(|bit| bench.control(*bit)));
        assert_eq!(bench.block.control_word(), bench.drive.control);
    }
    let mut bench = Bench::new();
    bench.inputs.pos_start = true;
    for _ in 0..5 {
        bench.step();
        assert!(!bench.control(5));
    }
}

/// Point 14.
#[test]
fn an_error_that_appears_while_start_is_low_makes_a_start_edge() {
    // Message, fault, warning, bit 12: each one is an error (section 8 step 2).
    for error in [0x0100, 0x0008, 0x0080, 0x1000] {
        let mut bench = Bench::new();
        bench.step();
        assert!(bench.control(5));
        bench.drive.status |= error;
        assert!(bench.step().error);
        assert!(!bench.control(5), "status bit {error:#06x}");
    }
}

/// Point 15.
#[test]
fn error_reset_stops_the_parameter_net_even_while_running_keeps_the_reset_bit_low() {
    let mut bench = Bench::new();
    bench.run(2);
    bench.drive.status |= 0x4000;
    bench.inputs.error_reset = true;
    bench.step();
    assert!(!bench.control(7) && !bench.control(11));
    assert_eq!((bench.places(), fired(&bench)), (vec![1, 10], vec![]));
    // With a fault, or without RUNNING, bit 7 is set and sets bit 11 with it.
    for status in [0x4008, 0x0000, 0x0008] {
        bench.drive.status = status;
        bench.step();
        assert!(bench.control(7) && bench.control(11), "status {status:#06x}");
    }
    bench.inputs.error_reset = false;
    bench.inputs.pos_stop = true;
    bench.step();
    assert!(!bench.control(7) && bench.control(11) && !bench.control(6));
}

/// Point 16.
#[test]
fn manual_mode_is_not_interlocked() {
    let mut bench = Bench::new();
    bench.inputs.manual_pos = true;
    bench.inputs.manual_neg = true;
    bench.step();
    assert_eq!([12, 13, 14].map(|bit| bench.control(bit)), [false, true, true]);
    // Manual mode does not keep the program from being started.
    bench.inputs.manual = true;
    bench.step();
    assert!(bench.control(12) && bench.control(5));
    bench.inputs.pos_start = true;
    bench.step();
    assert!(bench.control(12) && !bench.control(5));
}

/// Point 17.
#[test]
fn the_net_stays_safe_and_ends_its_cycles_in_four_markings() {
    const INVARIANTS: [&[u8]; 3] = [&[10, 11], &[1, 2, 3, 4, 6, 8, 9], &[1, 2, 3, 5, 7, 8, 9]];
    let mut ends = BTreeSet::new();
    for (delay, first) in [(0, false), (1, false), (3, true), (0, true)] {
        let drive = if first {
            Drive::beginning_with_handshake_1()
        } else {
            Drive::default()
        };
        let mut bench = Bench::with(Drive { delay, ..drive });
        for cycle in 0..600 {
            bench.inputs.error_reset = cycle % 41 == 40;
            bench.step();
            let places = bench.places();
            for sum in INVARIANTS {
                assert_eq!(
                    places.iter().filter(|place| sum.contains(*place)).count(),
                    1,
                    "{places:?}"
                );
            }
            ends.insert(places);
        }
        // Live: the drive answers, so the round comes back to every telegram.
        bench.inputs.error_reset = false;
        bench.drive.served.clear();
        bench.run(200);
        let served = served(&bench);
        assert!(
            ROUND
                .iter()
                .all(|telegram| served.iter().filter(|one| *one == telegram).count() > 2)
        );
    }
    assert_eq!(
        ends,
        BTreeSet::from([vec![1, 10], vec![2, 10], vec![5, 6, 10], vec![6, 7, 10]])
    );

    // A drive that falls silent while handshake 1 is awaited rests the net in {6, 7}, otherwise in {5, 6}.
    for (exchanges, rest) in [(0, [6, 7, 10]), (1, [5, 6, 10])] {
        let mut bench = Bench::new();
        bench.run(3 * exchanges);
        bench.drive.delay = u32::MAX;
        bench.run(500);
        assert_eq!(bench.places(), rest);
    }
}

/// Section 7 and section 8 step 2: which output each bit of the status word makes, alone.
#[test]
fn each_bit_of_the_status_word_makes_its_output_and_no_other() {
    for bit in 0..16 {
        let mut bench = Bench::new();
        bench.drive.status = 1 << bit;
        let outputs = bench.step();
        let made = [
            outputs.switched_on,
            outputs.drive_ready,
            outputs.error,
            outputs.running,
            outputs.job_finished,
        ];
        // DRIVECOM: 1 switched on, 2 operation enabled, 3 fault, 7 warning, 8 message.
        let expected = [bit == 1, bit == 2, [3, 7, 8, 12].contains(&bit), bit == 14, bit == 15];
        assert_eq!(made, expected, "bit {bit}");
    }
}

/// Section 8 steps 5 to 9, as they are printed, over all inputs and the four bits of the status word they ask for.
#[test]
fn the_control_word_is_the_formula_of_the_steps_for_all_inputs() {
    for case in 0..1u32 << 12 {
        let is = |number: u32| case >> number & 1 == 1;
        let [ready, fault, running, bit_12] = [is(0), is(1), is(2), is(3)];
        let mut bench = Bench::new();
        bench.drive.status =
            u16::from(ready) | u16::from(fault) << 3 | u16::from(bit_12) << 12 | u16::from(running) << 14;
        bench.inputs.read_mark = is(4);
        bench.inputs.manual = is(5);
        bench.inputs.manual_pos = is(6);
        bench.inputs.manual_neg = is(7);
        bench.inputs.pos_start = is(8);
        bench.inputs.pos_stop = is(9);
        bench.inputs.error_reset = is(10);
        bench.inputs.enable = is(11);
        bench.step();
        let error = fault || bit_12;
        let reset = (fault || !running) && is(10);
        let expected = [
            (0, ready || fault),
            (1, true),
            (2, true),
            (3, is(11)),
            (4, true),
            (5, !is(8) && !error),
            (6, !is(9)),
            (7, reset),
            (11, is(9) || reset),
            (12, is(5)),
            (13, is(7)),
            (14, is(6)),
            (15, is(4)),
        ];
        let word = expected
            .iter()
            .fold(0u16, |word, (bit, on)| word | u16::from(*on) << bit);
        assert_eq!(bench.drive.control, word, "case {case:012b}");
    }
}

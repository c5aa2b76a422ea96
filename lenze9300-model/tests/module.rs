//! The PROFIBUS module EMF2133IB between bus and drive, octet by octet.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

mod bus_bench;

use bus_bench::{Bench, LOCK, Reply, UNLOCK};
use dp_master::wire::ResponseFunction;
use drivecom::{ControlWord, State};
use lenze9300_model::bus::dp::{Emf2133Config, PAR_AND_FOUR_WORDS};
use lenze9300_model::code::{CodeStore, Inhibit};
use lenze9300_model::device::{DriveConfig, Fault};
use lenze9300_model::traverse::{Mode, Program, Record, Target};

/// A module that passes process data on at once, so that a test can count its own milliseconds.
fn direct() -> Emf2133Config {
    Emf2133Config {
        process_data_delay_ms: 0,
        ..Emf2133Config::default()
    }
}

/// In data exchange with the configuration of the thesis; the drive's self test is over.
fn exchanging(config: Emf2133Config, watchdog: Option<u16>) -> Bench {
    let mut bench = Bench::new(config, DriveConfig::default());
    bench.steps(200);
    bench.start_up(PAR_AND_FOUR_WORDS, watchdog);
    bench
}

/// Outputs with an idle parameter channel.
fn outputs(control_word: u16) -> [u8; 16] {
    request([0; 8], control_word)
}

fn request(parameters: [u8; 8], control_word: u16) -> [u8; 16] {
    let mut outputs = [0; 16];
    outputs[..8].copy_from_slice(&parameters);
    outputs[8..10].copy_from_slice(&control_word.to_be_bytes());
    outputs
}

/// By 0x0076, 0x0077 and 0x007F to operation enabled (9300 facts 2.3).
fn enable(bench: &mut Bench) {
    for control_word in [0x0076, 0x0077, 0x007F, 0x007F] {
        bench.exchange_for(&outputs(control_word), 1);
    }
    assert_eq!(bench.module.state(), State::OperationEnabled);
}

// ---- process data

#[test]
fn the_position_goes_out_low_word_first_and_each_word_high_octet_first() {
    // A program that does nothing but set the reference to VTPOS 001. With 32.768 units a revolution an increment is
    // 0.0005 units: 152 709.948 units are 305 419 896 = 0x12345678 increments.
    let mut codes = CodeStore::thesis();
    for (code, subcode, value) in [
        (1202, 0, 1_0000),
        (1203, 0, 1_0000),
        (1204, 0, 32_7680),
        (1301, 1, 1_527_099_480),
    ] {
        codes.write(code, subcode, value, Inhibit::Active).unwrap();
    }
    let drive = DriveConfig {
        codes,
        program: Program::new([(1, Record::new(Mode::SetReference, Target::Variable(1)))]).unwrap(),
        ..DriveConfig::default()
    };
    let mut bench = Bench::new(direct(), drive);
    bench.steps(200);
    bench.start_up(PAR_AND_FOUR_WORDS, None);
    enable(&mut bench);
    bench.exchange_for(&outputs(0x007F), 20);
    // Bit 5 falls: program start.
    let inputs = bench.exchange_for(&outputs(0x005F), 5);
    assert_eq!(bench.drive.position(), 0x1234_5678);
    // Octets 13, 14 low word, 15, 16 high word (9300 facts 1.3).
    assert_eq!(inputs[12..16], [0x56, 0x78, 0x12, 0x34]);
}

#[test]
fn the_status_word_goes_out_high_octet_first() {
    let mut bench = exchanging(direct(), None);
    bench.exchange_for(&outputs(0x0076), 1);
    // 9300 facts 2.2: ready 0x0231, switched on 0x0233. Enabled at rest 0x0637: bit 10, set-value reached.
    assert_eq!(bench.exchange(&outputs(0x0076))[8..10], [0x02, 0x31]);
    bench.exchange_for(&outputs(0x0077), 1);
    assert_eq!(bench.exchange(&outputs(0x0077))[8..10], [0x02, 0x33]);
    bench.exchange_for(&outputs(0x007F), 3);
    assert_eq!(bench.exchange(&outputs(0x007F))[8..10], [0x06, 0x37]);
}

#[test]
fn the_control_word_comes_in_high_octet_first() {
    let mut bench = exchanging(direct(), None);
    let mut outputs = [0; 16];
    outputs[8..10].copy_from_slice(&[0x10, 0x76]);
    bench.exchange_for(&outputs, 1);
    assert_eq!(bench.module.control_word(), ControlWord(0x1076));
}

#[test]
fn the_speed_goes_out_as_a_signed_word_with_16384_for_c0011() {
    let mut bench = exchanging(direct(), None);
    enable(&mut bench);
    for (sign, jog) in [(1.0, 0x507F), (-1.0, 0x307F)] {
        // Bit 12 manual with 14 positive or 13 negative; 10 % of 1200 mm/s are 281.45 rpm = 1537 (9300 facts 4.6).
        bench.exchange_for(&outputs(jog), 300);
        let inputs = bench.exchange(&outputs(jog));
        let speed = i16::from_be_bytes([inputs[10], inputs[11]]);
        assert!((f64::from(speed) - sign * 1537.1).abs() < 8.0, "{speed}");
    }
}

#[test]
fn process_data_take_the_set_time_each_way() {
    for delay in [0, 1, 3, 15] {
        let config = Emf2133Config {
            process_data_delay_ms: delay,
            ..Emf2133Config::default()
        };
        let mut bench = exchanging(config, None);
        bench.exchange_for(&outputs(0x0000), 40);
        // To the drive: so many cycles with the old control word.
        for cycle in 0..delay {
            bench.exchange_for(&outputs(0x0076), 1);
            assert_eq!(bench.module.control_word(), ControlWord(0), "{delay} ms, cycle {cycle}");
        }
        bench.exchange_for(&outputs(0x0076), 1);
        assert_eq!(bench.module.control_word(), ControlWord(0x0076), "{delay} ms");
        assert_eq!(bench.module.status_word().0, 0x0231);
        // From the drive: so many cycles until the answer shows the status word of this one.
        for cycle in 0..delay {
            let inputs = bench.exchange(&outputs(0x0076));
            assert_eq!(inputs[8..10], [0x02, 0x40], "{delay} ms, cycle {cycle}");
            bench.step();
        }
        assert_eq!(bench.exchange(&outputs(0x0076))[8..10], [0x02, 0x31], "{delay} ms");
    }
}

// ---- configurations

#[test]
fn without_a_parameter_channel_the_process_words_come_first() {
    let mut bench = Bench::new(direct(), DriveConfig::default());
    bench.steps(200);
    bench.start_up(&[0xF3], None);
    let inputs = bench.exchange_for(&[0x00, 0x76, 0, 0, 0, 0, 0, 0], 2);
    assert_eq!(bench.module.control_word(), ControlWord(0x0076));
    assert_eq!(inputs, [0x02, 0x31, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn what_would_be_a_job_in_the_parameter_channel_is_none_without_it() {
    let mut bench = Bench::new(direct(), DriveConfig::default());
    bench.steps(200);
    bench.start_up(&[0xF3], None);
    // As a request: write C0070 := 1. As process data: control word 0x7200, drive inhibited.
    bench.exchange_for(&[0x72, 0x00, 0x5F, 0xB9, 0x00, 0x00, 0x27, 0x10], 100);
    assert_eq!(bench.drive.codes().number(70, 0), 5.0);
}

#[test]
fn one_word_is_control_and_status_alone() {
    for configuration in [&[0x70_u8][..], &[0xF0], &[0xF3, 0x70]] {
        let mut bench = Bench::new(direct(), DriveConfig::default());
        bench.steps(200);
        bench.start_up(configuration, None);
        let parameters = 8 * (configuration.len() - 1);
        let mut octets = vec![0; parameters];
        octets.extend([0x00, 0x76]);
        let inputs = bench.exchange_for(&octets, 2);
        assert_eq!(inputs.len(), parameters + 2, "{configuration:02X?}");
        assert_eq!(inputs[parameters..], [0x02, 0x31], "{configuration:02X?}");
    }
}

#[test]
fn words_beyond_the_fourth_are_ignored_and_read_zero() {
    let mut bench = Bench::new(direct(), DriveConfig::default());
    bench.steps(200);
    bench.start_up(&[0xF3, 0xFF], None);
    let mut octets = [0xFF; 40];
    octets[..8].fill(0);
    octets[8..10].copy_from_slice(&[0x00, 0x76]);
    let inputs = bench.exchange_for(&octets, 2);
    assert_eq!(inputs[8..10], [0x02, 0x31]);
    assert_eq!(inputs[16..], [0; 24]);
}

// ---- parameter channel

/// Read C1204, as the thesis does; the handshake alternates.
const READ_C1204: [[u8; 8]; 2] = [
    [0x71, 0x00, 0x5B, 0x4B, 0, 0, 0, 0],
    [0x31, 0x00, 0x5B, 0x4B, 0, 0, 0, 0],
];

/// Module cycles from the one that saw the request to the one that gave the answer.
fn processing_time(bench: &mut Bench, job: [u8; 8]) -> u32 {
    let before = bench.exchange(&request(job, 0))[..8].to_vec();
    bench.step();
    for ms in 0..1000 {
        if bench.exchange(&request(job, 0))[..8] != before {
            return ms;
        }
        bench.step();
    }
    panic!("no answer in a second");
}

#[test]
fn a_parameter_job_takes_30_to_50_ms_and_every_time_in_between_occurs() {
    // 9300 facts 1.6: about 30 ms + up to 20 ms.
    let mut bench = exchanging(Emf2133Config::default(), None);
    let mut times: Vec<u32> = (0..400)
        .map(|round| processing_time(&mut bench, READ_C1204[round % 2]))
        .collect();
    let mean = f64::from(times.iter().sum::<u32>()) / times.len() as f64;
    times.sort_unstable();
    times.dedup();
    assert_eq!(times, (30..=50).collect::<Vec<_>>());
    // Evenly distributed: 40 ± 6.1/√400.
    assert!((mean - 40.0).abs() < 1.2, "{mean}");
}

#[test]
fn processing_times_follow_the_seed_alone() {
    let times = |seed| {
        let config = Emf2133Config {
            seed,
            ..Emf2133Config::default()
        };
        let mut bench = exchanging(config, None);
        (0..20)
            .map(|round| processing_time(&mut bench, READ_C1204[round % 2]))
            .collect::<Vec<_>>()
    };
    assert_eq!(times(7), times(7));
    assert_ne!(times(7), times(8));
}

#[test]
fn while_a_job_runs_the_old_answer_stays_and_a_second_request_waits() {
    let config = Emf2133Config {
        parameter_jitter_ms: 0,
        ..direct()
    };
    let mut bench = exchanging(config, None);
    // Before the first job the answer is all zero (9300 facts 3.1).
    let inputs = bench.exchange_for(&request(READ_C1204[0], 0), 30);
    assert_eq!(inputs[..8], [0; 8]);
    // Taken back and asked anew while the job runs: the answer still belongs to what was taken over.
    bench.exchange_for(&request(READ_C1204[1], 0), 1);
    // 179.0708 = 0x001B52F4, four octets, handshake copied.
    let answer = [0x70, 0x00, 0x5B, 0x4B, 0x00, 0x1B, 0x52, 0xF4];
    assert_eq!(bench.exchange(&request(READ_C1204[1], 0))[..8], answer);
    let inputs = bench.exchange_for(&request(READ_C1204[1], 0), 31);
    assert_eq!(inputs[..8], answer);
    assert_eq!(bench.exchange(&request(READ_C1204[1], 0))[0], 0x30);
}

#[test]
fn c0086_is_refused_while_enabled_with_the_octets_of_the_manual_and_written_while_inhibited() {
    let mut bench = exchanging(direct(), None);
    enable(&mut bench);
    bench.exchange_for(&request(READ_C1204[0], 0x007F), 60);
    // 108.0000 = 0x00107AC0; the handshake goes back to 0.
    let write = [0x32, 0x00, 0x5F, 0xA9, 0x00, 0x10, 0x7A, 0xC0];
    let inputs = bench.exchange_for(&request(write, 0x007F), 60);
    // 9300 facts 3.3.
    assert_eq!(inputs[..8], [0xB0, 0x00, 0x5F, 0xA9, 0x08, 0x00, 0x00, 0x30]);
    assert_eq!(bench.module.state(), State::OperationEnabled);

    // Shut down, then once more with the other handshake.
    bench.exchange_for(&outputs(0x0076), 5);
    let write = [0x72, 0x00, 0x5F, 0xA9, 0x00, 0x10, 0x7A, 0xC0];
    let inputs = bench.exchange_for(&request(write, 0x0076), 60);
    assert_eq!(inputs[..8], [0x70, 0x00, 0x5F, 0xA9, 0x00, 0x10, 0x7A, 0xC0]);
}

// ---- diagnosis

#[test]
fn a_trip_is_announced_with_high_priority_until_it_was_read() {
    let mut bench = exchanging(direct(), None);
    bench.diagnosis();
    bench.exchange_for(&outputs(0x0076), 2);
    bench.drive.inject(Fault::Oc2, true);
    bench.exchange_for(&outputs(0x0076), 3);
    let priority = |bench: &mut Bench| match bench.ask(None, &outputs(0x0076)) {
        Reply::Data { function, .. } => function,
        other => panic!("{other:?}"),
    };
    assert_eq!(priority(&mut bench), ResponseFunction::DataHigh);
    // Ext_Diag (bit 3 of octet 1); octets 7…9: 03, object 603Fh of an earth fault = 0x2330 (9300 facts 1.4).
    let diagnosis = bench.diagnosis();
    assert_eq!(diagnosis[0] & 0x08, 0x08);
    assert_eq!(diagnosis[6..], [0x03, 0x23, 0x30]);
    assert_eq!(priority(&mut bench), ResponseFunction::DataLow);
}

// ---- C1882 and C1883: what the drive does when the bus fails

/// How data exchange ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leaving {
    /// The master falls silent and the watchdog expires.
    Watchdog,
    /// The master releases the module, its watchdog not expired.
    Unlock,
    /// The master sends other parameters; the module waits for Chk_Cfg.
    Reparametrised,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Effect {
    None,
    Trip,
    Inhibit,
    QuickStop,
}

const WATCHDOG_MS: u16 = 50;

fn effect(bench: &Bench) -> Effect {
    if bench.drive.status().trip == Some(Fault::Ce0) {
        Effect::Trip
    } else if bench.drive.inhibited() {
        Effect::Inhibit
    } else if bench.drive.diagnosis() == 153 {
        // C0183: QSP by AIF.
        Effect::QuickStop
    } else {
        assert_eq!(bench.drive.diagnosis(), 0);
        Effect::None
    }
}

/// Enabled, with C1882 and C1883 written and the watchdog on or off.
fn with_reaction(c1882: i32, c1883_ms: i32, watchdog: Option<u16>) -> Bench {
    let mut bench = exchanging(direct(), watchdog);
    bench.drive.write_code(1882, 0, c1882 * 10_000).unwrap();
    bench.drive.write_code(1883, 0, c1883_ms * 10_000).unwrap();
    enable(&mut bench);
    bench.exchange_for(&outputs(0x007F), 20);
    assert_eq!(effect(&bench), Effect::None);
    bench
}

/// Ends data exchange; the next step is the first millisecond outside.
fn leave(bench: &mut Bench, how: Leaving, watchdog: Option<u16>) {
    match how {
        Leaving::Watchdog => {
            // It was triggered within the millisecond before.
            bench.steps(u32::from(watchdog.unwrap_or(WATCHDOG_MS)) - 1);
            while bench.module.slave().watchdog().is_some() {
                assert_eq!(effect(bench), Effect::None);
                bench.step();
            }
        }
        Leaving::Unlock => bench.set_prm(UNLOCK, None, &[]),
        Leaving::Reparametrised => bench.set_prm(LOCK, watchdog, &[]),
    }
}

#[test]
fn the_drive_does_what_c1882_and_c1883_say_when_the_bus_fails() {
    const OFF: i32 = 65_535;
    let reactions = [
        (0, Effect::None),
        (1, Effect::Trip),
        (2, Effect::Inhibit),
        (3, Effect::QuickStop),
    ];
    // C1883, how it ends, milliseconds outside until the reaction; `None`: never (9300 facts 1.5).
    let rows = [
        // Without the extra time the watchdog alone decides, at once.
        (OFF, Leaving::Watchdog, Some(1)),
        (OFF, Leaving::Unlock, None),
        (OFF, Leaving::Reparametrised, None),
        // With it the time counts, however data exchange was left: long after it, also without watchdog expiry.
        (100, Leaving::Watchdog, Some(100)),
        (100, Leaving::Unlock, Some(100)),
        (100, Leaving::Reparametrised, Some(100)),
        (0, Leaving::Watchdog, Some(1)),
        (0, Leaving::Unlock, Some(1)),
    ];
    for (c1882, reaction) in reactions {
        for (c1883_ms, how, after_ms) in rows {
            let mut bench = with_reaction(c1882, c1883_ms, Some(WATCHDOG_MS));
            leave(&mut bench, how, Some(WATCHDOG_MS));
            for ms in 1..=300 {
                bench.step();
                let expected = match after_ms {
                    Some(after_ms) if ms >= after_ms => reaction,
                    _ => Effect::None,
                };
                assert_eq!(
                    effect(&bench),
                    expected,
                    "C1882 = {c1882}, C1883 = {c1883_ms}, {how:?}, {ms} ms"
                );
            }
        }
    }
}

#[test]
fn a_master_without_watchdog_causes_no_reaction_however_it_leaves() {
    for how in [Leaving::Unlock, Leaving::Reparametrised] {
        for c1883_ms in [0, 100, 65_535] {
            let mut bench = with_reaction(2, c1883_ms, None);
            leave(&mut bench, how, None);
            bench.steps(300);
            assert_eq!(effect(&bench), Effect::None, "{how:?}, C1883 = {c1883_ms}");
        }
    }
}

#[test]
fn a_gap_shorter_than_c1883_causes_no_reaction() {
    let mut bench = with_reaction(1, 100, Some(WATCHDOG_MS));
    leave(&mut bench, Leaving::Unlock, Some(WATCHDOG_MS));
    bench.steps(99);
    bench.start_up(PAR_AND_FOUR_WORDS, Some(WATCHDOG_MS));
    bench.exchange_for(&outputs(0x007F), 200);
    assert_eq!(effect(&bench), Effect::None);
}

#[test]
fn inhibit_and_quick_stop_end_with_data_exchange_and_a_trip_stays_until_it_is_reset() {
    for (c1882, while_away) in [(1, Effect::Trip), (2, Effect::Inhibit), (3, Effect::QuickStop)] {
        let mut bench = with_reaction(c1882, 65_535, Some(WATCHDOG_MS));
        leave(&mut bench, Leaving::Watchdog, Some(WATCHDOG_MS));
        bench.steps(10);
        assert_eq!(effect(&bench), while_away);
        bench.start_up(PAR_AND_FOUR_WORDS, Some(WATCHDOG_MS));
        bench.exchange_for(&outputs(0x007F), 20);
        if while_away != Effect::Trip {
            assert_eq!(effect(&bench), Effect::None, "C1882 = {c1882}");
            continue;
        }
        assert_eq!(bench.module.state(), State::Fault);
        // CE0 in the diagnosis: 0x8100 (9300 facts 1.4).
        assert_eq!(bench.diagnosis()[6..], [0x03, 0x81, 0x00]);
        // Bit 7 rises.
        bench.exchange_for(&outputs(0x00FF), 5);
        assert_eq!(bench.drive.status().trip, None);
        enable(&mut bench);
        assert_eq!(effect(&bench), Effect::None);
    }
}

#[test]
fn without_a_reaction_the_drive_goes_on_with_the_last_process_data() {
    let mut bench = with_reaction(0, 65_535, Some(WATCHDOG_MS));
    // Manual, positive.
    bench.exchange_for(&outputs(0x507F), 300);
    leave(&mut bench, Leaving::Watchdog, Some(WATCHDOG_MS));
    let before = bench.drive.position();
    bench.steps(1000);
    // 10 % of 1200 mm/s for a second: 120 mm of 2561.847 increments.
    let travelled = (bench.drive.position() - before) as f64 / 2561.847;
    assert!((travelled - 120.0).abs() < 0.1, "{travelled} mm");
    assert_eq!(bench.module.control_word(), ControlWord(0x507F));
}

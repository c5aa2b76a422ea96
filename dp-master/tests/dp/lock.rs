//! Other masters: at the slave (who owns it) and at the master (who is on the line). Their telegrams are injected.

use dp_master::address::Address;
use dp_master::dp::{LeaveReason, MasterEvent, Mode, SlaveConfig, SlaveEvent, SlavePhase, SlaveState, sap};
use dp_master::fdl::{FdlState, RingEvent};
use dp_master::station::{MAX_TELEGRAM, Station};
use dp_master::time::Duration;
use dp_master::wire::{Fcb, RequestFunction, ResponseFunction, Telegram, decode_one};
use proptest::prelude::*;

use crate::common::bench::{BAUD, Bench, response};
use crate::common::{Line, SLAVE, slave_identity};

#[test]
fn only_the_parametrising_master_may_write_outputs() {
    let mut bench = Bench::owned_by(2);
    let reply = bench.ask(4, None, Fcb::First, &[9; 8]);
    assert_eq!(response(&reply), ResponseFunction::NoService);
    assert_eq!(bench.slave.outputs(), [0; 8]);
    bench.ask(2, None, Fcb::High, &[7; 8]);
    assert_eq!(bench.slave.outputs(), [7; 8]);
}

#[test]
fn another_master_can_neither_parametrise_nor_unlock_an_owned_slave() {
    for station_status in [0x80, 0x40, 0x00] {
        let mut bench = Bench::owned_by(2);
        let reply = bench.set_prm(4, station_status, Fcb::First);
        assert_eq!(response(&reply), ResponseFunction::NoService);
        assert_eq!(bench.slave.phase(), SlavePhase::DataExchange);
    }
}

#[test]
fn another_master_may_read_diagnosis_configuration_inputs_and_outputs() {
    let mut bench = Bench::owned_by(2);
    bench.slave.set_inputs(&[3; 8]);
    bench.ask(2, None, Fcb::High, &[7; 8]);
    let mut read = |sap| {
        let reply = bench.ask(4, Some(sap), Fcb::First, &[]);
        match decode_one(&reply) {
            Ok((Telegram::Data { data, .. }, _)) => data.to_vec(),
            other => panic!("{other:?}"),
        }
    };
    // Owner 2, ident 0x00DA, no watchdog.
    assert_eq!(read(sap::SLAVE_DIAG), [0, 0x04, 0, 2, 0, 0xDA]);
    assert_eq!(read(sap::GET_CFG), [0xF3]);
    assert_eq!(read(sap::RD_INP), [3; 8]);
    assert_eq!(read(sap::RD_OUTP), [7; 8]);
}

#[test]
fn unlock_by_the_owner_frees_the_slave_for_others() {
    let mut bench = Bench::owned_by(2);
    assert_eq!(bench.set_prm(2, 0x40, Fcb::High), [0xE5]);
    assert_eq!(bench.slave.phase(), SlavePhase::WaitPrm);
    let left = SlaveEvent::LeftDataExchange {
        reason: LeaveReason::Unlocked,
    };
    assert!(std::iter::from_fn(|| bench.slave.poll_event()).any(|event| event == left));
    assert_eq!(bench.set_prm(4, 0x80, Fcb::First), [0xE5]);
    assert_eq!(bench.slave.master(), Address::new(4).ok());
}

#[test]
fn exchange_is_refused_before_the_configuration_was_accepted() {
    let mut bench = Bench::new();
    let reply = bench.ask(2, None, Fcb::First, &[0; 8]);
    // SD1 DA 02 SA 03 FC 03 FCS 08 ED
    assert_eq!(reply, [0x10, 0x02, 0x03, 0x03, 0x08, 0x16]);
    bench.set_prm(2, 0x80, Fcb::Low);
    let reply = bench.ask(2, None, Fcb::High, &[0; 8]);
    assert_eq!(response(&reply), ResponseFunction::NoService);
}

#[test]
fn requests_of_low_priority_without_token_or_global_control_are_served() {
    let mut bench = Bench::owned_by(2);
    let function = RequestFunction::SrdLow;
    let reply = bench.ask_as(2, None, Fcb::High, function, &[1; 8]);
    assert_eq!(response(&reply), ResponseFunction::DataLow);
    assert_eq!(bench.slave.outputs(), [1; 8]);
}

#[test]
fn outputs_of_a_wrong_length_end_the_exchange() {
    let mut bench = Bench::owned_by(2);
    let reply = bench.ask(2, None, Fcb::High, &[1; 7]);
    assert_eq!(response(&reply), ResponseFunction::NoService);
    assert_eq!(bench.slave.phase(), SlavePhase::WaitPrm);
    let left = SlaveEvent::LeftDataExchange {
        reason: LeaveReason::OutputLength { expected: 8, got: 7 },
    };
    assert!(std::iter::from_fn(|| bench.slave.poll_event()).any(|event| event == left));
}

#[test]
fn the_fdl_status_names_a_passive_station() {
    let mut bench = Bench::new();
    // SD1 DA 03 SA 02 FC 49 FCS 4E ED, answered with FC 00
    let reply = bench.hear(&[0x10, 0x03, 0x02, 0x49, 0x4E, 0x16]);
    assert_eq!(reply, [0x10, 0x02, 0x03, 0x00, 0x05, 0x16]);
}

#[test]
fn an_fdl_status_between_a_request_and_its_repetition_does_not_change_the_reply() {
    let mut bench = Bench::owned_by(2);
    bench.slave.set_inputs(&[3; 8]);
    let reply = bench.ask(2, None, Fcb::High, &[7; 8]);
    bench.hear(&[0x10, 0x03, 0x04, 0x49, 0x50, 0x16]);
    assert_eq!(bench.ask(2, None, Fcb::High, &[7; 8]), reply);
}

#[test]
fn inputs_set_before_the_configuration_are_in_the_first_reply() {
    let mut bench = Bench::new();
    bench.slave.set_inputs(&[3; 20]);
    bench.set_prm(2, 0x80, Fcb::First);
    bench.ask(2, Some(sap::CHK_CFG), Fcb::Low, &[0xF3]);
    let reply = bench.ask(2, None, Fcb::High, &[0; 8]);
    // SD2 LE LEr SD2 DA SA FC, then eight octets
    assert_eq!(reply[7..15], [3; 8]);
}

#[test]
fn min_tsdr_of_set_prm_holds_from_the_next_request_on() {
    let mut bench = Bench::new();
    let prm = [0x80, 0, 0, 60, 0x00, 0xDA, 0];
    bench.ask(2, Some(sap::SET_PRM), Fcb::First, &prm);
    bench.now += Duration::from_millis(1);
    bench
        .slave
        .handle_octets(bench.now, &[0x10, 0x03, 0x02, 0x49, 0x4E, 0x16]);
    // 60 tBIT at 1.5 Mbit/s: 40 µs
    let expected = bench.now + Duration::from_micros(40);
    assert_eq!(bench.slave.poll_timeout(), Some(expected));
}

#[test]
fn the_address_cannot_be_changed_over_the_bus() {
    let mut bench = Bench::new();
    let reply = bench.ask(2, Some(sap::SET_SLAVE_ADD), Fcb::First, &[9, 0, 0xDA, 0]);
    assert_eq!(response(&reply), ResponseFunction::NoService);
}

#[test]
fn a_master_does_not_take_a_slave_from_another_and_says_whose_it_is() {
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    // Owned by master 4 before our master comes.
    line.slaves[0] = Bench::owned_by(4).slave;
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(50));
    let slave = line.indices[0];
    assert_eq!(line.master.state(slave), SlaveState::Refused);
    let owners: Vec<_> = line
        .master_events()
        .iter()
        .filter_map(|event| match event {
            MasterEvent::OwnedByOther { diagnosis, .. } => Some(diagnosis.master),
            _ => None,
        })
        .collect();
    assert_eq!(owners, [4]);
    assert_eq!(line.slaves[0].phase(), SlavePhase::DataExchange);
}

#[test]
fn a_master_that_hears_a_foreign_token_gives_its_own_up_and_regains_it_when_the_line_is_quiet() {
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    let intruder = line.bus.attach();
    line.master.set_mode(Mode::Operate);
    line.run_until(|line| line.master.exchanges(line.indices[0]) == 5);
    line.master_events();
    // Between a reply and the next request, as a master that does not know of us would.
    line.run_until(|line| {
        line.tap
            .log
            .last()
            .is_some_and(|last| last.starts_with("68 0B 0B 68 02 03") && last.len() == 50)
    });
    // Later than a character, before Tid1 (37 tBIT) has passed.
    let mut begin = line.now + Duration::from_micros(10);
    line.bus.clear_violations();
    for _ in 0..3 {
        // From 5 to 7: our master at 2 is not between them.
        line.bus.transmit(begin, intruder, &[0xDC, 0x07, 0x05]);
        let sent = line.tap.log.len();
        line.run_for(Duration::from_micros(1_500));
        // Ttimeout of address 2 is 2 ms: nothing of ours in between.
        assert_eq!(line.tap.log[sent..], ["DC 07 05"]);
        assert_eq!(line.master.fdl_state(), FdlState::ActiveIdle);
        begin = line.now;
    }
    let [five, seven] = [5, 7].map(|value| Address::new(value).unwrap());
    let ring = |event| MasterEvent::Ring(event);
    assert_eq!(
        line.master_events(),
        [
            ring(RingEvent::SecondToken(five)),
            ring(RingEvent::StationJoined(five)),
            ring(RingEvent::StationJoined(seven)),
        ]
    );
    // The others are gone: the token is claimed again, offered to each of them three times, and the exchange goes on.
    let sent = line.tap.log.len();
    line.run_for(Duration::from_millis(10));
    assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
    assert_eq!(
        line.master_events(),
        [
            ring(RingEvent::TokenLost),
            ring(RingEvent::Claimed),
            ring(RingEvent::StationLeft(five)),
            ring(RingEvent::StationLeft(seven)),
        ]
    );
    for (token, times) in [("DC 05 02", 3), ("DC 07 02", 3)] {
        let heard = line.tap.log[sent..]
            .iter()
            .filter(|telegram| *telegram == token)
            .count();
        assert_eq!(heard, times, "{token}");
    }
    // The intruder did not keep Tsyn when it broke in; ours broke no rule.
    let ours = line
        .bus
        .violations()
        .iter()
        .filter(|violation| violation.port == line.master_port);
    assert_eq!(ours.count(), 0);
}

proptest! {
    /// Whatever arrives in whatever pieces: no panic, and deadlines always move on.
    #[test]
    fn a_slave_survives_arbitrary_octets(
        pieces in prop::collection::vec((prop::collection::vec(any::<u8>(), 1..40), 0u64..200_000), 0..40),
        owned in any::<bool>(),
    ) {
        let mut bench = if owned { Bench::owned_by(2) } else { Bench::new() };
        let mut buf = [0; MAX_TELEGRAM];
        for (octets, pause) in pieces {
            bench.now += Duration::from_nanos(pause) + BAUD.characters(octets.len());
            bench.slave.handle_octets(bench.now, &octets);
            while let Some(due) = bench.slave.poll_timeout().filter(|due| *due <= bench.now) {
                bench.slave.handle_timeout(due);
                prop_assert!(bench.slave.poll_timeout().is_none_or(|next| next > due));
                bench.slave.poll_transmit(due, &mut buf);
            }
            while bench.slave.poll_event().is_some() {}
        }
    }

    /// Well-formed requests of any kind, from any master, in any order.
    #[test]
    fn a_slave_survives_arbitrary_requests(
        requests in prop::collection::vec((0u8..4, prop::option::of(50u8..64), 0u8..4, any::<u8>(), prop::collection::vec(any::<u8>(), 0..20)), 0..60),
    ) {
        let mut bench = Bench::owned_by(2);
        for (master, sap, fcb, code, data) in requests {
            let fcb = [Fcb::First, Fcb::High, Fcb::Low, Fcb::Inactive][usize::from(fcb)];
            bench.ask_as(master, sap, fcb, RequestFunction::from_code(code), &data);
            let lengths = bench.slave.lengths();
            prop_assert!(bench.slave.outputs().len() == lengths.outputs);
            prop_assert!(bench.slave.phase() != SlavePhase::DataExchange || bench.slave.master().is_some());
        }
    }

    /// The master under noise: no panic, no deadline that stands still.
    #[test]
    fn a_master_survives_arbitrary_octets(
        pieces in prop::collection::vec((prop::collection::vec(any::<u8>(), 1..40), 0u64..2_000_000), 0..40),
    ) {
        let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
        line.add_slave(slave_identity(BAUD));
        let noise = line.bus.attach();
        line.master.set_mode(Mode::Operate);
        for (octets, pause) in pieces {
            line.run_for(Duration::from_nanos(pause));
            line.bus.transmit(line.now, noise, &octets);
        }
        line.run_for(Duration::from_millis(60));
        // Noise without a token or request of another master leaves no trace once it is over.
        prop_assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
    }
}

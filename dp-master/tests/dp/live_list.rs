//! The live list on the virtual line.

use dp_master::address::Address;
use dp_master::dp::class2::{LiveList, LiveListEvent, Scan};
use dp_master::dp::{DpMaster, MasterConfig, Mode, SlaveConfig, SlaveIdentity, SlaveState};
use dp_master::fdl::BusParams;
use dp_master::phy::Script;
use dp_master::time::Duration;
use dp_master::wire::StationType;

use crate::common::bench::BAUD;
use crate::common::{Line, MASTER, SLAVE, slave_identity};

fn address(value: u8) -> Address {
    Address::new(value).unwrap()
}

fn at(value: u8) -> SlaveIdentity {
    SlaveIdentity {
        address: address(value),
        ..slave_identity(BAUD)
    }
}

/// Runs the list until `rounds` are complete; all events but the rounds.
fn scan(line: &mut Line, list: &mut LiveList, rounds: u32) -> Vec<LiveListEvent> {
    let end = line.now + Duration::from_millis(2_000);
    let mut events = Vec::new();
    while list.rounds() < rounds {
        assert!(line.now < end, "round {} not reached", rounds);
        while let Some(event) = list.poll(line.master.jobs()) {
            if event != LiveListEvent::Round {
                events.push(event);
            } else if list.rounds() == rounds {
                break;
            }
        }
        line.step();
    }
    events
}

#[test]
fn one_round_asks_every_address_once_and_finds_the_stations() {
    let mut line = Line::new(BAUD, &[]);
    for value in [0, 3, 57, 126] {
        line.add_slave(at(value));
    }
    let mut list = LiveList::new(MASTER, Address::MAX_STATION, Scan::Once);
    let events = scan(&mut line, &mut list, 1);
    let found = |value| LiveListEvent::Found {
        address: address(value),
        station: StationType::Slave,
    };
    assert_eq!(events, [found(0), found(3), found(57), found(126)]);
    let stations: Vec<_> = list
        .stations()
        .map(|(address, station)| (address.value(), station))
        .collect();
    assert_eq!(
        stations,
        [
            (0, StationType::Slave),
            (2, StationType::MasterInRing),
            (3, StationType::Slave),
            (57, StationType::Slave),
            (126, StationType::Slave),
        ]
    );
    assert!(list.is_finished());
    // 127 addresses less the own one, each once: FC 49. The master itself has asked its GAP before, 0 and 1.
    let asked: Vec<_> = line
        .tap
        .log
        .iter()
        .filter(|telegram| telegram.starts_with("10") && &telegram[9..11] == "49")
        .collect();
    assert_eq!(asked.len(), 126 + 2);
    line.run_for(Duration::from_millis(20));
    assert_eq!(list.poll(line.master.jobs()), None, "it is over");
    line.assert_no_violations();
}

#[test]
fn the_list_ends_at_the_highest_address_asked_for() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(at(3));
    line.add_slave(at(11));
    let mut list = LiveList::new(MASTER, address(10), Scan::Once);
    scan(&mut line, &mut list, 1);
    let stations: Vec<_> = list.stations().map(|(address, _)| address.value()).collect();
    assert_eq!(stations, [2, 3]);
}

#[test]
fn a_continuous_list_notices_who_comes_and_goes() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(at(3));
    line.add_slave(at(5));
    let mut list = LiveList::new(MASTER, address(10), Scan::Continuous);
    scan(&mut line, &mut list, 1);
    line.bus.disconnect(line.slave_ports[0]);
    let gone = scan(&mut line, &mut list, 2);
    assert_eq!(gone, [LiveListEvent::Lost { address: address(3) }]);
    line.bus.reconnect(line.slave_ports[0]);
    let back = scan(&mut line, &mut list, 3);
    assert_eq!(
        back,
        [LiveListEvent::Found {
            address: address(3),
            station: StationType::Slave
        }]
    );
    line.assert_no_violations();
}

#[test]
fn one_lost_answer_is_no_lost_station() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(at(3));
    let mut list = LiveList::new(MASTER, address(4), Scan::Continuous);
    scan(&mut line, &mut list, 1);
    // The next status request to 3 and its answer: 03 + 02 + 49 = 4E.
    let heard = line.tap.log.len();
    let question = "10 03 02 49 4E 16";
    let asked = |line: &Line| {
        line.tap.log[heard..]
            .iter()
            .filter(|telegram| *telegram == question)
            .count()
    };
    let end = line.now + Duration::from_millis(100);
    let mut events = Vec::new();
    let mut dropped = false;
    while list.rounds() < 2 {
        assert!(line.now < end);
        events.extend(list.poll(line.master.jobs()));
        line.step();
        if asked(&line) == 1 && !dropped {
            line.bus.script(Script::Drop {
                burst: line.bus.bursts(),
            });
            dropped = true;
        }
    }
    assert_eq!(events, [LiveListEvent::Round]);
    assert_eq!(asked(&line), 2);
}

#[test]
fn the_list_lengthens_a_cycle_by_one_telegram_and_disturbs_no_exchange() {
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) > 3);
    line.run_for(Duration::from_millis(5));
    let quiet = line.master.statistics().last_cycle;
    let from = line.master.exchanges(index);
    let mut list = LiveList::new(MASTER, Address::MAX_STATION, Scan::Once);
    scan(&mut line, &mut list, 1);
    // 126 questions, at most one a cycle.
    assert!(line.master.exchanges(index) - from >= 125);
    // Six characters, Tsl and Tid1 at 1.5 Mbit/s: 66 + 300 + 37 tBIT, the last only after an answer. Every now and then
    // a token to itself, 33 + 37 tBIT.
    let longest = line.master.statistics().longest_cycle - quiet;
    assert!(
        longest <= Duration::from_nanos((66 + 300 + 37 + 33 + 37) * 1_000 * 2 / 3 + 4),
        "{longest:?}"
    );
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
    line.assert_no_violations();
}

#[test]
fn a_master_in_the_ring_is_told_from_a_slave() {
    let mut params = BusParams::standard(BAUD);
    // A short GAP: the newcomer is asked again soon after it has heard two rotations.
    params.hsa = address(10);
    let mut line = Line::with_config(MasterConfig::new(MASTER, params), &[]);
    line.add_slave(at(3));
    let mut other = DpMaster::<0>::new(MasterConfig::new(address(5), params)).unwrap();
    let port = line.bus.attach();
    let end = line.now + Duration::from_millis(2_000);
    while !(line.master.is_in_ring() && other.is_in_ring()) {
        assert!(line.now < end, "no ring of two");
        line.step_with(&mut [(port, &mut other)]);
    }
    let mut list = LiveList::new(MASTER, address(10), Scan::Once);
    while !list.is_finished() {
        assert!(line.now < end, "the round was not finished");
        list.poll(line.master.jobs());
        line.step_with(&mut [(port, &mut other)]);
    }
    let stations: Vec<_> = list
        .stations()
        .map(|(address, station)| (address.value(), station))
        .collect();
    assert_eq!(
        stations,
        [
            (2, StationType::MasterInRing),
            (3, StationType::Slave),
            (5, StationType::MasterInRing),
        ]
    );
    line.assert_no_violations();
}

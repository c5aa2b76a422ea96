//! Bus parameters of whole networks. Expected values are calculated by hand from the formulas of EN 50170-2 or taken from manuals.

use dp_master::address::Address;
use dp_master::dp::{AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, Mode, SlaveConfig, SlaveIdentity};
use dp_master::fdl::{
    BusParams, BusParamsError, MasterLoad, MessageCycle, Network, Optical, OpticalTopology, Others, Profile, Segment,
    SlaveLoad, Violation, Way, octet_bits,
};
use dp_master::phy::{PortId, Tap, Trace, VirtualBus, pump};
use dp_master::station::Station;
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{FunctionCode, Telegram};

fn address(value: u8) -> Address {
    Address::new(value).unwrap()
}

fn slave(value: u8, octets: usize) -> SlaveLoad {
    SlaveLoad {
        address: address(value),
        outputs: octets,
        inputs: octets,
        t_sdr_max: None,
    }
}

/// A master without slaves.
fn lone() -> [MasterLoad<'static>; 1] {
    [MasterLoad {
        address: address(2),
        slaves: &[],
    }]
}

/// Parameters that break no rule, with a Ttr for any of these networks.
fn chosen() -> BusParams {
    BusParams {
        t_tr: BitTimes(100_000),
        ..BusParams::standard(Baud::B1500000)
    }
}

fn violations(network: &Network<'_>) -> Vec<Violation> {
    let mut found = Vec::new();
    network.check(&network.plan(), |violation| found.push(violation));
    found
}

/// The network of the thesis, ch. 8.2: PLC at 2, drive at 3, 16 + 16 octets, 12 Mbit/s, 3 m configured.
const THESIS_CABLE: [Segment; 1] = [Segment {
    length_cm: 300,
    stations: 2,
    stubs_cm: 0,
}];

#[test]
fn the_network_of_the_thesis_has_the_station_times_of_profile_dp() {
    let drive = [slave(3, 16)];
    let plc = [MasterLoad {
        address: address(2),
        slaves: &drive,
    }];
    let network = Network {
        segments: &THESIS_CABLE,
        ..Network::new(Baud::B12000000, Profile::Dp, &plc)
    };
    let plan = network.plan();
    let params = plan.params;
    // Profile DP at 12 Mbit/s: Tsl 1000, Tsdr 11…800, Tset 16, Tqui 9; 3 m there and back are 0.36, so one bit time.
    assert_eq!(params.t_sl, BitTimes(1001));
    assert_eq!((params.t_sdr_min, params.t_sdr_max), (BitTimes(11), BitTimes(800)));
    assert_eq!(
        (params.t_set, params.t_qui, params.t_rdy),
        (BitTimes(16), BitTimes(9), BitTimes(11))
    );
    // Tsm = 2 + 2·16 + 9 = 43; Tid1 = 33 + 43; Tid2 = max Tsdr.
    assert_eq!((params.t_id1, params.t_id2), (BitTimes(76), BitTimes(800)));
    assert_eq!((params.gap_factor, params.retry_limit, params.hsa), (10, 4, address(2)));
    assert_eq!(violations(&network), []);
}

#[test]
fn the_target_rotation_time_is_the_sum_of_what_one_rotation_can_hold() {
    let drive = [slave(3, 16)];
    let plc = [MasterLoad {
        address: address(2),
        slaves: &drive,
    }];
    let network = Network::new(Baud::B12000000, Profile::Dp, &plc);
    // By hand, line without length. Token 33 + 76. Data_Exchange 275 + 800 + 275 + 76. Global_Control 13 · 11 + 800. GAP 66 + 1000 + 76.
    // Acyclic 2 · 2805 + 800 + 76. Four repetitions of 2805 + 1000 + 76.
    let expected = 109 + 1_426 + 943 + 1_142 + 6_486 + 4 * 3_881;
    assert_eq!(expected, 25_630);
    assert_eq!(network.plan().params.t_tr, BitTimes(expected));
    // 6·Ttr = 12.8 ms, so 20 ms.
    assert_eq!(network.plan().watchdog, Duration::from_millis(20));
    // Token and exchange at 11 and at 30 tBIT.
    assert_eq!(network.plan().least_cycle, BitTimes(109 + 637));
    assert_eq!(network.plan().typical_cycle, BitTimes(109 + 656));
}

#[test]
fn the_tool_of_the_thesis_leaves_room_for_eight_more_acyclic_cycles() {
    let drive = [slave(3, 16)];
    let plc = [MasterLoad {
        address: address(2),
        slaves: &drive,
    }];
    let with = |acyclic| {
        let network = Network {
            segments: &THESIS_CABLE,
            acyclic,
            ..Network::new(Baud::B12000000, Profile::Dp, &plc)
        };
        network.baud.duration(network.plan().params.t_tr)
    };
    // Thesis, ch. 8.2, fig. 59: 6.5 ms, which is rounded to a tenth.
    let tenths = |time: Duration| (time.as_nanos() + 50_000) / 100_000;
    assert_eq!(tenths(with(9)), 65);
    assert_eq!(tenths(with(1)), 21);
}

#[test]
fn the_calculated_cycle_is_the_one_on_the_line() {
    for baud in [Baud::B1500000, Baud::B12000000] {
        let drive = [slave(3, 16)];
        let plc = [MasterLoad {
            address: address(2),
            slaves: &drive,
        }];
        let plan = Network::new(baud, Profile::Dp, &plc).plan();
        let calculated = MessageCycle::data_exchange(16, 16).bits(BitTimes(11), plan.params.t_id1, plan.round_trip);

        let mut master = DpMaster::<1>::new(MasterConfig::new(address(2), plan.params)).unwrap();
        let axis = master
            .add_slave(SlaveConfig::new(address(3), 0x00DA, &[0xF3, 0xF3]).unwrap())
            .unwrap();
        master.set_mode(Mode::Operate);
        let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF3]]);
        let mut station = DpSlave::new(SlaveIdentity::new(address(3), 0x00DA, baud, accepted)).unwrap();
        let mut bus = VirtualBus::new(baud);
        let ports = [bus.attach(), bus.attach(), bus.attach()];
        // Start of each request of Data_Exchange and start of whatever its sender sends next.
        let mut pauses = Vec::new();
        let mut asked: Option<Instant> = None;
        let mut tap = Tap::new(baud, |trace: Trace<'_>| {
            let dp_master::phy::Content::Telegram(telegram) = trace.content else {
                return;
            };
            let own = telegram.source() == Some(address(2));
            if own && let Some(asked) = asked.take() {
                pauses.push(baud.bits(trace.start - asked));
            }
            if let Telegram::Data { header, data } = telegram
                && matches!(header.fc, FunctionCode::Request { .. })
                && header.dsap.is_none()
                && data.len() == 16
            {
                asked = Some(trace.start);
            }
        });
        let mut now = Instant::ZERO;
        while master.exchanges(axis) < 20 {
            let mut stations: [(PortId, &mut dyn Station); 3] =
                [(ports[0], &mut master), (ports[1], &mut station), (ports[2], &mut tap)];
            now = pump(&mut bus, now, &mut stations).unwrap();
        }
        drop(tap);
        assert!(pauses.len() >= 18);
        for pause in pauses {
            assert!(
                pause.abs_diff(calculated.0.into()) <= 1,
                "{pause} tBIT on the line, {calculated} calculated, at {baud}"
            );
        }
    }
}

#[test]
fn cables_and_repeaters_lengthen_the_slot_time() {
    let slaves: Vec<_> = (3..33).map(|value| slave(value, 8)).collect();
    let plc = [MasterLoad {
        address: address(2),
        slaves: &slaves,
    }];
    let segments = [Segment {
        length_cm: 20_000,
        stations: 9,
        stubs_cm: 0,
    }; 4];
    let network = Network {
        segments: &segments,
        repeaters: 3,
        ..Network::new(Baud::B1500000, Profile::Dp, &plc)
    };
    // 800 m · 5 ns/m = 6 tBIT, three repeaters 4.5, there and back 21: 300 + 21.
    assert_eq!(network.plan().params.t_sl, BitTimes(321));
    assert_eq!(violations(&network), []);
}

#[test]
fn a_slow_slave_sets_max_tsdr_and_with_it_the_slot_time() {
    let slow = SlaveLoad {
        t_sdr_max: Some(BitTimes(500)),
        ..slave(3, 4)
    };
    let slaves = [slow, slave(4, 4)];
    let plc = [MasterLoad {
        address: address(2),
        slaves: &slaves,
    }];
    let plan = Network::new(Baud::B1500000, Profile::Dp, &plc).plan();
    assert_eq!(plan.params.t_sdr_max, BitTimes(500));
    // Tsl1 = 500 + 11 + Tsm (2 + 2·1) = 515; Tid2 = max Tsdr.
    assert_eq!((plan.params.t_sl, plan.params.t_id2), (BitTimes(515), BitTimes(500)));
    assert_eq!(plan.params.validate(), Ok(()));
}

#[test]
fn the_slot_time_of_a_redundant_optical_ring_is_that_of_its_manual() {
    let plc = lone();
    let ring = |baud, modules, fibre_m, profile| {
        let network = Network {
            optical: Some(Optical {
                modules,
                fibre_m,
                topology: OpticalTopology::RedundantRing,
            }),
            ..Network::new(baud, profile, &plc)
        };
        (network.plan().params.t_sl.0, network.plan().params.retry_limit)
    };
    // PROFIBUS network manual (C79000-G8976-C124-03), 3.3.4: 20 modules, 20 km, 1.5 Mbit/s: 351 + 30 · 20 + 24 · 20 = 1431, retry limit 3.
    assert_eq!(ring(Baud::B1500000, 20, 20_000, Profile::Dp), (1_431, 3));
    // Tables 3a and 3b, a + b · 10 + c · 10, where b · 10 is whole.
    assert_eq!(ring(Baud::B12000000, 10, 10_000, Profile::Dp).0, 1_651 + 2_400 + 280);
    assert_eq!(ring(Baud::B6000000, 10, 10_000, Profile::Dp).0, 951 + 1_200 + 240);
    assert_eq!(ring(Baud::B500000, 10, 10_000, Profile::Dp).0, 251 + 100 + 240);
    assert_eq!(ring(Baud::B45450, 10, 0, Profile::Dp).0, 851 + 240);
    assert_eq!(
        ring(Baud::B1500000, 10, 10_000, Profile::Universal).0,
        2_011 + 300 + 240
    );
    assert_eq!(ring(Baud::B500000, 10, 10_000, Profile::Universal).0, 771 + 100 + 240);
    assert_eq!(ring(Baud::B19200, 10, 0, Profile::Universal).0, 181 + 240);
}

#[test]
fn an_optical_line_costs_half_of_the_ring() {
    let plc = lone();
    let network = Network {
        optical: Some(Optical {
            modules: 4,
            fibre_m: 2_000,
            topology: OpticalTopology::Line,
        }),
        ..Network::new(Baud::B1500000, Profile::Dp, &plc)
    };
    // 2 km · 10 µs/km · 1.5 = 30; 4 modules · 12 = 48.
    assert_eq!(network.plan().params.t_sl, BitTimes(300 + 78));
}

#[test]
fn profile_standard_has_room_for_stations_that_are_not_named() {
    let drive = [slave(3, 16)];
    let plc = [MasterLoad {
        address: address(2),
        slaves: &drive,
    }];
    let others = Others {
        masters: 1,
        slaves: 2,
        outputs: 32,
        inputs: 32,
    };
    let dp = Network {
        others,
        ..Network::new(Baud::B12000000, Profile::Dp, &plc)
    };
    let standard = Network {
        profile: Profile::Standard,
        ..dp
    };
    let (known, all) = (dp.plan(), standard.plan());
    // A further master without known slaves: everything but the Data_Exchange; two slaves 2 · (41 · 11) + 800 + 76.
    let more = 25_630 - 1_426 + 2 * (2 * 451 + 876);
    assert_eq!(known.params.t_tr, BitTimes(25_630));
    assert_eq!(all.params.t_tr, BitTimes(25_630 + more));
    assert_eq!(all.params.hsa, Address::MAX_STATION);
    assert_eq!(all.params.t_sl, known.params.t_sl);
    // Two masters: two tokens.
    assert_eq!(all.typical_cycle, BitTimes(109 * 2 + 656));
}

#[test]
fn universal_has_slow_stations_and_keeps_its_own_rules() {
    let plc = lone();
    for baud in Baud::ALL.into_iter().filter(|baud| *baud <= Baud::B1500000) {
        let network = Network::new(baud, Profile::Universal, &plc);
        assert_eq!(violations(&network), [], "{baud}");
        let dp = Network::new(baud, Profile::Dp, &plc).plan();
        assert!(network.plan().params.t_sdr_max >= dp.params.t_sdr_max);
    }
    let plan = Network::new(Baud::B1500000, Profile::Universal, &plc).plan();
    // Tsm = 2 + 2 · 240 = 482, Tid1 = 33 + 482; Tsl = 2 · 980 exceeds Tsl1 = 980 + 11 + 482.
    assert_eq!(plan.params.t_id1, BitTimes(515));
    assert_eq!(
        (plan.params.t_sl, plan.params.t_sdr_max),
        (BitTimes(1_960), BitTimes(980))
    );
    // Trdy may be as long as min Tsdr, and a station with so slow a min Tsdr needs it.
    assert_eq!(
        (plan.params.t_sdr_min, plan.params.t_rdy),
        (BitTimes(150), BitTimes(150))
    );
    assert_eq!(
        violations(&Network::new(Baud::B3000000, Profile::Universal, &plc)),
        [Violation::UniversalTooFast { baud: Baud::B3000000 }]
    );
}

#[test]
fn every_profile_keeps_the_rules_at_every_baud_rate() {
    let drive = [slave(3, 244)];
    let plc = [MasterLoad {
        address: address(2),
        slaves: &drive,
    }];
    for baud in Baud::ALL {
        for profile in [Profile::Dp, Profile::Standard] {
            let network = Network::new(baud, profile, &plc);
            assert_eq!(violations(&network), [], "{baud}");
        }
    }
}

#[test]
fn each_broken_rule_of_the_cables_is_named() {
    let plc = lone();
    let cable = |length_cm, stations, stubs_cm| Segment {
        length_cm,
        stations,
        stubs_cm,
    };
    let at = |baud, segments: &[Segment], repeaters| {
        violations(&Network {
            segments,
            repeaters,
            ..Network::new(baud, Profile::Dp, &plc)
        })
    };
    // Film-feed specification, section 2: the longest segments are allowed, a centimetre more is not.
    for (baud, most_m) in [
        (Baud::B9600, 1_000),
        (Baud::B187500, 1_000),
        (Baud::B500000, 400),
        (Baud::B1500000, 200),
        (Baud::B3000000, 100),
        (Baud::B12000000, 100),
    ] {
        assert_eq!(at(baud, &[cable(most_m * 100, 32, 0)], 0), []);
        assert_eq!(
            at(baud, &[cable(100, 2, 0), cable(most_m * 100 + 1, 2, 0)], 1),
            [Violation::SegmentLength {
                segment: 2,
                baud,
                got_cm: most_m * 100 + 1,
                most_m
            }]
        );
    }
    assert_eq!(
        at(Baud::B500000, &[cable(100, 33, 0)], 0),
        [Violation::SegmentStations {
            segment: 1,
            got: 33,
            most: 32
        }]
    );
    assert_eq!(
        at(Baud::B500000, &[cable(100, 2, 0); 5], 4),
        [Violation::Repeaters { got: 4, most: 3 }]
    );
    assert_eq!(
        at(Baud::B500000, &[cable(100, 2, 0)], 1),
        [Violation::SegmentsMissing {
            repeaters: 1,
            segments: 1
        }]
    );
    // Stubs: 6 m in all at 1.5 Mbit/s, none above, no rule below.
    assert_eq!(at(Baud::B1500000, &[cable(100, 2, 600)], 0), []);
    assert_eq!(
        at(Baud::B1500000, &[cable(100, 2, 601)], 0),
        [Violation::Stubs {
            segment: 1,
            baud: Baud::B1500000,
            got_cm: 601,
            most_m: 6
        }]
    );
    assert_eq!(
        at(Baud::B3000000, &[cable(100, 2, 1)], 0),
        [Violation::Stubs {
            segment: 1,
            baud: Baud::B3000000,
            got_cm: 1,
            most_m: 0
        }]
    );
    assert_eq!(at(Baud::B500000, &[cable(100, 2, 5_000)], 0), []);
}

#[test]
fn each_broken_rule_of_the_stations_is_named() {
    let check = |masters: &[MasterLoad<'_>], hsa| {
        violations(&Network {
            hsa,
            ..Network::new(Baud::B1500000, Profile::Dp, masters)
        })
    };
    assert_eq!(check(&[], None), [Violation::NoMaster]);
    let twice = [slave(3, 1), slave(3, 1)];
    let plc = |slaves| {
        [MasterLoad {
            address: address(2),
            slaves,
        }]
    };
    assert_eq!(
        check(&plc(&twice), None),
        [Violation::AddressTwice { address: address(3) }]
    );
    assert_eq!(
        check(&plc(&[]), Some(address(1))),
        [Violation::AboveHsa {
            address: address(2),
            hsa: address(1)
        }]
    );
    let large = [SlaveLoad {
        inputs: 245,
        ..slave(3, 1)
    }];
    assert_eq!(
        check(&plc(&large), None),
        [Violation::TooMuchData {
            address: address(3),
            got: 245,
            most: 244
        }]
    );
    let crowd = Network {
        others: Others {
            masters: 0,
            slaves: 126,
            outputs: 1,
            inputs: 1,
        },
        ..Network::new(Baud::B1500000, Profile::Standard, &[])
    };
    assert_eq!(
        violations(&Network {
            masters: &plc(&[]),
            ..crowd
        }),
        [Violation::Stations { got: 127, most: 126 }]
    );
}

#[test]
fn each_broken_rule_of_chosen_parameters_is_named_and_none_hides_another() {
    let drive = [SlaveLoad {
        t_sdr_max: Some(BitTimes(150)),
        ..slave(3, 16)
    }];
    let plc = [MasterLoad {
        address: address(2),
        slaves: &drive,
    }];
    let good = chosen();
    let check = |params| violations(&Network::new(Baud::B1500000, Profile::User(params), &plc));
    assert_eq!(check(good), []);
    let bad = BusParams {
        retry_limit: 9,
        gap_factor: 0,
        t_sdr_max: BitTimes(100),
        t_id1: BitTimes(36),
        t_tr: BitTimes(500),
        hsa: address(1),
        ..good
    };
    let found = check(bad);
    for expected in [
        Violation::AboveHsa {
            address: address(2),
            hsa: address(1),
        },
        Violation::SlowSlave {
            address: address(3),
            got: BitTimes(150),
            most: BitTimes(100),
        },
        Violation::Params(BusParamsError::RetryLimit { got: 9 }),
        Violation::Params(BusParamsError::GapFactor { got: 0 }),
        Violation::Params(BusParamsError::Tid1 {
            least: BitTimes(37),
            got: BitTimes(36),
        }),
    ] {
        assert!(found.contains(&expected), "{expected} is missing in {found:?}");
    }
    assert!(
        found
            .iter()
            .any(|violation| matches!(violation, Violation::TargetRotation { got: BitTimes(500), .. })),
        "{found:?}"
    );
    assert_eq!(found.len(), 6, "{found:?}");
    // STEP 7 V13, table 3-2: max Tsdr at least 35 + 2·Tset + Tqui = 37, min Tsdr below that.
    let slow_setup = BusParams {
        t_set: BitTimes(100),
        t_id1: BitTimes(235),
        t_id2: BitTimes(235),
        ..good
    };
    assert_eq!(
        check(slow_setup),
        [
            Violation::MaxTsdrBelowIdle {
                least: BitTimes(235),
                got: BitTimes(150)
            },
            Violation::SlotTime {
                // Tsl2 = Tid1 + 11 + Tsm = 235 + 11 + 202.
                least: BitTimes(448),
                got: BitTimes(300)
            },
        ]
    );
    let late = BusParams {
        t_sdr_min: BitTimes(37),
        ..good
    };
    assert_eq!(
        check(late),
        [Violation::MinTsdrTooLong {
            most: BitTimes(36),
            got: BitTimes(37)
        }]
    );
    assert_eq!(
        violations(&Network::new(Baud::B500000, Profile::User(good), &plc)),
        [Violation::OtherBaud {
            params: Baud::B1500000,
            network: Baud::B500000
        }]
    );
}

/// One wrong value each, and what is found right behind it with the value set right (ranges: EN 50170-2, part 4, bus parameters).
#[test]
fn each_value_out_of_its_range_is_named_and_the_others_are_checked_all_the_same() {
    let plc = lone();
    let good = chosen();
    // The last rule there is.
    let last = BusParams {
        hsa: Address::BROADCAST,
        ..good
    };
    let hsa = BusParamsError::Hsa {
        got: Address::BROADCAST,
    };
    let cases = [
        (
            BusParams {
                t_sdr_min: BitTimes(10),
                ..last
            },
            BusParamsError::MinTsdr { got: BitTimes(10) },
        ),
        (
            BusParams {
                t_set: BitTimes(0),
                ..last
            },
            BusParamsError::Tset { got: BitTimes(0) },
        ),
        (
            BusParams { retry_limit: 9, ..last },
            BusParamsError::RetryLimit { got: 9 },
        ),
        (
            BusParams {
                gap_factor: 101,
                ..last
            },
            BusParamsError::GapFactor { got: 101 },
        ),
        (
            BusParams {
                t_sdr_max: BitTimes(11),
                ..last
            },
            BusParamsError::MaxTsdr {
                min: BitTimes(11),
                got: BitTimes(11),
            },
        ),
        (
            BusParams {
                t_sdr_max: BitTimes(1024),
                t_id2: BitTimes(1024),
                t_sl: BitTimes(2_000),
                ..last
            },
            BusParamsError::MaxTsdr {
                min: BitTimes(11),
                got: BitTimes(1024),
            },
        ),
        (
            BusParams {
                t_rdy: BitTimes(12),
                ..last
            },
            BusParamsError::Trdy {
                min_tsdr: BitTimes(11),
                got: BitTimes(12),
            },
        ),
        (
            BusParams {
                t_qui: BitTimes(11),
                t_id1: BitTimes(60),
                ..last
            },
            BusParamsError::Tqui {
                t_rdy: BitTimes(11),
                got: BitTimes(11),
            },
        ),
        (
            // Tsyn + Tsm = 33 + 2 + 2·1.
            BusParams {
                t_id1: BitTimes(36),
                ..last
            },
            BusParamsError::Tid1 {
                least: BitTimes(37),
                got: BitTimes(36),
            },
        ),
        (
            BusParams {
                t_id2: BitTimes(149),
                ..last
            },
            BusParamsError::Tid2 {
                least: BitTimes(150),
                got: BitTimes(149),
            },
        ),
        (
            // Max Tsdr + 11 + Tsm = 150 + 11 + 4.
            BusParams {
                t_sl: BitTimes(16_384),
                ..last
            },
            BusParamsError::Tsl {
                least: BitTimes(165),
                got: BitTimes(16_384),
            },
        ),
        (
            BusParams {
                t_tr: BitTimes(0),
                ..last
            },
            BusParamsError::Ttr { got: BitTimes(0) },
        ),
    ];
    let of_params = |params| {
        let found = violations(&Network::new(Baud::B1500000, Profile::User(params), &plc));
        let of_params = found.into_iter().filter_map(|violation| match violation {
            Violation::Params(error) => Some(error),
            _ => None,
        });
        of_params.collect::<Vec<_>>()
    };
    for (params, expected) in cases {
        assert_eq!(of_params(params), [expected, hsa]);
    }
    // A min Tsdr that leaves no room for a max Tsdr: nothing behind it can be judged.
    let no_room = BusParams {
        t_sdr_min: BitTimes(1023),
        ..last
    };
    assert_eq!(
        of_params(no_room),
        [BusParamsError::MaxTsdr {
            min: BitTimes(1023),
            got: BitTimes(150)
        }]
    );
}

#[test]
fn a_value_at_the_limit_breaks_no_rule() {
    let plc = lone();
    let good = chosen();
    let check = |params| violations(&Network::new(Baud::B1500000, Profile::User(params), &plc));
    // 33 + 2 + 2·100 = 235: max Tsdr may be that, min Tsdr one less than 37.
    let slow_setup = BusParams {
        t_set: BitTimes(100),
        t_sdr_max: BitTimes(235),
        t_id1: BitTimes(235),
        t_id2: BitTimes(235),
        t_sl: BitTimes(448),
        ..good
    };
    assert_eq!(check(slow_setup), []);
    let late = BusParams {
        t_sdr_min: BitTimes(36),
        ..good
    };
    assert_eq!(check(late), []);
    let full = Network {
        masters: &plc,
        others: Others {
            masters: 0,
            slaves: 125,
            outputs: 1,
            inputs: 1,
        },
        ..Network::new(Baud::B1500000, Profile::Standard, &[])
    };
    assert_eq!(violations(&full), []);
    // IEC 61158-6-3: a watchdog counts 10 ms · factor 1 · factor 2, 255 each.
    let watchdog = |ms| {
        violations(&Network {
            watchdog: Some(Duration::from_millis(ms)),
            ..Network::new(Baud::B1500000, Profile::Dp, &plc)
        })
    };
    assert_eq!(watchdog(650_250), []);
    assert!(matches!(watchdog(650_260)[..], [Violation::Watchdog { .. }]));
    let network = Network::new(Baud::B1500000, Profile::Dp, &plc);
    let least = network.baud.duration(network.plan().least_constant_cycle);
    let cycle = |time| {
        violations(&Network {
            constant_cycle: Some(time),
            ..network
        })
    };
    assert_eq!(cycle(least), []);
    assert_eq!(
        cycle(least - Duration::from_nanos(1)),
        [Violation::ConstantCycle {
            least,
            got: least - Duration::from_nanos(1)
        }]
    );
}

#[test]
fn without_acyclic_cycles_repetitions_are_those_of_the_longest_exchange() {
    let drive = [slave(3, 16)];
    let plc = [MasterLoad {
        address: address(2),
        slaves: &drive,
    }];
    let network = Network {
        acyclic: 0,
        ..Network::new(Baud::B12000000, Profile::Dp, &plc)
    };
    // As above without the acyclic cycle; the request of Data_Exchange four times: 275 + 1000 + 76.
    assert_eq!(
        network.plan().params.t_tr,
        BitTimes(109 + 1_426 + 943 + 1_142 + 4 * 1_351)
    );
}

#[test]
fn the_proposed_watchdog_ends_at_its_longest() {
    let plc = lone();
    let network = |acyclic| Network {
        acyclic,
        ..Network::new(Baud::B9600, Profile::Dp, &plc)
    };
    // Above 5.1 s, which is where ten times the sum of both factors would end.
    let plan = network(16).plan();
    let six = Duration::from_nanos(network(16).baud.duration(plan.params.t_tr).as_nanos() * 6);
    assert!(six > Duration::from_millis(5_100));
    assert!(plan.watchdog >= six && plan.watchdog - six < Duration::from_millis(11));
    assert_eq!(network(100_000).plan().watchdog, Duration::from_millis(650_250));
}

#[test]
fn times_too_long_to_count_are_the_longest_there_are() {
    // 11 · 5·10⁸ tBIT and three for each repeater are more than 32 bits hold.
    assert_eq!(octet_bits(500_000_000), BitTimes(u32::MAX));
    let way = Way {
        repeaters: u32::MAX,
        ..Way::default()
    };
    assert_eq!(way.round_trip(Baud::B9600), BitTimes(u32::MAX));
}

#[test]
fn a_slot_time_without_room_for_the_cable_is_named() {
    let plc = lone();
    let tight = BusParams {
        // Tsl1 without the line: 150 + 11 + 4.
        t_sl: BitTimes(165),
        ..BusParams::standard(Baud::B1500000)
    };
    let cable = [Segment {
        length_cm: 20_000,
        stations: 2,
        stubs_cm: 0,
    }];
    let network = Network {
        segments: &cable,
        ..Network::new(Baud::B1500000, Profile::User(tight), &plc)
    };
    // 200 m · 10 ns = 2 µs = 3 tBIT.
    assert_eq!(
        violations(&network),
        [Violation::SlotTime {
            least: BitTimes(168),
            got: BitTimes(165)
        }]
    );
}

#[test]
fn watchdog_and_constant_cycle_are_checked_against_the_load() {
    let drive = [slave(3, 16)];
    let plc = [
        MasterLoad {
            address: address(2),
            slaves: &drive,
        },
        MasterLoad {
            address: address(4),
            slaves: &[],
        },
    ];
    let one = Network::new(Baud::B12000000, Profile::Dp, &plc[..1]);
    let wish = |watchdog_ms: Option<u64>, cycle_us: Option<u64>, network: Network<'_>| {
        violations(&Network {
            watchdog: watchdog_ms.map(Duration::from_millis),
            constant_cycle: cycle_us.map(Duration::from_micros),
            ..network
        })
    };
    // Ttr is 25 630 tBIT = 2.136 ms, so a rotation fits into 2200 µs and not into 2100 µs; three of them into 10 ms.
    assert_eq!(wish(Some(10), Some(2_200), one), []);
    let found = wish(Some(5), Some(2_100), one);
    assert!(matches!(
        found[..],
        [
            Violation::Watchdog { least, .. },
            Violation::ConstantCycle { .. }
        ] if least == Duration::from_millis(10)
    ));
    let two = Network::new(Baud::B12000000, Profile::Dp, &plc);
    assert_eq!(
        wish(None, Some(10_000), two),
        [Violation::ConstantCycleMasters { masters: 2 }]
    );
}

#[test]
fn a_ring_asks_for_repetitions_and_a_free_address() {
    let slaves = [slave(1, 1), slave(2, 1)];
    let plc = [MasterLoad {
        address: address(0),
        slaves: &slaves,
    }];
    let ring = Network {
        optical: Some(Optical {
            modules: 2,
            fibre_m: 100,
            topology: OpticalTopology::RedundantRing,
        }),
        hsa: Some(address(2)),
        ..Network::new(Baud::B1500000, Profile::Dp, &plc)
    };
    assert_eq!(violations(&ring), [Violation::RingAddress { hsa: address(2) }]);
    assert_eq!(
        violations(&Network {
            hsa: Some(address(3)),
            ..ring
        }),
        []
    );
    let params = BusParams {
        retry_limit: 1,
        ..ring.plan().params
    };
    let found = violations(&Network {
        profile: Profile::User(params),
        ..ring
    });
    assert!(
        found.contains(&Violation::RingRetries { least: 3, got: 1 }),
        "{found:?}"
    );
}

#[test]
fn absurd_numbers_neither_panic_nor_wrap() {
    let slaves = [SlaveLoad {
        outputs: usize::MAX,
        inputs: usize::MAX,
        t_sdr_max: Some(BitTimes(u32::MAX)),
        address: address(1),
    }];
    let plc = [MasterLoad {
        address: address(0),
        slaves: &slaves,
    }];
    let cable = [Segment {
        length_cm: u32::MAX,
        stations: u32::MAX,
        stubs_cm: u32::MAX,
    }; 2];
    for profile in [Profile::Dp, Profile::Standard, Profile::Universal] {
        let network = Network {
            segments: &cable,
            repeaters: u32::MAX,
            optical: Some(Optical {
                modules: u32::MAX,
                fibre_m: u32::MAX,
                topology: OpticalTopology::RedundantRing,
            }),
            others: Others {
                masters: u32::MAX,
                slaves: u32::MAX,
                outputs: usize::MAX,
                inputs: usize::MAX,
            },
            acyclic: u32::MAX,
            ..Network::new(Baud::B9600, profile, &plc)
        };
        assert!(violations(&network).len() > 5);
    }
}

//! The module's GSD file against the module: what the file promises to a configuration tool must hold on the bus.
//!
//! `gsd-parser` reads the file; what it leaves out is taken from the text. The reader of `dp-master` sets the module up.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

mod bus_bench;

use std::collections::BTreeSet;
use std::path::Path;

use bus_bench::{Bench, FREEZE, LOCK, Reply, SYNC};
use dp_master::address::Address;
use dp_master::dp::{ClearOutputs, SlavePhase, io_lengths, sap};
use dp_master::fdl::BusParams;
use dp_master::gsd::{Gsd, MainFamily, Rate, SetupError};
use dp_master::time::{Baud, BitTimes};
use dp_master::wire::ResponseFunction;
use gsd_parser::{GenericStationDescription, PrmBuilder, SupportedSpeeds};
use lenze9300_model::bus::dp::{Emf2133Config, IDENT, PAR_AND_FOUR_WORDS};
use lenze9300_model::device::{DriveConfig, Fault};
use proptest::prelude::*;

const TEXT: &str = include_str!("../gsd/LENZ00DA.GSD");

fn gsd() -> GenericStationDescription {
    gsd_parser::parser::parse(Path::new("LENZ00DA.GSD"), TEXT).unwrap()
}

/// The description as our own reader gives it; there must be nothing to say about the file.
fn description() -> Gsd {
    let reading = dp_master::gsd::parse(TEXT.as_bytes());
    assert_eq!(reading.diagnostics, []);
    reading.gsd
}

/// The value of a keyword as it stands in the file.
fn value(keyword: &str) -> &'static str {
    let mut values = TEXT.lines().filter_map(|line| {
        let (key, value) = line.split_once('=')?;
        (key.trim() == keyword).then_some(value.trim())
    });
    let value = values.next().unwrap();
    assert_eq!(values.next(), None, "{keyword} stands twice");
    value
}

fn bench() -> Bench {
    Bench::new(Emf2133Config::default(), DriveConfig::default())
}

/// Name and identifiers of the configurations of the fact sheet, section 1.2.
fn configurations() -> Vec<(String, Vec<u8>)> {
    let mut expected = Vec::new();
    for n in 1..=16_u8 {
        let (whole, by_word) = (0xF0 + (n - 1), 0x70 + (n - 1));
        expected.push((format!("PAR(Cons.) + PZD({n}W Cons.)"), vec![0xF3, whole]));
        expected.push((format!("PAR(Cons.) + PZD({n}W)"), vec![0xF3, by_word]));
        expected.push((format!("PZD({n}W Cons.)"), vec![whole]));
        expected.push((format!("PZD({n}W)"), vec![by_word]));
    }
    expected.sort();
    expected
}

#[test]
fn the_file_describes_a_dp_slave_with_the_modules_ident_number() {
    let gsd = gsd();
    assert_eq!(gsd.ident_number, IDENT);
    // The file's name ends with the ident number: LENZ00DA.
    assert_eq!(format!("LENZ{IDENT:04X}"), "LENZ00DA");
    assert_eq!(gsd.vendor, "Lenze");
    for (keyword, expected) in [("Protocol_Ident", "0"), ("Station_Type", "0"), ("FMS_supp", "0")] {
        assert_eq!(value(keyword), expected, "{keyword}");
    }
}

#[test]
fn all_ten_baud_rates_of_dp_are_supported_and_the_revision_of_the_file_knows_them() {
    let gsd = gsd();
    let all = SupportedSpeeds::all().difference(SupportedSpeeds::B31250);
    assert_eq!(gsd.supported_speeds, all);
    assert_eq!(Baud::ALL.len(), 10);
    // 45.45_supp exists from GSD_Revision 2 on.
    assert!(gsd.gsd_revision >= 2, "GSD_Revision = {}", gsd.gsd_revision);
}

#[test]
fn the_module_answers_within_the_max_tsdr_of_the_file_at_every_baud_rate() {
    let t = gsd().max_tsdr;
    let times = [
        t.b9600,
        t.b19200,
        t.b45450,
        t.b93750,
        t.b187500,
        t.b500000,
        t.b1500000,
        t.b3000000,
        t.b6000000,
        t.b12000000,
    ];
    // Source: 9300 facts 8.
    assert_eq!(times, [60, 60, 250, 60, 60, 100, 150, 250, 450, 800]);
    for (baud, max_tsdr) in Baud::ALL.into_iter().zip(times) {
        let mut bench = Bench::at(baud, Emf2133Config::default(), DriveConfig::default());
        bench.diagnosis();
        assert!(bench.reply_after >= baud.duration(BitTimes(11)), "{baud}");
        assert!(
            bench.reply_after <= baud.duration(BitTimes(u32::from(max_tsdr))),
            "{baud}"
        );
        // A master with the standard bus parameters waits long enough.
        assert!(u32::from(max_tsdr) <= BusParams::standard(baud).t_sdr_max.0, "{baud}");
    }
}

#[test]
fn the_entries_are_the_configurations_of_the_fact_sheet() {
    let mut entries: Vec<_> = gsd()
        .available_modules
        .iter()
        .map(|module| (module.name.clone(), module.config.clone()))
        .collect();
    entries.sort();
    assert_eq!(entries, configurations());
    let thesis = ("PAR(Cons.) + PZD(4W Cons.)".to_owned(), PAR_AND_FOUR_WORDS.to_vec());
    assert!(entries.contains(&thesis));
    // Visible-String(32) and one name an entry.
    assert!(entries.iter().all(|(name, _)| name.len() <= 32));
}

#[test]
fn the_module_accepts_every_entry_and_no_other_configuration_of_one_or_two_identifiers() {
    let entries: BTreeSet<Vec<u8>> = gsd()
        .available_modules
        .iter()
        .map(|module| module.config.clone())
        .collect();
    assert_eq!(entries.len(), 64);
    let one = (0..=u8::MAX).map(|identifier| vec![identifier]);
    let two = (0..=u16::MAX).map(|identifiers| identifiers.to_be_bytes().to_vec());
    let mut bench = bench();
    for identifiers in one.chain(two) {
        assert_eq!(
            bench.accepts(&identifiers),
            entries.contains(&identifiers),
            "{identifiers:02X?}"
        );
        if !entries.contains(&identifiers) {
            // Cfg_Fault, bit 2 of station status 1.
            assert_eq!(bench.module.slave().diagnosis().octets()[0] & 0x04, 0x04);
        }
    }
}

#[test]
fn a_refused_configuration_is_told_in_the_diagnosis_on_the_bus() {
    let mut bench = bench();
    assert!(!bench.accepts(&[0xF3, 0xF3, 0xF3]));
    // Cfg_Fault and Station_Not_Ready; Prm_Req, which a slave back in Wait_Prm shows.
    let diagnosis = bench.diagnosis();
    assert_eq!(diagnosis[..2], [0x06, 0x05]);
    assert_eq!(diagnosis[4..6], IDENT.to_be_bytes());
}

#[test]
fn the_lengths_are_those_of_the_longest_entry() {
    let gsd = gsd();
    let lengths: Vec<_> = gsd
        .available_modules
        .iter()
        .map(|module| io_lengths(&module.config).unwrap())
        .collect();
    let longest = |length: &dyn Fn(usize) -> usize| (0..lengths.len()).map(length).max().unwrap();
    assert_eq!(
        usize::from(gsd.max_input_length),
        longest(&|place| lengths[place].inputs)
    );
    assert_eq!(
        usize::from(gsd.max_output_length),
        longest(&|place| lengths[place].outputs)
    );
    assert_eq!(
        usize::from(gsd.max_data_length),
        longest(&|place| lengths[place].inputs + lengths[place].outputs)
    );
    // 9300 facts 1.1: 8 octets of parameters and 16 words.
    assert_eq!((gsd.max_input_length, gsd.max_data_length), (40, 80));

    let mut bench = bench();
    for (module, lengths) in gsd.available_modules.iter().zip(lengths) {
        bench.start_up(&module.config, None);
        let inputs = bench.exchange(&vec![0; lengths.outputs]);
        assert_eq!(inputs.len(), lengths.inputs, "{}", module.name);
        bench.step();
    }
    // Modular, and room for the two identifiers of an entry, which some tools count as two modules.
    assert!(gsd.modular_station);
    assert_eq!(gsd.max_modules, 2);
}

#[test]
fn the_longest_diagnosis_has_the_length_of_the_file() {
    let mut bench = bench();
    bench.start_up(PAR_AND_FOUR_WORDS, None);
    let mut longest = bench.diagnosis().len();
    for fault in Fault::ALL {
        bench.drive.inject(fault, true);
        bench.steps(2);
        longest = longest.max(bench.diagnosis().len());
        bench.drive.inject(fault, false);
    }
    assert_eq!(longest, usize::from(gsd().max_diag_data_length));
}

#[test]
fn the_user_parameters_of_the_file_are_accepted() {
    let gsd = gsd();
    let prm = PrmBuilder::new(&gsd.user_prm_data);
    let user = prm.as_bytes();
    // Three octets without known meaning (9300 facts 8).
    assert_eq!(user, [0, 0, 0]);
    assert_eq!(value("Max_User_Prm_Data_Len").parse(), Ok(user.len()));
    let mut bench = bench();
    bench.set_prm(LOCK, None, user);
    assert_eq!(bench.module.slave().phase(), SlavePhase::WaitCfg);
    assert_eq!(bench.module.slave().user_prm(), user);
}

#[test]
fn sync_freeze_and_set_slave_address_are_as_the_file_says() {
    let gsd = gsd();
    let mut bench = bench();
    assert!(gsd.sync_mode_supported && gsd.freeze_mode_supported && gsd.auto_baud_supported);
    bench.set_prm(LOCK | SYNC | FREEZE, None, &[]);
    assert_eq!(bench.module.slave().phase(), SlavePhase::WaitCfg);
    // 9300 facts 1.1: Set_Slave_Address is not supported.
    assert!(!gsd.set_slave_addr_supported);
    let refused = Reply::Data {
        function: ResponseFunction::NoService,
        data: Vec::new(),
    };
    assert_eq!(bench.ask(Some(sap::SET_SLAVE_ADD), &[9, 0x00, 0xDA, 0]), refused);
    assert!(!gsd.fail_safe);
    assert_eq!(value("Min_Slave_Intervall"), "1");
}

#[test]
fn both_readers_agree_about_the_file() {
    let (own, peer) = (description(), gsd());
    assert_eq!(own.general.ident_number, Some(peer.ident_number));
    assert_eq!(own.general.model_name, Some(peer.model));
    let entries: Vec<_> = own
        .modules
        .iter()
        .map(|module| (&module.name, &module.config))
        .collect();
    let peers: Vec<_> = peer
        .available_modules
        .iter()
        .map(|module| (&module.name, &module.config))
        .collect();
    assert_eq!(entries, peers);
    let (slave, prm) = (&own.slave, PrmBuilder::new(&peer.user_prm_data));
    assert_eq!(slave.max_module, Some(peer.max_modules));
    assert_eq!(slave.max_input_len, Some(peer.max_input_length));
    assert_eq!(slave.max_output_len, Some(peer.max_output_length));
    assert_eq!(slave.max_data_len, Some(peer.max_data_length));
    assert_eq!(slave.max_diag_data_len, Some(peer.max_diag_data_length));
    assert_eq!(own.prm.constants[0].octets, prm.as_bytes());
    // What the other one leaves out.
    assert_eq!(slave.min_slave_intervall, Some(1));
    let family = slave.slave_family.as_ref().unwrap();
    assert_eq!(
        (family.main, &family.sub[..]),
        (MainFamily::Drives, &["Lenze".to_owned()][..])
    );
    assert!(Baud::ALL.into_iter().all(|baud| own.supports(baud)));
    assert!(!own.rates.contains_key(&Rate::B31250));
}

#[test]
fn a_project_with_the_thesis_configuration_starts_the_module() {
    let gsd = description();
    let mut project = gsd.configure();
    assert_eq!(project.plug("PAR(Cons.) + PZD(4W Cons.)"), Ok(1));
    // 9300 facts 1.2: F3 F3; three octets without known meaning (8).
    assert_eq!(project.identifiers().unwrap(), PAR_AND_FOUR_WORDS);
    assert_eq!(project.identifiers().unwrap(), [0xF3, 0xF3]);
    assert_eq!(project.user_prm().unwrap(), [0, 0, 0]);
    let slave = project.slave_config(Address::new(3).unwrap()).unwrap();
    assert_eq!(slave.ident, IDENT);
    assert_eq!(slave.clear_outputs, ClearOutputs::Zeros);
    let lengths = slave.configuration.lengths();
    assert_eq!((lengths.inputs, lengths.outputs), (16, 16));

    let mut bench = bench();
    bench.set_prm(LOCK, None, &slave.user_prm);
    assert_eq!(bench.module.slave().phase(), SlavePhase::WaitCfg);
    bench.start_up(slave.configuration.identifiers(), None);
    assert_eq!(bench.exchange(&[0; 16]).len(), 16);
}

#[test]
fn two_entries_together_are_more_than_the_module_takes() {
    let gsd = description();
    let mut project = gsd.configure();
    project.plug("PAR(Cons.) + PZD(16W Cons.)").unwrap();
    project.plug("PZD(1W)").unwrap();
    let refusal = project.identifiers().unwrap_err();
    assert!(
        matches!(refusal, SetupError::TooMany { got: 42, max: 40, .. }),
        "{refusal}"
    );
    assert!(matches!(project.plug("PZD(2W)"), Err(SetupError::NoFreeSlot { .. })));
}

proptest! {
    #[test]
    fn no_configuration_but_the_entries_is_accepted_whatever_its_length(
        identifiers in prop::collection::vec(prop_oneof![0xF0..=0xFF_u8, 0x70..=0x7F_u8, any::<u8>()], 0..24),
    ) {
        let known = configurations().iter().any(|(_, config)| *config == identifiers);
        prop_assert_eq!(bench().accepts(&identifiers), known);
    }
}

//! Telegrams for people. The octets are put together by hand from the standard; the words are what an engineer should read.

use dp_master::wire::{Pretty, Service, Side, Telegram, decode_one, sap_name};

/// The octets of a telegram with variable data from DA to the last data octet: LE, LEr, FCS and ED are added by the rules of IEC 61158-4-3.
fn sd2(body: &[u8]) -> Vec<u8> {
    let le = u8::try_from(body.len()).unwrap();
    let fcs = body.iter().fold(0_u8, |sum, octet| sum.wrapping_add(*octet));
    [&[0x68, le, le, 0x68][..], body, &[fcs, 0x16]].concat()
}

#[track_caller]
fn line(octets: &[u8]) -> String {
    let (telegram, used) = decode_one(octets).unwrap();
    assert_eq!(used, octets.len());
    Pretty(&telegram).to_string()
}

#[track_caller]
fn lines(octets: &[u8]) -> String {
    format!("{:#}", Pretty(&decode_one(octets).unwrap().0))
}

#[track_caller]
fn service(octets: &[u8]) -> Service {
    Service::of(&decode_one(octets).unwrap().0)
}

#[test]
fn a_token_says_who_passes_it_to_whom() {
    // SD4 DA SA
    assert_eq!(line(&[0xDC, 0x05, 0x02]), "2 → 5  token");
    assert_eq!(service(&[0xDC, 0x05, 0x02]), Service::Token);
}

#[test]
fn telegrams_of_fixed_length_are_named_by_their_start_delimiter() {
    assert_eq!(
        lines(&[0xDC, 0x05, 0x02]),
        "SD4, 3 octets\n  destination  5\n  source       2\n  service      Token\n"
    );
    assert_eq!(lines(&[0xE5]), "SC, 1 octet\n  service      Short_Ack\n");
    assert_eq!(
        lines(&[0x10, 0x03, 0x02, 0x49, 0x4E, 0x16]),
        "SD1, 6 octets\n  destination  3\n  source       2\n  function     49 FDL status\n  service      FDL_Status\n"
    );
}

#[test]
fn a_short_acknowledgement_has_no_addresses() {
    assert_eq!(line(&[0xE5]), "short acknowledgement");
}

#[test]
fn the_fdl_status_is_asked_and_told_with_the_station_type() {
    assert_eq!(line(&[0x10, 0x03, 0x02, 0x49, 0x4E, 0x16]), "2 → 3  FDL_Status request");
    assert_eq!(line(&[0x10, 0x02, 0x03, 0x00, 0x05, 0x16]), "3 → 2  FDL_Status slave");
    // Station type 3 in bits 5 and 4: in the ring.
    assert_eq!(
        line(&[0x10, 0x02, 0x01, 0x30, 0x33, 0x16]),
        "1 → 2  FDL_Status master in ring"
    );
}

#[test]
fn a_diagnosis_is_asked_for_at_sap_60() {
    // DA 3, SA 2 with access points 60 and 62; 6D = SRD high, FCB 1, FCV 0.
    let octets = sd2(&[0x83, 0x82, 0x6D, 60, 62]);
    assert_eq!(line(&octets), "2 → 3  SRD high first  Slave_Diag");
    assert_eq!(
        lines(&octets),
        "SD2, 11 octets\n  destination  3\n  source       2\n  function     6D SRD high first\n  DSAP         60 Slave_Diag\n  \
         SSAP         62 MS0\n  service      Slave_Diag\n"
    );
}

#[test]
fn a_diagnosis_tells_its_bits_by_name() {
    // IEC 61158-6-3: status 1 = Station_Not_Ready, status 2 = Prm_Req with bit 2 always 1; no master; ident 00DA.
    let octets = sd2(&[0x82, 0x83, 0x08, 62, 60, 0x02, 0x05, 0x00, 0xFF, 0x00, 0xDA]);
    assert_eq!(
        line(&octets),
        "3 → 2  DL slave  Slave_Diag  [Station_Not_Ready Prm_Req] master none ident 00DA"
    );
}

#[test]
fn the_blocks_of_an_extended_diagnosis_are_told_apart() {
    // 9300 facts 1.4: header 03, then the fault code 3210h; then modules 0 and 2, channel 3 of module 1 (in, bit, wire break), revision 7.
    let octets = sd2(&[
        0x82, 0x83, 0x0A, 62, 60, 0x08, 0x0C, 0x80, 0x02, 0x00, 0xDA, 0x03, 0x32, 0x10, 0x42, 0x05, 0x81, 0x43, 0x26,
        0xC7,
    ]);
    assert_eq!(
        line(&octets),
        "3 → 2  DH slave  Slave_Diag  [Ext_Diag WD_On] master 2 ident 00DA overflow; device 32 10; modules 0 2; \
         channel 3 of module 1 in (bit): line break; revision 7"
    );
    let several = lines(&octets);
    assert!(
        several.contains("\n  block        channel 3 of module 1 in (bit): line break\n"),
        "{several}"
    );
    assert!(
        several.contains("\n  data         15 octets\n      0  08 0C 80 02"),
        "{several}"
    );
}

#[test]
fn parameters_are_read_out() {
    // Lock and WD_On, 10 ms × 5 × 1, min Tsdr 11, ident 00DA, group 1, three user octets.
    let octets = sd2(&[
        0x83, 0x82, 0x5D, 61, 62, 0x88, 5, 1, 11, 0x00, 0xDA, 0x01, 0xC0, 0x00, 0x00,
    ]);
    assert_eq!(
        line(&octets),
        "2 → 3  SRD high FCB=0  Set_Prm  lock WD 50 ms min Tsdr 11 ident 00DA group 01 user C0 00 00"
    );
}

#[test]
fn a_configuration_is_read_module_by_module() {
    // 9300 facts 1.2: F3 = 4 words, both directions, consistent.
    let octets = sd2(&[0x83, 0x82, 0x7C, 62, 62, 0xF3, 0xF3]);
    assert_eq!(
        line(&octets),
        "2 → 3  SRD low FCB=1  Chk_Cfg  F3 = 4 words in+out whole, F3 = 4 words in+out whole"
    );
    assert_eq!(service(&octets), Service::ChkCfg);
    // 21 = two octets of outputs, 10 = one octet of inputs: on lines of their own, whoever says it.
    let modules = "  module       21 = 2 octets out\n  module       10 = 1 octet in\n";
    assert!(lines(&sd2(&[0x83, 0x82, 0x7C, 62, 62, 0x21, 0x10])).contains(modules));
    assert!(lines(&sd2(&[0x82, 0x83, 0x08, 62, 59, 0x21, 0x10])).contains(modules));
}

#[test]
fn what_a_telegram_means_stands_above_its_octets() {
    // Sync and Unfreeze for group 1 at access point 58.
    let octets = sd2(&[0xFF, 0x82, 0x46, 58, 62, 0x24, 0x01]);
    let shown = lines(&octets);
    let (line, _) = shown.split_once("  data  ").unwrap();
    assert!(line.ends_with("  content      Unfreeze Sync, groups 1\n"), "{shown}");
}

#[test]
fn the_special_identifier_format_has_its_own_lengths() {
    // IEC 61158-6-3: C3 = outputs and inputs follow, three octets of the manufacturer; C1 = whole, words, 2; 83 = whole, octets, 4.
    // Then 00, an empty slot, and 41 40 05: inputs, one word without consistency over the module, one octet of the manufacturer.
    let octets = sd2(&[
        0x83, 0x82, 0x7C, 62, 62, 0xC3, 0xC1, 0x83, 0xFD, 0x00, 0x35, 0x00, 0x41, 0x40, 0x05,
    ]);
    assert_eq!(
        line(&octets),
        "2 → 3  SRD low FCB=1  Chk_Cfg  C3 C1 83 FD 00 35 = 2 words out whole + 4 octets in whole manufacturer FD 00 35, \
         00 = empty slot, 41 40 05 = 1 word in manufacturer 05"
    );
}

#[test]
fn a_cut_special_identifier_is_named_incomplete() {
    let octets = sd2(&[0x83, 0x82, 0x7C, 62, 62, 0x11, 0xC3, 0x81]);
    assert_eq!(
        line(&octets),
        "2 → 3  SRD low FCB=1  Chk_Cfg  11 = 2 octets in, C3 81 = incomplete"
    );
}

#[test]
fn global_control_names_its_commands_and_groups() {
    // DA 127 with DSAP 58, SSAP 62; 46 = SDN high; Sync and Freeze to groups 1 and 8.
    let octets = sd2(&[0xFF, 0x82, 0x46, 58, 62, 0x28, 0x81]);
    assert_eq!(
        line(&octets),
        "2 → all  SDN high  Global_Control  Freeze Sync, groups 1 8"
    );
    let operate = sd2(&[0xFF, 0x82, 0x46, 58, 62, 0x00, 0x00]);
    assert_eq!(line(&operate), "2 → all  SDN high  Global_Control  Operate, all groups");
}

#[test]
fn data_exchange_shows_its_data_in_hexadecimal() {
    let request = sd2(&[0x03, 0x02, 0x7D, 0x04, 0x7F]);
    assert_eq!(line(&request), "2 → 3  SRD high FCB=1  Data_Exchange  2 octets: 04 7F");
    let response = sd2(&[0x02, 0x03, 0x0A, 0x40]);
    assert_eq!(line(&response), "3 → 2  DH slave  Data_Exchange  1 octet: 40");
}

#[test]
fn eight_octets_of_data_are_an_sd3_telegram() {
    let mut octets = vec![0xA2, 0x03, 0x02, 0x5D, 1, 2, 3, 4, 5, 6, 7, 8];
    // 3 + 2 + 0x5D + 36 = 0x86
    octets.extend([0x86, 0x16]);
    assert!(lines(&octets).starts_with("SD3, 14 octets\n"));
}

#[test]
fn a_negative_answer_is_told_by_its_name() {
    // 03 = RS: no service activated.
    assert_eq!(
        line(&[0x10, 0x02, 0x03, 0x03, 0x08, 0x16]),
        "3 → 2  RS (no service) slave"
    );
}

#[test]
fn acyclic_services_name_slot_and_index() {
    // MSAC1: 5E = Read, slot 1, index 47, length 240; error answer DE with decode 80, codes B0 00.
    let read = sd2(&[0x83, 0x82, 0x7C, 51, 51, 0x5E, 1, 47, 240]);
    assert_eq!(
        line(&read),
        "2 → 3  SRD low FCB=1  MSAC1  Read slot 1 index 47 length 240"
    );
    let error = sd2(&[0x82, 0x83, 0x08, 51, 51, 0xDE, 0x80, 0xB0, 0x00]);
    assert_eq!(line(&error), "3 → 2  DL slave  MSAC1  Read error decode 80 code B0 00");
    let class_2 = sd2(&[0x83, 0x81, 0x7C, 4, 50, 0x48]);
    assert_eq!(line(&class_2), "1 → 3  SRD low FCB=1  MSAC2  Idle");
}

/// What stands behind the name of the service.
#[track_caller]
fn content(body: &[u8], name: &str) -> String {
    let line = line(&sd2(body));
    let (_, content) = line
        .split_once(&format!("  {name}"))
        .unwrap_or_else(|| panic!("{line}"));
    content.trim_start().to_owned()
}

#[test]
fn a_new_address_is_read_out() {
    // IEC 61158-6-3, coding of Set_Slave_Add: address, ident, No_Add_Chg, octets for the user.
    let told = |data: &[u8]| content(&[&[0x83, 0x82, 0x6D, 55, 62][..], data].concat(), "Set_Slave_Add");
    assert_eq!(told(&[42, 0x00, 0xDA, 0x00]), "new address 42 ident 00DA changeable");
    assert_eq!(
        told(&[42, 0x00, 0xDA, 0xFF, 1, 2]),
        "new address 42 ident 00DA locked user 01 02"
    );
    assert_eq!(told(&[42, 0x00, 0xDA]), "malformed: 2A 00 DA");
}

#[test]
fn what_is_too_short_for_its_service_is_shown_as_it_is() {
    assert_eq!(
        content(&[0x82, 0x83, 0x08, 62, 60, 0x02, 0x05], "Slave_Diag"),
        "malformed: 02 05"
    );
    assert_eq!(content(&[0x83, 0x82, 0x5D, 61, 62, 0x88], "Set_Prm"), "malformed: 88");
    assert_eq!(
        content(&[0xFF, 0x82, 0x46, 58, 62, 0x28], "Global_Control"),
        "malformed: 28"
    );
}

/// Direction in bits 7 and 6 of the second octet; unit in bits 7…5 of the third, error in bits 4…0 (IEC 61158-6-3, Channel_Related_Diagnosis).
#[test]
fn a_channel_tells_its_direction_unit_and_error() {
    let told = |block: &[u8]| {
        let standard = [0x82, 0x83, 0x0A, 62, 60, 0x08, 0x0C, 0x80, 0x02, 0x00, 0xDA];
        let content = content(&[&standard[..], block].concat(), "Slave_Diag");
        content.split_once("; ").unwrap().1.to_owned()
    };
    assert_eq!(
        told(&[0x81, 0x83, 0x21]),
        "channel 3 of module 1 out (bit): short circuit"
    );
    assert_eq!(
        told(&[0x81, 0xC3, 0x21]),
        "channel 3 of module 1 in+out (bit): short circuit"
    );
    assert_eq!(told(&[0x81, 0x03, 0x01]), "channel 3 of module 1: short circuit");
    assert_eq!(told(&[0x81, 0x43, 0xEA]), "channel 3 of module 1 in: error 10");
    // An identifier-related block of five octets of which two are there.
    assert_eq!(told(&[0x45, 0x01]), "malformed 45 01");
}

#[test]
fn each_request_of_the_parameters_is_told() {
    let told = |status: u8, factor: u8| {
        content(
            &[0x83, 0x82, 0x5D, 61, 62, status, factor, 1, 11, 0, 0xDA, 0],
            "Set_Prm",
        )
    };
    let rest = "min Tsdr 11 ident 00DA group 00";
    for (status, factor, expected) in [
        (0x00, 0, "keep WD off"),
        (0x80, 0, "lock WD off"),
        (0x40, 0, "unlock WD off"),
        (0xA0, 0, "lock sync WD off"),
        (0x90, 0, "lock freeze WD off"),
        (0xB8, 10, "lock sync freeze WD 100 ms"),
        (0x88, 0, "lock WD invalid"),
    ] {
        assert_eq!(told(status, factor), format!("{expected} {rest}"), "{status:02X}");
    }
}

/// Bits 5…1: Sync, Unsync, Freeze, Unfreeze, Clear_Data; 7, 6 and 0 are reserved (IEC 61158-6-3, Control_Command).
#[test]
fn each_bit_of_a_control_command_is_told() {
    let told = |command: u8, groups: u8| content(&[0xFF, 0x82, 0x46, 58, 62, command, groups], "Global_Control");
    assert_eq!(told(0x02, 0x02), "Clear_Data, groups 2");
    assert_eq!(told(0x14, 0), "Unfreeze Unsync, all groups");
    assert_eq!(told(0x28, 0), "Freeze Sync, all groups");
    assert_eq!(told(0xC1, 0), "reserved C1, all groups");
    assert_eq!(told(0x42, 0), "Clear_Data reserved 40, all groups");
}

/// Function numbers: IEC 61158-6-3, coding of the MSAC PDUs; bit 7 is an error.
#[test]
fn each_acyclic_service_has_its_name() {
    let told = |data: &[u8]| content(&[&[0x83, 0x82, 0x7C, 51, 51][..], data].concat(), "MSAC1");
    for (octet, name) in [
        (0x48, "Idle"),
        (0x51, "Data_Transport"),
        (0x56, "RM"),
        (0x57, "Initiate"),
        (0x58, "Abort"),
        (0x5C, "Alarm_Ack"),
        (0x5E, "Read"),
        (0x5F, "Write"),
    ] {
        assert_eq!(told(&[octet]), name);
        assert_eq!(
            told(&[octet | 0x80, 0x80, 0xB0, 0x01]),
            format!("{name} error decode 80 code B0 01")
        );
        assert_eq!(told(&[octet, 9]), format!("{name} 09"));
    }
    assert_eq!(
        told(&[0x5F, 1, 47, 2, 0xAA, 0x55]),
        "Write slot 1 index 47 length 2: AA 55"
    );
    assert_eq!(told(&[0x5E, 1, 47, 240]), "Read slot 1 index 47 length 240");
    assert_eq!(told(&[0x58, 1, 47, 240]), "Abort 01 2F F0");
    assert_eq!(told(&[0x33, 1]), "function 33 01");
    assert_eq!(told(&[]), "");
}

#[test]
fn an_access_point_has_a_name_on_each_side() {
    assert_eq!(sap_name(62, Side::Responder), Some("Chk_Cfg"));
    assert_eq!(sap_name(62, Side::Initiator), Some("MS0"));
    assert_eq!(sap_name(50, Side::Initiator), Some("MSAC2"));
    assert_eq!(sap_name(12, Side::Responder), None);
}

#[test]
fn every_function_code_and_access_point_can_be_shown() {
    // Whatever comes from outside must only be shown, never end the program.
    for fc in 0..=u8::MAX {
        for dsap in 0..64 {
            let octets = sd2(&[0x83, 0x82, fc, dsap, 62, 0x00, 0xFF, 0x01]);
            let (telegram, _) = decode_one(&octets).unwrap();
            assert!(Pretty(&telegram).to_string().contains("2 → 3"));
            assert!(format!("{:#}", Pretty(&telegram)).starts_with("SD"));
        }
    }
    assert_eq!(format!("{:#}", Pretty(&Telegram::ShortAck)).lines().count(), 2);
}

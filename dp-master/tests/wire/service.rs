//! Which service a telegram belongs to, and how access points are called. Numbers: IEC 61158-6-3, service access points of DP; functions:
//! IEC 61158-4-3.

use dp_master::address::Address;
use dp_master::wire::{
    Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, Service, Side, StationType, Telegram, sap_name,
};

fn data<'a>(fc: FunctionCode, saps: Option<(u8, u8)>, data: &'a [u8]) -> Telegram<'a> {
    let header = Header::new(Address::new(3).unwrap(), Address::new(2).unwrap(), fc);
    let header = match saps {
        Some((dsap, ssap)) => header.with_saps(dsap, ssap),
        None => header,
    };
    Telegram::Data { header, data }
}

fn request(function: RequestFunction) -> FunctionCode {
    FunctionCode::request(Fcb::High, function)
}

fn response(function: ResponseFunction) -> FunctionCode {
    FunctionCode::response(StationType::Slave, function)
}

#[test]
fn each_service_of_dp_is_told_by_the_access_points_of_slave_and_master() {
    for (slave, master, service, name) in [
        (55, 62, Service::SetSlaveAdd, "Set_Slave_Add"),
        (56, 62, Service::RdInp, "Rd_Inp"),
        (57, 62, Service::RdOutp, "Rd_Outp"),
        (58, 62, Service::GlobalControl, "Global_Control"),
        (59, 62, Service::GetCfg, "Get_Cfg"),
        (60, 62, Service::SlaveDiag, "Slave_Diag"),
        (61, 62, Service::SetPrm, "Set_Prm"),
        (62, 62, Service::ChkCfg, "Chk_Cfg"),
        (53, 62, Service::ExtSetPrm, "Ext_Set_Prm"),
        (54, 54, Service::MasterMaster, "Master_Master"),
        (51, 51, Service::Msac1, "MSAC1"),
        (50, 51, Service::Msac1, "MSAC1"),
        (0, 50, Service::Msac2, "MSAC2"),
        (48, 50, Service::Msac2, "MSAC2"),
        (49, 50, Service::Msac2, "MSAC2"),
        (50, 50, Service::Fdl, "FDL"),
        (53, 50, Service::Fdl, "FDL"),
        (54, 62, Service::Fdl, "FDL"),
        (51, 50, Service::Fdl, "FDL"),
    ] {
        // DSAP of a request, SSAP of a response.
        let asked = data(request(RequestFunction::SrdHigh), Some((slave, master)), &[]);
        let answered = data(response(ResponseFunction::DataLow), Some((master, slave)), &[1]);
        assert_eq!(Service::of(&asked), service, "{slave} {master}");
        assert_eq!(Service::of(&answered), service, "{slave} {master}");
        assert_eq!(service.to_string(), name);
    }
}

#[test]
fn without_access_points_the_function_tells() {
    for (function, service, name) in [
        (RequestFunction::FdlStatus, Service::FdlStatus, "FDL_Status"),
        (RequestFunction::Ident, Service::Ident, "Ident"),
        (RequestFunction::LsapStatus, Service::LsapStatus, "LSAP_Status"),
        (RequestFunction::TimeEvent, Service::Clock, "Clock"),
        (RequestFunction::ClockValue, Service::Clock, "Clock"),
        (RequestFunction::SrdLow, Service::DataExchange, "Data_Exchange"),
        (RequestFunction::SrdHigh, Service::DataExchange, "Data_Exchange"),
        (RequestFunction::Msrd, Service::DataExchange, "Data_Exchange"),
        (RequestFunction::SdaHigh, Service::Fdl, "FDL"),
        (RequestFunction::SdnLow, Service::Fdl, "FDL"),
    ] {
        assert_eq!(
            Service::of(&data(request(function), None, &[])),
            service,
            "{function:?}"
        );
        assert_eq!(service.name(), name);
    }
    for (function, octets, service) in [
        (ResponseFunction::Ok, &[][..], Service::FdlStatus),
        (ResponseFunction::Ok, &[1], Service::DataExchange),
        (ResponseFunction::DataLow, &[], Service::DataExchange),
        (ResponseFunction::DataHigh, &[], Service::DataExchange),
        (ResponseFunction::DataLowNoResource, &[], Service::DataExchange),
        (ResponseFunction::DataHighNoResource, &[], Service::DataExchange),
        (ResponseFunction::NoService, &[], Service::Fdl),
        (ResponseFunction::NoReplyData, &[], Service::Fdl),
    ] {
        assert_eq!(
            Service::of(&data(response(function), None, octets)),
            service,
            "{function:?}"
        );
    }
    // With access points a positive acknowledgement alone is no status.
    let acknowledged = data(response(ResponseFunction::Ok), Some((62, 61)), &[]);
    assert_eq!(Service::of(&acknowledged), Service::SetPrm);
    let token = Telegram::Token {
        da: Address::new(3).unwrap(),
        sa: Address::new(2).unwrap(),
    };
    assert_eq!((Service::of(&token), Service::Token.name()), (Service::Token, "Token"));
    assert_eq!(
        (Service::of(&Telegram::ShortAck), Service::ShortAck.name()),
        (Service::ShortAck, "Short_Ack")
    );
}

#[test]
fn each_access_point_has_its_name_on_its_side() {
    let both: [(u8, &str); 12] = [
        (49, "MSAC2 RM"),
        (51, "MSAC1"),
        (53, "Ext_Set_Prm"),
        (54, "MM"),
        (55, "Set_Slave_Add"),
        (56, "Rd_Inp"),
        (57, "Rd_Outp"),
        (58, "Global_Control"),
        (59, "Get_Cfg"),
        (60, "Slave_Diag"),
        (61, "Set_Prm"),
        (63, "all"),
    ];
    for sap in 0..=63 {
        let same = both.iter().find(|(number, _)| *number == sap).map(|(_, name)| *name);
        let (initiator, responder) = match sap {
            50 => (Some("MSAC2"), Some("MSAC1 alarm")),
            62 => (Some("MS0"), Some("Chk_Cfg")),
            _ => (same, same),
        };
        assert_eq!(sap_name(sap, Side::Initiator), initiator, "{sap}");
        assert_eq!(sap_name(sap, Side::Responder), responder, "{sap}");
    }
}

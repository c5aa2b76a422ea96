//! What the tests of the GSD reader share: a smallest slave to put statements into, and remarks in a form that reads well in a test.

use dp_master::gsd::{self, Gsd, Reading, Severity};

/// A slave about which there is nothing to say. It ends with a line end; what is appended starts in its line 23.
pub(crate) const SLAVE: &str = "\
#Profibus_DP
GSD_Revision = 5
Vendor_Name = \"V\"
Model_Name = \"M\"
Revision = \"1\"
Ident_Number = 0x1234
Protocol_Ident = 0
Station_Type = 0
Hardware_Release = \"1\"
Software_Release = \"1\"
9.6_supp = 1
MaxTsdr_9.6 = 60
Min_Slave_Intervall = 1
Max_Diag_Data_Len = 64
Slave_Family = 0
Max_User_Prm_Data_Len = 20
Modular_Station = 1
Max_Module = 8
Max_Input_Len = 100
Max_Output_Len = 100
Module = \"first\" 0x10
EndModule
";

/// Lines of [`SLAVE`].
pub(crate) const SLAVE_LINES: u32 = 22;

/// The reading of [`SLAVE`] with statements behind it.
pub(crate) fn with(statements: &str) -> Reading {
    gsd::parse(format!("{SLAVE}{statements}").as_bytes())
}

/// The same, when there must be nothing to say about it.
pub(crate) fn clean(statements: &str) -> Gsd {
    let reading = with(statements);
    assert_eq!(remarks(&reading), [""; 0], "{statements}");
    reading.gsd
}

/// What there is to say about [`SLAVE`] with statements behind it, with lines counted from the first of these.
pub(crate) fn complaints(statements: &str) -> Vec<String> {
    let reading = with(statements);
    let relative = |line: u32| match line.checked_sub(SLAVE_LINES) {
        Some(line @ 1..) => line.to_string(),
        _ => format!("slave {line}"),
    };
    reading
        .diagnostics
        .iter()
        .map(|remark| format!("{} {}: {}", remark.severity, relative(remark.line()), remark.message))
        .collect()
}

/// All remarks as `error 12: message`.
pub(crate) fn remarks(reading: &Reading) -> Vec<String> {
    reading
        .diagnostics
        .iter()
        .map(|remark| format!("{} {}: {}", remark.severity, remark.line(), remark.message))
        .collect()
}

/// Whether there is an error.
pub(crate) fn has_error(reading: &Reading) -> bool {
    reading
        .diagnostics
        .iter()
        .any(|remark| remark.severity == Severity::Error)
}

/// Description of a compact slave: Windows-1252, CRLF, parameters without names.
pub(crate) const COMPACT: &[u8] = include_bytes!("WAAG_101.GSD");
/// Description of a remote I/O station: modules in both identifier formats, parameters of modules.
pub(crate) const MODULAR: &[u8] = include_bytes!("RIOW_102.GSD");
/// Description of a drive: parameters of all types.
pub(crate) const DRIVE: &[u8] = include_bytes!("DRMO_103.GSD");
/// Description of a DP-V1 slave: alarms, slots, PROFIsafe, isochronous mode.
pub(crate) const DPV1: &[u8] = include_bytes!("PROX_104.GSD");

/// All of them.
pub(crate) const FILES: [(&str, &[u8]); 4] = [
    ("WAAG_101.GSD", COMPACT),
    ("RIOW_102.GSD", MODULAR),
    ("DRMO_103.GSD", DRIVE),
    ("PROX_104.GSD", DPV1),
];

/// The description in a file about which there must be nothing to say.
pub(crate) fn read(file: &[u8]) -> Gsd {
    let reading = gsd::parse(file);
    assert_eq!(remarks(&reading), [""; 0]);
    reading.gsd
}

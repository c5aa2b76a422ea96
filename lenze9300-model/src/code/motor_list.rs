//! The motor database behind C0086.

use super::table::number::*;

/// A motor of the list: the codes that C0086 resets, with their values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotorEntry {
    /// Value of C0086, without the factor 10000.
    pub number: u16,
    /// Name of the motor as shown by the keypad.
    pub name: &'static str,
    /// Code number and value ×10000, in ascending order of the code.
    pub values: &'static [(u16, i32)],
}

/// The motors the model knows.
///
/// C0011 is not among the dependants although the thesis lists it there (9300 facts 9, row 13); C0075 and C0076 are
/// (row 12). Source: film-feed specification, section 5; 9300 facts 4.4.
pub const MOTOR_LIST: &[MotorEntry] = &[MotorEntry {
    number: 108,
    name: "DSKS36-13-200",
    values: &[
        (C0006, 3_0000),
        (C0022, 1_3500),
        (C0070, 5_0000),
        (C0071, 20_0000),
        (C0075, 7500),
        (C0076, 1_5000),
        (C0081, 2500),
        (C0084, 19_8000),
        (C0085, 30_5000),
        (C0087, 4000_0000),
        (C0088, 9000),
        (C0089, 200_0000),
        (C0090, 245_0000),
        (C0091, 1_0000),
        (C0583, 0),
        (C0584, 2_0000),
        (C0594, 0),
    ],
}];

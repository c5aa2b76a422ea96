//! Telegrams of the fieldbus data link layer (FDL): octets to values and back.
//!
//! | start | octet | layout | length |
//! |---|---|---|---|
//! | SD1 | `10` | `SD1 DA SA FC FCS ED` | 6 |
//! | SD2 | `68` | `SD2 LE LEr SD2 DA SA FC data… FCS ED` | LE + 6, LE 4…249 |
//! | SD3 | `A2` | `SD3 DA SA FC data×8 FCS ED` | 14 |
//! | SD4 | `DC` | `SD4 DA SA` | 3 |
//! | SC | `E5` | `SC` | 1 |
//!
//! FCS is the sum of all octets from DA to the last data octet, modulo 256; ED is `16`. Bit 7 of DA or SA says that the data begin with a
//! service access point.
//!
//! Source: IEC 61158-4-3 (DL type 3); film-feed specification, section 2.

mod control;
mod decoder;
mod pretty;
mod service;
mod telegram;

pub use control::{Fcb, FunctionCode, RequestFunction, ResponseFunction, StationType};
pub use decoder::{DecodeError, Decoded, Decoder, DiscardReason, decode_one};
pub use pretty::{Function, Hex, ModuleText, Modules, Pretty, StatusBits};
pub use service::{Service, Side, sap_name};
pub use telegram::{EncodeError, Header, MAX_DATA, MAX_SAP, Telegram};

/// Start delimiter of a telegram without data.
pub const SD1: u8 = 0x10;
/// Start delimiter of a telegram with variable data length.
pub const SD2: u8 = 0x68;
/// Start delimiter of a telegram with eight octets of data.
pub const SD3: u8 = 0xA2;
/// Start delimiter of a token.
pub const SD4: u8 = 0xDC;
/// Short acknowledgement, a telegram of one octet.
pub const SC: u8 = 0xE5;
/// End delimiter.
pub const ED: u8 = 0x16;

/// Smallest LE of an SD2 telegram: DA, SA, FC and one octet of data.
const MIN_LE: u8 = 4;
/// Largest LE of an SD2 telegram: DA, SA, FC and 246 octets of data.
const MAX_LE: u8 = 249;
/// Data octets of an SD3 telegram.
const SD3_DATA: usize = 8;
/// Bit 7 of an address octet: a service access point follows in the data.
const EXTENSION: u8 = 0x80;

/// Frame check sequence: the sum modulo 256.
///
/// Eight octets at a time: telegrams are too short for the compiler's own vector loop to pay.
#[inline]
fn checksum(octets: &[u8]) -> u8 {
    let (words, tail) = octets.as_chunks::<8>();
    let sums = words.iter().fold(0, |sums, word| add_lanes(sums, *word));
    tail.iter()
        .fold(sum_of_lanes(sums), |sum, octet| sum.wrapping_add(*octet))
}

/// Copies `octets` to the front of `to`, as many as both have, and returns their [`checksum`].
///
/// In one pass: what has just been written is read back slowly.
#[inline]
fn copy_with_checksum(octets: &[u8], to: &mut [u8]) -> u8 {
    let (words, tail) = octets.as_chunks::<8>();
    let (words_to, tail_to) = to.as_chunks_mut::<8>();
    let mut sums = 0;
    for (word, to) in words.iter().zip(words_to) {
        *to = *word;
        sums = add_lanes(sums, *word);
    }
    let mut sum = sum_of_lanes(sums);
    for (octet, to) in tail.iter().zip(tail_to) {
        *to = *octet;
        sum = sum.wrapping_add(*octet);
    }
    sum
}

/// Adds eight octets to four sums of 16 bits, in pairs: at most 32 words of at most 2 · 255 each.
#[inline]
fn add_lanes(sums: u64, word: [u8; 8]) -> u64 {
    const EVEN: u64 = 0x00FF_00FF_00FF_00FF;
    let word = u64::from_le_bytes(word);
    sums.wrapping_add((word & EVEN) + ((word >> 8) & EVEN))
}

/// The four sums together, modulo 256.
#[inline]
fn sum_of_lanes(sums: u64) -> u8 {
    (sums.wrapping_mul(0x0001_0001_0001_0001) >> 48) as u8
}

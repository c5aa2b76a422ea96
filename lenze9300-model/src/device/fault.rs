//! The drive's faults: names, numbers, reactions (9300 fact sheet, sections 1.4 and 4.9).

use std::fmt;

/// A monitoring function that can respond. The first set; the numbers are those of the LECOM list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Fault {
    /// CE0: communication over the automation interface. Set by the bus module when C1882 asks for a TRIP.
    Ce0,
    /// EEr: external fault, set over the bus.
    Eer,
    /// LU: DC-link undervoltage.
    Lu,
    /// OU: DC-link overvoltage.
    Ou,
    /// NMAX: speed above C0596.
    Nmax,
    /// OC2: earth fault. Injected only.
    Oc2,
    /// OH4: heat sink warmer than C0122. Injected only.
    Oh4,
    /// P03: following error above C0255.
    P03,
    /// P14: following error above C1218/1 (number assumed).
    P14,
    /// Sd2: resolver. Injected only.
    Sd2,
}

/// What the drive does when a monitoring function responds, the weakest first (fact sheet, section 2.5, priority).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Reaction {
    /// Nothing.
    Off,
    /// The drive runs on, status bit 7.
    Warning,
    /// The output stage is off as long as the cause lasts, status bit 8.
    Message,
    /// The output stage is off until the TRIP is reset.
    Trip,
}

#[derive(Debug)]
struct Row {
    fault: Fault,
    display: &'static str,
    number: u16,
    reaction: Reaction,
    /// DRIVECOM object 603Fh.
    error_code: u16,
    cause: &'static str,
}

const fn row(
    fault: Fault,
    display: &'static str,
    number: u16,
    reaction: Reaction,
    error_code: u16,
    cause: &'static str,
) -> Row {
    Row {
        fault,
        display,
        number,
        reaction,
        error_code,
        cause,
    }
}

/// In the order of the enum. Error codes are the profile's usual groups, assumed for this device (fact sheet, section 1.4).
const TABLE: [Row; 10] = [
    row(
        Fault::Ce0,
        "CE0",
        61,
        Reaction::Trip,
        0x8100,
        "communication over the bus module lost",
    ),
    row(
        Fault::Eer,
        "EEr",
        91,
        Reaction::Trip,
        0x9000,
        "external fault set over the bus",
    ),
    row(
        Fault::Lu,
        "LU",
        30,
        Reaction::Message,
        0x3220,
        "DC-link undervoltage: mains missing or too low",
    ),
    row(
        Fault::Ou,
        "OU",
        20,
        Reaction::Message,
        0x3210,
        "DC-link overvoltage: braking energy is not taken away",
    ),
    row(
        Fault::Nmax,
        "NMAX",
        200,
        Reaction::Trip,
        0x1000,
        "motor faster than C0596",
    ),
    row(Fault::Oc2, "OC2", 12, Reaction::Trip, 0x2330, "earth fault"),
    row(
        Fault::Oh4,
        "OH4",
        54,
        Reaction::Warning,
        0x4210,
        "heat sink warmer than C0122",
    ),
    row(
        Fault::P03,
        "P03",
        153,
        Reaction::Trip,
        0x8611,
        "following error above C0255",
    ),
    row(
        Fault::P14,
        "P14",
        164,
        Reaction::Trip,
        0x8611,
        "following error above C1218/1",
    ),
    row(Fault::Sd2, "Sd2", 82, Reaction::Trip, 0x7303, "resolver wire break"),
];

impl Fault {
    /// All of them.
    pub const ALL: [Fault; 10] = [
        Fault::Ce0,
        Fault::Eer,
        Fault::Lu,
        Fault::Ou,
        Fault::Nmax,
        Fault::Oc2,
        Fault::Oh4,
        Fault::P03,
        Fault::P14,
        Fault::Sd2,
    ];

    const fn row(self) -> &'static Row {
        let row = &TABLE[self as usize];
        debug_assert!(
            row.fault as usize == self as usize,
            "the table stands in the order of the faults"
        );
        row
    }

    /// What the keypad shows.
    pub const fn display(self) -> &'static str {
        self.row().display
    }

    /// Reaction as delivered; P03 is a TRIP here (fact sheet, section 4.7).
    pub const fn reaction(self) -> Reaction {
        self.row().reaction
    }

    /// LECOM number: n as TRIP, 1000 + n as message, 2000 + n as warning; what C0067 shows.
    pub const fn lecom_number(self, reaction: Reaction) -> u16 {
        let class = match reaction {
            Reaction::Off | Reaction::Trip => 0,
            Reaction::Message => 1000,
            Reaction::Warning => 2000,
        };
        class + self.row().number
    }

    /// DRIVECOM fault code, object 603Fh, as in the diagnosis telegram.
    pub const fn drivecom_code(self) -> u16 {
        self.row().error_code
    }

    /// The usual cause, for people.
    pub const fn cause(self) -> &'static str {
        self.row().cause
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.display(), self.cause())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_stands_in_the_order_of_the_faults() {
        for fault in Fault::ALL {
            assert_eq!(fault.row().fault, fault);
            assert!(!fault.cause().is_empty());
        }
    }

    #[test]
    fn numbers_follow_the_lecom_rule() {
        // Source: 9300 fact sheet, section 4.9: LU 1030, OU 1020, P03 153 / 2153, OH4 2054.
        assert_eq!(Fault::Lu.lecom_number(Fault::Lu.reaction()), 1030);
        assert_eq!(Fault::Ou.lecom_number(Fault::Ou.reaction()), 1020);
        assert_eq!(Fault::Oh4.lecom_number(Fault::Oh4.reaction()), 2054);
        assert_eq!(Fault::P03.lecom_number(Reaction::Trip), 153);
        assert_eq!(Fault::P03.lecom_number(Reaction::Warning), 2153);
    }
}

//! The declaration table of the codes: one line each, declared once.
//!
//! Source: 9300 facts 3.4, 4.4; film-feed specification, section 5. Lines marked `(A)` carry a range or a factory value
//! for which no source was found.

/// What a code is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Keeps what was written.
    Stored,
    /// Shows a value of the drive; cannot be written from outside.
    Display,
    /// Writing triggers something; reading shows the state of it.
    Action,
}

/// When a code can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Writable {
    /// At any time.
    Always,
    /// Only while the controller is inhibited, whatever the source of the inhibit.
    OnlyInhibited,
    /// Never from outside.
    Never,
}

/// How the number on the bus is to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Form {
    /// Fixed point with four decimals: the value times 10000.
    FixedPoint4,
    /// The value itself, bit for bit.
    Plain,
}

/// Number of data octets in the parameter channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DataLength {
    /// Two octets, left-aligned in the answer.
    Two,
    /// Four octets.
    Four,
}

impl DataLength {
    /// The number itself.
    pub const fn octets(self) -> u8 {
        match self {
            Self::Two => 2,
            Self::Four => 4,
        }
    }
}

/// The part of the drive that has to look again when a code changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Concern {
    /// Nobody caches it.
    Nothing,
    /// Configuration and control source.
    Configuration,
    /// Motor data; a write by hand sets C0086 to 0.
    Motor,
    /// The motor list C0086 itself.
    MotorList,
    /// Current, speed and position controllers, limits and filters.
    Controllers,
    /// Monitoring and fault reactions.
    Monitoring,
    /// Gear, feed constant and the references of the traversing program.
    Machine,
    /// The variables of the traversing program.
    Program,
    /// The bus module.
    Bus,
    /// A value of the drive that is only shown.
    Display,
}

/// The values a code takes, raw (×10000 unless the code is plain).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// From `min` to `max`; values between two steps are cut to the lower magnitude.
    Range {
        /// Least value.
        min: i32,
        /// Greatest value.
        max: i32,
        /// Distance of two values.
        step: i32,
    },
    /// One of these, in ascending order.
    Selection(&'static [i32]),
}

impl Domain {
    /// Least value.
    pub const fn min(&self) -> i32 {
        match self {
            Self::Range { min, .. } => *min,
            Self::Selection(values) => values[0],
        }
    }

    /// Greatest value.
    pub const fn max(&self) -> i32 {
        match self {
            Self::Range { max, .. } => *max,
            Self::Selection(values) => values[values.len() - 1],
        }
    }
}

/// One line of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CodeEntry {
    /// Code number, for example 1301.
    pub number: u16,
    /// Least subcode; 0 for a code without subcodes.
    pub first_subcode: u8,
    /// Greatest subcode; 0 for a code without subcodes.
    pub last_subcode: u8,
    /// Stored, display or action.
    pub kind: Kind,
    /// When it can be written.
    pub writable: Writable,
    /// Values it takes.
    pub domain: Domain,
    /// Value after loading the factory setting, raw.
    pub factory: i32,
    /// ×10000 or plain.
    pub form: Form,
    /// Data octets on the bus.
    pub length: DataLength,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Who has to look again after a change.
    pub concern: Concern,
    /// What it means.
    pub name: &'static str,
}

impl CodeEntry {
    /// Number of values: 1 for a code without subcodes.
    pub const fn count(&self) -> usize {
        (self.last_subcode - self.first_subcode) as usize + 1
    }

    /// Index of the code in the parameter channel: 24575 − number.
    ///
    /// Source: 9300 facts 3.2.
    pub const fn index(&self) -> u16 {
        24_575 - self.number
    }
}

/// The line of a code, or `None` when the drive does not know it.
pub const fn entry(number: u16) -> Option<&'static CodeEntry> {
    match line_of(number) {
        Some(line) => Some(&CODE_TABLE[line]),
        None => None,
    }
}

/// Where the values of a code lie in a store: its line.
pub(super) const fn line_of(number: u16) -> Option<usize> {
    if number as usize >= LINES.len() {
        return None;
    }
    match LINES[number as usize] {
        NO_LINE => None,
        line => Some(line as usize),
    }
}

/// First place of each line in a store, and one more for the end.
pub(super) const PLACES: [u16; CODE_TABLE.len() + 1] = {
    let mut places = [0; CODE_TABLE.len() + 1];
    let mut line = 0;
    while line < CODE_TABLE.len() {
        places[line + 1] = places[line] + CODE_TABLE[line].count() as u16;
        line += 1;
    }
    places
};

/// Number of values in a store.
pub(super) const PLACE_COUNT: usize = PLACES[CODE_TABLE.len()] as usize;

/// Number of subcodes of the table of positions. (A)
pub const POSITION_COUNT: u8 = 110;
/// Number of subcodes of the tables of velocities, accelerations, times and pieces. (A)
pub const VARIABLE_COUNT: u8 = 34;

/// The four decimals of a code as an integer.
const fn e4(value: f64) -> i32 {
    let scaled = value * 10_000.0;
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
}

/// Domain, factory value, form and length of a line.
struct Values(Domain, i32, Form, DataLength);

const fn fixed(min: f64, max: f64, step: f64, factory: f64) -> Values {
    let domain = Domain::Range {
        min: e4(min),
        max: e4(max),
        step: e4(step),
    };
    Values(domain, e4(factory), Form::FixedPoint4, DataLength::Four)
}

/// Integer selection, ×10000 on the bus like everything else.
const fn choice(values: &'static [i32], factory: i32) -> Values {
    Values(Domain::Selection(values), factory, Form::FixedPoint4, DataLength::Four)
}

const fn plain(min: i32, max: i32, factory: i32, length: DataLength) -> Values {
    Values(Domain::Range { min, max, step: 1 }, factory, Form::Plain, length)
}

macro_rules! code_table {
    ($($(#[$meta:meta])* $constant:ident $number:literal / $first:literal $last:expr, $kind:ident $writable:ident
        $values:expr, $unit:literal $concern:ident $name:literal;)*) => {
        /// The numbers of the codes, named as the drive names them.
        pub mod number {
            $(#[doc = $name] $(#[$meta])* pub const $constant: u16 = $number;)*
        }

        /// Every code the modelled drive knows, in ascending order.
        pub const CODE_TABLE: &[CodeEntry] = &[$({
            let Values(domain, factory, form, length) = $values;
            CodeEntry {
                number: $number,
                first_subcode: $first,
                last_subcode: $last,
                kind: Kind::$kind,
                writable: Writable::$writable,
                domain,
                factory,
                form,
                length,
                unit: $unit,
                concern: Concern::$concern,
                name: $name,
            }
        },)*];
    };
}

// Greatest length, position and speed a ×10000 number can carry. (A)
const UNITS: f64 = 214_000.0;

code_table! {
    C0005 5/0 0, Stored OnlyInhibited fixed(0.0, 65_535.0, 1.0, 20_000.0), "" Configuration "signal configuration, factory value (A)";
    C0006 6/0 0, Stored OnlyInhibited choice(&[1_0000, 2_0000, 3_0000, 11_0000, 22_0000], 3_0000), "" Motor "motor control";
    C0011 11/0 0, Stored Always fixed(500.0, 16_000.0, 1.0, 3000.0), "rpm" Controllers "maximum speed, reference of all speeds";
    C0022 22/0 0, Stored Always fixed(0.0, 3.75, 0.01, 3.75), "A" Controllers "maximum current, factory value (A)";
    C0043 43/0 0, Action Always choice(&[0, 1_0000], 0), "" Monitoring "TRIP: 1 = present, write 0 = reset";
    C0051 51/0 0, Display Never fixed(-30_000.0, 30_000.0, 0.0001, 0.0), "rpm" Display "actual speed";
    C0053 53/0 0, Display Never fixed(0.0, 900.0, 0.0001, 0.0), "V" Display "DC-link voltage";
    C0054 54/0 0, Display Never fixed(0.0, 500.0, 0.0001, 0.0), "A" Display "motor current";
    C0061 61/0 0, Display Never fixed(-100.0, 200.0, 0.0001, 0.0), "°C" Display "heat-sink temperature, lower limit (A)";
    C0067 67/0 0, Display Never fixed(0.0, 65_535.0, 1.0, 0.0), "" Display "present fault, LECOM number";
    C0070 70/0 0, Stored Always fixed(0.0, 255.0, 0.5, 3.0), "" Controllers "speed controller gain, factory value (A)";
    C0071 71/0 0, Stored Always fixed(1.0, 600.0, 0.5, 24.0), "ms" Controllers "speed controller integral time, above 512 off, factory value (A)";
    C0075 75/0 0, Stored Always fixed(0.0, 15.99, 0.01, 0.35), "" Controllers "current controller gain";
    C0076 76/0 0, Stored Always fixed(0.5, 2000.0, 0.1, 1.8), "ms" Controllers "current controller integral time, 2000 off";
    C0081 81/0 0, Stored OnlyInhibited fixed(0.01, 500.0, 0.01, 0.8), "kW" Motor "rated motor power, factory value (A)";
    C0084 84/0 0, Stored OnlyInhibited fixed(0.0, 100.0, 0.01, 1.1), "Ohm" Motor "stator resistance, factory value (A)";
    C0085 85/0 0, Stored OnlyInhibited fixed(0.0, 200.0, 0.01, 5.3), "mH" Motor "leakage inductance, factory value (A)";
    C0086 86/0 0, Stored OnlyInhibited choice(&[0, 108_0000], 0), "" MotorList "motor list, 0 = no Lenze motor, factory value (A)";
    C0087 87/0 0, Stored OnlyInhibited fixed(300.0, 16_000.0, 1.0, 3700.0), "rpm" Motor "rated motor speed, factory value (A)";
    C0088 88/0 0, Stored OnlyInhibited fixed(0.5, 500.0, 0.1, 2.5), "A" Motor "rated motor current, factory value (A)";
    C0089 89/0 0, Stored OnlyInhibited fixed(10.0, 1000.0, 1.0, 185.0), "Hz" Motor "rated motor frequency, factory value (A)";
    C0090 90/0 0, Stored OnlyInhibited fixed(50.0, 500.0, 1.0, 325.0), "V" Motor "rated motor voltage, factory value (A)";
    C0091 91/0 0, Stored OnlyInhibited fixed(0.5, 1.0, 0.01, 1.0), "" Motor "motor cos phi";
    C0105 105/0 0, Stored Always fixed(0.0, 999.9, 0.001, 0.0), "s" Controllers "quick-stop ramp, 0 to C0011";
    C0142 142/0 0, Stored Always choice(&[0, 1_0000], 1_0000), "" Configuration "0 = restart lock, 1 = automatic start";
    C0150 150/0 0, Display Never plain(0, 65_535, 0, DataLength::Two), "" Display "status word, bit for bit";
    C0173 173/0 0, Stored OnlyInhibited choice(&[0, 1_0000, 2_0000, 3_0000, 4_0000], 1_0000), "" Monitoring "DC-link thresholds";
    C0183 183/0 0, Display Never fixed(0.0, 250.0, 1.0, 0.0), "" Display "drive diagnosis, lowest number wins";
    C0254 254/0 0, Stored Always fixed(0.0, 3.9999, 0.0001, 0.4), "" Controllers "position controller gain";
    /// Interpretation: plain. Its factory value 327 680 inc times 10000 does not fit 32 bits with sign.
    C0255 255/0 0, Stored Always plain(10, 180_000_000, 327_680, DataLength::Four), "inc" Monitoring "P03 following-error limit, bit for bit";
    C0497 497/0 0, Stored Always fixed(0.0, 50.0, 0.1, 2.0), "ms" Controllers "filter of the actual speed";
    C0583 583/0 0, Stored Always choice(&[0, 3_0000], 3_0000), "" Monitoring "reaction OH3: 0 TRIP, 3 off, factory value (A)";
    C0584 584/0 0, Stored Always choice(&[2_0000, 3_0000], 3_0000), "" Monitoring "reaction OH7: 2 warning, 3 off, factory value (A)";
    C0594 594/0 0, Stored Always choice(&[0, 2_0000, 3_0000], 3_0000), "" Monitoring "reaction Sd6: 0 TRIP, 2 warning, 3 off, factory value (A)";
    C1202 1202/0 0, Stored OnlyInhibited fixed(1.0, 65_535.0, 1.0, 1.0), "" Machine "gear numerator, range and factory value (A)";
    C1203 1203/0 0, Stored OnlyInhibited fixed(1.0, 65_535.0, 1.0, 1.0), "" Machine "gear denominator, range and factory value (A)";
    C1204 1204/0 0, Stored OnlyInhibited fixed(0.0001, UNITS, 0.0001, 360.0), "units/rev" Machine "feed constant, range and factory value (A)";
    C1205 1205/0 0, Display Never fixed(0.0, UNITS, 0.0001, 0.0), "inc/unit" Display "position resolution, number (A)";
    C1211 1211/0 0, Stored Always fixed(1.0, 32.0, 1.0, 1.0), "" Program "first record of the program";
    C1218 1218/1 1, Stored Always fixed(0.0001, UNITS, 0.0001, 5.0), "units" Monitoring "following-error tolerance, range and factory value (A)";
    C1240 1240/0 0, Stored Always fixed(0.0001, UNITS, 0.0001, 100.0), "units/s" Machine "v_max, 100 % of VTVEL, range and factory value (A)";
    C1250 1250/0 0, Stored Always fixed(0.0001, UNITS, 0.0001, 100.0), "units/s²" Machine "a_max, 100 % of VTACC, range and factory value (A)";
    /// Subcodes from 61 are formed in the drive and cannot be written (9300 facts 4.1).
    C1301 1301/1 POSITION_COUNT, Stored Always fixed(-UNITS, UNITS, 0.0001, 0.0), "units" Program "VTPOS, target positions";
    /// Factory value as shown in thesis fig. 67.
    C1302 1302/1 VARIABLE_COUNT, Stored Always fixed(0.0, 100.0, 0.01, 10.0), "%" Program "VTVEL, travel velocities, of C1240";
    /// Factory value as shown in thesis fig. 67. DEVIATION: 0 % is refused, a record with it could never brake.
    C1303 1303/1 VARIABLE_COUNT, Stored Always fixed(0.01, 100.0, 0.01, 10.0), "%" Program "VTACC, accelerations and decelerations, of C1250";
    C1304 1304/1 VARIABLE_COUNT, Stored Always fixed(0.0, UNITS, 1.0, 0.0), "ms" Program "VTTIME, waiting times, number and range (A)";
    C1305 1305/1 VARIABLE_COUNT, Stored Always fixed(0.0, UNITS, 1.0, 0.0), "" Program "VTPCS, numbers of pieces, number and range (A)";
    C1882 1882/0 0, Stored Always choice(&[0, 1_0000, 2_0000, 3_0000], 0), "" Bus "reaction to a bus failure: none, TRIP, inhibit, quick stop; coding (A)";
    C1883 1883/0 0, Stored Always fixed(0.0, 65_535.0, 1.0, 65_535.0), "ms" Bus "time from leaving data exchange to the reaction, 65535 off";
}

const NO_LINE: u8 = u8::MAX;

/// Line of each code number: a look-up without hashing or searching.
const LINES: [u8; 2048] = {
    assert!(CODE_TABLE.len() < NO_LINE as usize, "the table has outgrown its index");
    let mut lines = [NO_LINE; 2048];
    let mut line = 0;
    while line < CODE_TABLE.len() {
        let number = CODE_TABLE[line].number as usize;
        assert!(lines[number] == NO_LINE, "a code is declared twice");
        lines[number] = line as u8;
        line += 1;
    }
    lines
};

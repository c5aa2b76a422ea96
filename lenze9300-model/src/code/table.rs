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

/// What the model makes of a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Effect {
    /// The drive works by it, or shows what it computes.
    Acts,
    /// Its value is kept, checked and saved, and changes nothing.
    Kept,
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
    /// The CAN system bus.
    Can,
    /// The parameter sets.
    Sets,
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
    /// Values after loading the factory setting, raw, subcode by subcode; the last one holds for all that follow.
    pub factory: &'static [i32],
    /// ×10000 or plain.
    pub form: Form,
    /// Data octets on the bus.
    pub length: DataLength,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Who has to look again after a change.
    pub concern: Concern,
    /// Whether the model works by it.
    pub effect: Effect,
    /// What it means.
    pub name: &'static str,
}

impl CodeEntry {
    /// Number of values: 1 for a code without subcodes.
    pub const fn count(&self) -> usize {
        (self.last_subcode - self.first_subcode) as usize + 1
    }

    /// Factory value of a subcode, raw.
    pub const fn factory_of(&self, subcode: u8) -> i32 {
        let place = subcode.saturating_sub(self.first_subcode) as usize;
        let last = self.factory.len() - 1;
        self.factory[if place < last { place } else { last }]
    }

    /// A raw value as the keypad shows it: with the decimals of the step, and the unit.
    ///
    /// # Example
    ///
    /// ```
    /// let feed_constant = lenze9300_model::code::entry(1204).ok_or("no C1204")?;
    /// assert_eq!(feed_constant.show(179_0708), "179.0708 units/rev");
    /// # Ok::<(), &str>(())
    /// ```
    pub fn show(&self, raw: i32) -> String {
        let gap = if self.unit.is_empty() { "" } else { " " };
        format!("{}{gap}{}", self.decimal(raw), self.unit)
    }

    /// A raw value as a decimal number without its unit.
    pub fn decimal(&self, raw: i32) -> String {
        let Form::FixedPoint4 = self.form else {
            return raw.to_string();
        };
        let mut text = format!(
            "{}{}.{:04}",
            if raw < 0 { "-" } else { "" },
            raw.unsigned_abs() / 10_000,
            raw.unsigned_abs() % 10_000
        );
        let step = match self.domain {
            Domain::Range { step, .. } => step,
            Domain::Selection(_) => 10_000,
        };
        // A value between two steps, as displays have them, keeps all its digits.
        let mut unit = 10;
        while text.ends_with('0') && step % unit == 0 && unit <= 10_000 {
            text.pop();
            unit *= 10;
        }
        if text.ends_with('.') {
            text.pop();
        }
        text
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

/// Domain, form and length of a line.
struct Values(Domain, Form, DataLength);

const fn fixed(min: f64, max: f64, step: f64) -> Values {
    let domain = Domain::Range {
        min: e4(min),
        max: e4(max),
        step: e4(step),
    };
    Values(domain, Form::FixedPoint4, DataLength::Four)
}

/// Integer selection, ×10000 on the bus like everything else.
const fn choice(values: &'static [i32]) -> Values {
    Values(Domain::Selection(values), Form::FixedPoint4, DataLength::Four)
}

const fn plain(min: i32, max: i32, length: DataLength) -> Values {
    Values(Domain::Range { min, max, step: 1 }, Form::Plain, length)
}

/// Factory values with four decimals.
const fn e4s<const N: usize>(values: [f64; N]) -> [i32; N] {
    let mut raw = [0; N];
    let mut place = 0;
    while place < N {
        raw[place] = e4(values[place]);
        place += 1;
    }
    raw
}

macro_rules! code_table {
    ($($(#[$meta:meta])* $constant:ident $number:literal / $first:literal $last:expr, $kind:ident $writable:ident
        $values:expr, [$($factory:expr),+], $unit:literal $concern:ident $effect:ident $name:literal;)*) => {
        /// The numbers of the codes, named as the drive names them.
        pub mod number {
            $(#[doc = $name] $(#[$meta])* pub const $constant: u16 = $number;)*
        }

        /// Every code the modelled drive knows, in ascending order.
        pub const CODE_TABLE: &[CodeEntry] = &[$({
            const VALUES: Values = $values;
            const FACTORY: &[i32] = &match VALUES.1 {
                Form::FixedPoint4 => e4s([$($factory as f64),+]),
                Form::Plain => [$($factory as i32),+],
            };
            CodeEntry {
                number: $number,
                first_subcode: $first,
                last_subcode: $last,
                kind: Kind::$kind,
                writable: Writable::$writable,
                domain: VALUES.0,
                factory: FACTORY,
                form: VALUES.1,
                length: VALUES.2,
                unit: $unit,
                concern: Concern::$concern,
                effect: Effect::$effect,
                name: $name,
            }
        },)*];
    };
}

// Greatest length, position and speed a ×10000 number can carry. (A)
const UNITS: f64 = 214_000.0;

/// Reactions of a monitoring function, as the codes C0581 to C0598 name them.
const TRIP: i32 = 0;
const MESSAGE: i32 = 1_0000;
const WARNING: i32 = 2_0000;
const OFF: i32 = 3_0000;

code_table! {
    /// Interpretation: loading needs the inhibit, because a set holds codes that may only be written then.
    C0002 2/0 0, Action OnlyInhibited choice(&[0, 1_0000, 2_0000, 3_0000, 4_0000]), [0], "" Sets Acts "load parameter set: 0 = factory setting, 1 to 4";
    C0003 3/0 0, Action Always choice(&[0, 1_0000, 2_0000, 3_0000, 4_0000]), [0], "" Sets Acts "save parameter set 1 to 4, 0 = nothing";
    C0005 5/0 0, Stored OnlyInhibited fixed(0.0, 65_535.0, 1.0), [20_000], "" Configuration Kept "signal configuration, factory value (A)";
    C0006 6/0 0, Stored OnlyInhibited choice(&[1_0000, 2_0000, 3_0000, 11_0000, 22_0000]), [3], "" Motor Kept "motor control";
    C0011 11/0 0, Stored Always fixed(500.0, 16_000.0, 1.0), [3000], "rpm" Controllers Acts "maximum speed, reference of all speeds";
    C0012 12/0 0, Stored Always fixed(0.0, 999.9, 0.001), [0], "s" Controllers Kept "acceleration time of the main set-value";
    C0013 13/0 0, Stored Always fixed(0.0, 999.9, 0.001), [0], "s" Controllers Kept "deceleration time of the main set-value";
    C0018 18/0 0, Stored Always choice(&[0, 1_0000, 2_0000]), [1], "" Controllers Kept "chopping frequency: 0 = automatic, 1 = 8 kHz, 2 = 16 kHz";
    C0019 19/0 0, Stored Always fixed(0.0, 16_000.0, 1.0), [0], "rpm" Monitoring Kept "threshold n = 0";
    C0022 22/0 0, Stored Always fixed(0.0, 3.75, 0.01), [3.75], "A" Controllers Acts "maximum current, factory value (A)";
    /// The list of the device has encoders that the model does not: 10 is the resolver.
    C0025 25/0 0, Stored OnlyInhibited choice(&[10_0000]), [10], "" Configuration Kept "feedback system: 10 = resolver, the only one modelled";
    C0037 37/0 0, Stored Always fixed(-16_000.0, 16_000.0, 1.0), [0], "rpm" Controllers Kept "speed set-value";
    C0039 39/1 15, Stored Always fixed(-199.99, 199.99, 0.01), [100, 75, 50, 25, 0], "%" Controllers Kept "JOG set-values";
    C0040 40/0 0, Action Always choice(&[0, 1_0000]), [1], "" Configuration Acts "controller: write 0 = inhibit, 1 = enable; reads what is in force";
    C0042 42/0 0, Display Never choice(&[0, 1_0000]), [0], "" Display Acts "quick stop: 1 = active";
    C0043 43/0 0, Action Always choice(&[0, 1_0000]), [0], "" Monitoring Acts "TRIP: 1 = present, write 0 = reset";
    C0050 50/0 0, Display Never fixed(-200.0, 200.0, 0.01), [0], "%" Display Acts "speed set-value, of C0011; range (A)";
    C0051 51/0 0, Display Never fixed(-30_000.0, 30_000.0, 0.0001), [0], "rpm" Display Acts "actual speed";
    C0052 52/0 0, Display Never fixed(0.0, 800.0, 1.0), [0], "V" Display Acts "motor voltage, line to line";
    C0053 53/0 0, Display Never fixed(0.0, 900.0, 0.0001), [0], "V" Display Acts "DC-link voltage";
    C0054 54/0 0, Display Never fixed(0.0, 500.0, 0.0001), [0], "A" Display Acts "motor current";
    C0056 56/0 0, Display Never fixed(-100.0, 100.0, 0.01), [0], "%" Display Acts "torque set-value, of C0057";
    C0057 57/0 0, Display Never fixed(0.0, 500.0, 0.01), [0], "Nm" Display Acts "greatest torque, from C0022 and the motor";
    C0058 58/0 0, Display Never fixed(-180.0, 179.9, 0.1), [0], "°" Display Kept "rotor offset";
    C0059 59/0 0, Display Never fixed(1.0, 200.0, 1.0), [1], "" Display Acts "pole pairs of the motor, from C0087 and C0089";
    C0060 60/0 0, Display Never fixed(0.0, 2047.0, 1.0), [0], "" Display Acts "rotor position, 2048 per revolution";
    C0061 61/0 0, Display Never fixed(-100.0, 200.0, 0.0001), [0], "°C" Display Acts "heat-sink temperature, lower limit (A)";
    C0063 63/0 0, Display Never fixed(-100.0, 200.0, 0.0001), [0], "°C" Display Acts "motor temperature, lower limit (A)";
    C0064 64/0 0, Display Never fixed(0.0, 150.0, 0.01), [0], "%" Display Acts "I×t load of the last 180 s";
    C0067 67/0 0, Display Never fixed(0.0, 65_535.0, 1.0), [0], "" Display Acts "present fault, LECOM number";
    C0070 70/0 0, Stored Always fixed(0.0, 255.0, 0.5), [3], "" Controllers Acts "speed controller gain, factory value (A)";
    C0071 71/0 0, Stored Always fixed(1.0, 600.0, 0.5), [24], "ms" Controllers Acts "speed controller integral time, above 512 off, factory value (A)";
    C0072 72/0 0, Stored Always fixed(0.0, 32.0, 0.1), [0], "ms" Controllers Acts "speed controller derivative time";
    C0075 75/0 0, Stored Always fixed(0.0, 15.99, 0.01), [0.35], "" Controllers Acts "current controller gain";
    C0076 76/0 0, Stored Always fixed(0.5, 2000.0, 0.1), [1.8], "ms" Controllers Acts "current controller integral time, 2000 off";
    C0081 81/0 0, Stored OnlyInhibited fixed(0.01, 500.0, 0.01), [0.8], "kW" Motor Kept "rated motor power, factory value (A)";
    C0084 84/0 0, Stored OnlyInhibited fixed(0.0, 100.0, 0.01), [1.1], "Ohm" Motor Kept "stator resistance, factory value (A)";
    C0085 85/0 0, Stored OnlyInhibited fixed(0.0, 200.0, 0.01), [5.3], "mH" Motor Kept "leakage inductance, factory value (A)";
    C0086 86/0 0, Stored OnlyInhibited choice(&[0, 108_0000]), [0], "" MotorList Acts "motor list, 0 = no Lenze motor, factory value (A)";
    C0087 87/0 0, Stored OnlyInhibited fixed(300.0, 16_000.0, 1.0), [3700], "rpm" Motor Acts "rated motor speed, factory value (A)";
    C0088 88/0 0, Stored OnlyInhibited fixed(0.5, 500.0, 0.1), [2.5], "A" Motor Kept "rated motor current, factory value (A)";
    C0089 89/0 0, Stored OnlyInhibited fixed(10.0, 1000.0, 1.0), [185], "Hz" Motor Acts "rated motor frequency, factory value (A)";
    C0090 90/0 0, Stored OnlyInhibited fixed(50.0, 500.0, 1.0), [325], "V" Motor Kept "rated motor voltage, factory value (A)";
    C0091 91/0 0, Stored OnlyInhibited fixed(0.5, 1.0, 0.01), [1], "" Motor Kept "motor cos phi";
    C0095 95/0 0, Stored OnlyInhibited choice(&[0, 1_0000]), [0], "" Motor Kept "1 = start the adjustment of the rotor position";
    C0105 105/0 0, Stored Always fixed(0.0, 999.9, 0.001), [0], "s" Controllers Acts "quick-stop ramp, 0 to C0011";
    C0121 121/0 0, Stored Always fixed(45.0, 150.0, 1.0), [150], "°C" Monitoring Acts "OH7: motor temperature of the warning";
    C0122 122/0 0, Stored Always fixed(45.0, 85.0, 1.0), [85], "°C" Monitoring Acts "OH4: heat-sink temperature of the warning";
    C0126 126/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Kept "reaction CE0 of the plug connection: 0 TRIP, 2 warning, 3 off";
    C0135 135/0 0, Action Always plain(0, 65_535, DataLength::Two), [0], "" Configuration Acts "control word, bit for bit, laid out as that of the bus module";
    C0142 142/0 0, Stored Always choice(&[0, 1_0000]), [1], "" Configuration Acts "0 = restart lock, 1 = automatic start";
    C0150 150/0 0, Display Never plain(0, 65_535, DataLength::Two), [0], "" Display Acts "status word, bit for bit";
    C0155 155/0 0, Display Never plain(0, 65_535, DataLength::Two), [0], "" Display Kept "second status word, bit for bit";
    C0156 156/1 7, Stored OnlyInhibited fixed(0.0, 65_535.0, 1.0), [0], "" Configuration Kept "sources of the status bits 0, 2, 3, 4, 5, 14, 15; range and factory value (A)";
    C0161 161/0 0, Display Never fixed(0.0, 65_535.0, 1.0), [0], "" Display Acts "present fault, LECOM number";
    C0167 167/0 0, Action Always choice(&[0, 1_0000]), [0], "" Monitoring Acts "1 = clear the fault memory";
    C0168 168/1 8, Display Never fixed(0.0, 65_535.0, 1.0), [0], "" Display Acts "fault memory: LECOM number, /1 present, /2 to /8 the last seven";
    C0169 169/1 8, Display Never plain(0, i32::MAX, DataLength::Four), [0], "s" Display Acts "fault memory: time, C0179 of the last occurrence";
    C0170 170/1 8, Display Never fixed(0.0, 65_535.0, 1.0), [0], "" Display Acts "fault memory: occurrences in a row";
    C0173 173/0 0, Stored OnlyInhibited choice(&[0, 1_0000, 2_0000, 3_0000, 4_0000]), [1], "" Monitoring Acts "DC-link thresholds";
    /// Interpretation: plain, as a 32-bit count of seconds ×10000 would overflow after 2.5 days.
    C0178 178/0 0, Display Never plain(0, i32::MAX, DataLength::Four), [0], "s" Display Acts "time enabled";
    C0179 179/0 0, Display Never plain(0, i32::MAX, DataLength::Four), [0], "s" Display Acts "time on mains";
    C0183 183/0 0, Display Never fixed(0.0, 250.0, 1.0), [0], "" Display Acts "drive diagnosis, lowest number wins";
    C0254 254/0 0, Stored Always fixed(0.0, 3.9999, 0.0001), [0.4], "" Controllers Acts "position controller gain";
    /// Interpretation: plain. Its factory value 327 680 inc times 10000 does not fit 32 bits with sign.
    C0255 255/0 0, Stored Always plain(10, 180_000_000, DataLength::Four), [327_680], "inc" Monitoring Acts "P03 following-error limit, bit for bit";
    C0350 350/0 0, Stored OnlyInhibited fixed(1.0, 63.0, 1.0), [1], "" Can Acts "system bus: node address";
    C0351 351/0 0, Stored OnlyInhibited choice(&[0, 1_0000, 2_0000, 3_0000, 4_0000]), [0], "" Can Acts "system bus: 0 = 500, 1 = 250, 2 = 125, 3 = 50, 4 = 1000 kbit/s";
    C0352 352/0 0, Stored OnlyInhibited choice(&[0, 1_0000]), [0], "" Can Acts "system bus: 0 = slave, 1 = master";
    C0353 353/1 3, Stored Always choice(&[0, 1_0000]), [0], "" Can Acts "system bus: identifiers from 0 = C0350, 1 = C0354";
    C0354 354/1 6, Stored Always fixed(1.0, 1663.0, 1.0), [129, 1, 257, 258, 385, 386], "" Can Acts "system bus: identifiers of CAN-IN1, OUT1, IN2, OUT2, IN3, OUT3 less 384; range (A)";
    C0355 355/1 6, Display Never fixed(0.0, 2047.0, 1.0), [513, 385, 641, 642, 769, 770], "" Display Acts "system bus: identifiers in force";
    C0356 356/1 4, Stored Always fixed(0.0, 65_000.0, 1.0), [3000, 10, 10, 20], "ms" Can Acts "system bus: boot-up time, cycles of OUT2 and OUT3, delay";
    C0357 357/1 3, Stored OnlyInhibited fixed(0.0, 65_000.0, 1.0), [3000], "ms" Can Acts "system bus: monitoring times of CAN-IN1 to 3";
    C0358 358/0 0, Action Always choice(&[0, 1_0000]), [0], "" Can Acts "system bus: 1 = reset node";
    C0359 359/0 0, Display Never choice(&[0, 1_0000, 2_0000, 3_0000]), [1], "" Display Acts "system bus: 0 operational, 1 pre-operational, 2 warning, 3 bus off";
    C0360 360/1 12, Display Never fixed(0.0, 65_535.0, 1.0), [0], "" Display Acts "system bus: counters of telegrams";
    C0361 361/1 6, Display Never fixed(0.0, 100.0, 1.0), [0], "%" Display Acts "system bus: load, number of subcodes (A)";
    C0366 366/0 0, Stored Always choice(&[0, 1_0000]), [1], "" Can Acts "system bus: 1 = answers a sync, factory value (A)";
    C0367 367/0 0, Stored Always fixed(1.0, 2047.0, 1.0), [128], "" Can Acts "system bus: identifier of a received sync, range (A)";
    C0368 368/0 0, Stored Always fixed(1.0, 2047.0, 1.0), [128], "" Can Acts "system bus: identifier of a sent sync, range (A)";
    C0369 369/0 0, Stored Always fixed(0.0, 65_000.0, 1.0), [0], "ms" Can Acts "system bus: cycle of the sync, 0 = off, factory value (A)";
    C0497 497/0 0, Stored Always fixed(0.0, 50.0, 0.1), [2], "ms" Controllers Acts "filter of the actual speed";
    C0581 581/0 0, Stored Always choice(&[TRIP, MESSAGE, WARNING, OFF]), [0], "" Monitoring Acts "reaction EEr: 0 TRIP, 1 message, 2 warning, 3 off";
    C0582 582/0 0, Stored Always choice(&[WARNING, OFF]), [2], "" Monitoring Acts "reaction OH4: 2 warning, 3 off";
    C0583 583/0 0, Stored Always choice(&[TRIP, OFF]), [3], "" Monitoring Acts "reaction OH3: 0 TRIP, 3 off, factory value (A)";
    C0584 584/0 0, Stored Always choice(&[WARNING, OFF]), [3], "" Monitoring Acts "reaction OH7: 2 warning, 3 off, factory value (A)";
    C0585 585/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Acts "reaction OH8: 0 TRIP, 2 warning, 3 off";
    C0586 586/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [0], "" Monitoring Acts "reaction Sd2: 0 TRIP, 2 warning, 3 off";
    C0587 587/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Acts "reaction Sd3: 0 TRIP, 2 warning, 3 off";
    C0588 588/0 0, Stored Always choice(&[TRIP, OFF]), [0], "" Monitoring Acts "reaction H10 and H11: 0 TRIP, 3 off";
    /// Its factory value is a warning in the register controller; the positioning controller's is not known (9300 facts 4.7).
    C0589 589/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [0], "" Monitoring Acts "reaction P03: 0 TRIP, 2 warning, 3 off, factory value (A)";
    C0590 590/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [0], "" Monitoring Acts "reaction P13: 0 TRIP, 2 warning, 3 off";
    C0591 591/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Acts "reaction CE1: 0 TRIP, 2 warning, 3 off";
    C0592 592/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Acts "reaction CE2: 0 TRIP, 2 warning, 3 off";
    C0593 593/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Acts "reaction CE3: 0 TRIP, 2 warning, 3 off";
    C0594 594/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Acts "reaction Sd6: 0 TRIP, 2 warning, 3 off, factory value (A)";
    C0595 595/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Acts "reaction CE4: 0 TRIP, 2 warning, 3 off";
    C0596 596/0 0, Stored Always fixed(0.0, 16_000.0, 1.0), [5500], "rpm" Monitoring Acts "NMAX: greatest speed of the plant, range (A)";
    C0597 597/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Acts "reaction LP1: 0 TRIP, 2 warning, 3 off";
    C0598 598/0 0, Stored Always choice(&[TRIP, WARNING, OFF]), [3], "" Monitoring Acts "reaction Sd5: 0 TRIP, 2 warning, 3 off";
    C0850 850/1 3, Stored OnlyInhibited fixed(0.0, 65_535.0, 1.0), [0], "" Configuration Kept "sources of the words to the bus module; range and factory value (A)";
    C0852 852/0 0, Stored OnlyInhibited fixed(0.0, 65_535.0, 1.0), [0], "" Configuration Kept "type of word 2 to the bus module; range and factory value (A)";
    C0853 853/0 0, Stored OnlyInhibited fixed(0.0, 65_535.0, 1.0), [0], "" Configuration Kept "type of word 3 to the bus module; range and factory value (A)";
    C0858 858/1 3, Display Never fixed(-199.99, 199.99, 0.01), [0], "%" Display Acts "words 1 to 3 to the bus module, 16384 = 100 %";
    C0859 859/0 0, Display Never plain(i32::MIN, i32::MAX, DataLength::Four), [0], "inc" Display Acts "double word to the bus module, from words 2 and 3";
    C1202 1202/0 0, Stored OnlyInhibited fixed(1.0, 65_535.0, 1.0), [1], "" Machine Acts "gear numerator, range and factory value (A)";
    C1203 1203/0 0, Stored OnlyInhibited fixed(1.0, 65_535.0, 1.0), [1], "" Machine Acts "gear denominator, range and factory value (A)";
    C1204 1204/0 0, Stored OnlyInhibited fixed(0.0001, UNITS, 0.0001), [360], "units/rev" Machine Acts "feed constant, range and factory value (A)";
    C1205 1205/0 0, Display Never fixed(0.0, UNITS, 0.0001), [0], "inc/unit" Display Acts "position resolution, number (A)";
    C1211 1211/0 0, Stored Always fixed(1.0, 32.0, 1.0), [1], "" Program Acts "first record of the program";
    C1218 1218/1 2, Stored Always fixed(0.0001, UNITS, 0.0001), [5, 10], "units" Monitoring Acts "following-error tolerances, range and factory values (A)";
    C1240 1240/0 0, Stored Always fixed(0.0001, UNITS, 0.0001), [100], "units/s" Machine Acts "v_max, 100 % of VTVEL, range and factory value (A)";
    C1250 1250/0 0, Stored Always fixed(0.0001, UNITS, 0.0001), [100], "units/s²" Machine Acts "a_max, 100 % of VTACC, range and factory value (A)";
    /// Subcodes from 61 are formed in the drive and cannot be written (9300 facts 4.1).
    C1301 1301/1 POSITION_COUNT, Stored Always fixed(-UNITS, UNITS, 0.0001), [0], "units" Program Acts "VTPOS, target positions";
    /// Factory value as shown in thesis fig. 67.
    C1302 1302/1 VARIABLE_COUNT, Stored Always fixed(0.0, 100.0, 0.01), [10], "%" Program Acts "VTVEL, travel velocities, of C1240";
    /// Factory value as shown in thesis fig. 67. DEVIATION: 0 % is refused, a record with it could never brake.
    C1303 1303/1 VARIABLE_COUNT, Stored Always fixed(0.01, 100.0, 0.01), [10], "%" Program Acts "VTACC, accelerations and decelerations, of C1250";
    C1304 1304/1 VARIABLE_COUNT, Stored Always fixed(0.0, UNITS, 1.0), [0], "ms" Program Acts "VTTIME, waiting times, number and range (A)";
    C1305 1305/1 VARIABLE_COUNT, Stored Always fixed(0.0, UNITS, 1.0), [0], "" Program Acts "VTPCS, numbers of pieces, number and range (A)";
    C1882 1882/0 0, Stored Always choice(&[0, 1_0000, 2_0000, 3_0000]), [0], "" Bus Acts "reaction to a bus failure: none, TRIP, inhibit, quick stop; coding (A)";
    C1883 1883/0 0, Stored Always fixed(0.0, 65_535.0, 1.0), [65_535], "ms" Bus Acts "time from leaving data exchange to the reaction, 65535 off";
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

//! The drive's faults: names, numbers, reactions, remedies.
//!
//! Numbers, causes and permitted reactions: 9300 facts 4.9. Interpretation: the names and causes of P01 to P18 are those the
//! facts assume by function; number = 150 + nn is their rule. Error codes (object 603Fh) are the profile's usual groups,
//! assumed for this device (9300 facts 1.4).

use std::fmt;

use crate::code::CodeStore;
use crate::code::table::number::{
    C0581, C0582, C0583, C0584, C0585, C0586, C0587, C0588, C0589, C0590, C0591, C0592, C0593, C0594, C0595, C0597,
    C0598,
};

/// A monitoring function that can respond, in the order of its display.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Fault {
    /// CCr: system fault of the control unit.
    Ccr,
    /// CE0: communication over the bus module lost.
    Ce0,
    /// CE1: no telegram CAN-IN1 within C0357/1.
    Ce1,
    /// CE2: no telegram CAN-IN2 within C0357/2.
    Ce2,
    /// CE3: no telegram CAN-IN3 within C0357/3.
    Ce3,
    /// CE4: system bus off after too many faulty telegrams.
    Ce4,
    /// EEr: external fault, set by a control word.
    Eer,
    /// H05: internal fault.
    H05,
    /// H07: wrong power stage found at power-up.
    H07,
    /// H10: temperature sensor of the heat sink.
    H10,
    /// H11: temperature sensor inside the device.
    H11,
    /// LP1: a motor phase is missing.
    Lp1,
    /// LU: DC-link undervoltage: mains missing or too low.
    Lu,
    /// OU: DC-link overvoltage: braking energy is not taken away.
    Ou,
    /// NMAX: motor faster than C0596.
    Nmax,
    /// OC1: short circuit.
    Oc1,
    /// OC2: earth fault.
    Oc2,
    /// OC5: I×t overload, C0064 above 100 %.
    Oc5,
    /// OH: heat sink too warm.
    Oh,
    /// OH3: motor warmer than 150 °C.
    Oh3,
    /// OH4: heat sink warmer than C0122.
    Oh4,
    /// OH7: motor warmer than C0121.
    Oh7,
    /// OH8: PTC at T1, T2: motor too warm.
    Oh8,
    /// P01: negative limit switch reached.
    P01,
    /// P02: positive limit switch reached.
    P02,
    /// P03: following error above C0255.
    P03,
    /// P04: target below the negative position limit.
    P04,
    /// P05: target above the positive position limit.
    P05,
    /// P06: no reference: an absolute target needs homing first.
    P06,
    /// P07: mode of the record does not fit the configuration.
    P07,
    /// P08: reference offset out of range.
    P08,
    /// P09: impermissible programming.
    P09,
    /// P12: range of the encoder exceeded.
    P12,
    /// P13: phase overflow.
    P13,
    /// P14: following error above C1218/1.
    P14,
    /// P15: following error above C1218/2.
    P15,
    /// P16: synchronisation over the system bus lost.
    P16,
    /// P17: touch probe could not be worked off.
    P17,
    /// P18: internal limitation.
    P18,
    /// PEr: program fault of the control unit.
    Per,
    /// PI: initialisation with a wrong parameter set.
    Pi,
    /// PR0: all parameter sets damaged, factory setting loaded.
    Pr0,
    /// PR1: parameter set 1 damaged, factory setting loaded.
    Pr1,
    /// PR2: parameter set 2 damaged, factory setting loaded.
    Pr2,
    /// PR3: parameter set 3 damaged, factory setting loaded.
    Pr3,
    /// PR4: parameter set 4 damaged, factory setting loaded.
    Pr4,
    /// Sd2: resolver wire break.
    Sd2,
    /// Sd3: encoder at X9/8.
    Sd3,
    /// Sd5: master current below 2 mA.
    Sd5,
    /// Sd6: temperature sensor of the motor.
    Sd6,
    /// Sd7: absolute encoder.
    Sd7,
}

/// What the drive does when a monitoring function responds, the weakest first (9300 facts 2.5, priority).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Reaction {
    /// Nothing.
    Off,
    /// The drive stops by quick stop and reports it, status bit 12. No fault of the list has it as delivered.
    #[doc(alias = "FAIL-QSP")]
    FailQsp,
    /// The drive runs on, status bit 7.
    #[doc(alias = "Warnung")]
    Warning,
    /// The output stage is off as long as the cause lasts, status bit 8.
    #[doc(alias = "Meldung")]
    Message,
    /// The output stage is off until the TRIP is reset.
    #[doc(alias = "Störung")]
    Trip,
}

impl Reaction {
    /// The reaction that a value of C0581 to C0598 stands for: 0 TRIP, 1 message, 2 warning, 3 off.
    pub const fn from_code(value: i32) -> Option<Self> {
        match value {
            0 => Some(Self::Trip),
            1 => Some(Self::Message),
            2 => Some(Self::Warning),
            3 => Some(Self::Off),
            _ => None,
        }
    }
}

/// How the model comes to a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Detection {
    /// The model finds the cause by itself.
    Monitored,
    /// Only an operator or a test sets it; its consequences are those of the device.
    Injected,
}

#[derive(Debug)]
struct Row {
    fault: Fault,
    display: &'static str,
    number: u16,
    /// What the device permits, the factory setting first.
    reactions: &'static [Reaction],
    /// The code that chooses among them.
    code: Option<u16>,
    /// DRIVECOM object 603Fh.
    error_code: u16,
    detection: Detection,
    cause: &'static str,
    remedy: &'static str,
}

impl Fault {
    /// All of them.
    pub const ALL: [Fault; 51] = [
        Fault::Ccr,
        Fault::Ce0,
        Fault::Ce1,
        Fault::Ce2,
        Fault::Ce3,
        Fault::Ce4,
        Fault::Eer,
        Fault::H05,
        Fault::H07,
        Fault::H10,
        Fault::H11,
        Fault::Lp1,
        Fault::Lu,
        Fault::Ou,
        Fault::Nmax,
        Fault::Oc1,
        Fault::Oc2,
        Fault::Oc5,
        Fault::Oh,
        Fault::Oh3,
        Fault::Oh4,
        Fault::Oh7,
        Fault::Oh8,
        Fault::P01,
        Fault::P02,
        Fault::P03,
        Fault::P04,
        Fault::P05,
        Fault::P06,
        Fault::P07,
        Fault::P08,
        Fault::P09,
        Fault::P12,
        Fault::P13,
        Fault::P14,
        Fault::P15,
        Fault::P16,
        Fault::P17,
        Fault::P18,
        Fault::Per,
        Fault::Pi,
        Fault::Pr0,
        Fault::Pr1,
        Fault::Pr2,
        Fault::Pr3,
        Fault::Pr4,
        Fault::Sd2,
        Fault::Sd3,
        Fault::Sd5,
        Fault::Sd6,
        Fault::Sd7,
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

    /// Number in the LECOM list, without the class of the reaction.
    pub const fn number(self) -> u16 {
        self.row().number
    }

    /// Reactions that the device permits, the factory setting first.
    pub const fn reactions(self) -> &'static [Reaction] {
        self.row().reactions
    }

    /// Code that chooses the reaction; `None` when there is no choice, or no code is known.
    pub const fn reaction_code(self) -> Option<u16> {
        self.row().code
    }

    /// Reaction that the codes choose; the first permitted one where there is no choice.
    pub fn reaction(self, codes: &CodeStore) -> Reaction {
        let row = self.row();
        let chosen = row
            .code
            .and_then(|code| Reaction::from_code(codes.number(code, 0) as i32));
        chosen.unwrap_or(row.reactions[0])
    }

    /// LECOM number: n as TRIP, 1000 + n as message, 2000 + n as warning; what C0067 shows.
    pub const fn lecom_number(self, reaction: Reaction) -> u16 {
        let class = match reaction {
            // No source gives a class for FAIL-QSP: it is shown as a TRIP of the same number.
            Reaction::Off | Reaction::FailQsp | Reaction::Trip => 0,
            Reaction::Message => 1000,
            Reaction::Warning => 2000,
        };
        class + self.row().number
    }

    /// The fault and its reaction behind a LECOM number, as in the fault memory.
    pub fn from_lecom_number(number: u16) -> Option<(Fault, Reaction)> {
        let reaction = match number / 1000 {
            0 => Reaction::Trip,
            1 => Reaction::Message,
            2 => Reaction::Warning,
            _ => return None,
        };
        let fault = Self::ALL.into_iter().find(|fault| fault.number() == number % 1000)?;
        Some((fault, reaction))
    }

    /// DRIVECOM fault code, object 603Fh, as in the diagnosis telegram.
    pub const fn drivecom_code(self) -> u16 {
        self.row().error_code
    }

    /// Whether the model finds the fault by itself.
    pub const fn detection(self) -> Detection {
        self.row().detection
    }

    /// The usual cause, for people.
    pub const fn cause(self) -> &'static str {
        self.row().cause
    }

    /// What to do about it, for people.
    pub const fn remedy(self) -> &'static str {
        self.row().remedy
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.display(), self.cause())
    }
}

/// In the order of the enum.
const TABLE: [Row; Fault::ALL.len()] = [
    Row {
        fault: Fault::Ccr,
        display: "CCr",
        number: 71,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "system fault of the control unit",
        remedy: "switch the mains off and on; if it comes back the device is defective",
    },
    Row {
        fault: Fault::Ce0,
        display: "CE0",
        number: 61,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x8100,
        detection: Detection::Monitored,
        cause: "communication over the bus module lost",
        remedy: "check cable, terminators and master; C1882 says what the drive does",
    },
    Row {
        fault: Fault::Ce1,
        display: "CE1",
        number: 62,
        reactions: &[Reaction::Off, Reaction::Trip, Reaction::Warning],
        code: Some(C0591),
        error_code: 0x8100,
        detection: Detection::Monitored,
        cause: "no telegram CAN-IN1 within C0357/1",
        remedy: "check the system bus and its sender, or lengthen C0357/1",
    },
    Row {
        fault: Fault::Ce2,
        display: "CE2",
        number: 63,
        reactions: &[Reaction::Off, Reaction::Trip, Reaction::Warning],
        code: Some(C0592),
        error_code: 0x8100,
        detection: Detection::Monitored,
        cause: "no telegram CAN-IN2 within C0357/2",
        remedy: "check the system bus and its sender, or lengthen C0357/2",
    },
    Row {
        fault: Fault::Ce3,
        display: "CE3",
        number: 64,
        reactions: &[Reaction::Off, Reaction::Trip, Reaction::Warning],
        code: Some(C0593),
        error_code: 0x8100,
        detection: Detection::Monitored,
        cause: "no telegram CAN-IN3 within C0357/3",
        remedy: "check the system bus and its sender, or lengthen C0357/3",
    },
    Row {
        fault: Fault::Ce4,
        display: "CE4",
        number: 65,
        reactions: &[Reaction::Off, Reaction::Trip, Reaction::Warning],
        code: Some(C0595),
        error_code: 0x8100,
        detection: Detection::Monitored,
        cause: "system bus off after too many faulty telegrams",
        remedy: "check wiring, terminators and bit rate of the system bus",
    },
    Row {
        fault: Fault::Eer,
        display: "EEr",
        number: 91,
        reactions: &[Reaction::Trip, Reaction::Message, Reaction::Warning, Reaction::Off],
        code: Some(C0581),
        error_code: 0x9000,
        detection: Detection::Monitored,
        cause: "external fault, set by a control word",
        remedy: "find why the master or the terminal set it",
    },
    Row {
        fault: Fault::H05,
        display: "H05",
        number: 105,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "internal fault",
        remedy: "the device is defective",
    },
    Row {
        fault: Fault::H07,
        display: "H07",
        number: 107,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "wrong power stage found at power-up",
        remedy: "the device is defective",
    },
    Row {
        fault: Fault::H10,
        display: "H10",
        number: 110,
        reactions: &[Reaction::Trip, Reaction::Off],
        code: Some(C0588),
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "temperature sensor of the heat sink",
        remedy: "the device is defective; C0588 = 3 runs on without it",
    },
    Row {
        fault: Fault::H11,
        display: "H11",
        number: 111,
        reactions: &[Reaction::Trip, Reaction::Off],
        code: Some(C0588),
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "temperature sensor inside the device",
        remedy: "the device is defective; C0588 = 3 runs on without it",
    },
    Row {
        fault: Fault::Lp1,
        display: "LP1",
        number: 32,
        reactions: &[Reaction::Off, Reaction::Trip, Reaction::Warning],
        code: Some(C0597),
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "a motor phase is missing",
        remedy: "check the motor cable",
    },
    Row {
        fault: Fault::Lu,
        display: "LU",
        number: 30,
        reactions: &[Reaction::Message],
        code: None,
        error_code: 0x3220,
        detection: Detection::Monitored,
        cause: "DC-link undervoltage: mains missing or too low",
        remedy: "check the mains; C0173 sets the threshold",
    },
    Row {
        fault: Fault::Ou,
        display: "OU",
        number: 20,
        reactions: &[Reaction::Message],
        code: None,
        error_code: 0x3210,
        detection: Detection::Monitored,
        cause: "DC-link overvoltage: braking energy is not taken away",
        remedy: "brake more slowly or fit a brake module; C0173 sets the threshold",
    },
    Row {
        fault: Fault::Nmax,
        display: "NMAX",
        number: 200,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Monitored,
        cause: "motor faster than C0596",
        remedy: "check what drives the motor, its feedback and C0596",
    },
    Row {
        fault: Fault::Oc1,
        display: "OC1",
        number: 11,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x2310,
        detection: Detection::Injected,
        cause: "short circuit",
        remedy: "check motor and motor cable",
    },
    Row {
        fault: Fault::Oc2,
        display: "OC2",
        number: 12,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x2330,
        detection: Detection::Injected,
        cause: "earth fault",
        remedy: "check motor and motor cable",
    },
    Row {
        fault: Fault::Oc5,
        display: "OC5",
        number: 15,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x2311,
        detection: Detection::Monitored,
        cause: "I×t overload, C0064 above 100 %",
        remedy: "brake and accelerate more gently or less often, or take a larger drive",
    },
    Row {
        fault: Fault::Oh,
        display: "OH",
        number: 50,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x4210,
        detection: Detection::Monitored,
        cause: "heat sink too warm",
        remedy: "let it cool; check fan, filters and load",
    },
    Row {
        fault: Fault::Oh3,
        display: "OH3",
        number: 53,
        reactions: &[Reaction::Trip, Reaction::Off],
        code: Some(C0583),
        error_code: 0x4310,
        detection: Detection::Monitored,
        cause: "motor warmer than 150 °C",
        remedy: "let it cool; check load and sensor",
    },
    Row {
        fault: Fault::Oh4,
        display: "OH4",
        number: 54,
        reactions: &[Reaction::Warning, Reaction::Off],
        code: Some(C0582),
        error_code: 0x4210,
        detection: Detection::Monitored,
        cause: "heat sink warmer than C0122",
        remedy: "check fan, filters and load",
    },
    Row {
        fault: Fault::Oh7,
        display: "OH7",
        number: 57,
        reactions: &[Reaction::Warning, Reaction::Off],
        code: Some(C0584),
        error_code: 0x4310,
        detection: Detection::Monitored,
        cause: "motor warmer than C0121",
        remedy: "check load and cooling of the motor",
    },
    Row {
        fault: Fault::Oh8,
        display: "OH8",
        number: 58,
        reactions: &[Reaction::Off, Reaction::Trip, Reaction::Warning],
        code: Some(C0585),
        error_code: 0x4310,
        detection: Detection::Injected,
        cause: "PTC at T1, T2: motor too warm",
        remedy: "let it cool; check load and sensor",
    },
    Row {
        fault: Fault::P01,
        display: "P01",
        number: 151,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "negative limit switch reached",
        remedy: "move away in positive direction by hand",
    },
    Row {
        fault: Fault::P02,
        display: "P02",
        number: 152,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "positive limit switch reached",
        remedy: "move away in negative direction by hand",
    },
    Row {
        fault: Fault::P03,
        display: "P03",
        number: 153,
        reactions: &[Reaction::Trip, Reaction::Warning, Reaction::Off],
        code: Some(C0589),
        error_code: 0x8611,
        detection: Detection::Monitored,
        cause: "following error above C0255",
        remedy: "check for a blocked axis, too little torque (C0022) or too fast a set-value",
    },
    Row {
        fault: Fault::P04,
        display: "P04",
        number: 154,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Monitored,
        cause: "target below the negative position limit",
        remedy: "correct target or limit",
    },
    Row {
        fault: Fault::P05,
        display: "P05",
        number: 155,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Monitored,
        cause: "target above the positive position limit",
        remedy: "correct target or limit",
    },
    Row {
        fault: Fault::P06,
        display: "P06",
        number: 156,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Monitored,
        cause: "no reference: an absolute target needs homing first",
        remedy: "start homing or set a reference",
    },
    Row {
        fault: Fault::P07,
        display: "P07",
        number: 157,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "mode of the record does not fit the configuration",
        remedy: "correct the record or C1210",
    },
    Row {
        fault: Fault::P08,
        display: "P08",
        number: 158,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "reference offset out of range",
        remedy: "correct the offset",
    },
    Row {
        fault: Fault::P09,
        display: "P09",
        number: 159,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "impermissible programming",
        remedy: "correct the traversing program",
    },
    Row {
        fault: Fault::P12,
        display: "P12",
        number: 162,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "range of the encoder exceeded",
        remedy: "set a new reference",
    },
    Row {
        fault: Fault::P13,
        display: "P13",
        number: 163,
        reactions: &[Reaction::Trip, Reaction::Warning, Reaction::Off],
        code: Some(C0590),
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "phase overflow",
        remedy: "reduce the speed or the following error",
    },
    Row {
        fault: Fault::P14,
        display: "P14",
        number: 164,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x8611,
        detection: Detection::Monitored,
        cause: "following error above C1218/1",
        remedy: "check for a blocked axis, too little torque (C0022) or too fast a set-value",
    },
    Row {
        fault: Fault::P15,
        display: "P15",
        number: 165,
        reactions: &[Reaction::Warning],
        code: None,
        error_code: 0x8611,
        detection: Detection::Monitored,
        cause: "following error above C1218/2",
        remedy: "check for a blocked axis, too little torque (C0022) or too fast a set-value",
    },
    Row {
        fault: Fault::P16,
        display: "P16",
        number: 166,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "synchronisation over the system bus lost",
        remedy: "check sender and cycle of the sync telegram",
    },
    Row {
        fault: Fault::P17,
        display: "P17",
        number: 167,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "touch probe could not be worked off",
        remedy: "check sensor and record",
    },
    Row {
        fault: Fault::P18,
        display: "P18",
        number: 168,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "internal limitation",
        remedy: "reduce speed or acceleration",
    },
    Row {
        fault: Fault::Per,
        display: "PEr",
        number: 74,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "program fault of the control unit",
        remedy: "switch the mains off and on; if it comes back the device is defective",
    },
    Row {
        fault: Fault::Pi,
        display: "PI",
        number: 79,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "initialisation with a wrong parameter set",
        remedy: "load the factory setting and set the parameters anew",
    },
    Row {
        fault: Fault::Pr0,
        display: "PR0",
        number: 75,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "all parameter sets damaged, factory setting loaded",
        remedy: "set the parameters, save them, switch the mains off and on",
    },
    Row {
        fault: Fault::Pr1,
        display: "PR1",
        number: 72,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "parameter set 1 damaged, factory setting loaded",
        remedy: "set the parameters and save them with C0003 = 1",
    },
    Row {
        fault: Fault::Pr2,
        display: "PR2",
        number: 73,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "parameter set 2 damaged, factory setting loaded",
        remedy: "set the parameters and save them with C0003 = 2",
    },
    Row {
        fault: Fault::Pr3,
        display: "PR3",
        number: 77,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "parameter set 3 damaged, factory setting loaded",
        remedy: "set the parameters and save them with C0003 = 3",
    },
    Row {
        fault: Fault::Pr4,
        display: "PR4",
        number: 78,
        reactions: &[Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "parameter set 4 damaged, factory setting loaded",
        remedy: "set the parameters and save them with C0003 = 4",
    },
    Row {
        fault: Fault::Sd2,
        display: "Sd2",
        number: 82,
        reactions: &[Reaction::Trip, Reaction::Warning, Reaction::Off],
        code: Some(C0586),
        error_code: 0x7303,
        detection: Detection::Injected,
        cause: "resolver wire break",
        remedy: "check cable and plug X7",
    },
    Row {
        fault: Fault::Sd3,
        display: "Sd3",
        number: 83,
        reactions: &[Reaction::Off, Reaction::Trip, Reaction::Warning],
        code: Some(C0587),
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "encoder at X9/8",
        remedy: "check the cable of the digital frequency input",
    },
    Row {
        fault: Fault::Sd5,
        display: "Sd5",
        number: 85,
        reactions: &[Reaction::Off, Reaction::Trip, Reaction::Warning],
        code: Some(C0598),
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "master current below 2 mA",
        remedy: "check the cable of the analog input",
    },
    Row {
        fault: Fault::Sd6,
        display: "Sd6",
        number: 86,
        reactions: &[Reaction::Trip, Reaction::Warning, Reaction::Off],
        code: Some(C0594),
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "temperature sensor of the motor",
        remedy: "check cable and plug X7 or X8",
    },
    Row {
        fault: Fault::Sd7,
        display: "Sd7",
        number: 87,
        reactions: &[Reaction::Off, Reaction::Trip],
        code: None,
        error_code: 0x1000,
        detection: Detection::Injected,
        cause: "absolute encoder",
        remedy: "check its cable",
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::table::{Domain, entry};

    #[test]
    fn the_table_stands_in_the_order_of_the_faults() {
        for fault in Fault::ALL {
            assert_eq!(fault.row().fault, fault);
            assert!(!fault.cause().is_empty() && !fault.remedy().is_empty(), "{fault}");
        }
    }

    #[test]
    fn numbers_follow_the_lecom_rule() {
        // Source: 9300 facts 4.9: LU 1030, OU 1020, P03 153 / 2153, OH4 2054.
        let factory = CodeStore::factory();
        let shown = |fault: Fault| fault.lecom_number(fault.reaction(&factory));
        assert_eq!(shown(Fault::Lu), 1030);
        assert_eq!(shown(Fault::Ou), 1020);
        assert_eq!(shown(Fault::Oh4), 2054);
        assert_eq!(Fault::P03.lecom_number(Reaction::Trip), 153);
        assert_eq!(Fault::P03.lecom_number(Reaction::Warning), 2153);
        assert_eq!(Fault::from_lecom_number(2153), Some((Fault::P03, Reaction::Warning)));
        assert_eq!(Fault::from_lecom_number(3153), None);
    }

    #[test]
    fn no_number_is_given_twice() {
        let mut numbers = Fault::ALL.map(Fault::number);
        numbers.sort_unstable();
        assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn the_codes_offer_exactly_the_reactions_that_the_device_permits() {
        // Two lists of the same source, typed apart: 9300 facts 4.4 (codes) and 4.9 (faults).
        for fault in Fault::ALL {
            let Some(code) = fault.reaction_code() else {
                continue;
            };
            let line = entry(code).unwrap();
            let Domain::Selection(values) = line.domain else {
                panic!("C{code:04} is no selection");
            };
            let mut offered: Vec<_> = values
                .iter()
                .map(|value| Reaction::from_code(value / 10_000).unwrap())
                .collect();
            let mut permitted = fault.reactions().to_vec();
            offered.sort();
            permitted.sort();
            assert_eq!(offered, permitted, "{fault}");
        }
    }

    #[test]
    fn the_factory_setting_of_the_codes_is_the_first_permitted_reaction() {
        let factory = CodeStore::factory();
        // OH3, OH7 and Sd6 are off until C0086 names a motor with a sensor.
        let by_motor = [Fault::Oh3, Fault::Oh7, Fault::Sd6];
        for fault in Fault::ALL.into_iter().filter(|fault| !by_motor.contains(fault)) {
            assert_eq!(fault.reaction(&factory), fault.reactions()[0], "{fault}");
        }
        let thesis = CodeStore::thesis();
        for fault in by_motor {
            assert_eq!(fault.reaction(&factory), Reaction::Off, "{fault}");
            assert_eq!(fault.reaction(&thesis), fault.reactions()[0], "{fault}");
        }
    }
}

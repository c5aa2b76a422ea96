//! Traversing records: the program as data.

use thiserror::Error;

use super::homing::HomingRule;

/// Number of a traversing record, 1 to 32.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RecordNumber(u8);

impl RecordNumber {
    /// Greatest number of records. Source: 9300 facts 4.1.
    pub const MAX: u8 = 32;

    /// Checks the range 1 to 32.
    pub const fn new(number: u8) -> Option<Self> {
        if number >= 1 && number <= Self::MAX {
            Some(Self(number))
        } else {
            None
        }
    }

    /// The number itself.
    pub const fn get(self) -> u8 {
        self.0
    }

    pub(super) const fn index(self) -> usize {
        self.0 as usize - 1
    }
}

/// One traversing record with the 17 fields of its dialog, in the order they are worked off.
///
/// Source: 9300 facts 4.1, table of the fields; thesis fig. 66–69.
#[doc(alias = "Verfahrsatz")]
#[doc(alias = "PS")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Field 1: hold the record until the input has the level.
    #[doc(alias = "Warten")]
    pub wait: Option<InputLevel>,
    /// Field 2: set an output before the travel.
    #[doc(alias = "Schalten")]
    pub switch_before: Option<OutputLevel>,
    /// Field 3, with fields 9 and 10 where they apply.
    #[doc(alias = "PS-Mode")]
    pub mode: Mode,
    /// Field 4: the target.
    #[doc(alias = "Lage-Ziel")]
    pub target: Target,
    /// Field 5: travel velocity.
    #[doc(alias = "Verfahrgeschw.")]
    pub velocity: Velocity,
    /// Field 6: acceleration.
    #[doc(alias = "Beschleunigung")]
    pub acceleration: Acceleration,
    /// Field 7: deceleration.
    #[doc(alias = "Verzögerung")]
    pub deceleration: Acceleration,
    /// Field 8: the speed at which the target is crossed.
    #[doc(alias = "Endgeschw.")]
    pub final_velocity: FinalVelocity,
    /// Field 11: where to go when the target is reached without a touch probe.
    #[doc(alias = "wenn PS-CANCEL oder kein TP")]
    pub without_touch: Successor,
    /// Field 12: set an output after the travel.
    pub switch_after: Option<OutputLevel>,
    /// Field 13: waiting time after the travel, VTTIME number.
    #[doc(alias = "Wartezeit")]
    pub dwell: Option<u8>,
    /// Field 14: first conditional jump.
    #[doc(alias = "Verzweigung")]
    pub branch_1: Option<Branch>,
    /// Field 15: second conditional jump.
    pub branch_2: Option<Branch>,
    /// Field 16: jump when the record has been passed this often.
    #[doc(alias = "Stückzahl")]
    pub pieces: Option<Pieces>,
    /// Field 17: the successor otherwise.
    #[doc(alias = "Sprung")]
    pub jump: Successor,
}

impl Record {
    /// A record with everything optional inactive, at v-max and a-max to a standstill, ending the program.
    pub const fn new(mode: Mode, target: Target) -> Self {
        Self {
            wait: None,
            switch_before: None,
            mode,
            target,
            velocity: Velocity::Max,
            acceleration: Acceleration::Max,
            deceleration: Acceleration::Max,
            final_velocity: FinalVelocity::Standstill,
            without_touch: Successor::End,
            switch_after: None,
            dwell: None,
            branch_1: None,
            branch_2: None,
            pieces: None,
            jump: Successor::End,
        }
    }
}

/// Kind of positioning. Source: 9300 facts 4.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// No motion: the actual position becomes the target value, set-value and target shift with it.
    #[doc(alias = "Referenz setzen")]
    SetReference,
    /// Target = previous target + variable.
    #[doc(alias = "Relativer PS")]
    Relative,
    /// As relative; at the first touch inside the window the target becomes the touch position ± residual path.
    #[doc(alias = "Touch Point")]
    RelativeWithTouchProbe(TouchRule),
    /// Target = variable, counted from the reference.
    Absolute,
    /// As absolute; at the first touch inside the window the target becomes the touch position ± residual path.
    AbsoluteWithTouchProbe(TouchRule),
    /// Find the reference point; it gets the target value. The velocity is that of the search.
    Homing(HomingRule),
}

impl Mode {
    /// The rule of the touch probe, if the record has one.
    pub const fn touch_rule(&self) -> Option<&TouchRule> {
        match self {
            Self::RelativeWithTouchProbe(rule) | Self::AbsoluteWithTouchProbe(rule) => Some(rule),
            Self::SetReference | Self::Relative | Self::Absolute | Self::Homing(_) => None,
        }
    }
}

/// Fields 9 and 10 of a record with touch probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TouchRule {
    /// Field 9: where touches count.
    #[doc(alias = "TP-Fenster")]
    pub window: TouchWindow,
    /// Field 10: rest to travel from the latched position; only its magnitude counts.
    #[doc(alias = "TP-Restweg")]
    pub residual: ResidualPath,
}

/// Where touches count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TouchWindow {
    /// As long as the record is worked off.
    #[doc(alias = "Fahrbereich")]
    TravelRange,
    /// Between two positions counted from the reference, ends included (VTPOS numbers). Assumed: other windows than
    /// the travel range exist, their form is not known.
    Between {
        /// VTPOS number of one end.
        first: u8,
        /// VTPOS number of the other end.
        second: u8,
    },
}

/// Rest to travel after a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResidualPath {
    /// The target is the touch position itself.
    #[doc(alias = "Ziel = TP-Lage")]
    None,
    /// A position variable.
    Variable(u8),
    /// A fixed length, units ×10000.
    Fixed(i32),
}

/// A position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// 0.
    #[doc(alias = "Real-Null")]
    Zero,
    /// VTPOS number.
    #[doc(alias = "VTPOS-No")]
    Variable(u8),
}

/// A travel velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Velocity {
    /// C1240.
    #[doc(alias = "v-max")]
    Max,
    /// VTVEL number.
    #[doc(alias = "VTVEL-No")]
    Variable(u8),
}

/// An acceleration or deceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acceleration {
    /// C1250.
    #[doc(alias = "a-max")]
    Max,
    /// VTACC number.
    #[doc(alias = "VTACC-No")]
    Variable(u8),
}

/// The speed at which a target is crossed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FinalVelocity {
    /// Stop at the target.
    #[doc(alias = "Stillstand")]
    Standstill,
    /// Cross it with this speed (VTVEL number) and hand over to the next record on the fly.
    Variable(u8),
}

/// Where the program goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Successor {
    /// Another record.
    Record(RecordNumber),
    /// End of the program.
    #[doc(alias = "Prg.-Ende")]
    End,
}

/// A program function input, 1 to 32.
///
/// Assumed: how many the drive has is not known; the thesis uses one.
#[doc(alias = "PFI")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ProgramInput(u8);

impl ProgramInput {
    /// Input 1; in the film feed high = printed film.
    #[doc(alias = "PFI 01")]
    pub const PFI01: Self = Self(1);

    /// Greatest number.
    pub const MAX: u8 = 32;

    /// Checks the range 1 to 32.
    pub const fn new(number: u8) -> Option<Self> {
        if number >= 1 && number <= Self::MAX {
            Some(Self(number))
        } else {
            None
        }
    }

    /// The number itself.
    pub const fn get(self) -> u8 {
        self.0
    }
}

/// A level of a program function input or output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Level {
    /// 0.
    Low,
    /// 1.
    High,
}

/// An input and the level asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputLevel {
    /// Input.
    pub input: ProgramInput,
    /// Level.
    pub level: Level,
}

/// A program function output, 1 to 16, and the level to set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutputLevel {
    /// Output number, 1 to 16.
    #[doc(alias = "PFO")]
    pub output: u8,
    /// Level.
    pub level: Level,
}

/// A conditional jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// Condition.
    pub when: InputLevel,
    /// Successor when it holds.
    pub to: Successor,
}

/// A jump after a number of passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pieces {
    /// VTPCS number that holds the number of passes.
    pub count: u8,
    /// Successor when it is reached.
    pub to: Successor,
}

/// A traversing program of up to 32 records.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    records: Box<[Option<Record>; RecordNumber::MAX as usize]>,
}

impl Program {
    /// Builds a program and checks that it can be worked off.
    ///
    /// # Errors
    ///
    /// See [`ProgramError`]; the first mistake found, by record number as given.
    pub fn new(records: impl IntoIterator<Item = (u8, Record)>) -> Result<Self, ProgramError> {
        let mut places = Box::new([None; RecordNumber::MAX as usize]);
        for (number, record) in records {
            let number = RecordNumber::new(number).ok_or(ProgramError::Number { got: number })?;
            if places[number.index()].replace(record).is_some() {
                return Err(ProgramError::Doubled { record: number.get() });
            }
        }
        let program = Self { records: places };
        for number in (1..=RecordNumber::MAX).filter_map(RecordNumber::new) {
            if let Some(record) = program.record(number) {
                program.check(number, record)?;
            }
        }
        Ok(program)
    }

    /// A record, or `None` when it is not programmed.
    pub fn record(&self, number: RecordNumber) -> Option<&Record> {
        self.records[number.index()].as_ref()
    }

    /// The records that are programmed, with their numbers.
    pub fn records(&self) -> impl Iterator<Item = (RecordNumber, &Record)> {
        (1..=RecordNumber::MAX)
            .filter_map(RecordNumber::new)
            .filter_map(|number| self.record(number).map(|record| (number, record)))
    }

    fn check(&self, number: RecordNumber, record: &Record) -> Result<(), ProgramError> {
        let in_record = number.get();
        for successor in record.successors() {
            if let Successor::Record(to) = successor
                && self.record(to).is_none()
            {
                return Err(ProgramError::NoSuccessor {
                    record: in_record,
                    to: to.get(),
                });
            }
        }
        if record.dwell.is_some() && record.final_velocity != FinalVelocity::Standstill {
            return Err(ProgramError::DwellOnTheFly { record: in_record });
        }
        if matches!(record.mode, Mode::Homing(_)) && record.final_velocity != FinalVelocity::Standstill {
            return Err(ProgramError::HomingOnTheFly { record: in_record });
        }
        for output in [record.switch_before, record.switch_after].into_iter().flatten() {
            if !(1..=16).contains(&output.output) {
                return Err(ProgramError::Output {
                    record: in_record,
                    got: output.output,
                });
            }
        }
        let (positions, variables) = record.variables();
        for (got, last) in positions
            .map(|got| (got, crate::code::table::POSITION_COUNT))
            .into_iter()
            .chain(variables.map(|got| (got, crate::code::table::VARIABLE_COUNT)))
        {
            if let Some(got) = got
                && !(1..=last).contains(&got)
            {
                return Err(ProgramError::Variable {
                    record: in_record,
                    got,
                    last,
                });
            }
        }
        Ok(())
    }
}

impl Record {
    /// Everywhere the record can go on.
    pub(super) fn successors(&self) -> impl Iterator<Item = Successor> {
        let branches = [self.branch_1, self.branch_2]
            .into_iter()
            .flatten()
            .map(|branch| branch.to);
        let pieces = self.pieces.map(|pieces| pieces.to);
        branches.chain(pieces).chain([self.without_touch, self.jump])
    }

    /// Numbers of the position variables and of the other variables.
    fn variables(&self) -> ([Option<u8>; 4], [Option<u8>; 6]) {
        let target = match self.target {
            Target::Variable(number) => Some(number),
            Target::Zero => None,
        };
        let (mut residual, mut window) = (None, (None, None));
        if let Some(rule) = self.mode.touch_rule() {
            if let ResidualPath::Variable(number) = rule.residual {
                residual = Some(number);
            }
            if let TouchWindow::Between { first, second } = rule.window {
                window = (Some(first), Some(second));
            }
        }
        let velocity = match self.velocity {
            Velocity::Variable(number) => Some(number),
            Velocity::Max => None,
        };
        let [acceleration, deceleration] = [self.acceleration, self.deceleration].map(|rate| match rate {
            Acceleration::Variable(number) => Some(number),
            Acceleration::Max => None,
        });
        let final_velocity = match self.final_velocity {
            FinalVelocity::Variable(number) => Some(number),
            FinalVelocity::Standstill => None,
        };
        let pieces = self.pieces.map(|pieces| pieces.count);
        (
            [target, residual, window.0, window.1],
            [velocity, acceleration, deceleration, final_velocity, self.dwell, pieces],
        )
    }
}

/// Why a program cannot be worked off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ProgramError {
    /// Record numbers run from 1 to 32.
    #[error("record number {got}: expected 1 to 32")]
    Number {
        /// Number given.
        got: u8,
    },
    /// Two records have the same number.
    #[error("record {record} is given twice")]
    Doubled {
        /// Record.
        record: u8,
    },
    /// A jump leads nowhere.
    #[error("record {record} goes on at record {to}, which is not programmed")]
    NoSuccessor {
        /// Record.
        record: u8,
        /// Its successor.
        to: u8,
    },
    /// A waiting time needs a standstill.
    #[error("record {record} has a waiting time and a final velocity: expected standstill")]
    DwellOnTheFly {
        /// Record.
        record: u8,
    },
    /// Homing ends on the reference point.
    #[error("record {record} homes and has a final velocity: expected standstill")]
    HomingOnTheFly {
        /// Record.
        record: u8,
    },
    /// Program function outputs run from 1 to 16.
    #[error("record {record} switches output {got}: expected 1 to 16")]
    Output {
        /// Record.
        record: u8,
        /// Output given.
        got: u8,
    },
    /// A variable number is outside its table.
    #[error("record {record} names variable {got}: expected 1 to {last}")]
    Variable {
        /// Record.
        record: u8,
        /// Number given.
        got: u8,
        /// Greatest number.
        last: u8,
    },
}

//! Function_Num: the first octet of every PDU of DP-V1.

/// What a PDU of DP-V1 is for.
///
/// ```text
/// bit 7  1 = negative response        bit 6  always 1        bits 5…0  the number
/// ```
///
/// Request and positive response have the same code. Source: IEC 61158-6-3, coding of Function_Num.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Function {
    /// `48`: the connection lives (MSAC2).
    Idle,
    /// `51`: data there and back in one service (MSAC2).
    DataTransport,
    /// `56`: the resource manager names the access point of a connection (MSAC2, slave to master only).
    ResourceManager,
    /// `57`: opens a connection (MSAC2).
    Initiate,
    /// `58`: ends a connection (MSAC2).
    Abort,
    /// `5C`: acknowledges an alarm (MSAC1).
    AlarmAck,
    /// `5E`: reads a data record.
    Read,
    /// `5F`: writes a data record.
    Write,
}

impl Function {
    /// All of them, by code.
    pub const ALL: [Self; 8] = [
        Self::Idle,
        Self::DataTransport,
        Self::ResourceManager,
        Self::Initiate,
        Self::Abort,
        Self::AlarmAck,
        Self::Read,
        Self::Write,
    ];

    /// The code of request and positive response.
    pub const fn code(self) -> u8 {
        match self {
            Self::Idle => 0x48,
            Self::DataTransport => 0x51,
            Self::ResourceManager => 0x56,
            Self::Initiate => 0x57,
            Self::Abort => 0x58,
            Self::AlarmAck => 0x5C,
            Self::Read => 0x5E,
            Self::Write => 0x5F,
        }
    }

    /// The function with this code; `None` for one without a name and for a negative response.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|function| function.code() == code)
    }
}

/// Bit 7 of Function_Num: the response is negative.
pub const NEGATIVE: u8 = 0x80;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_names_one_function_and_negative_codes_name_none() {
        let named: Vec<u8> = (0..=u8::MAX)
            .filter(|&code| Function::from_code(code).is_some())
            .collect();
        // Source: IEC 61158-6-3, coding of Function_Num.
        assert_eq!(named, [0x48, 0x51, 0x56, 0x57, 0x58, 0x5C, 0x5E, 0x5F]);
        for function in Function::ALL {
            assert_eq!(Function::from_code(function.code()), Some(function));
            assert_eq!(Function::from_code(function.code() | NEGATIVE), None);
        }
    }
}

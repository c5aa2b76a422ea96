//! One macro for 16-bit words whose bits have names: accessor, builder, name list and `Display` from one line.

/// Gives a `struct Word(pub u16)` one accessor and one builder per named bit, and a `Display` of hex and names.
///
/// The names of a bit stand in one place only, so that accessor, builder and print-out cannot disagree.
macro_rules! named_bits {
    ($word:ident { $( $(#[$doc:meta])* $bit:literal $get:ident $with:ident $name:literal; )* }) => {
        impl $word {
            $(
                $(#[$doc])*
                #[must_use]
                pub const fn $get(self) -> bool {
                    self.0 & (1 << $bit) != 0
                }

                #[doc = concat!("The same word with bit ", stringify!($bit), " (", $name, ") set to `on`.")]
                #[must_use]
                pub const fn $with(self, on: bool) -> Self {
                    if on { Self(self.0 | (1 << $bit)) } else { Self(self.0 & !(1 << $bit)) }
                }
            )*

            /// Number and name of every named bit, lowest first; bits without a name are missing.
            pub const BIT_NAMES: &'static [(u8, &'static str)] = &[ $( ($bit, $name) ),* ];
        }

        impl From<u16> for $word {
            fn from(word: u16) -> Self {
                Self(word)
            }
        }

        impl From<$word> for u16 {
            fn from(word: $word) -> Self {
                word.0
            }
        }

        /// Four hex digits, then the names of the bits at 1: `0x0006 enable-voltage no-quick-stop`.
        impl core::fmt::Display for $word {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                write!(f, "0x{:04X}", self.0)?;
                for bit in 0..16_u8 {
                    if self.0 & (1 << bit) == 0 {
                        continue;
                    }
                    match Self::BIT_NAMES.iter().find(|(number, _)| *number == bit) {
                        Some((_, name)) => write!(f, " {name}")?,
                        None => write!(f, " bit{bit}")?,
                    }
                }
                Ok(())
            }
        }
    };
}

pub(crate) use named_bits;

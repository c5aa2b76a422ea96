//! DRIVECOM profile 20, both sides.
#![cfg_attr(not(feature = "std"), no_std)]

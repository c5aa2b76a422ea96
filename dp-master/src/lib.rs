//! PROFIBUS FDL and DP, master and slave side, sans I/O.
#![cfg_attr(not(feature = "std"), no_std)]

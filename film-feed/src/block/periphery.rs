//! The PLC's consistent access to the periphery, as the block sees it.

/// What SFC 14 (`DPRD_DAT`) and SFC 15 (`DPWR_DAT`) do: move one whole module area of 8 octets at once.
///
/// Both report whether the address names an area. The block ignores the answer, as the original ignores `RET_VAL`; what
/// it does rely on is that a wrong address leaves the record, respectively the outputs, as they were.
pub trait Periphery {
    /// Reads the 8 input octets of the module at `laddr` into `record`. Returns false, and leaves `record` unchanged, if
    /// no module begins at `laddr`.
    #[doc(alias = "SFC 14")]
    fn dprd_dat(&mut self, laddr: u16, record: &mut [u8; 8]) -> bool;

    /// Writes `record` to the 8 output octets of the module at `laddr`. Returns false, and changes nothing, if no module
    /// begins at `laddr`.
    #[doc(alias = "SFC 15")]
    fn dpwr_dat(&mut self, laddr: u16, record: &[u8; 8]) -> bool;
}

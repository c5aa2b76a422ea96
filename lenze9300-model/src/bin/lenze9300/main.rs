//! The modelled drive as a process.
fn main() {}

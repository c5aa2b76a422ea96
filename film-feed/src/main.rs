//! The film feed application.
fn main() {}

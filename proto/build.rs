//! Generates.
fn main(){}

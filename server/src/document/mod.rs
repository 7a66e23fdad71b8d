//! TOML texts that people write: read key by key, with every mistake collected together with its place.

pub mod bounds;
pub mod keys;
pub mod mistake;

mod suggest;

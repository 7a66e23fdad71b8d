//! Data gloves.

pub mod calibrate;
pub mod cyberglove;
pub mod delimited;
pub mod fivedt;
pub mod format;
pub mod listening;
pub mod lucidglove;
pub mod opencyberglove;
pub mod quick_range;
pub mod sensor;

mod auto_range;

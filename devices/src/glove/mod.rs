//! Data gloves.

pub mod calibrate;
pub mod cyberglove;
pub mod lucidglove;
pub mod quick_range;
pub mod sensor;

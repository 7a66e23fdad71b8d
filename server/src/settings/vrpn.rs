//! `vrpn`, `vrpn_rate_hz`, `vrpn_axes`: the VRPN server.

use std::net::SocketAddr;

use tsukamu_devices::tracker::space::TrackerSpace;

use crate::document::bounds::Bounds;

/// Where VRPN servers listen, by their own rule; here on this machine alone.
pub const ADDRESS_DEFAULT: &str = "127.0.0.1:3883";
/// The word for no server, so that a flag can take back what the file says.
pub const OFF: &str = "off";
/// Pose rates.
pub(super) const RATE: Bounds = Bounds::within(1.0, 1000.0, "Hz");
/// Pose rate unless told otherwise, Hz.
pub const RATE_DEFAULT_HZ: f64 = 60.0;
/// Names of axes.
pub(super) const AXES: [&str; 2] = ["y_up", "z_up"];

/// The VRPN server.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VrpnSettings {
    /// Address and port, TCP and UDP.
    pub listen: SocketAddr,
    /// Pictures of the world per second, 1 to 1000; no more than it steps.
    pub rate_hz: f64,
    /// Which way the axes of poses point.
    pub axes: TrackerSpace,
}

impl VrpnSettings {
    /// 60 Hz in the world's own axes.
    pub const fn new(listen: SocketAddr) -> Self {
        Self {
            listen,
            rate_hz: RATE_DEFAULT_HZ,
            axes: TrackerSpace::YUp,
        }
    }
}

/// Axes by their name.
pub(super) fn axes_from(name: Option<&str>) -> TrackerSpace {
    match name {
        Some("z_up") => TrackerSpace::ZUp,
        _ => TrackerSpace::YUp,
    }
}

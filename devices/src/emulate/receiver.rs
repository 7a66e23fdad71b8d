//! What a tracker measures.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

/// One receiver of a tracker.
#[derive(Debug, Clone)]
pub(crate) struct Receiver {
    /// The receiver in transmitter space, m.
    pub(crate) pose: Isometry3<f64>,
    pub(crate) connected: bool,
}

impl Receiver {
    /// 0.3 m in front of the transmitter.
    pub(crate) fn in_front(connected: bool) -> Self {
        Self {
            pose: Isometry3::translation(0.3, 0.0, 0.0),
            connected,
        }
    }

    pub(crate) fn place(&mut self, position: Point3<f64>, rotation: UnitQuaternion<f64>) {
        self.pose = Isometry3::from_parts(Translation3::from(position.coords), rotation);
    }
}

/// One of a row that is numbered from 1.
pub(crate) fn numbered<T>(row: &mut [T], number: u8) -> Option<&mut T> {
    let index = usize::from(number).checked_sub(1)?;
    row.get_mut(index)
}

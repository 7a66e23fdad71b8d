//! Quantities that move: all that filtering, prediction and interpolation need to know of them.

use nalgebra::{Isometry3, Point3, SVector, Translation3, UnitQuaternion, Vector3};
use tsukamu_world::hand::sample::{JointAngles, N_ANGLES};

/// A value that moves, and its changes as vectors of `N` numbers.
pub trait Moving<const N: usize>: Clone {
    /// Numbers of a change, from the front, that are of the first kind; the others are of a second kind. A pose has metres
    /// and radians: their speeds are never added.
    const N_FIRST: usize;

    /// The change that leads from another value to this one.
    fn change_from(&self, from: &Self) -> SVector<f64, N>;

    /// The value after a change.
    #[must_use]
    fn moved(&self, change: &SVector<f64, N>) -> Self;

    /// The value a share of the way to another.
    #[must_use]
    fn toward(&self, to: &Self, share: f64) -> Self {
        self.moved(&(to.change_from(self) * share))
    }
}

/// Sizes of a change's two kinds.
pub fn sizes<T: Moving<N>, const N: usize>(change: &SVector<f64, N>) -> [f64; 2] {
    let (first, second) = (change.rows(0, T::N_FIRST), T::N_FIRST..N);
    [first.norm(), change.rows_range(second).norm()]
}

/// A change of which each kind is taken so many times.
pub fn scaled<T: Moving<N>, const N: usize>(
    change: &SVector<f64, N>,
    [first, second]: [f64; 2],
) -> SVector<f64, N> {
    SVector::from_fn(|row, _| change[row] * if row < T::N_FIRST { first } else { second })
}

/// A pose moves in space (m, world axes) and turns (rad, its own axes): straight and evenly.
impl Moving<6> for Isometry3<f64> {
    const N_FIRST: usize = 3;

    fn change_from(&self, from: &Self) -> SVector<f64, 6> {
        let way = self.translation.vector - from.translation.vector;
        let turn = (from.rotation.inverse() * self.rotation).scaled_axis();
        SVector::from([way.x, way.y, way.z, turn.x, turn.y, turn.z])
    }

    fn moved(&self, change: &SVector<f64, 6>) -> Self {
        let way = Vector3::new(change[0], change[1], change[2]);
        let turn = Vector3::new(change[3], change[4], change[5]);
        let mut rotation = self.rotation * UnitQuaternion::from_scaled_axis(turn);
        // Rounding of many small turns adds up.
        rotation.renormalize();
        Self::from_parts(Translation3::from(self.translation.vector + way), rotation)
    }
}

/// Joint angles, rad.
impl Moving<N_ANGLES> for JointAngles {
    const N_FIRST: usize = N_ANGLES;

    fn change_from(&self, from: &Self) -> SVector<f64, N_ANGLES> {
        SVector::from(self.to_list()) - SVector::from(from.to_list())
    }

    fn moved(&self, change: &SVector<f64, N_ANGLES>) -> Self {
        Self::from_list(&(SVector::from(self.to_list()) + change).into())
    }
}

/// A place, m.
impl Moving<3> for Point3<f64> {
    const N_FIRST: usize = 3;

    fn change_from(&self, from: &Self) -> SVector<f64, 3> {
        self - from
    }

    fn moved(&self, change: &SVector<f64, 3>) -> Self {
        self + change
    }
}

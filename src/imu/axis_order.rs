//! The 48 signed permutations of three axes.

use nalgebra::{Matrix3, Vector3};

/// A signed permutation of three axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisOrder {
    /// For each axis of the result, the index of the axis of the argument.
    pub source: [usize; 3],
    /// For each axis of the result, whether the sign is reversed.
    pub reversed: [bool; 3],
}

impl AxisOrder {
    /// The identity.
    pub const IDENTITY: Self = Self {
        source: [0, 1, 2],
        reversed: [false; 3],
    };

    /// The order from front, right, down to right, front, up.
    pub const FRONT_RIGHT_DOWN: Self = Self {
        source: [1, 0, 2],
        reversed: [false, false, true],
    };
    /// The order from front, left, up to right, front, up.
    pub const FRONT_LEFT_UP: Self = Self {
        source: [1, 0, 2],
        reversed: [true, false, false],
    };

    /// All 48 axis orders, the identity first.
    pub fn all() -> impl Iterator<Item = Self> {
        const ORDERS: [[usize; 3]; 6] = [
            [0, 1, 2],
            [1, 0, 2],
            [0, 2, 1],
            [2, 1, 0],
            [1, 2, 0],
            [2, 0, 1],
        ];
        ORDERS.into_iter().flat_map(|source| {
            (0..8).map(move |signs| Self {
                source,
                reversed: [0, 1, 2].map(|axis| signs >> axis & 1 == 1),
            })
        })
    }

    /// The sign of an axis of the result, 1 or −1.
    pub fn sign(&self, axis: usize) -> f64 {
        if self.reversed[axis] { -1.0 } else { 1.0 }
    }

    /// Applies the order and signs to a vector.
    pub fn apply(&self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.sign(axis) * v[self.source[axis]])
    }

    /// Rearranges one value per axis, such as a σ or a nominal scale. The sign of the value does not change, because a
    /// reversed axis changes the sign of both input and output.
    pub fn each(&self, v: Vector3<f64>) -> Vector3<f64> {
        Vector3::from(self.source.map(|axis| v[axis]))
    }

    /// The order as a matrix.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| {
            if column == self.source[row] {
                self.sign(row)
            } else {
                0.0
            }
        })
    }

    /// The composition of two orders: first `first`, then this order.
    pub fn after(&self, first: &Self) -> Self {
        Self {
            source: self.source.map(|axis| first.source[axis]),
            reversed: [0, 1, 2]
                .map(|axis| self.reversed[axis] != first.reversed[self.source[axis]]),
        }
    }

    /// The inverse order.
    pub fn inverse(&self) -> Self {
        let mut inverse = Self::IDENTITY;
        for axis in 0..3 {
            inverse.source[self.source[axis]] = axis;
            inverse.reversed[self.source[axis]] = self.reversed[axis];
        }
        inverse
    }

    /// A copy with every axis reversed.
    pub fn opposite(&self) -> Self {
        Self {
            reversed: self.reversed.map(|reversed| !reversed),
            ..*self
        }
    }

    /// Whether the permutation is a rotation, so that right-handed axes stay right-handed.
    pub fn is_rotation(&self) -> bool {
        self.matrix().determinant() > 0.0
    }

    /// The axes that this order changes.
    pub fn changed(&self) -> impl Iterator<Item = usize> {
        (0..3).filter(|&axis| self.source[axis] != axis || self.reversed[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_48_of_which_24_are_rotations() {
        let all: Vec<AxisOrder> = AxisOrder::all().collect();
        assert_eq!(all.len(), 48);
        assert_eq!(all[0], AxisOrder::IDENTITY);
        for (k, order) in all.iter().enumerate() {
            assert!(!all[..k].contains(order));
        }
        assert_eq!(all.iter().filter(|order| order.is_rotation()).count(), 24);
    }

    #[test]
    fn orders_are_their_matrices() {
        let v = Vector3::new(1.0, 2.0, 3.0);
        for a in AxisOrder::all() {
            assert_eq!(a.apply(&v), a.matrix() * v);
            assert_eq!(a.inverse().matrix(), a.matrix().transpose());
            assert_eq!(a.opposite().matrix(), -a.matrix());
            for b in AxisOrder::all() {
                assert_eq!(a.after(&b).matrix(), a.matrix() * b.matrix());
            }
        }
    }
}

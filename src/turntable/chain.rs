//! The chain of joints from the Earth to the body, and its motion.

use nalgebra::{Matrix3, Vector3};

use super::{Imperfection, PHASES, Profile, Table, Turned, phases};
use crate::attitude::exp;

/// The attitude and its derivatives at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinematics {
    /// `C_b_n`, body to East-North-Up.
    pub attitude: Matrix3<f64>,
    /// `ω_nb`, rate of the body relative to the Earth along body axes, rad/s.
    pub rate: Vector3<f64>,
    /// Derivative of the components of `rate`, rad/s².
    pub acceleration: Vector3<f64>,
}

impl Kinematics {
    fn times(&mut self, constant: &Matrix3<f64>) {
        self.attitude *= constant;
        self.rate = constant.tr_mul(&self.rate);
        self.acceleration = constant.tr_mul(&self.acceleration);
    }

    /// Continues the chain through a joint that turns about `axis`.
    fn turn(&mut self, axis: &Vector3<f64>, angle: f64, rate: f64, acceleration: f64) {
        let rotation = exp(axis * angle);
        self.times(&rotation);
        self.acceleration += axis * acceleration - axis.cross(&self.rate) * rate;
        self.rate += axis * rate;
    }
}

/// Rotation vectors for each of [`phases`] of an angle, rad.
type Harmonics = [Vector3<f64>; PHASES];

/// The joints that move during one stretch of a path, with the fixed rotations around them.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Rotation before the first joint; `C_b_n` if nothing moves.
    base: Matrix3<f64>,
    joints: Vec<Joint>,
}

/// A moving joint with the fixed rotation after it.
#[derive(Debug, Clone, PartialEq)]
struct Joint {
    axis: Vector3<f64>,
    from: f64,
    profile: Profile,
    harmonics: Harmonics,
    behind: Matrix3<f64>,
}

impl Chain {
    /// A body at rest.
    pub fn still(attitude: Matrix3<f64>) -> Self {
        Self {
            base: attitude,
            joints: Vec::new(),
        }
    }

    /// A body that turns about one of its axes.
    pub fn about_body_axis(attitude: Matrix3<f64>, axis: Vector3<f64>, profile: Profile) -> Self {
        let mut chain = Self::still(attitude);
        chain.turn(axis, 0.0, profile, Default::default());
        chain
    }

    /// A table whose axes turn from these angles along these profiles; without profiles, the table is at rest.
    pub fn of_table(
        table: &Table,
        imperfection: &Imperfection,
        angles: &[f64],
        profiles: &[Profile],
    ) -> Self {
        let mut chain = Self::still(exp(imperfection.base));
        let axes = table.axes.iter().zip(&imperfection.axes).zip(angles);
        for (i, ((axis, errors), &from)) in axes.enumerate() {
            chain.fix(&exp(errors.tilt));
            match profiles.get(i).filter(|profile| profile.duration() > 0.0) {
                Some(&profile) => chain.turn(axis.direction, from, profile, errors.harmonics),
                None => {
                    for (harmonic, value) in errors.harmonics.iter().zip(phases(from)) {
                        chain.fix(&exp(harmonic * value));
                    }
                    chain.fix(&exp(axis.direction * from));
                }
            }
        }
        chain.fix(&table.mount);
        chain
    }

    fn turn(&mut self, axis: Vector3<f64>, from: f64, profile: Profile, harmonics: Harmonics) {
        self.joints.push(Joint {
            axis,
            from,
            profile,
            harmonics,
            behind: Matrix3::identity(),
        });
    }

    fn fix(&mut self, rotation: &Matrix3<f64>) {
        match self.joints.last_mut() {
            Some(joint) => joint.behind *= rotation,
            None => self.base *= rotation,
        }
    }

    pub fn stands(&self) -> bool {
        self.joints.is_empty()
    }

    /// Duration of the move of the slowest joint, s.
    pub fn duration(&self) -> f64 {
        let durations = self.joints.iter().map(|joint| joint.profile.duration());
        durations.fold(0.0, f64::max)
    }

    /// Times in s since the start at which derivatives of the rate jump.
    pub fn breaks(&self) -> impl Iterator<Item = f64> {
        let start = (!self.stands()).then_some(0.0);
        let of_joints = self.joints.iter().flat_map(|joint| joint.profile.breaks());
        start.into_iter().chain(of_joints)
    }

    /// The state at this time after the start, s.
    pub fn at(&self, time: f64) -> Kinematics {
        let mut state = Kinematics {
            attitude: self.base,
            rate: Vector3::zeros(),
            acceleration: Vector3::zeros(),
        };
        for joint in &self.joints {
            let turned = joint.profile.at(time);
            let angle = joint.from + turned.angle;
            if joint.harmonics != Harmonics::default() {
                joint.stray(&mut state, angle, &turned);
            }
            state.turn(&joint.axis, angle, turned.rate, turned.acceleration);
            state.times(&joint.behind);
        }
        state
    }
}

impl Joint {
    /// Continues the chain through the harmonics of the joint.
    fn stray(&self, state: &mut Kinematics, angle: f64, turned: &Turned) {
        // Cosine and sine of the angle, then of twice the angle, with their derivatives.
        let [c, s, c2, s2] = phases(angle);
        let slopes = [-s, c, -2.0 * s2, 2.0 * c2];
        let curvatures = [-c, -s, -4.0 * c2, -4.0 * s2];
        for (k, value) in [c, s, c2, s2].into_iter().enumerate() {
            if self.harmonics[k] != Vector3::zeros() {
                let rate = slopes[k] * turned.rate;
                let along_path = curvatures[k] * turned.rate * turned.rate;
                let acceleration = slopes[k] * turned.acceleration + along_path;
                state.turn(&self.harmonics[k], value, rate, acceleration);
            }
        }
    }
}

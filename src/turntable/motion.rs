//! Where the table is at any time.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::{AxesStep, BodyStep, Imperfection, Moves, Path, Profile, Table, TableError};
use crate::attitude::exp;
use crate::units::DEGREE;

/// Attitude and its derivatives at one moment.
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
    fn still(attitude: Matrix3<f64>) -> Self {
        Self {
            attitude,
            rate: Vector3::zeros(),
            acceleration: Vector3::zeros(),
        }
    }

    fn times(&mut self, constant: &Matrix3<f64>) {
        self.attitude *= constant;
        self.rate = constant.tr_mul(&self.rate);
        self.acceleration = constant.tr_mul(&self.acceleration);
    }

    /// Goes on through a joint that turns about `axis`.
    fn turn(&mut self, axis: &Vector3<f64>, angle: f64, rate: f64, acceleration: f64) {
        let rotation = exp(axis * angle);
        self.times(&rotation);
        self.acceleration += axis * acceleration - axis.cross(&self.rate) * rate;
        self.rate += axis * rate;
    }
}

/// A moving joint of the chain from the Earth to the body, and what is fixed behind it.
#[derive(Debug, Clone, PartialEq)]
struct Joint {
    axis: Vector3<f64>,
    from: f64,
    profile: Profile,
    wobble: Vector3<f64>,
    behind: Matrix3<f64>,
}

/// A stretch of the path in which the same joints move, or none.
#[derive(Debug, Clone, PartialEq)]
struct Stretch {
    start: f64,
    end: f64,
    position: usize,
    /// `C_b_n` if nothing moves, else what lies before the first joint.
    base: Matrix3<f64>,
    joints: Vec<Joint>,
}

/// A path as driven by one table: attitude, rate and acceleration in closed form at any time from
/// zero to its duration.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    stretches: Vec<Stretch>,
    breaks: Vec<f64>,
}

impl Motion {
    /// Drives a table with these imperfections along a path.
    ///
    /// A rotation about body axes is held against the lowest limits of all axes.
    ///
    /// # Errors
    /// If the path does not fit the table's axes or is beyond its limits.
    pub fn new(
        table: &Table,
        path: &Path,
        imperfection: &Imperfection,
    ) -> Result<Self, TableError> {
        let mut motion = Self {
            stretches: Vec::new(),
            breaks: Vec::new(),
        };
        match &path.moves {
            Moves::Axes { start, steps } => {
                axis_count(table, start, || "start".into())?;
                let mut angles = start.clone();
                motion.stand(path.first_dwell, chain(table, imperfection, &angles, &[]));
                for (i, step) in steps.iter().enumerate() {
                    let profiles = axes_profiles(table, step, i + 1)?;
                    motion.go(chain(table, imperfection, &angles, &profiles));
                    for (angle, by) in angles.iter_mut().zip(&step.angles) {
                        *angle += by;
                    }
                    motion.stand(step.dwell, chain(table, imperfection, &angles, &[]));
                }
            }
            Moves::Body { start, steps } => {
                let errs = |v: &Vec<Vector3<f64>>| v.iter().any(|v| v.norm() > 0.0);
                if errs(&imperfection.tilt) || errs(&imperfection.wobble) {
                    return Err(TableError::AxesUnknown);
                }
                let base = exp(imperfection.base);
                let mut attitude = *start;
                motion.stand(path.first_dwell, (base * attitude, Vec::new()));
                for (i, step) in steps.iter().enumerate() {
                    let vector = step.rotation.vector(&attitude);
                    let profile = body_profile(table, step, vector.norm(), i + 1)?;
                    let joint = Joint {
                        axis: vector.try_normalize(0.0).unwrap_or_default(),
                        from: 0.0,
                        profile,
                        wobble: Vector3::zeros(),
                        behind: Matrix3::identity(),
                    };
                    motion.go((base * attitude, vec![joint]));
                    attitude *= exp(vector);
                    motion.stand(step.dwell, (base * attitude, Vec::new()));
                }
            }
        }
        Ok(motion)
    }

    /// How long the path takes, s.
    pub fn duration(&self) -> f64 {
        self.stretches.last().map_or(0.0, |last| last.end)
    }

    /// The times in s, in order, at which derivatives of the rate jump. An integral across one of
    /// them is best made in two parts.
    pub fn breaks(&self) -> &[f64] {
        &self.breaks
    }

    /// Whether the table stands at a time in s.
    pub fn stands(&self, time: f64) -> bool {
        self.stretch(time).joints.is_empty()
    }

    /// How many moves have begun at a time in s: the number of the position in force.
    pub fn position(&self, time: f64) -> usize {
        self.stretch(time).position
    }

    /// When the table stands, `(start, end)` in s, in order.
    pub fn dwells(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.stretches
            .iter()
            .filter(|stretch| stretch.joints.is_empty())
            .map(|stretch| (stretch.start, stretch.end))
    }

    /// Attitude, rate and acceleration at a time in s.
    pub fn at(&self, time: f64) -> Kinematics {
        self.stretch(time).at(time)
    }

    fn stretch(&self, time: f64) -> &Stretch {
        let next = self.stretches.partition_point(|s| s.start <= time);
        &self.stretches[next.saturating_sub(1)]
    }

    fn stand(&mut self, duration: f64, (base, joints): (Matrix3<f64>, Vec<Joint>)) {
        // The first stretch is kept even if it is empty: there is always an attitude.
        if duration > 0.0 || self.stretches.is_empty() {
            self.push(duration, base, joints, self.position_so_far());
        }
    }

    fn go(&mut self, (base, joints): (Matrix3<f64>, Vec<Joint>)) {
        let start = self.duration();
        let duration = joints
            .iter()
            .map(|joint| joint.profile.duration())
            .fold(0.0, f64::max);
        if duration > 0.0 {
            let mut breaks: Vec<f64> = joints
                .iter()
                .flat_map(|joint| joint.profile.breaks())
                .map(|after| start + after)
                .chain([start])
                .collect();
            breaks.sort_by(f64::total_cmp);
            self.breaks.extend(breaks);
            self.push(duration, base, joints, self.position_so_far() + 1);
        }
    }

    fn push(&mut self, duration: f64, base: Matrix3<f64>, joints: Vec<Joint>, position: usize) {
        let start = self.duration();
        self.stretches.push(Stretch {
            start,
            end: start + duration,
            position,
            base,
            joints,
        });
    }

    fn position_so_far(&self) -> usize {
        self.stretches.last().map_or(0, |last| last.position)
    }
}

impl Stretch {
    fn at(&self, time: f64) -> Kinematics {
        let mut state = Kinematics::still(self.base);
        for joint in &self.joints {
            let turned = joint.profile.at(time - self.start);
            let angle = joint.from + turned.angle;
            if joint.wobble != Vector3::zeros() {
                let (s, c) = angle.sin_cos();
                state.turn(
                    &joint.wobble,
                    s,
                    c * turned.rate,
                    c * turned.acceleration - s * turned.rate * turned.rate,
                );
            }
            state.turn(&joint.axis, angle, turned.rate, turned.acceleration);
            state.times(&joint.behind);
        }
        state
    }
}

/// The chain from the Earth to the body: everything fixed before the first moving joint, and the
/// moving joints. Without profiles nothing moves.
fn chain(
    table: &Table,
    imperfection: &Imperfection,
    angles: &[f64],
    profiles: &[Profile],
) -> (Matrix3<f64>, Vec<Joint>) {
    let mut base = exp(imperfection.base);
    let mut joints: Vec<Joint> = Vec::new();
    let parts = table
        .axes
        .iter()
        .zip(angles)
        .zip(imperfection.tilt.iter().zip(&imperfection.wobble));
    for (i, ((axis, &from), (tilt, &wobble))) in parts.enumerate() {
        let moving = profiles.get(i).filter(|profile| profile.duration() > 0.0);
        let fixed = match moving {
            Some(_) => exp(*tilt),
            None => exp(*tilt) * exp(wobble * from.sin()) * exp(axis.direction * from),
        };
        match joints.last_mut() {
            Some(joint) => joint.behind *= fixed,
            None => base *= fixed,
        }
        if let Some(&profile) = moving {
            joints.push(Joint {
                axis: axis.direction,
                from,
                profile,
                wobble,
                behind: Matrix3::identity(),
            });
        }
    }
    match joints.last_mut() {
        Some(joint) => joint.behind *= table.mount,
        None => base *= table.mount,
    }
    (base, joints)
}

fn axis_count(
    table: &Table,
    angles: &[f64],
    place: impl FnOnce() -> String,
) -> Result<(), TableError> {
    if angles.len() == table.axes.len() {
        Ok(())
    } else {
        Err(TableError::AxisCount {
            place: place(),
            found: angles.len(),
            expected: table.axes.len(),
        })
    }
}

fn axes_profiles(
    table: &Table,
    step: &AxesStep,
    number: usize,
) -> Result<Vec<Profile>, TableError> {
    axis_count(table, &step.angles, || format!("step {number}"))?;
    table
        .axes
        .iter()
        .zip(&step.angles)
        .map(|(axis, &angle)| {
            let profile = Profile::limited(angle, step.rate, step.acceleration);
            if angle != 0.0 {
                within(axis, number, profile.peak_rate(), step.acceleration)?;
            }
            Ok(profile)
        })
        .collect()
}

fn body_profile(
    table: &Table,
    step: &BodyStep,
    angle: f64,
    number: usize,
) -> Result<Profile, TableError> {
    let profile = Profile::timed(angle, step.duration, step.acceleration).ok_or_else(|| {
        TableError::Hurried {
            step: number,
            angle_deg: angle / DEGREE,
            duration: step.duration,
            needed: (2.0 * PI * angle / step.acceleration).sqrt(),
        }
    })?;
    for axis in &table.axes {
        within(axis, number, profile.peak_rate(), step.acceleration)?;
    }
    Ok(profile)
}

fn within(axis: &super::Axis, step: usize, rate: f64, acceleration: f64) -> Result<(), TableError> {
    let above = |what, unit, found: f64, limit: f64| {
        // A limit given in degrees must admit itself.
        if found <= limit * (1.0 + 1e-12) {
            Ok(())
        } else {
            Err(TableError::Limit {
                step,
                what,
                found: found / DEGREE,
                limit: limit / DEGREE,
                unit,
                axis: axis.name.clone(),
            })
        }
    };
    above("rate", "°/s", rate, axis.max_rate)?;
    above("acceleration", "°/s²", acceleration, axis.max_acceleration)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::attitude::log;
    use crate::turntable::{Axis, TableErrors};

    fn table(errors: TableErrors) -> Table {
        let axis = |name: &str, direction| Axis {
            name: name.into(),
            direction,
            max_rate: 1.0,
            max_acceleration: 1.0,
        };
        Table {
            axes: vec![
                axis("outer", Vector3::z()),
                axis("middle", Vector3::x()),
                axis("inner", Vector3::y()),
            ],
            mount: exp(Vector3::new(0.1, -0.2, 0.3)),
            errors,
        }
    }

    fn crooked() -> (Table, Imperfection) {
        let table = table(TableErrors {
            level: 0.01,
            north: 0.02,
            nonorthogonality: 0.03,
            wobble: 0.04,
            ..TableErrors::default()
        });
        let mut number = 0.3;
        let imperfection = Imperfection::draw(&table, || {
            number = (number * 7.3_f64).sin();
            number
        });
        (table, imperfection)
    }

    fn step(angles: [f64; 3]) -> AxesStep {
        AxesStep {
            angles: angles.to_vec(),
            rate: 0.5,
            acceleration: 0.4,
            dwell: 5.0,
        }
    }

    fn path(steps: &[[f64; 3]]) -> Path {
        Path {
            first_dwell: 2.0,
            moves: Moves::Axes {
                start: vec![0.2, 0.1, -0.3],
                steps: steps.iter().copied().map(step).collect(),
            },
        }
    }

    #[test]
    fn rate_and_acceleration_are_the_derivatives_of_the_attitude_on_a_crooked_table() {
        let (table, imperfection) = crooked();
        let path = path(&[[1.0, -0.5, 0.7], [0.0, 2.0, 0.0], [-1.0, 0.0, 0.0]]);
        let motion = Motion::new(&table, &path, &imperfection).unwrap();
        let step = 1e-5;
        for k in 0..500 {
            let time = motion.duration() * (f64::from(k) + 0.3) / 500.0;
            let (before, at, after) = (
                motion.at(time - step),
                motion.at(time),
                motion.at(time + step),
            );
            let rate = log(&(before.attitude.tr_mul(&after.attitude))) / (2.0 * step);
            assert!((rate - at.rate).norm() < 1e-9);
            let acceleration = (after.rate - before.rate) / (2.0 * step);
            assert!((acceleration - at.acceleration).norm() < 2e-5);
            assert_eq!(motion.stands(time), at.rate == Vector3::zeros());
        }
    }

    #[test]
    fn attitude_is_continuous_from_dwell_to_move_and_a_full_turn_closes() {
        let (table, imperfection) = crooked();
        let path = path(&[[2.0 * PI, 0.0, 0.0], [0.0, 0.0, 2.0 * PI], [0.3, 0.0, 0.1]]);
        let motion = Motion::new(&table, &path, &imperfection).unwrap();
        for &time in motion.breaks() {
            let jump = motion.at(time + 1e-9).attitude - motion.at(time - 1e-9).attitude;
            assert!(jump.amax() < 2e-9);
        }
        let dwells: Vec<_> = motion.dwells().map(|(start, _)| motion.at(start)).collect();
        assert_eq!(dwells.len(), 4);
        for turned in &dwells[1..3] {
            assert_relative_eq!(turned.attitude, dwells[0].attitude, epsilon = 1e-14);
        }
    }

    #[test]
    fn a_position_begins_when_the_table_starts_to_move() {
        let (table, imperfection) = crooked();
        let motion = Motion::new(&table, &path(&[[1.0, 0.0, 0.0]; 2]), &imperfection).unwrap();
        assert_eq!(motion.position(1.999), 0);
        assert_eq!(motion.position(2.001), 1);
        assert!(!motion.stands(2.001));
        assert_eq!(motion.position(motion.duration()), 2);
    }

    #[test]
    fn an_outer_axis_at_a_quarter_turn_swings_the_front_axis_from_north_to_west() {
        let mut table = table(TableErrors::default());
        table.mount = Matrix3::identity();
        let path = Path {
            first_dwell: 1.0,
            moves: Moves::Axes {
                start: vec![PI / 2.0, 0.0, 0.0],
                steps: Vec::new(),
            },
        };
        let motion = Motion::new(&table, &path, &Imperfection::none(&table)).unwrap();
        let front = motion.at(0.5).attitude * Vector3::y();
        assert_relative_eq!(front, -Vector3::x(), epsilon = 1e-15);
    }

    #[test]
    fn pointing_brings_a_body_axis_along_its_direction_even_when_it_points_away() {
        let table = table(TableErrors::default());
        let along = Vector3::new(0.0, 0.8, 0.6);
        let point = |axis: Vector3<f64>| BodyStep {
            rotation: super::super::Rotation::Point { axis, along },
            duration: 20.0,
            acceleration: 0.5,
            dwell: 1.0,
        };
        let axes = [Vector3::x(), -Vector3::x(), Vector3::z(), -Vector3::z()];
        let path = Path {
            first_dwell: 0.0,
            moves: Moves::Body {
                start: Matrix3::identity(),
                steps: axes.map(point).to_vec(),
            },
        };
        let motion = Motion::new(&table, &path, &Imperfection::none(&table)).unwrap();
        for (axis, (start, _)) in axes.iter().zip(motion.dwells().skip(1)) {
            assert_relative_eq!(motion.at(start).attitude * axis, along, epsilon = 1e-14);
        }
    }

    #[test]
    fn what_is_beyond_the_table_is_refused_by_name() {
        let (table, imperfection) = crooked();
        let refused = |path: &Path| {
            Motion::new(&table, path, &imperfection)
                .unwrap_err()
                .to_string()
        };
        let fast = |rate, acceleration| Path {
            first_dwell: 0.0,
            moves: Moves::Axes {
                start: vec![0.0; 3],
                steps: vec![AxesStep {
                    rate,
                    acceleration,
                    ..step([0.0, 9.0, 0.0])
                }],
            },
        };
        assert!(refused(&fast(1.1, 1.0)).contains("the middle axis"));
        assert!(refused(&fast(1.0, 1.1)).contains("acceleration"));
        let two = Moves::Axes {
            start: vec![0.0; 2],
            steps: Vec::new(),
        };
        let two = Path {
            first_dwell: 0.0,
            moves: two,
        };
        assert!(refused(&two).contains("2 angles for a table of 3 axes"));
        let body = Path {
            first_dwell: 0.0,
            moves: Moves::Body {
                start: Matrix3::identity(),
                steps: Vec::new(),
            },
        };
        assert!(refused(&body).contains("body axes"));
    }
}

//! Start of a magnetometer: linear in its inverse matrix and in the field, with the attitudes of a first navigation.

use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};

use super::homogeneous::homogeneous;
use crate::attitude::exp;
use crate::calibration::linearisation::UNKNOWN_HEADING;
use crate::calibration::several::Start;
use crate::calibration::{CalibrationError, Problem, Script};
use crate::magnetic::MagneticTriad;
use crate::recording::MagneticMean;

/// A latitude, rad, beyond which the sign of the inclination is that of the latitude.
const HEMISPHERE: f64 = 0.25;

/// The start with the magnetometer, if the dwells determine it. A heading that Earth rate does not show is then that of
/// the magnetometer.
///
/// # Errors
/// [`CalibrationError::Singular`] if a triad cannot be inverted at the start.
pub fn with_magnetometer(problem: &Problem, start: Start) -> Result<Start, CalibrationError> {
    if !problem.model.magnetic.is_on() {
        return Ok(start);
    }
    let script = Script::new(problem, &start.priors, &start.at)?;
    Ok(match Fit::new(problem, &script) {
        Some(fit) => fit.applied(problem, start),
        None => start,
    })
}

/// Mean output in a part of a dwell, with the computed attitude.
struct Seen<'a> {
    stretch: usize,
    attitude: Matrix3<f64>,
    mean: &'a MagneticMean,
}

/// `C (G n + h) = b`, with the output n = (N − middle)/size.
struct Fit {
    inverse: Matrix3<f64>,
    offset: Vector3<f64>,
    /// The field in each stretch, because without a table each has its own heading.
    fields: Vec<Vector3<f64>>,
    middle: Vector3<f64>,
    size: f64,
}

impl Fit {
    fn new(problem: &Problem, script: &Script) -> Option<Self> {
        let seen: Vec<Seen> = (0..problem.stretches().len())
            .flat_map(|stretch| script.parts(stretch).map(move |rest| (stretch, rest)))
            .filter_map(|(stretch, rest)| {
                Some(Seen {
                    stretch,
                    attitude: rest.begin.attitude,
                    mean: rest.magnetic.as_ref()?,
                })
            })
            .collect();
        let last = seen.last()?.stretch;
        let (middle, size) = MagneticMean::scatter(seen.iter().map(|of| *of.mean))?;
        let rows = |of: &Seen| of.rows((&middle, size), last + 1);
        let rows: Vec<DMatrix<f64>> = seen.iter().map(rows).collect();
        let solution = homogeneous(&rows)?;
        let field = |stretch: usize| solution.fixed_rows::<3>(12 + 3 * stretch).into_owned();
        Some(Self {
            inverse: Matrix3::from_fn(|i, j| solution[3 * i + j]),
            offset: solution.fixed_rows::<3>(9).into(),
            fields: (0..=last).map(field).collect(),
            middle,
            size,
        })
    }

    /// The start with this magnetometer.
    fn applied(mut self, problem: &Problem, mut start: Start) -> Start {
        let prior = &problem.model.magnetic;
        self.choose_sign(problem);
        let count = self.fields.len() as f64;
        let magnitude = self.fields.iter().map(Vector3::norm).sum::<f64>() / count;
        let mut sum = Vector3::zeros();
        for (stretch, field) in self.fields.iter().enumerate() {
            let mut turn = Matrix3::identity();
            if start.priors[stretch].heading_is_unknown() {
                let azimuth = field.x.atan2(field.y);
                turn = exp(Vector3::z() * (azimuth - prior.angles().x));
                start.turn(stretch, &turn);
                if problem.stretches()[stretch].run.site.is_known {
                    start.priors[stretch].earth_rate_sigma = Vector3::zeros();
                }
            }
            sum += turn * field;
        }
        let Some(matrix) = self.inverse.try_inverse() else {
            return start;
        };
        let (azimuth, level) = (sum.x.atan2(sum.y), sum.x.hypot(sum.y));
        let triad = MagneticTriad {
            matrix: matrix * (self.size * magnitude),
            bias: self.middle - matrix * self.offset * self.size,
            angles: Vector2::new(azimuth, (-sum.z).atan2(level)),
        };
        start.at.magnetic = Some(triad.vector());
        start
    }

    /// A field and a matrix of opposite signs explain the same output. With a heading, the field points North;
    /// otherwise the inclination has its sign by the hemisphere, or else the axes are right-handed.
    fn choose_sign(&mut self, problem: &Problem) {
        let sum: Vector3<f64> = self.fields.iter().sum();
        let site = &problem.run().site;
        let table = problem.model.aiding == crate::run::Aiding::Table;
        let prior = &problem.model.magnetic;
        let inclination = if prior.knows_magnitude() {
            prior.angles().y
        } else if site.is_known {
            site.latitude
        } else {
            0.0
        };
        let sign = if table {
            sum.y
        } else if inclination.abs() > HEMISPHERE {
            -sum.z * inclination
        } else {
            self.inverse.determinant()
        };
        if sign < 0.0 {
            self.inverse = -self.inverse;
            self.offset = -self.offset;
            self.fields.iter_mut().for_each(|field| *field = -*field);
        }
    }
}

impl Seen<'_> {
    /// Coefficients of G row by row, h and the field of each stretch.
    fn rows(&self, (middle, size): (&Vector3<f64>, f64), stretches: usize) -> DMatrix<f64> {
        let output = (self.mean.output - middle) / size;
        let mut rows = DMatrix::zeros(3, 12 + 3 * stretches);
        for row in 0..3 {
            for axis in 0..3 {
                let along = self.attitude[(row, axis)];
                for k in 0..3 {
                    rows[(row, 3 * axis + k)] = along * output[k];
                }
                rows[(row, 9 + axis)] = along;
            }
            rows[(row, 12 + 3 * self.stretch + row)] = -1.0;
        }
        rows
    }
}

impl Start {
    /// Turns the attitude of a stretch about Up; its heading is then unknown, but may be observed.
    fn turn(&mut self, stretch: usize, turn: &Matrix3<f64>) {
        let attitude = &mut self.at.initial_attitudes[stretch];
        *attitude = turn * *attitude;
        let prior = &mut self.priors[stretch];
        prior.mean = turn * prior.mean;
        prior.sigma.z = UNKNOWN_HEADING;
    }
}

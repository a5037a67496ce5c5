//! Estimate from gravity at rest alone, for an instrument that has no gyros or is not turned between any two dwells.
//!
//! The accelerometers follow from the magnitude of gravity in the dwells and from labels, if there are any; the gyro
//! biases follow from the rates at rest. All other parameters keep their prior.

use nalgebra::{DMatrix, Matrix3, SMatrix, Vector2, Vector3};

use super::coarse::{calibrated, dwells};
use super::equations::{Common, Equations, Rows, gauss_newton, of};
use super::gravity::{AtRest, Force, add_magnitude, events, of_noise};
use super::labels::{Section, Used};
use crate::attitude::skew;
use crate::calibration::checks::prior_distance::widened;
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::linearisation::singular;
use crate::calibration::magnetometer::{self, Alone, Up};
use crate::calibration::model::usual_variation;
use crate::calibration::problem::Stretch;
use crate::calibration::{
    CalibrationError, Estimate, Finding, MagneticEstimate, Model, NoisePolicy, PARAMETERS,
    ParameterMatrix, ParameterVector, Problem, checks, from_vector, parameter,
    sensor_and_parameter, to_vector,
};
use crate::imu::{
    Noise, PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, Sensor, Triad, TriadVector,
};
use crate::recording::{LabelledMotion, Segment};
use crate::run::{Aiding, Dwell, Run, SET_BY_HAND, motion};

/// A smaller step (1 ppm, 0.2″, 1e-6 m/s²) ends the iteration.
const SMALL: f64 = 1e-6;
/// The rotation of the faces against the accelerometers, common to all labels.
const FACES: Common = Common::Unit(0);

impl Problem<'_> {
    /// Whether the runs contain no information except gravity at rest.
    pub fn shows_gravity_alone(&self) -> bool {
        let turns = |of: &Segment| matches!(of.motion, Some(LabelledMotion::Turns { .. }));
        let labelled = |run: &Run| run.recording.segments.iter().any(turns);
        let stays = |stretch: &Stretch| {
            let up = |dwell: &Dwell| dwell.force(stretch.run);
            let mut pairs = stretch.dwells.windows(2);
            pairs.all(|pair| up(&pair[0]).angle(&up(&pair[1])) < SET_BY_HAND)
        };
        let never_turns = self.stretches().len() > 1
            && self.stretches().iter().all(stays)
            && !self.runs().any(labelled);
        self.model.aiding == Aiding::Velocity
            && self.model.thermal.is_none()
            && (self.lacks(Sensor::Gyro) || never_turns)
    }

    /// Whether a run lacks a triad.
    pub fn lacks(&self, sensor: Sensor) -> bool {
        self.runs().any(|run| !run.recording.imu.has(sensor))
    }
}

/// Dwells of a problem, with the sections of each stretch whose labels agree with gravity.
struct Positions<'a> {
    problem: &'a Problem<'a>,
    rests: Vec<Vec<AtRest>>,
    sections: Vec<Vec<Section>>,
}

/// An estimate from gravity at rest.
pub struct Standing {
    pub estimate: Estimate,
    pub findings: Vec<Finding>,
    /// The magnetometer, if there is one and the dwells determine it.
    pub magnetic: Option<MagneticEstimate>,
    /// Number of dwells, and their total time, s.
    pub count: usize,
    pub time: f64,
}

/// Estimates the accelerometers and, if there are gyros, their biases. A prior that the dwells contradict is widened,
/// so that it does not bias parameters that the dwells hardly show.
pub fn standing(problem: &Problem) -> Result<Standing, CalibrationError> {
    let mut findings = Vec::new();
    let labels = problem.stretches().iter().map(|stretch| {
        let used = Used::of(stretch.run, &motion::rests(stretch.run));
        let found = checks::labels::contradicted(&used.contradicted);
        findings.extend(found.filter(|found| !findings.contains(found)));
        used.sections
    });
    let positions = Positions {
        sections: labels.collect(),
        rests: with_bias_variation(problem, dwells(problem)?),
        problem,
    };
    let (first, residuals) = positions.accelerometers(&problem.model)?;
    let (mut estimate, residuals) = match widened(&problem.model, &first) {
        Some(model) => positions.accelerometers(&model)?,
        None => (first, residuals),
    };
    findings.extend(residuals.finding("the accelerometers"));
    if !problem.lacks(Sensor::Gyro) {
        positions.gyro_biases(&mut estimate)?;
    }
    let rests = || positions.rests.iter().flatten();
    let magnetic = positions.magnetometer(&estimate)?;
    findings.extend(checks::magnetic::alone(problem, magnetic.as_ref()));
    Ok(Standing {
        magnetic: magnetic.map(|alone| alone.estimate),
        estimate,
        findings,
        count: rests().count(),
        time: rests().map(AtRest::duration).sum(),
    })
}

impl Positions<'_> {
    /// The accelerometers; the gyros keep their prior.
    fn accelerometers(&self, model: &Model) -> Result<(Estimate, Residuals), CalibrationError> {
        let prior = from_vector(model.form, &model.prior_mean);
        let smallest = ParameterVector::repeat(SMALL);
        let step = |triads: &PerSensor<Triad>| self.equations(model, triads)?.step();
        let triads = gauss_newton(prior, &smallest, step)?;
        let equations = self.equations(model, &triads)?;
        let solution = equations.solved().ok_or_else(|| singular(&triads))?;
        let mut estimate = Estimate {
            triads: from_vector(model.form, &(to_vector(&triads) + solution.step)),
            covariance: solution.covariance,
        };
        estimate.covariance += self.second_order(equations, &estimate);
        let gyro = parameter(Sensor::Gyro, 0);
        for k in gyro..gyro + PER_TRIAD {
            estimate.covariance[(k, k)] = model.prior_sigma[k].powi(2);
        }
        Ok((estimate, solution.residuals))
    }

    fn equations(
        &self,
        model: &Model,
        triads: &PerSensor<Triad>,
    ) -> Result<Equations, CalibrationError> {
        let mut equations = Equations::of_triads(model, triads, &[Sensor::Accel]);
        add_magnitude(&mut equations, self.problem, &self.rests, triads)?;
        for (stretch, rest) in self.each() {
            let middle = rest.samples.start.midpoint(rest.samples.end);
            let mut sections = self.sections[stretch].iter();
            let section = sections.find(|section| section.samples.contains(&middle));
            if let Some(LabelledMotion::Stands { up }) = section.map(|section| section.motion) {
                equations.add(&self.face(stretch, rest, triads, up)?);
            }
        }
        equations.events = events(self.problem, &self.rests);
        equations.correlated = true;
        Ok(equations)
    }

    /// The magnetometer from its angle to gravity in each dwell.
    fn magnetometer(&self, estimate: &Estimate) -> Result<Option<Alone>, CalibrationError> {
        let first = parameter(Sensor::Accel, 0);
        let own = estimate
            .covariance
            .fixed_view::<PER_TRIAD, PER_TRIAD>(first, first);
        let eigen = own.into_owned().symmetric_eigen();
        let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
        let common = eigen.eigenvectors * SMatrix::from_diagonal(&roots);
        let mut all = Vec::new();
        for (stretch, rest) in self.each() {
            let stretch = &self.problem.stretches()[stretch];
            let Some(mean) = stretch.magnetic(&rest.samples) else {
                continue;
            };
            let Force { size, up, error } = Force::of(&estimate.triads, rest)?;
            let level = (Matrix3::identity() - up * up.transpose()) / size;
            let by_common = level * error * common;
            all.push(magnetometer::AtRest {
                mean,
                up: Some(Up {
                    direction: up,
                    tilt: rest.mean.accel.variance.sqrt() / size,
                    by_common: DMatrix::from_column_slice(3, PER_TRIAD, by_common.as_slice()),
                }),
            });
        }
        let found = Alone::new(&all, &self.problem.model.magnetic);
        Ok(found.filter(|of| of.estimate.is_shown()))
    }

    /// Every dwell, with the number of its stretch.
    fn each(&self) -> impl Iterator<Item = (usize, &AtRest)> {
        let stretches = self.rests.iter().enumerate();
        stretches.flat_map(|(stretch, rests)| rests.iter().map(move |rest| (stretch, rest)))
    }

    /// The direction of gravity across a face that is set by hand.
    fn face(
        &self,
        stretch: usize,
        rest: &AtRest,
        triads: &PerSensor<Triad>,
        label: Vector3<f64>,
    ) -> Result<Rows<2>, CalibrationError> {
        let run = self.problem.stretches()[stretch].run;
        let Force { size, up, error } = Force::of(triads, rest)?;
        let axis = label.iamax();
        let across = SMatrix::<f64, 2, 3>::from_fn(|row, column| {
            f64::from(u8::from(column == (axis + 1 + row) % 3))
        });
        let turned = across * (Matrix3::identity() - up * up.transpose()) / size;
        let partials = turned * error;
        let set = run.segment_sigma.powi(2);
        let faces = run.instrument.prior.accel.installation_sigma.max();
        Ok(Rows {
            event: rest.event(),
            weighted: Vector2::repeat(set + faces.powi(2)),
            common: vec![
                of_noise(Sensor::Accel, rest.event(), &partials),
                (FACES, across * skew(label) * faces),
            ],
            ..Rows::new(of(Sensor::Accel, &partials), across * up, set)
        })
    }

    /// Mean squares of the second order of each magnitude in errors of the estimate, which its least squares passes on
    /// (Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, §10.3.2).
    fn second_order(&self, mut equations: Equations, estimate: &Estimate) -> ParameterMatrix {
        let first = parameter(Sensor::Accel, 0);
        let of_triad = estimate
            .covariance
            .fixed_view::<PER_TRIAD, PER_TRIAD>(first, first);
        if !of_triad.iter().all(|of| of.is_finite()) {
            return ParameterMatrix::zeros();
        }
        let eigen = of_triad.into_owned().symmetric_eigen();
        let sigmas: Vec<TriadVector> = (0..PER_TRIAD)
            .map(|k| eigen.eigenvectors.column(k) * eigen.eigenvalues[k].max(0.0).sqrt())
            .collect();
        let (form, at) = (estimate.form(), estimate.triads.accel.to_vector());
        let magnitudes = self.rests.iter().flatten().map(|rest| {
            let size = |by: TriadVector| {
                let triad = Triad::from_vector(form, &(at + by));
                let force = triad.correction()? * (rest.mean.accel.output - triad.bias);
                Some(force.norm())
            };
            let curved = |a: &TriadVector, b: &TriadVector| {
                let sums = size(a + b)? + size(-a - b)?;
                Some((sums - size(a - b)? - size(b - a)?) / 4.0)
            };
            let pairs = sigmas
                .iter()
                .flat_map(|a| sigmas.iter().map(move |b| (a, b)));
            let matrix: Vec<f64> = pairs.map(|(a, b)| curved(a, b).unwrap_or(0.0)).collect();
            let trace: f64 = matrix.iter().step_by(PER_TRIAD + 1).sum();
            let mut parts: Vec<f64> = matrix.iter().map(|of| of / 2f64.sqrt()).collect();
            parts.extend([trace / 2.0, 0.0, 0.0]);
            parts
        });
        let magnitudes: Vec<Vec<f64>> = magnitudes.collect();
        for (number, row) in equations.rows.iter_mut().enumerate() {
            row.own.fill(0.0);
            let parts = magnitudes.get(number).map_or(&[][..], Vec::as_slice);
            let units = parts
                .chunks_exact(3)
                .map(SMatrix::<f64, 1, 3>::from_row_slice);
            row.common = units
                .enumerate()
                .map(|(k, by)| (Common::Unit(k), by))
                .collect();
        }
        equations.by_errors().unwrap_or_default()
    }

    /// The gyro biases from the rates at rest, with scale factors and misalignments as before. Their scatter over the
    /// positions widens σ: the biases of many gyros follow gravity.
    fn gyro_biases(&self, estimate: &mut Estimate) -> Result<(), CalibrationError> {
        let mut model = self.problem.model.clone();
        model.prior_mean = estimate.vector();
        let is_gyro_bias = |k: usize| {
            let (sensor, of_triad) = sensor_and_parameter(k);
            sensor == Sensor::Gyro && Triad::kind(of_triad) == ParameterKind::Bias
        };
        for k in (0..PARAMETERS).filter(|&k| !is_gyro_bias(k)) {
            model.prior_sigma[k] = 0.0;
        }
        let turned = calibrated(&self.problem.with_model(model), &self.rests)?;
        let (triads, mut equations) = (turned.at.triads, turned.equations);
        let unknown = equations.unknown.clone();
        equations
            .rows
            .retain(|row| unknown.iter().any(|&k| row.partials[k] != 0.0));
        let solution = equations.solved().ok_or_else(|| singular(&triads))?;
        let values = to_vector(&triads) + solution.step;
        for &k in &unknown {
            for &j in &unknown {
                estimate.covariance[(k, j)] = solution.covariance[(k, j)];
            }
        }
        estimate.triads = from_vector(estimate.form(), &values);
        Ok(())
    }
}

/// Adds the typical bias variation where none is stated: no dwell averages it out.
fn with_bias_variation(problem: &Problem, mut rests: Vec<Vec<AtRest>>) -> Vec<Vec<AtRest>> {
    if problem.options.noise == NoisePolicy::Stated {
        return rests;
    }
    for (stretch, rests) in problem.stretches().iter().zip(&mut rests) {
        for sensor in Sensor::ALL {
            let noise = stretch.run.instrument.noise.get(sensor);
            let varies = Noise {
                gauss_markov: Some(usual_variation(noise)),
                ..Noise::default()
            };
            for rest in rests.iter_mut().filter(|_| noise.gauss_markov.is_none()) {
                let variance = varies.covariance_of_means(rest.times, rest.times);
                rest.mean.get_mut(sensor).variance += variance;
            }
        }
    }
    rests
}

//! From an estimate to the record that others read.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::at_rest::AtRest;
use super::thermal_record::{RecordingRecord, ThermalRecord};
use super::{
    BlockRecord, Calibration, ConsistencyRecord, DirectionRecord, EQUATION, EQUATION_WITH_TERMS,
    FORMAT, FORMAT_WITH_TEMPERATURE, GravityRecord, MeasuresRecord, Method, NisRecord, NoiseRecord,
    QualityRecord, SpreadRecord, TermRecord, TestVector, TriadRecord,
};
use crate::calibration::auxiliary::{Auxiliary, auxiliary_name};
use crate::calibration::budget::Budget;
use crate::calibration::checks::error_term_test::ErrorTermTest;
use crate::calibration::checks::finding::Finding;
use crate::calibration::checks::innovation::{Consistency, Nis};
use crate::calibration::checks::observability::Direction;
use crate::calibration::checks::quality::{Measures, Quality, Spread};
use crate::calibration::estimate::Estimate;
use crate::calibration::outcome::Outcome;
use crate::calibration::parameters::{
    PARAMETERS, ParameterMatrix, parameter, parameter_name, sensor_and_parameter,
};
use crate::calibration::problem::Problem;
use crate::calibration::start::closed_form::ClosedForm;
use crate::imu::{
    BodyFrame, InstallationForm, Nominal, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad,
};
use crate::run::Run;

/// Inputs of the test vectors: rad/s, then m/s².
const TEST_INPUTS: [[f64; 6]; 3] = [
    [0.0, 0.0, 0.0, 0.0, 0.0, 9.8],
    [0.1, -0.2, 0.3, 1.0, 2.0, -3.0],
    [-1.0, 0.5, 0.25, -9.8, 0.5, 4.0],
];

impl Outcome {
    /// This calibration of a problem, with what error terms did to it and what it leaves of gravity and
    /// turns.
    pub fn record(
        &self,
        problem: &Problem,
        tests: &[ErrorTermTest],
        quality: &Quality,
    ) -> Calibration {
        let findings = self.findings_with(tests);
        Calibration {
            quality: Some(quality_record(quality)),
            method: Some(Method::Ekf),
            provenance: Some(problem.provenance()),
            blocks: tests.iter().map(BlockRecord::from).collect(),
            aiding: Some(problem.model.aiding),
            terms: self.auxiliary.records(),
            equation: Some(match self.auxiliary.has_terms() {
                true => EQUATION_WITH_TERMS.to_owned(),
                false => EQUATION.to_owned(),
            }),
            gravity: Some(GravityRecord {
                m_s2: self.gravity.0,
                sigma_m_s2: self.gravity.1,
            }),
            passes: Some(self.passes.len()),
            converged: Some(self.converged),
            consistency: Some(ConsistencyRecord {
                dwells: self.dwell_scatter,
                ..consistency_record(&self.consistency)
            }),
            observability: direction_records(self),
            noise: Some(noise_record(self)),
            format: match self.thermal {
                Some(_) => FORMAT_WITH_TEMPERATURE.to_owned(),
                None => FORMAT.to_owned(),
            },
            temperature: self
                .thermal
                .as_ref()
                .map(|thermal| ThermalRecord::of(thermal, &self.estimate, problem.run())),
            recordings: RecordingRecord::all(self, problem.run()),
            warnings: texts(&findings),
            findings,
            ..self
                .estimate
                .record(problem.run(), problem.model.aiding.body_frame())
        }
    }
}

impl Calibration {
    /// With what each source adds to its uncertainty, and with the covariance that is the sum of that: the
    /// same as the filter's, but for the rounding of passes in which variances fall by ten orders of magnitude.
    pub(in crate::calibration) fn take_budget(
        &mut self,
        run: &Run,
        outcome: &Outcome,
        budget: &Budget,
        tests: &[ErrorTermTest],
    ) {
        let estimate = Estimate {
            triads: outcome.estimate.triads,
            covariance: budget.covariance(),
        };
        let estimated: Vec<usize> = estimate.estimated().collect();
        self.budget = Some(budget.record(&estimated, |index| factor(run, index), tests));
        let Self {
            sigma, covariance, ..
        } = estimate.record(run, self.body_frame);
        (self.sigma, self.covariance) = (sigma, covariance);
    }
}

/// What brings a parameter to the file's unit.
fn factor(run: &Run, index: usize) -> f64 {
    let (sensor, of_triad) = sensor_and_parameter(index);
    run.instrument.nominal.get(sensor).factor(of_triad)
}

impl ClosedForm {
    /// This calibration of a problem, with what it leaves of gravity and turns.
    pub fn record(&self, problem: &Problem, quality: &Quality) -> Calibration {
        Calibration {
            quality: Some(quality_record(quality)),
            method: Some(Method::SixPosition),
            provenance: Some(problem.provenance()),
            gravity: Some(GravityRecord {
                m_s2: problem.run().site.gravity,
                sigma_m_s2: problem.run().site.gravity_sigma,
            }),
            noise: self.noise.clone().map(|report| NoiseRecord {
                run_toml: report.run_toml(PerSensor::default()),
                report,
            }),
            warnings: texts(&self.findings),
            findings: self.findings.clone(),
            ..self
                .estimate
                .record(problem.run(), self.reference.body_frame())
        }
    }
}

impl AtRest {
    /// What of a calibration it says: biases of the gyros within Earth rate, and how all biases change; the rest is as
    /// it was known before.
    pub fn record(&self, run: &Run) -> Calibration {
        let (triads, sigma) = self.triads(run);
        let mut covariance = ParameterMatrix::zeros();
        for sensor in Sensor::ALL {
            for (of_triad, sigma) in sigma.get(sensor).iter().enumerate() {
                let index = parameter(sensor, of_triad);
                covariance[(index, index)] = sigma * sigma;
            }
        }
        let estimate = Estimate { triads, covariance };
        let findings = self.findings(&estimate);
        Calibration {
            format: FORMAT_WITH_TEMPERATURE.to_owned(),
            temperature: Some(ThermalRecord::of(&self.thermal(), &estimate, run)),
            warnings: texts(&findings),
            findings,
            ..estimate.record(run, BodyFrame::Accelerometer)
        }
    }
}

impl Auxiliary {
    /// Its estimated parameters by name.
    pub fn records(&self) -> BTreeMap<String, TermRecord> {
        let sigma = self.sigma();
        let record = |k: usize| {
            let record = TermRecord {
                value: self.values[k],
                sigma: Some(sigma[k]),
            };
            Some((auxiliary_name(k)?, record))
        };
        self.estimated().filter_map(record).collect()
    }
}

impl Estimate {
    /// The record of this estimate, with a model card: equation, correction, test vectors.
    pub fn record(&self, run: &Run, body_frame: BodyFrame) -> Calibration {
        let form = self.form();
        let sigma = self.sigma();
        let estimated: Vec<usize> = self.estimated().collect();
        let names = |wanted: bool| {
            (0..PARAMETERS)
                .filter(|&i| (self.covariance[(i, i)] > 0.0) == wanted)
                .filter_map(|i| parameter_name(form, i))
                .collect()
        };
        let of = |sensor| triad_record(self.triads.get(sensor), run.instrument.nominal.get(sensor));
        let correction = |sensor| {
            let sensitivity = run
                .instrument
                .nominal
                .get(sensor)
                .sensitivity(self.triads.get(sensor));
            Some(rows(&sensitivity.try_inverse()?))
        };
        Calibration {
            installation_form: Some(form),
            body_frame,
            unit: Some(run.instrument.unit.clone()),
            sigma: Some(PerSensor::from_fn(|sensor| {
                let sigma = sigma.fixed_rows::<PER_TRIAD>(parameter(sensor, 0));
                sigma_record(
                    form,
                    &sigma.into_owned(),
                    run.instrument.nominal.get(sensor),
                )
            })),
            parameters: names(true),
            covariance: estimated
                .iter()
                .map(|&i| {
                    estimated
                        .iter()
                        .map(|&j| self.covariance[(i, j)] * factor(run, i) * factor(run, j))
                        .collect()
                })
                .collect(),
            fixed: names(false),
            equation: Some(EQUATION.to_owned()),
            correction: correction(Sensor::Gyro)
                .zip(correction(Sensor::Accel))
                .map(|(gyro, accel)| PerSensor { gyro, accel }),
            test_vectors: TEST_INPUTS
                .iter()
                .map(|input| self.test_vector(run, input))
                .collect(),
            meta: run.recording.meta.clone(),
            ..Calibration::new(of(Sensor::Gyro), of(Sensor::Accel))
        }
    }

    fn test_vector(&self, run: &Run, input: &[f64; 6]) -> TestVector {
        let mut raw = [0.0; 6];
        for (sensor, first) in [(Sensor::Gyro, 0), (Sensor::Accel, 3)] {
            let u = Vector3::from_column_slice(&input[first..first + 3]);
            let output = self.triads.get(sensor).output(&u);
            let output = output.component_mul(&run.instrument.nominal.get(sensor).0);
            raw[first..first + 3].copy_from_slice(output.as_slice());
        }
        TestVector {
            raw,
            calibrated: *input,
        }
    }
}

/// The record of a known truth.
pub fn truth_record(truth: &PerSensor<Triad>, run: &Run) -> Calibration {
    let of = |sensor| triad_record(truth.get(sensor), run.instrument.nominal.get(sensor));
    Calibration {
        installation_form: Some(truth.gyro.form),
        unit: Some(run.instrument.unit.clone()),
        ..Calibration::new(of(Sensor::Gyro), of(Sensor::Accel))
    }
}

fn triad_record(triad: &Triad, nominal: &Nominal) -> TriadRecord {
    TriadRecord {
        scale: triad.scale.component_mul(&nominal.0).into(),
        installation: rows(&triad.installation()),
        bias: triad.bias.component_mul(&nominal.0).into(),
    }
}

/// σ of a triad's parameters where they stand in its record, in their own units.
pub fn sigma_rows(form: InstallationForm, sigma: &crate::imu::TriadVector) -> TriadRecord {
    sigma_record(form, sigma, &Nominal(Vector3::repeat(1.0)))
}

fn sigma_record(
    form: InstallationForm,
    sigma: &crate::imu::TriadVector,
    nominal: &Nominal,
) -> TriadRecord {
    let triad = Triad::from_vector(form, sigma);
    let mut installation = [[0.0; 3]; 3];
    for (angle, &(row, column)) in form.angle_names().iter().enumerate() {
        installation[row][column] = triad.angles[angle];
        if form == InstallationForm::ThreeAngle {
            installation[column][row] = triad.angles[angle];
        }
    }
    TriadRecord {
        scale: triad.scale.component_mul(&nominal.0).abs().into(),
        installation,
        bias: triad.bias.component_mul(&nominal.0).abs().into(),
    }
}

pub fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [m[(i, 0)], m[(i, 1)], m[(i, 2)]])
}

fn direction_records(outcome: &Outcome) -> Vec<DirectionRecord> {
    let form = outcome.estimate.form();
    let record = |direction: &Direction| DirectionRecord {
        remaining: direction.remaining,
        words: direction.words(form),
        parts: direction
            .parts
            .iter()
            .filter_map(|part| Some((parameter_name(form, part.parameter)?, part.component)))
            .collect(),
    };
    outcome
        .observability
        .directions
        .iter()
        .map(record)
        .collect()
}

impl From<&ErrorTermTest> for BlockRecord {
    fn from(test: &ErrorTermTest) -> Self {
        Self {
            block: test.term.name().to_owned(),
            on: test.on,
            sigma_factors: test.sigma_factors,
            merit_gain: test.gain,
            merit_gain_limit: test.limit,
            asked_for: test.significant(),
            nis_without: test.without,
            nis_with: test.with,
        }
    }
}

fn quality_record(quality: &Quality) -> QualityRecord {
    let spread = |spread: &Spread| SpreadRecord {
        count: spread.count,
        rms: spread.rms,
        largest: spread.largest,
    };
    let measures = |measures: &Measures| MeasuresRecord {
        gravity_m_s2: spread(&measures.gravity),
        direction_rad: spread(&measures.direction),
        turns_rad: spread(&measures.turns),
    };
    QualityRecord {
        all: measures(&quality.all),
        held_out: quality.held_out.as_ref().map(measures),
    }
}

fn consistency_record(consistency: &Consistency) -> ConsistencyRecord {
    let Consistency {
        all,
        velocity,
        table,
        attitude,
    } = consistency;
    let of = |nis: &Nis| NisRecord {
        nis: nis.mean,
        nis_interval: [nis.interval.0, nis.interval.1],
    };
    let some = |nis: &Nis| (nis.count > 0).then(|| of(nis));
    ConsistencyRecord {
        all: of(all),
        velocity: some(velocity),
        table: some(table),
        attitude: some(attitude),
        dwells: None,
    }
}

fn noise_record(outcome: &Outcome) -> NoiseRecord {
    let correlation_time = PerSensor::from_fn(|sensor| {
        let gauss_markov = outcome.model.noise.get(sensor).gauss_markov;
        gauss_markov.map(|gauss_markov| gauss_markov.correlation_time)
    });
    NoiseRecord {
        report: outcome.noise.clone(),
        run_toml: outcome.noise.run_toml(correlation_time),
    }
}

fn texts(findings: &[Finding]) -> Vec<String> {
    findings.iter().map(Finding::to_string).collect()
}

//! From an estimate to the record that others read.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::block_effect::BlockEffect;
use super::closed_form::ClosedForm;
use super::further::{Further, constant_name};
use super::observability::Direction;
use super::outcome::{Consistency, Estimate, Nis, Outcome, parameter_name};
use super::quality::{Measures, Quality, Spread};
use super::states::{PARAMETERS, sensor_and_parameter};
use crate::imu::{InstallationForm, Nominal, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::run::Run;
use crate::run::record::{
    Aiding, BlockRecord, BodyFrame, CalibrationRecord, ConsistencyRecord, DirectionRecord,
    EQUATION, EQUATION_WITH_TERMS, MeasuresRecord, Method, NisRecord, QualityRecord, SpreadRecord,
    TermRecord, TestVector, TriadRecord,
};

/// Inputs of the test vectors: rad/s, then m/s².
const TEST_INPUTS: [[f64; 6]; 3] = [
    [0.0, 0.0, 0.0, 0.0, 0.0, 9.8],
    [0.1, -0.2, 0.3, 1.0, 2.0, -3.0],
    [-1.0, 0.5, 0.25, -9.8, 0.5, 4.0],
];

impl Outcome {
    /// The record of this calibration of a run, with what blocks of states did to it and what it leaves
    /// of gravity and turns.
    pub fn record(
        &self,
        run: &Run,
        effects: &[BlockEffect],
        quality: &Quality,
    ) -> CalibrationRecord {
        CalibrationRecord {
            quality: Some(quality_record(quality)),
            method: Some(Method::Ekf),
            blocks: effects.iter().map(BlockRecord::from).collect(),
            aiding: Some(match run.body_frame() {
                BodyFrame::Table => Aiding::Table,
                BodyFrame::Accelerometer => Aiding::Velocity,
            }),
            terms: self.further.records(),
            equation: Some(match self.further.has_terms() {
                true => EQUATION_WITH_TERMS.to_owned(),
                false => EQUATION.to_owned(),
            }),
            passes: Some(self.passes.len()),
            converged: Some(self.converged),
            consistency: Some(consistency_record(&self.consistency)),
            observability: direction_records(self),
            warnings: self.warnings.clone(),
            ..self.estimate.record(run)
        }
    }
}

impl ClosedForm {
    /// The record of this calibration of a run, with what it leaves of gravity and turns.
    pub fn record(&self, run: &Run, quality: &Quality) -> CalibrationRecord {
        CalibrationRecord {
            quality: Some(quality_record(quality)),
            method: Some(Method::SixPosition),
            body_frame: self.reference.body_frame(),
            warnings: self.warnings.clone(),
            ..self.estimate.record(run)
        }
    }
}

impl Further {
    /// Its estimated constants by name.
    pub fn records(&self) -> BTreeMap<String, TermRecord> {
        let sigma = self.sigma();
        let record = |k: usize| {
            let record = TermRecord {
                value: self.values[k],
                sigma: Some(sigma[k]),
            };
            Some((constant_name(k)?, record))
        };
        self.estimated().filter_map(record).collect()
    }
}

impl Estimate {
    /// The record of this estimate, with a model card: equation, correction, test vectors.
    pub fn record(&self, run: &Run) -> CalibrationRecord {
        let form = self.form();
        let sigma = self.sigma();
        let estimated: Vec<usize> = self.estimated().collect();
        let names = |wanted: bool| {
            (0..PARAMETERS)
                .filter(|&i| (self.covariance[(i, i)] > 0.0) == wanted)
                .filter_map(|i| parameter_name(form, i))
                .collect()
        };
        let factor = |index: usize| {
            let (sensor, of_triad) = sensor_and_parameter(index);
            run.nominal.get(sensor).factor(of_triad)
        };
        let of = |sensor| triad_record(self.triads.get(sensor), run.nominal.get(sensor));
        let correction = |sensor| {
            let sensitivity = run.nominal.get(sensor).sensitivity(self.triads.get(sensor));
            Some(rows(&sensitivity.try_inverse()?))
        };
        CalibrationRecord {
            installation_form: Some(form),
            body_frame: run.body_frame(),
            unit: Some(run.unit.clone()),
            sigma: Some(PerSensor::from_fn(|sensor| {
                let sigma = sigma.fixed_rows::<PER_TRIAD>(super::states::parameter(sensor, 0));
                sigma_record(form, &sigma.into_owned(), run.nominal.get(sensor))
            })),
            parameters: names(true),
            covariance: estimated
                .iter()
                .map(|&i| {
                    estimated
                        .iter()
                        .map(|&j| self.covariance[(i, j)] * factor(i) * factor(j))
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
            meta: run.meta.clone(),
            ..CalibrationRecord::new(of(Sensor::Gyro), of(Sensor::Accel))
        }
    }

    fn test_vector(&self, run: &Run, input: &[f64; 6]) -> TestVector {
        let mut raw = [0.0; 6];
        for (sensor, first) in [(Sensor::Gyro, 0), (Sensor::Accel, 3)] {
            let u = Vector3::from_column_slice(&input[first..first + 3]);
            let output = self.triads.get(sensor).output(&u);
            let output = output.component_mul(&run.nominal.get(sensor).0);
            raw[first..first + 3].copy_from_slice(output.as_slice());
        }
        TestVector {
            raw,
            calibrated: *input,
        }
    }
}

/// The record of a known truth.
pub fn truth_record(truth: &PerSensor<Triad>, run: &Run) -> CalibrationRecord {
    let of = |sensor| triad_record(truth.get(sensor), run.nominal.get(sensor));
    CalibrationRecord {
        installation_form: Some(truth.gyro.form),
        unit: Some(run.unit.clone()),
        ..CalibrationRecord::new(of(Sensor::Gyro), of(Sensor::Accel))
    }
}

/// Both triads of a record, normalised by these nominal scales and split in a form. A record may
/// hold any installation matrix, so the split goes through `K C`, which all forms share.
pub fn triads_of(
    record: &CalibrationRecord,
    nominal: &PerSensor<Nominal>,
    form: InstallationForm,
) -> PerSensor<Triad> {
    PerSensor::from_fn(|sensor| {
        let triad = match sensor {
            Sensor::Gyro => &record.gyro,
            Sensor::Accel => &record.accel,
        };
        let nominal = nominal.get(sensor).0;
        let a = Matrix3::from_fn(|i, j| triad.scale[i] * triad.installation[i][j] / nominal[i]);
        let bias = Vector3::from(triad.bias).component_div(&nominal);
        Triad::from_sensitivity(form, &a, bias)
    })
}

fn triad_record(triad: &Triad, nominal: &Nominal) -> TriadRecord {
    TriadRecord {
        scale: triad.scale.component_mul(&nominal.0).into(),
        installation: rows(&triad.installation()),
        bias: triad.bias.component_mul(&nominal.0).into(),
    }
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

fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
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

impl From<&BlockEffect> for BlockRecord {
    fn from(effect: &BlockEffect) -> Self {
        Self {
            block: effect.block.name().to_owned(),
            on: effect.on,
            sigma_factors: effect.cost,
            merit_gain: effect.gain,
            merit_gain_limit: effect.limit,
            asked_for: effect.asked_for(),
            nis_without: effect.without,
            nis_with: effect.with,
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
    }
}

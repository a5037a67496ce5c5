//! Conversion of an estimate to the record for files.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::thermal_record::{RecordingRecord, ThermalRecord};
use super::{
    BlockRecord, Calibration, ConsistencyRecord, EQUATION, EQUATION_WITH_TERMS, FORMAT,
    FORMAT_WITH_TEMPERATURE, GravityRecord, Method, NisRecord, NoiseRecord, Provenance, TermRecord,
    TestVector, TriadRecord, rows,
};
use crate::calibration::parameters::{Before, factor};
use crate::calibration::{
    AtRest, Auxiliary, Budget, ClosedForm, Estimate, Finding, MagRecord, MagneticEstimate, Nis,
    Outcome, PARAMETERS, ParameterVector, Problem, Quality, Reference, TermEvidence, Verdict,
    auxiliary_name, checks, ellipsoid, from_vector, parameter_name,
};
use crate::imu::{BodyFrame, InstallationForm, Nominal, Output, PerSensor, Sensor, Triad};
use crate::run::Run;
use crate::units::DEGREE;

/// Inputs of the test vectors: rad/s, then m/s².
const TEST_INPUTS: [[f64; 6]; 3] = [
    [0.0, 0.0, 0.0, 0.0, 0.0, 9.8],
    [0.1, -0.2, 0.3, 1.0, 2.0, -3.0],
    [-1.0, 0.5, 0.25, -9.8, 0.5, 4.0],
];

impl Outcome {
    /// The record of this calibration of a problem, with the residuals of gravity and turns.
    pub fn record(&self, problem: &Problem, quality: &Quality) -> Calibration {
        let (run, estimate) = (problem.run(), self.estimate.usable(self.before()));
        let equation = if self.auxiliary.has_terms() {
            EQUATION_WITH_TERMS
        } else {
            EQUATION
        };
        let format = match self.thermal {
            Some(_) => FORMAT_WITH_TEMPERATURE,
            None => FORMAT,
        };
        let thermal = self.thermal.as_ref();
        let body_frame = problem.model.aiding.body_frame();
        let record = Calibration {
            mag: mag_record(self.magnetic.as_ref(), run),
            format: format.to_owned(),
            method: Some(Method::Ekf),
            aiding: Some(problem.model.aiding),
            terms: self.auxiliary.records(),
            temperature: thermal.map(|thermal| ThermalRecord::of(thermal, &estimate, run)),
            recordings: RecordingRecord::all(self, run),
            gravity: Some(GravityRecord::new(self.gravity)),
            passes: Some(self.passes.len()),
            converged: Some(self.converged),
            consistency: self.consistency_record(),
            quality: Some(quality.clone()),
            blocks: self.terms.iter().map(BlockRecord::from).collect(),
            observability: self.observability.directions.clone(),
            noise: Some(self.noise_record()),
            equation: Some(equation.to_owned()),
            provenance: Some(problem.provenance()),
            ..self.estimate.usable_record(self.before(), run, body_frame)
        };
        record.with_findings(self.findings.clone())
    }

    /// `None` without innovations, because their mean square is then not a number.
    fn consistency_record(&self) -> Option<ConsistencyRecord> {
        let of = |nis: Nis| NisRecord {
            nis: nis.mean,
            nis_interval: nis.interval.into(),
        };
        let some = |nis: Nis| (nis.count > 0).then(|| of(nis));
        let consistency = &self.consistency;
        Some(ConsistencyRecord {
            all: some(consistency.all)?,
            velocity: some(consistency.velocity),
            table: some(consistency.table),
            attitude: some(consistency.attitude),
        })
    }

    fn noise_record(&self) -> NoiseRecord {
        let time = |sensor| Some(self.model.noise.get(sensor).gauss_markov?.correlation_time);
        NoiseRecord {
            report: self.noise.clone(),
            run_toml: self.noise.run_toml(PerSensor::from_fn(time)),
        }
    }
}

impl Calibration {
    /// Adds the uncertainty budget.
    pub(in crate::calibration) fn take_budget(
        &mut self,
        run: &Run,
        outcome: &Outcome,
        budget: &Budget,
    ) {
        let estimated: Vec<usize> = outcome
            .estimate
            .usable(outcome.before())
            .estimated()
            .collect();
        let factor = |index| factor(&run.instrument.nominal, index);
        let variance = |index| outcome.estimate.covariance[(index, index)];
        self.budget = Some(budget.record(&estimated, variance, factor));
    }

    fn with_findings(self, findings: Vec<Finding>) -> Self {
        Self {
            verdict: Some(Verdict::of(&findings)),
            warnings: findings
                .iter()
                .map(|finding| finding.text.clone())
                .collect(),
            findings,
            ..self
        }
    }
}

/// The record of a magnetometer, if the run has one and it was calibrated.
fn mag_record(estimate: Option<&MagneticEstimate>, run: &Run) -> Option<MagRecord> {
    MagRecord::of_estimate(estimate?, run.recording.magnetometer.as_ref()?)
}

impl Calibration {
    /// The calibration of a magnetometer without gyros and accelerometers: both triads are nominal. `None` if the values
    /// do not determine an ellipsoid.
    pub fn of_magnetometer(run: &Run) -> Option<Self> {
        let log = run.recording.magnetometer.as_ref()?;
        let mut found = ellipsoid(log)?;
        if let Some(facts) = &run.recording.imu.log {
            found.estimate = found.estimate.along(&facts.named.axes.matrix());
        }
        let nominal = TriadRecord {
            scale: [1.0; 3],
            installation: rows(&Matrix3::identity()),
            bias: [0.0; 3],
        };
        let record = Self {
            mag: Some(MagRecord::of_ellipsoid(&found, log)?),
            provenance: Some(Provenance::of_run(run)),
            meta: run.recording.meta.clone(),
            ..Self::new(nominal, nominal)
        };
        Some(record.with_findings(checks::magnetic::of_ellipsoid(&found)))
    }

    /// Whether only a magnetometer was calibrated, from its own values.
    pub fn is_of_magnetometer(&self) -> bool {
        self.mag.as_ref().is_some_and(|mag| mag.ellipsoid.is_some())
    }
}

impl Provenance {
    /// Origin of a calibration of a run, without the list of files and the number of dwells.
    pub fn of_run(run: &Run) -> Self {
        let imu = &run.recording.imu;
        Self {
            program: concat!("turncal ", env!("CARGO_PKG_VERSION")).to_owned(),
            inputs: Vec::new(),
            nominal: PerSensor::from_fn(|sensor| run.instrument.nominal.get(sensor).0.into()),
            latitude_deg: (run.site.is_known).then_some(run.site.latitude / DEGREE),
            height_m: run.site.height,
            duration_s: imu.duration(),
            rate_hz: 1.0 / imu.period,
            dwells: 0,
        }
    }
}

impl GravityRecord {
    fn new((m_s2, sigma_m_s2): (f64, f64)) -> Self {
        Self { m_s2, sigma_m_s2 }
    }
}

impl ClosedForm {
    /// The record of this calibration of a problem, with the residuals of gravity and turns.
    pub fn record(&self, problem: &Problem, quality: &Quality) -> Calibration {
        let (run, body_frame) = (problem.run(), self.reference.body_frame());
        let record = match self.reference {
            Reference::GravityAlone => {
                let before = problem.model.before();
                self.estimate.usable_record(before, run, body_frame)
            }
            _ => self.estimate.record(run, body_frame),
        };
        let record = Calibration {
            mag: mag_record(self.magnetic.as_ref(), run),
            quality: Some(quality.clone()),
            method: Some(Method::SixPosition),
            provenance: Some(problem.provenance()),
            gravity: Some(GravityRecord::new((
                run.site.gravity,
                run.site.gravity_sigma,
            ))),
            ..record
        };
        record.with_findings(self.findings.clone())
    }
}

impl AtRest {
    /// The partial calibration of an instrument at rest: gyro biases (accurate to Earth rate), and the temperature
    /// dependence of all biases; all other values come from the prior.
    pub fn record(&self, problem: &Problem) -> Calibration {
        let run = problem.run();
        let (estimate, thermal) = self.biases(problem);
        let before = problem.model.before();
        let body_frame = problem.model.aiding.body_frame();
        let record = Calibration {
            format: FORMAT_WITH_TEMPERATURE.to_owned(),
            temperature: Some(ThermalRecord::of(&thermal, &estimate.usable(before), run)),
            ..estimate.usable_record(before, run, body_frame)
        };
        record.with_findings(self.findings.clone())
    }
}

impl Auxiliary {
    /// Estimated parameters by name.
    pub fn records(&self) -> BTreeMap<String, TermRecord> {
        let sigma = self.sigma();
        let record = |k: usize| {
            let (value, sigma) = (self.values[k], Some(sigma[k]));
            Some((auxiliary_name(k)?, TermRecord { value, sigma }))
        };
        self.estimated().filter_map(record).collect()
    }
}

impl Estimate {
    /// The record of the usable values; unobserved parameters are stated with their prior values and σ.
    fn usable_record(&self, before: Before<'_>, run: &Run, body_frame: BodyFrame) -> Calibration {
        let (mut sigma, nominal) = (self.sigma(), &run.instrument.nominal);
        for index in self.unobserved(before.sigma) {
            sigma[index] = before.sigma[index];
        }
        Calibration {
            sigma: Some(TriadRecord::of_both_sigma(self.form(), &sigma, nominal)),
            ..self.usable(before).record(run, body_frame)
        }
    }

    /// The record of this estimate, with a description of the model: equation, correction and test vectors.
    pub fn record(&self, run: &Run, body_frame: BodyFrame) -> Calibration {
        let (form, sigma) = (self.form(), self.sigma());
        let nominal = &run.instrument.nominal;
        let (estimated, fixed): (Vec<usize>, Vec<usize>) =
            (0..PARAMETERS).partition(|&i| self.covariance[(i, i)] > 0.0);
        let names = |of: &[usize]| of.iter().filter_map(|&i| parameter_name(form, i)).collect();
        let entry = |i, j| self.covariance[(i, j)] * factor(nominal, i) * factor(nominal, j);
        let row = |&i: &usize| estimated.iter().map(|&j| entry(i, j)).collect();
        let vectors = TEST_INPUTS.map(|input| self.test_vector(nominal, input));
        Calibration {
            body_frame,
            sigma: Some(TriadRecord::of_both_sigma(form, &sigma, nominal)),
            parameters: names(&estimated),
            covariance: estimated.iter().map(row).collect(),
            fixed: names(&fixed),
            equation: Some(EQUATION.to_owned()),
            correction: correction_of(&self.triads, nominal),
            test_vectors: vectors.into(),
            meta: run.recording.meta.clone(),
            ..truth_record(&self.triads, run)
        }
    }

    fn test_vector(&self, nominal: &PerSensor<Nominal>, calibrated: [f64; 6]) -> TestVector {
        let mut raw = [0.0; 6];
        for (sensor, first) in [(Sensor::Gyro, 0), (Sensor::Accel, 3)] {
            let u = Vector3::from_column_slice(&calibrated[first..first + 3]);
            let output = self.triads.get(sensor).output(&u);
            let output = output.component_mul(&nominal.get(sensor).0);
            raw[first..first + 3].copy_from_slice(output.as_slice());
        }
        TestVector { raw, calibrated }
    }
}

/// The record of a known truth.
pub fn truth_record(truth: &PerSensor<Triad>, run: &Run) -> Calibration {
    let (nominal, imu) = (&run.instrument.nominal, &run.recording.imu);
    let log = imu.log.as_ref();
    let pulses = (imu.pulse.gyro > 0.0).then_some(Output::Pulse);
    Calibration {
        installation_form: Some(truth.gyro.form),
        unit: Some(run.instrument.unit.clone()),
        output: log.map(|log| log.output).or(pulses),
        columns: log.and_then(|log| log.named.along_body()),
        ..Calibration::new(
            TriadRecord::new(&truth.gyro, &nominal.gyro),
            TriadRecord::new(&truth.accel, &nominal.accel),
        )
    }
}

/// The matrices in `u = correction (N − bias)`, for these nominal scales; `None` if one has no inverse.
pub fn correction_of(
    triads: &PerSensor<Triad>,
    nominal: &PerSensor<Nominal>,
) -> Option<PerSensor<[[f64; 3]; 3]>> {
    let of = |sensor| {
        let sensitivity = nominal.get(sensor).sensitivity(triads.get(sensor));
        Some(rows(&sensitivity.try_inverse()?))
    };
    Some(PerSensor {
        gyro: of(Sensor::Gyro)?,
        accel: of(Sensor::Accel)?,
    })
}

impl TriadRecord {
    /// σ of the parameters of both triads, arranged as in the records, for these nominal scales.
    pub fn of_both_sigma(
        form: InstallationForm,
        sigma: &ParameterVector,
        nominal: &PerSensor<Nominal>,
    ) -> PerSensor<Self> {
        let triads = from_vector(form, sigma);
        PerSensor::from_fn(|sensor| Self::of_sigma(triads.get(sensor), nominal.get(sensor)))
    }

    /// σ of the parameters of a triad, arranged as in the record, by nominal scales.
    fn of_sigma(triad: &Triad, nominal: &Nominal) -> Self {
        let form = triad.form;
        let mut installation = [[0.0; 3]; 3];
        for (angle, &(row, column)) in form.angle_names().iter().enumerate() {
            installation[row][column] = triad.angles[angle];
            if form == InstallationForm::ThreeAngle {
                installation[column][row] = triad.angles[angle];
            }
        }
        Self {
            scale: triad.scale.component_mul(&nominal.0).abs().into(),
            installation,
            bias: triad.bias.component_mul(&nominal.0).abs().into(),
        }
    }
}

impl From<&TermEvidence> for BlockRecord {
    fn from(of: &TermEvidence) -> Self {
        Self {
            block: of.term.name().to_owned(),
            on: of.present == 1.0,
            present: of.present,
            remaining: of.remaining,
            sigma_factors: of.sigma_factors,
        }
    }
}

//! Table 1 of the paper: errors after 40 h of navigation due to the two simplified misalignment forms (Zhao, Jiang, Li
//! 2016, §3.2).
//!
//! For each sample, misalignment angles are drawn (six independent angles for each triad, rows of unit norm), and the
//! triad is calibrated by the closed form from six positions without noise. Navigation then uses the remaining errors
//! of the gyros and of the accelerometers separately, for a level body at rest with perfect alignment and fixed height.
//! The figure of a sample is the largest absolute error of the run.
//!
//! Navigation uses the linear error model. A linear model suffices because the errors are small. The neglected terms
//! are products of two errors and are at most a hundredth of the largest error in any row of the table (a test compares
//! the model with nonlinear navigation). Second-order terms of the calibration, such as scale factors of rows of unit
//! norm, are included.

pub mod paper;
mod quantity;
mod response;
mod verdict;

use nalgebra::Vector3;
use paper::Published;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use response::{Moment, Response, errors, standing};

use crate::earth::ROTATION_RATE;
use crate::imu::{InstallationForm, PerSensor, Sensor, Triad};
use crate::models::{InstallationModel, Instrument, ModelError, Place};
use crate::study::navigation::NavigationStudyError;

pub use paper::{Installation, Kind, Reading};
pub use quantity::{ByQuantity, Moments, QUANTITIES};
pub use verdict::{AGREEMENT, Verdict};

/// Minimum number of samples for verdicts; with this number, only the sampling error of the paper matters.
pub const POPULATION: usize = 4000;

/// Number of times at which the errors of samples are stored.
const TIMES: usize = 500;

/// Configuration of the study.
#[derive(Debug, Clone, PartialEq)]
pub struct Table1Study {
    /// Number of samples, at least two.
    pub samples: usize,
    /// Seed; each sample has its own random stream.
    pub seed: u64,
    /// Length of a run, h.
    pub hours: f64,
    /// Geodetic latitude, rad.
    pub latitude: f64,
}

/// Errors of a study.
#[derive(Debug, thiserror::Error)]
pub enum Table1Error {
    /// The embedded models of the paper's instrument cannot be read.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The heading is undefined near a pole in East-North-Up.
    #[error(transparent)]
    Navigation(#[from] NavigationStudyError),
    /// The length of a run, in h, is invalid.
    #[error("a run of {0} h; expected more than 0 h")]
    Hours(f64),
    /// Standard deviations need two samples.
    #[error("{0} samples; expected at least 2")]
    Samples(usize),
    /// The positions of a sample do not determine its calibration.
    #[error(
        "sample {0} cannot be calibrated from six positions: its misalignment angles are too large"
    )]
    Degenerate(usize),
}

/// Result of the study.
#[derive(Debug, Clone)]
pub struct Table1 {
    /// The configuration.
    pub study: Table1Study,
    /// Number of samples for the verdicts; the first of these samples are the samples of the study.
    pub population: usize,
    /// The columns of the paper, in the order of the paper.
    pub columns: Vec<Column>,
}

/// One of the paper's columns under all readings.
#[derive(Debug, Clone)]
pub struct Column {
    /// The published column.
    pub published: &'static Published,
    /// The row under the stated reading.
    pub stated: Row,
    /// The rows under other readings.
    pub others: Vec<Row>,
    /// Verdict on the paper's figures.
    pub verdict: Verdict,
    /// Errors against time, under the stated reading.
    pub courses: Courses,
}

/// Results for one column of the table in the paper, under one interpretation of the paper. Errors in the usual units
/// of [`QUANTITIES`].
#[derive(Debug, Clone)]
pub struct Row {
    /// The reading.
    pub reading: &'static Reading,
    /// Length of the runs, h.
    pub hours: f64,
    /// Mean and standard deviation over the samples of the study.
    pub sample: ByQuantity<Moments>,
    /// Mean and standard deviation over the population.
    pub population: ByQuantity<Moments>,
    /// Mean of the paper minus mean of the population, in standard errors of the difference.
    pub difference: ByQuantity<f64>,
    /// Errors of the sensed rate (rad/s) or specific force (m/s²) along body axes, computed − true, of
    /// each sample of the study.
    pub sensed: Vec<Vector3<f64>>,
}

impl Column {
    /// All rows, of which the first is that of the stated reading.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        std::iter::once(&self.stated).chain(&self.others)
    }
}

impl Row {
    /// Whether a quantity, given by its place in [`QUANTITIES`], agrees with the paper's figure.
    pub fn agrees(&self, quantity: usize) -> bool {
        self.difference[quantity].abs() <= AGREEMENT
    }
}

/// Errors against time, with signed attitude errors and norms of velocity and position.
#[derive(Debug, Clone, Default)]
pub struct Courses {
    /// Times, s.
    pub times: Vec<f64>,
    /// Errors of the first samples (at most as many as in the paper) at each time.
    pub samples: Vec<Vec<ByQuantity<f64>>>,
    /// Mean and standard deviation over all samples of the study, at each time.
    pub moments: Vec<ByQuantity<Moments>>,
}

impl Table1Study {
    /// Computes the table on all cores. The result does not depend on the number of cores.
    ///
    /// # Errors
    /// Returns [`Table1Error`] if the configuration is invalid.
    pub fn run(&self) -> Result<Table1, Table1Error> {
        if self.samples < 2 {
            return Err(Table1Error::Samples(self.samples));
        }
        // This form of the condition also rejects NaN.
        if !(self.hours > 0.0 && self.hours.is_finite()) {
            return Err(Table1Error::Hours(self.hours));
        }
        let population = self.samples.max(POPULATION);
        let triads = self.draw(population)?;
        let columns = paper::TABLE.iter();
        let columns = columns.map(|published| self.column(published, &triads));
        Ok(Table1 {
            study: self.clone(),
            population,
            columns: columns.collect::<Result<_, _>>()?,
        })
    }

    /// True triads of every sample.
    fn draw(&self, count: usize) -> Result<Vec<PerSensor<Triad>>, Table1Error> {
        let instrument = Instrument::load("paper", &Place::Embedded)?;
        let installation = InstallationModel::load("general", &Place::Embedded)?;
        let sample = |stream: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(stream);
            PerSensor::from_fn(|sensor| {
                let variation = instrument.variation.get(sensor);
                let mut triad = Triad::ideal(installation.form);
                triad.angles = installation.draw(&mut rng);
                triad.scale = Vector3::from_fn(|_, _| 1.0 + variation.scale.draw(&mut rng));
                triad.bias = Vector3::from_fn(|_, _| variation.bias.draw(&mut rng));
                triad
            })
        };
        Ok((0..count as u64).map(sample).collect())
    }

    fn column(
        &self,
        published: &'static Published,
        triads: &[PerSensor<Triad>],
    ) -> Result<Column, Table1Error> {
        let stated = self.row(published, &published.stated, triads)?;
        let others = published.others.iter();
        let others: Vec<Row> = others
            .map(|reading| self.row(published, reading, triads))
            .collect::<Result<_, _>>()?;
        let three_angle = paper::TABLE
            .iter()
            .find(|other| {
                other.sensor == published.sensor && other.form == InstallationForm::ThreeAngle
            })
            .unwrap_or(published);
        let of_others: Vec<_> = others
            .iter()
            .map(|row| (row.reading, row.difference))
            .collect();
        Ok(Column {
            published,
            verdict: verdict::verdict(
                published,
                three_angle,
                (&stated.population, &stated.difference),
                &of_others,
            ),
            courses: self.courses(published.sensor, &stated)?,
            stated,
            others,
        })
    }

    fn row(
        &self,
        published: &Published,
        reading: &'static Reading,
        triads: &[PerSensor<Triad>],
    ) -> Result<Row, Table1Error> {
        let (sensor, form) = (published.sensor, published.form);
        let hours = reading.hours.unwrap_or(self.hours);
        let mission = standing(self.latitude, hours * 3600.0);
        let response = Response::new(&mission)?;
        let at_rest = mission.start();
        let (input, size) = match sensor {
            Sensor::Gyro => (at_rest.rate, ROTATION_RATE),
            Sensor::Accel => (at_rest.force, at_rest.force.norm()),
        };
        let results: Vec<(Vector3<f64>, ByQuantity<f64>)> = triads
            .par_iter()
            .enumerate()
            .map(|(sample, triads)| {
                let truth = reading.drawn(triads.get(sensor));
                let sensed = sensed(&truth, reading.calibrated(&truth, form, size), &input)
                    .ok_or(Table1Error::Degenerate(sample))?;
                Ok((sensed, response.largest(sensor, &sensed)))
            })
            .collect::<Result<_, Table1Error>>()?;
        let moments = |count: usize| {
            let results = results.iter().take(count);
            std::array::from_fn(|q| Moments::of(results.clone().map(|r| r.1[q])))
        };
        let population = moments(triads.len());
        let paper = published.moments();
        Ok(Row {
            reading,
            hours,
            sample: moments(self.samples),
            population,
            difference: std::array::from_fn(|q| {
                verdict::difference(&paper[q], &population[q], triads.len())
            }),
            sensed: results.iter().take(self.samples).map(|r| r.0).collect(),
        })
    }

    /// Errors of a row against time.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn courses(&self, sensor: Sensor, row: &Row) -> Result<Courses, Table1Error> {
        let response = Response::new(&standing(self.latitude, row.hours * 3600.0))?;
        let exposures: Vec<&Moment> = response.thinned(TIMES).collect();
        let course = |sensed: &Vector3<f64>| {
            let errors = exposures.iter().map(|at| errors(at, sensor, sensed));
            errors.collect()
        };
        let moments = |at: &&Moment| {
            let all: Vec<_> = row.sensed.iter().map(|s| errors(at, sensor, s)).collect();
            std::array::from_fn(|q| Moments::of(all.iter().map(|errors| errors[q])))
        };
        Ok(Courses {
            times: exposures.iter().map(|at| at.time).collect(),
            samples: row.sensed.iter().take(paper::SAMPLES).map(course).collect(),
            moments: exposures.par_iter().map(moments).collect(),
        })
    }
}

/// The input that a calibration computes from the output at rest, minus the true input.
fn sensed(truth: &Triad, calibrated: Option<Triad>, input: &Vector3<f64>) -> Option<Vector3<f64>> {
    let calibrated = calibrated?;
    Some(calibrated.correction()? * (truth.output(input) - calibrated.bias) - input)
}

//! Rows of an instrument of which hardly anything is known, as a run: its dwells, the likelihood of its axes and its closed
//! form, which are those of any run, show zero, scale, signs and order of axes.

use nalgebra::{SMatrix, SVector, Vector3};

use super::motion::{Motion, TOLERANCE, mean, means};
use super::registers::Rows;
use crate::calibration::{
    Estimate, NoisePolicy, Options, Problem, orders_of_gyros, parameter, six_position,
};
use crate::earth::Site;
use crate::imu::{AxisOrder, GaussMarkov, Instrument, Noise, PARAMETERS, PerSensor, Prior, Sensor};
use crate::noise::white_noise;
use crate::recording::{Fault, FaultKind, Recording, Stretch, stretches_between};
use crate::run::{Aiding, Dwell, Run};
use crate::statistics::{FALSE_ALARM, chi_square_limit, median, median_of_axes};
use crate::units::{DEGREE, STANDARD_GRAVITY};

/// Place of the biases among the parameters of a triad.
const BIAS: usize = PARAMETERS - 3;
/// Length of the rows of the run, s, where those of the log are shorter.
const ROW: f64 = 0.02;
/// A run needs longer rests than a hand makes: all is taken to happen this many times slower, on which nothing else depends.
const SLOWED: f64 = 2.0;
/// 1σ of a scale that is as good as unknown, relative …
const ANY_SCALE: f64 = 0.5;
/// … and of axes of one chip, rad.
const ASKEW: f64 = 2.0 * DEGREE;
/// Zero of a register that is made to say nothing at zero, 1σ, m/s² …
const ABOUT_ZERO: f64 = 1.0;
/// … and of gyros, rad/s: their output at rest shows it.
const ANY_RATE: f64 = 10.0;
/// Relative accuracy of gravity at rest: raw outputs are not linear, and drift.
const PART: f64 = 1e-3;
/// How long an output wanders one way, s.
const WANDERS: f64 = 1.0;
/// Output of one chip is straight to this part, 1σ, as data sheets of such chips state (MPU-6050, section 6.1: 0.2 %): a
/// scale found at large rates is none at small ones.
const LINEAR: f64 = 2e-3;
/// A first guess of how far gyros turn may be wrong by this factor, for a hand shakes more than it turns …
const SEARCHED: f64 = 8.0;
/// … each that is tried is this many times the one before …
const STEP: f64 = 1.1;
/// … and those within this factor are the same.
const SAME: f64 = 1.25;
/// Other axes and scales are this many times less likely.
const TOLD_APART: f64 = 1e3;

/// How the axes of a triad follow rotation or gravity.
#[derive(Debug, Clone, PartialEq)]
pub struct Axes {
    /// The file's quantity a row for one rad a row, negative where it turns the other way, or for one g.
    pub scale: Vector3<f64>,
    /// Of what is common to them, relative.
    pub sigma: f64,
    /// Whether they differ by more than those of one chip.
    pub by_axis: bool,
}

/// What gravity at rest shows of accelerometers.
#[derive(Debug, Clone, PartialEq)]
pub struct Gravity {
    /// What the axes say at zero, the file's quantity a row, where it is not what they are made to say.
    pub own_zero: Option<Vector3<f64>>,
    /// Its largest σ.
    pub zero_sigma: f64,
    pub axes: Axes,
    /// Rests it was found from.
    pub rests: usize,
}

/// How the gyros' columns lie to the accelerometers'.
#[derive(Debug, Clone, PartialEq)]
pub struct Turns {
    /// Of each axis of the accelerometers the column that turns about it.
    pub columns: [usize; 3],
    pub axes: Axes,
    pub moves: usize,
}

impl Turns {
    /// Angle in rad of a unit in a row, if all axes turn one way.
    pub fn angle(&self) -> Option<f64> {
        let scale = self.axes.scale;
        let size = scale.abs().map(f64::ln).mean().exp().recip();
        let sign = scale.map(f64::signum);
        (self.columns == [0, 1, 2] && sign.min() == sign.max()).then_some(size * sign.x)
    }

    /// Whether the columns are in the order of the accelerometers' and turn as theirs do.
    pub fn agree(&self) -> bool {
        self.columns == [0, 1, 2] && self.axes.scale.min() > 0.0
    }
}

/// What is taken for the instrument.
#[derive(Debug, Clone)]
struct Guess {
    /// rad/s and m/s² of one of the file's quantity a row.
    unit: PerSensor<f64>,
    /// What accelerometers say at zero.
    zero: Vector3<f64>,
    /// How the gyros' columns make its axes.
    order: AxisOrder,
}

/// Rows of both triads, and what does not follow from the row before.
#[derive(Clone)]
pub struct RawRun {
    rows: PerSensor<Vec<Vector3<f64>>>,
    /// By its clock, s.
    period: f64,
    /// Of the log's own rows.
    period_of_log: f64,
    is_whole: PerSensor<bool>,
    breaks: Vec<usize>,
    guess: Guess,
}

impl RawRun {
    /// Of the rows of a log some of which, `breaks`, do not follow from the one before.
    pub fn new(of_log: &Rows, breaks: &[usize], motion: &Motion) -> Self {
        let length = ((ROW / of_log.period).round() as usize).max(1);
        let period = SLOWED * of_log.period;
        let rows = PerSensor::from_fn(|sensor| means(of_log.triads.get(sensor), length));
        // Where nothing shows how far gyros turn, they turn by a radian a second at most.
        let largest = rows.gyro.iter().map(Vector3::norm).fold(0.0, f64::max);
        let size = Some(motion.size).filter(|size| size.is_finite() && *size > 0.0);
        let size = size.unwrap_or(period / if largest > 0.0 { largest } else { 1.0 });
        Self {
            rows,
            period: length as f64 * period,
            period_of_log: period,
            is_whole: of_log.whole,
            breaks: breaks.iter().map(|row| row / length).collect(),
            guess: Guess {
                unit: PerSensor {
                    gyro: size / period,
                    accel: STANDARD_GRAVITY / motion.gravity,
                },
                zero: Vector3::zeros(),
                order: AxisOrder::IDENTITY,
            },
        }
    }

    /// The same where gyros have a zero of their own in each stretch.
    pub fn of_sections(mut self) -> Self {
        for stretch in stretches(self.rows.gyro.len(), &self.breaks, self.period) {
            let rows = &mut self.rows.gyro[stretch.samples];
            let zero = median_of_axes(rows).unwrap_or_default();
            rows.iter_mut().for_each(|row| *row -= zero);
        }
        self
    }

    /// The run if the instrument is this one, and if moves are unknown where it breaks.
    fn run(&self, guess: &Guess, breaks: &[usize]) -> Option<Run> {
        let gyro = |row: &Vector3<f64>| guess.order.apply(row) * (guess.unit.gyro * self.period);
        let accel = |row: &Vector3<f64>| (row - guess.zero) * (guess.unit.accel * self.period);
        let [gyro, accel] = [
            self.rows.gyro.iter().map(gyro).collect::<Vec<_>>(),
            self.rows.accel.iter().map(accel).collect(),
        ];
        let mut recording = Recording::from_samples("log", 0.0, self.period, gyro, accel).ok()?;
        let imu = &mut recording.imu;
        imu.stretches = stretches(imu.len(), breaks, self.period);
        imu.pulse = PerSensor::from_fn(|sensor| match self.is_whole.get(sensor) {
            true => guess.unit.get(sensor) * self.period_of_log,
            false => 0.0,
        });
        let wanders = |sigma| GaussMarkov {
            sigma,
            correlation_time: WANDERS,
        };
        let noise = PerSensor::from_fn(|sensor| Noise {
            random_walk: white_noise(imu, sensor),
            gauss_markov: (sensor == Sensor::Accel).then(|| wanders(PART * STANDARD_GRAVITY)),
        });
        let prior = PerSensor {
            gyro: ANY_RATE,
            accel: ABOUT_ZERO,
        };
        let prior = PerSensor::from_fn(|sensor| Prior {
            scale_sigma: Vector3::repeat(ANY_SCALE),
            installation_sigma: Vector3::repeat(ASKEW),
            bias: Vector3::zeros(),
            bias_sigma: Vector3::repeat(*prior.get(sensor)),
        });
        let site = Site::unknown().with_gravity(STANDARD_GRAVITY, 0.0);
        Some(Run::new(recording, Instrument::new(prior, noise), site))
    }

    /// The run as it is guessed, and where it rests: gravity lies one way there.
    fn at_rest(&self) -> Option<(Run, Vec<Dwell>)> {
        let run = self.run(&self.guess, &self.breaks)?;
        let mut dwells = run.dwells(Aiding::Velocity);
        dwells.retain(|dwell| {
            let rows = &self.rows.accel[dwell.samples.clone()];
            let size = rows.iter().map(Vector3::norm).sum::<f64>() / rows.len() as f64;
            mean(rows).norm() > (1.0 - TOLERANCE) * size
        });
        Some((run, dwells))
    }

    /// How often it rests.
    pub fn rests(&self) -> usize {
        self.at_rest().map_or(0, |(_, dwells)| dwells.len())
    }

    /// What gravity shows of the accelerometers, which are then guessed so.
    pub fn gravity(&mut self) -> Option<Gravity> {
        let (_, dwells) = self.at_rest()?;
        let rows = &self.rows.accel;
        let at_rest: Vec<_> = dwells
            .iter()
            .map(|of| mean(&rows[of.samples.clone()]))
            .collect();
        let size = |zero: &Vector3<f64>| {
            median(
                &mut at_rest
                    .iter()
                    .map(|rest| (rest - zero).norm())
                    .collect::<Vec<_>>(),
            )
        };
        let own_zero = centre(&at_rest).filter(|(zero, sigma)| {
            let about_zero = size(zero).unwrap_or(0.0) * ABOUT_ZERO / STANDARD_GRAVITY;
            let beyond = zero.norm_squared() / about_zero.powi(2);
            *sigma < about_zero && beyond > chi_square_limit(3.0, FALSE_ALARM)
        });
        self.guess.zero = own_zero.map_or(Vector3::zeros(), |(zero, _)| zero);
        self.guess.unit.accel =
            STANDARD_GRAVITY / size(&self.guess.zero).filter(|size| *size > 0.0)?;
        // Of gyros that may be wrong nothing is asked: a move is unknown.
        let moves = dwells.iter().map(|dwell| dwell.samples.end);
        let breaks: Vec<usize> = self.breaks.iter().copied().chain(moves).collect();
        let run = self.run(&self.guess, &breaks)?;
        let estimate = calibrated(&run)?;
        let unit = self.guess.unit.accel;
        let axes = Axes::of(&estimate, Sensor::Accel, STANDARD_GRAVITY / unit, 0.0);
        let zero = self.guess.zero + estimate.triads.accel.bias / unit;
        let sigma = estimate.sigma();
        let zero_sigma = (0..3).map(|axis| sigma[parameter(Sensor::Accel, BIAS + axis)]);
        Some(Gravity {
            zero_sigma: zero_sigma.fold(0.0, f64::max) / unit,
            own_zero: own_zero.map(|_| zero),
            rests: dwells.len(),
            axes,
        })
    }

    /// How the gyros turn gravity from dwell to dwell; `None` if this does not single out one axis order and scale.
    pub fn turns(&mut self) -> Option<Turns> {
        let (run, dwells) = self.at_rest()?;
        let options = Options::default().noise(NoisePolicy::Stated);
        let problem = Problem::new(&run, &options);
        let reach = (SEARCHED.ln() / STEP.ln()).ceil() as i32;
        let mut tried = Vec::new();
        for k in -reach..=reach {
            let mut guess = self.guess.clone();
            guess.unit.gyro *= STEP.powi(k);
            let run = self.run(&guess, &self.breaks)?;
            for (order, likelihood, none) in orders_of_gyros(&problem, &run) {
                tried.push((likelihood, none, order, guess.unit.gyro));
            }
        }
        let &(most, none, order, unit) = tried.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let is_same = |unit: f64, other: f64| (SAME.recip()..SAME).contains(&(other / unit));
        let rivals = tried
            .iter()
            .filter(|of| of.2 != order || !is_same(unit, of.3));
        let rival = rivals.map(|of| of.0).fold(f64::NEG_INFINITY, f64::max);
        if most < none || most < rival + TOLD_APART.ln() {
            return None;
        }
        (self.guess.order, self.guess.unit.gyro) = (order, unit);
        let estimate = calibrated(&self.run(&self.guess, &self.breaks)?)?;
        let mut axes = Axes::of(
            &estimate,
            Sensor::Gyro,
            (unit * self.period_of_log).recip(),
            LINEAR,
        );
        let found = Vector3::from_fn(|axis, _| order.sign(axis) * axes.scale[axis]);
        axes.scale = found;
        Some(Turns {
            columns: order.source,
            axes,
            moves: dwells.len().saturating_sub(1),
        })
    }
}

impl Axes {
    /// Of a triad whose guessed scale was this, and of which this part is not straight.
    fn of(estimate: &Estimate, sensor: Sensor, guessed: f64, linear: f64) -> Self {
        let found = estimate.triads.get(sensor).scale;
        let sigma = estimate.sigma();
        let sigma = Vector3::from_fn(|axis, _| sigma[parameter(sensor, axis)].max(f64::EPSILON));
        let weight = sigma.map(|sigma| sigma.powi(-2));
        let common = weight.dot(&found) / weight.sum();
        let is_another = |axis: usize| {
            (found[axis] / common - 1.0).abs() > (2.0 * TOLERANCE).max(3.0 * sigma[axis])
        };
        let by_axis = (0..3).any(is_another);
        let scatter = weight.dot(&found.map(|scale| (scale - common).powi(2))) / weight.sum();
        Self {
            scale: match by_axis {
                true => found * guessed,
                false => Vector3::repeat(common * guessed),
            },
            sigma: (linear.powi(2) + weight.sum().recip() + scatter / 3.0).sqrt(),
            by_axis,
        }
    }
}

fn calibrated(run: &Run) -> Option<Estimate> {
    let options = Options::default().noise(NoisePolicy::Stated);
    let closed_form = six_position(&Problem::new(run, &options)).ok()?;
    Some(closed_form.estimate)
}

/// Stretches of samples between breaks, each of which costs a sample.
fn stretches(count: usize, breaks: &[usize], period: f64) -> Vec<Stretch> {
    let lost = |&row: &usize| Fault {
        kind: FaultKind::Missing,
        axis: None,
        samples: row..row + 1,
        line: 0,
        bridged: false,
    };
    let within = breaks.iter().filter(|row| **row < count);
    let lost: Vec<Fault> = within.map(lost).collect();
    stretches_between(count, 0.0, period, &lost)
}

/// Centre of the sphere on which points lie, by `|a|² = 2 b·a + c`, with its largest σ; `None` if they lie in a plane.
fn centre(points: &[Vector3<f64>]) -> Option<(Vector3<f64>, f64)> {
    let middle = mean(points);
    let (mut information, mut right) = (SMatrix::<f64, 4, 4>::zeros(), SVector::<f64, 4>::zeros());
    for point in points {
        let from = point - middle;
        let row = (2.0 * from).push(1.0);
        information += row * row.transpose();
        right += row * from.norm_squared();
    }
    let covariance = information.cholesky()?.inverse();
    let solved = covariance * right;
    let centre = solved.xyz();
    let size = (solved.w + centre.norm_squared()).sqrt();
    let off = points
        .iter()
        .map(|point| (point - middle - centre).norm() - size);
    let scatter = off.map(|off| off * off).sum::<f64>() / (points.len() as f64 - 4.0).max(1.0);
    let sigma = 2.0 * size * (PART * size).hypot(scatter.sqrt());
    let sigma = sigma
        * (0..3)
            .map(|axis| covariance[(axis, axis)])
            .fold(0.0, f64::max)
            .sqrt();
    (sigma.is_finite()).then_some((middle + centre, sigma))
}

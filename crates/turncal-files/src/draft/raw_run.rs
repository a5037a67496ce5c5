//! Rows of an almost unknown instrument as a run: dwells, axis likelihood and closed form, as for any run, give zero,
//! scale, signs and axis order.

use nalgebra::{SMatrix, SVector, Vector3};

use super::motion::{Motion, TOLERANCE, mean, means};
use super::raw_samples::RawSamples;
use turncal::calibration::{
    Estimate, NoisePolicy, Options, Problem, orders_of_gyros, parameter, six_position,
};
use turncal::earth::Site;
use turncal::imu::{
    AxisOrder, GaussMarkov, Instrument, Noise, PARAMETERS, PerSensor, Prior, Sensor,
};
use turncal::noise::white_noise;
use turncal::recording::{Fault, FaultKind, Recording, Stretch, stretches_between};
use turncal::run::{Aiding, Dwell, Run};
use turncal::statistics::{FALSE_ALARM, chi_square_limit, median, median_of_axes};
use turncal::units::{DEGREE, STANDARD_GRAVITY};

/// Index of the biases among the parameters of a triad.
const BIAS: usize = PARAMETERS - 3;
/// Row period of the run, s, if that of the log is shorter.
const ROW: f64 = 0.02;
/// A run needs longer dwells than a hand makes, so time is stretched by this factor, which has no other effect.
const SLOWED: f64 = 2.0;
/// Relative 1σ of an unknown scale …
const ANY_SCALE: f64 = 0.5;
/// … and 1σ of the axes of one chip, rad.
const ASKEW: f64 = 2.0 * DEGREE;
/// 1σ of the zero of a register with nominal zero, m/s² …
const ABOUT_ZERO: f64 = 1.0;
/// … and for gyros, rad/s, from their output at rest.
const ANY_RATE: f64 = 10.0;
/// Relative accuracy of gravity at rest, given nonlinearity and drift of raw output.
const PART: f64 = 1e-3;
/// Correlation time of output drift, s.
const WANDERS: f64 = 1.0;
/// 1σ nonlinearity of a chip from data sheets (MPU-6050, section 6.1: 0.2 %): a scale found at large rates differs at
/// small ones.
const LINEAR: f64 = 2e-3;
/// The first guess of the gyro rotation may be wrong by this factor, because a hand shakes more than it turns …
const SEARCHED: f64 = 8.0;
/// … successive trials differ by this factor …
const STEP: f64 = 1.1;
/// … and those within this factor are equal.
const SAME: f64 = 1.25;
/// Other axes and scales are this many times less likely.
const TOLD_APART: f64 = 1e3;

/// Response of the axes of a triad to rotation or gravity.
#[derive(Debug, Clone, PartialEq)]
pub struct Axes {
    /// Quantity of the file per row for one rad per row (negative if reversed) or for one g.
    pub scale: Vector3<f64>,
    /// Relative σ of the common part.
    pub sigma: f64,
    /// Whether they differ by more than the axes of one chip.
    pub by_axis: bool,
}

/// Accelerometer parameters from gravity at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Gravity {
    /// Zero of the axes, in the quantity of the file per row, if it is not the nominal one.
    pub own_zero: Option<Vector3<f64>>,
    /// Its largest σ.
    pub zero_sigma: f64,
    pub axes: Axes,
    /// Number of dwells used.
    pub rests: usize,
}

/// Relation of gyro columns to accelerometer columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Turns {
    /// For each accelerometer axis, the gyro column about it.
    pub columns: [usize; 3],
    pub axes: Axes,
    pub moves: usize,
}

impl Turns {
    /// Angle in rad per unit in one row, if all axes have the same sign.
    pub fn angle(&self) -> Option<f64> {
        let scale = self.axes.scale;
        let size = scale.abs().map(f64::ln).mean().exp().recip();
        let sign = scale.map(f64::signum);
        (self.columns == [0, 1, 2] && sign.min() == sign.max()).then_some(size * sign.x)
    }

    /// Whether the columns have the order and signs of the accelerometers.
    pub fn agree(&self) -> bool {
        self.columns == [0, 1, 2] && self.axes.scale.min() > 0.0
    }
}

/// Assumed instrument.
#[derive(Debug, Clone)]
struct Guess {
    /// rad/s and m/s² per quantity of the file per row.
    unit: PerSensor<f64>,
    /// Accelerometer zero.
    zero: Vector3<f64>,
    /// Assignment of gyro columns to its axes.
    order: AxisOrder,
}

/// Rows of both triads, and breaks between them.
#[derive(Clone)]
pub struct RawRun {
    rows: PerSensor<Vec<Vector3<f64>>>,
    /// Row period by its clock, s.
    period: f64,
    /// Row period of the log.
    period_of_log: f64,
    is_whole: PerSensor<bool>,
    breaks: Vec<usize>,
    guess: Guess,
}

impl RawRun {
    /// From the rows of a log, with `breaks` before some of them.
    pub fn new(of_log: &RawSamples, breaks: &[usize], motion: &Motion) -> Self {
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

    /// The same with a separate gyro zero in each stretch.
    pub fn of_sections(mut self) -> Self {
        for stretch in stretches(self.rows.gyro.len(), &self.breaks, self.period) {
            let rows = &mut self.rows.gyro[stretch.samples];
            let zero = median_of_axes(rows).unwrap_or_default();
            rows.iter_mut().for_each(|row| *row -= zero);
        }
        self
    }

    /// The run with this instrument, with unknown moves at breaks.
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
        let prior = PerSensor::from_fn(|sensor: Sensor| Prior {
            scale_sigma: Vector3::repeat(ANY_SCALE),
            installation_sigma: Vector3::repeat(ASKEW),
            bias: Vector3::zeros(),
            bias_sigma: Vector3::repeat(sensor.pick(ANY_RATE, ABOUT_ZERO)),
        });
        let site = Site::unknown().with_gravity(STANDARD_GRAVITY, 0.0);
        Some(Run::new(recording, Instrument::new(prior, noise), site))
    }

    /// The guessed run, with its dwells, where the gravity direction is constant.
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

    /// Number of dwells.
    pub fn rests(&self) -> usize {
        self.at_rest().map_or(0, |(_, dwells)| dwells.len())
    }

    /// Accelerometer parameters from gravity, which become the guess.
    pub fn gravity(&mut self) -> Option<Gravity> {
        let (_, dwells) = self.at_rest()?;
        let rows = &self.rows.accel;
        let at_rest = dwells.iter().map(|of| mean(&rows[of.samples.clone()]));
        let at_rest: Vec<_> = at_rest.collect();
        let size = |zero: &Vector3<f64>| {
            let sizes = at_rest.iter().map(|rest| (rest - zero).norm());
            median(&mut sizes.collect::<Vec<_>>())
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

    /// Gyro axes and scale from the rotation of gravity between dwells; `None` if not unique.
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
        let mut rivals = tried.clone();
        rivals.retain(|of| of.2 != order || !is_same(unit, of.3));
        let rival = rivals
            .iter()
            .map(|of| of.0)
            .fold(f64::NEG_INFINITY, f64::max);
        if most < none || most < rival + TOLD_APART.ln() {
            return None;
        }
        (self.guess.order, self.guess.unit.gyro) = (order, unit);
        let estimate = calibrated(&self.run(&self.guess, &self.breaks)?)?;
        let guessed = (unit * self.period_of_log).recip();
        let mut axes = Axes::of(&estimate, Sensor::Gyro, guessed, LINEAR);
        axes.scale = Vector3::from_fn(|axis, _| order.sign(axis) * axes.scale[axis]);
        Some(Turns {
            columns: order.source,
            axes,
            moves: dwells.len().saturating_sub(1),
        })
    }
}

impl Axes {
    /// For a triad with this guessed scale and this nonlinearity.
    fn of(estimate: &Estimate, sensor: Sensor, guessed: f64, linear: f64) -> Self {
        let found = estimate.triads.get(sensor).scale;
        let sigma = estimate.sigma();
        let sigma = Vector3::from_fn(|axis, _| sigma[parameter(sensor, axis)].max(f64::EPSILON));
        let weight = sigma.map(|sigma| sigma.powi(-2));
        let common = weight.dot(&found) / weight.sum();
        let off = found.map(|scale| (scale / common - 1.0).abs());
        let by_axis = (0..3).any(|axis| off[axis] > (2.0 * TOLERANCE).max(3.0 * sigma[axis]));
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

/// Sample ranges between breaks; each break costs a sample.
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

/// Centre of the sphere through the points, from `|a|² = 2 b·a + c`, with its largest σ; `None` if they lie in a plane.
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
    let off = points.iter().map(|of| (of - middle - centre).norm() - size);
    let scatter = off.map(|off| off * off).sum::<f64>() / (points.len() as f64 - 4.0).max(1.0);
    let largest = covariance.diagonal().xyz().max();
    let sigma = 2.0 * size * (PART * size).hypot(scatter.sqrt()) * largest.max(0.0).sqrt();
    (sigma.is_finite()).then_some((middle + centre, sigma))
}

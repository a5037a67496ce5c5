//! The table that every format reads: a calibration, its run, and all values along the axes of the format.

use nalgebra::{Matrix3, Vector3};

use crate::unit_scale;
use turncal::calibration::model::usual_variation;
use turncal::calibration::result::{Calibration, TriadRecord};
use turncal::calibration::{Correction, CorrectionError, Source};
use turncal::imu::{AXES, AxisOrder, GaussMarkov, Noise, PerSensor, Sensor, Term};
use turncal::run::Run;

/// Orders of the temperature polynomials that autopilots support.
pub const ORDERS: usize = 3;

/// Axes along which the values of a format are given.
#[derive(Debug, Clone, Copy)]
pub enum Axes {
    RightFrontUp,
    FrontRightDown,
    /// Axes of the log of the run or, without a run, right, front and up.
    Log,
}

/// All values of a calibration and, optionally, of a run of its instrument.
pub struct Values<'a> {
    pub record: &'a Calibration,
    /// Correction matrix in the unit of the calibration file, along the right, front and up axes.
    pub correction: Correction,
    /// Axis order from the axes of the format to right, front, up.
    pub order: AxisOrder,
    /// Triads along the axes of the format.
    pub triads: PerSensor<Normalised>,
    /// Gyro output per unit of specific force, along the axes of the format.
    pub g_sensitivity: Matrix3<f64>,
    /// Sample rate of the run or, without a run, of the calibration's own recording, in Hz.
    pub rate: Option<f64>,
}

/// A triad in rad/s or m/s²: `n = sensitivity u + bias`, `u = inverse (n − bias)`, with `n = N / nominal`.
pub struct Normalised {
    /// Divisor of the file's quantity per second, axis by axis.
    pub nominal: Vector3<f64>,
    pub sensitivity: Matrix3<f64>,
    pub inverse: Matrix3<f64>,
    pub bias: Vector3<f64>,
    /// 1σ of the scale factors of n; `None` if the calibration file states none.
    pub scale_sigma: Option<Vector3<f64>>,
    /// 1σ of the bias in n.
    pub bias_sigma: Option<Vector3<f64>>,
    /// Coefficients of powers 1 to 3 of the bias about the reference temperature, axis by axis, in n per °C, °C², °C³.
    pub bias_powers: [[f64; ORDERS]; 3],
    /// Noise of the instrument, if it is known and its white noise is greater than zero.
    pub noise: Option<Noise>,
}

impl<'a> Values<'a> {
    /// The values for a format. Without a run, the unit gives the nominal scale; for counts, the nominal scale is the
    /// calibrated scale factors rounded to three digits.
    pub fn new(
        record: &'a Calibration,
        run: Option<&Run>,
        axes: Axes,
    ) -> Result<Self, CorrectionError> {
        let correction = match run {
            Some(run) => Correction::for_run(record, run)?,
            None => Correction::of_record(record)?,
        };
        let log = run.and_then(|run| run.recording.imu.log.as_ref());
        let order = match axes {
            Axes::RightFrontUp => AxisOrder::IDENTITY,
            Axes::FrontRightDown => AxisOrder::FRONT_RIGHT_DOWN,
            Axes::Log => log.map_or(AxisOrder::IDENTITY, |log| log.named.axes),
        };
        let of_record = record.provenance.as_ref().map(|from| from.rate_hz);
        let rate = run
            .map(|run| run.recording.imu.period.recip())
            .or(of_record);
        let turn = order.matrix();
        let q = Term::GSensitivity.parameters().start;
        let g_sensitivity = Matrix3::from_fn(|i, j| correction.terms[q + 3 * i + j]);
        Ok(Self {
            triads: PerSensor::from_fn(|sensor| {
                Normalised::new(record, &correction, run, &order, sensor)
            }),
            g_sensitivity: turn.transpose() * g_sensitivity * turn,
            rate: rate.filter(|rate| *rate > 0.0),
            record,
            correction,
            order,
        })
    }

    /// The unit of `N`. A count may be a unit of rate or, per second, a unit of increment; the calibration file does
    /// not distinguish the two cases.
    pub fn unit(&self, sensor: Sensor) -> String {
        let unit = self.record.unit.as_ref();
        match unit.map(|unit| unit.get(sensor).as_str()) {
            None => "an unnamed unit".to_owned(),
            Some(unit @ ("rad" | "deg" | "arcsec" | "m/s" | "g*s")) => format!("{unit}/s"),
            Some(unit) => unit.to_owned(),
        }
    }

    /// The unit of `u`.
    pub fn input(sensor: Sensor) -> &'static str {
        sensor.pick("rad/s", "m/s^2")
    }

    /// 1σ of the parameters of a triad, in the unit of the calibration file.
    pub fn sigma(&self, sensor: Sensor) -> Option<&TriadRecord> {
        Some(self.record.sigma.as_ref()?.get(sensor))
    }

    /// Remark on the omission of these keys; `None` if no key is omitted.
    pub fn missing(keys: &[String], program: &str) -> Option<String> {
        let keys = (!keys.is_empty()).then(|| keys.join(", "))?;
        Some(format!(
            "{keys}: {program} does not start without these keys; export with --run RUN.toml, or measure the noise \
             with `turncal allan`"
        ))
    }
}

impl Normalised {
    fn new(
        record: &Calibration,
        correction: &Correction,
        run: Option<&Run>,
        order: &AxisOrder,
        sensor: Sensor,
    ) -> Self {
        let of_unit = correction.sensitivity.get(sensor);
        let unit = record.unit.as_ref().map(|unit| unit.get(sensor));
        let nominal = match (run, unit.and_then(|unit| unit_scale(sensor, unit))) {
            (Some(run), _) => run.instrument.nominal.get(sensor).0,
            (None, Some(scale)) => Vector3::repeat(scale),
            (None, None) => Vector3::from_fn(|i, _| {
                let scale = of_unit.row(i).norm().copysign(of_unit[(i, i)]);
                format!("{scale:.2e}").parse().unwrap_or(scale)
            }),
        };
        let turn = order.matrix();
        let back = order.inverse();
        let bias = correction.bias.get(sensor).component_div(&nominal);
        let sensitivity = Matrix3::from_fn(|i, j| of_unit[(i, j)] / nominal[i]);
        let sensitivity = turn.transpose() * sensitivity * turn;
        let nominal = back.each(nominal);
        let sigma = record.sigma.as_ref().map(|sigma| sigma.get(sensor));
        let in_n = |sigma: [f64; 3]| back.each(sigma.into()).component_div(&nominal.abs());
        let powers = record.temperature.as_ref().map(|thermal| &thermal.powers);
        let bias_powers = std::array::from_fn(|axis| {
            let name = format!("{}.bias.{}", sensor.name(), AXES[back.source[axis]]);
            let of_axis = powers.and_then(|powers| powers.get(&name));
            let power = |k| of_axis.and_then(|of| of.get(k)).copied().unwrap_or(0.0);
            std::array::from_fn(|k| back.sign(axis) * power(k) / nominal[axis])
        });
        Self {
            // An exportable calibration has an inverse.
            inverse: sensitivity.try_inverse().unwrap_or_else(Matrix3::identity),
            sensitivity,
            bias: turn.transpose() * bias,
            scale_sigma: sigma.map(|sigma| in_n(sigma.scale)),
            bias_sigma: sigma.map(|sigma| in_n(sigma.bias)),
            nominal,
            bias_powers,
            noise: noise(record, run, sensor),
        }
    }

    /// White noise density, rad/√s or (m/s)/√s.
    pub fn density(&self) -> Option<f64> {
        Some(self.noise?.random_walk)
    }

    /// Bias variation, and whether it is only the value that is usual for this white noise.
    pub fn varying(&self) -> Option<(GaussMarkov, bool)> {
        let noise = self.noise?;
        let usual = || (usual_variation(&noise), true);
        Some(noise.gauss_markov.map_or_else(usual, |bias| (bias, false)))
    }
}

/// The noise of the run. A figure that the calibration refuted, or that no run states, is replaced by the estimate of
/// the calibration.
fn noise(record: &Calibration, run: Option<&Run>, sensor: Sensor) -> Option<Noise> {
    let mut noise = run.map_or_else(Noise::default, |run| *run.instrument.noise.get(sensor));
    let report = record.noise.as_ref().map(|noise| &noise.report);
    let estimated = |source: Source, stated: f64| {
        let sources = &report.filter(|report| report.learnt)?.sources;
        let figures = sources.iter().find(|of| of.source == source)?;
        let unit = source.unit().1;
        let agrees = |[low, high]: [f64; 2]| (low..=high).contains(&(stated / unit));
        let is_used = figures.used > 0.0 && !figures.interval.is_some_and(agrees);
        is_used.then_some(figures.used * unit)
    };
    let (white, varying) = sensor.pick(
        (Source::AngleRandomWalk, Source::GyroGaussMarkov),
        (Source::VelocityRandomWalk, Source::AccelGaussMarkov),
    );
    noise.random_walk = estimated(white, noise.random_walk).unwrap_or(noise.random_walk);
    let stated = noise.gauss_markov;
    let usual = stated.unwrap_or_else(|| usual_variation(&noise));
    let sigma = estimated(varying, stated.map_or(0.0, |bias| bias.sigma));
    noise.gauss_markov = sigma.map(|sigma| GaussMarkov { sigma, ..usual }).or(stated);
    Some(noise).filter(|noise| noise.random_walk > 0.0)
}

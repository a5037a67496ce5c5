//! Scales from data sheets and from a recording.

use nalgebra::Vector3;

use crate::draft::motion::TOLERANCE;
use crate::draft::name::Unit;
use crate::draft::raw_run::{Axes, Gravity};
use crate::unit_scale;
use turncal::imu::{Output, Sensor};
use turncal::number::rounded;
use turncal::units::{DEGREE, STANDARD_GRAVITY};

/// Data-sheet values for counts per degree per second …
const PER_DEGREE: [f64; 17] = [
    131.0, 65.5, 32.8, 16.4, 262.144, 14.375, 114.29, 57.14, 28.57, 14.29, 160.0, 100.0, 80.0,
    50.0, 40.0, 20.0, 10.0,
];
/// … and per g, in addition to powers of two.
const PER_G: [f64; 11] = [
    256_000.0, 128_000.0, 64_000.0, 4000.0, 2000.0, 1250.0, 1200.0, 1000.0, 800.0, 500.0, 250.0,
];

/// Counts per unit of `run.toml`, with the reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// The file's quantity per second for one rad/s or m/s².
    pub value: Vector3<f64>,
    /// Its relative uncertainty from the recording.
    pub off: f64,
    /// Whether the file names the unit.
    pub is_named: bool,
    pub why: String,
}

impl Scale {
    /// For a named unit that is a multiple of one in `run.toml`.
    pub fn of_unit(sensor: Sensor, unit: Unit) -> Option<Self> {
        let of_one = unit_scale(sensor, unit.word).filter(|_| unit.times != 1.0)?;
        let times = rounded(unit.times, 4);
        Some(Self {
            value: Vector3::repeat(of_one / unit.times),
            off: 0.0,
            is_named: true,
            why: format!("1 unit of the file is {times} {}", unit.word),
        })
    }

    /// Scale of the accelerometers' axes from gravity at rest, for this number of rows per second.
    pub fn of_gravity(gravity: &Gravity, per_second: f64) -> Self {
        let Axes { scale, sigma, .. } = gravity.axes;
        let is_sure = sigma < TOLERANCE;
        let mut by = match gravity.rests {
            1 => " in one dwell".to_owned(),
            rests => format!(" ± {} %, from gravity in {rests} dwells", percent(sigma)),
        };
        if !is_sure {
            by += ", if the zero offset is zero, which too few directions of gravity can verify";
        }
        let often = likely_for_g((scale * per_second).mean());
        let often = if is_sure { String::new() } else { often + ": " };
        // Zeros that are not known leave room for any figure.
        let others = if is_sure { &PER_G[..] } else { &[] };
        let sheet = |figure: f64| [&[2f64.powf(figure.log2().round())], others].concat();
        let one = ("g", STANDARD_GRAVITY);
        Self::measured(&gravity.axes, per_second, one, sheet, [&by, &often])
    }

    /// Scale of the gyro axes from their rotation, for rows of this length in s (one for increments), over this many
    /// moves or, with a common scale, from step to step.
    pub fn of_turns(axes: &Axes, moves: Option<usize>, row: f64, output: Output) -> Self {
        let by = match moves {
            Some(moves) => {
                let sigma = percent(axes.sigma);
                format!(" ± {sigma} %, from the change of gravity direction in {moves} moves")
            }
            None => " , from the change of gravity direction".to_owned(),
        };
        // Pulses are made as each instrument makes them.
        let sheet = |_| match output {
            Output::Rate => PER_DEGREE.to_vec(),
            Output::Pulse | Output::Increment => Vec::new(),
        };
        Self::measured(axes, row * DEGREE, ("deg/s", DEGREE), sheet, [&by, ""])
    }

    /// Data-sheet values if close enough, otherwise measured values.
    fn measured(
        axes: &Axes,
        times: f64,
        (of, one): (&str, f64),
        sheet: impl Fn(f64) -> Vec<f64>,
        [by, often]: [&str; 2],
    ) -> Self {
        let sizes = times * axes.scale.abs();
        let sizes = if axes.by_axis {
            sizes
        } else {
            Vector3::repeat(sizes.map(f64::ln).mean().exp())
        };
        let stated = sizes.map(|size| nearest(&sheet(size), size).unwrap_or(f64::NAN));
        let is_stated = !stated.iter().any(|stated| stated.is_nan());
        let plain = sizes.map(|size| rounded(size, 4));
        let (value, least) = if is_stated {
            (stated, 0.0)
        } else {
            (plain, 2.0 * axes.sigma)
        };
        let off = value.component_div(&sizes).add_scalar(-1.0).amax();
        let [words, measured] = [value, plain].map(|figures| axes.words(&figures));
        Self {
            off: off.max(least),
            is_named: false,
            why: if is_stated {
                format!("{words} counts per {of}; measured {measured}{by}")
            } else {
                format!("{measured} counts per {of}{by}; {often}prefer the data-sheet value")
            },
            value: value.zip_map(&axes.scale, f64::copysign) / one,
        }
    }
}

impl Axes {
    /// One figure if all axes are equal.
    fn words(&self, figures: &Vector3<f64>) -> String {
        let [x, y, z] = <[f64; 3]>::from(*figures);
        match self.by_axis {
            true => format!("{x}, {y} and {z}"),
            false => x.to_string(),
        }
    }
}

fn percent(part: f64) -> f64 {
    rounded(100.0 * part, 2)
}

/// The data-sheet value nearest to a measured figure, if within tolerance.
fn nearest(sheet: &[f64], measured: f64) -> Option<f64> {
    let off = |stated: &f64| (stated / measured - 1.0).abs();
    let nearest = sheet.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    nearest.copied().filter(|stated| off(stated) < TOLERANCE)
}

/// Typical counts per g for a register with this output and an unknown zero.
pub fn likely_for_g(per_g: f64) -> String {
    let power = 2f64.powf(per_g.log2().floor());
    let next = 2.0 * power;
    format!("typical values are {power} and {next} counts per g")
}

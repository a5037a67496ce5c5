//! Scales as data sheets state them, and as a record shows them.

use nalgebra::Vector3;

use super::axes::Axes;
use super::gravity::Gravity;
use super::name::Unit;
use super::rests::TOLERANCE;
use super::units::short;
use crate::formats::unit_scale;
use crate::imu::{Output, Sensor};
use crate::units::{DEGREE, STANDARD_GRAVITY};

/// Counts for a degree a second that data sheets state …
const PER_DEGREE: [f64; 17] = [
    131.0, 65.5, 32.8, 16.4, 262.144, 14.375, 114.29, 57.14, 28.57, 14.29, 160.0, 100.0, 80.0,
    50.0, 40.0, 20.0, 10.0,
];
/// … and for one g, beside powers of two.
const PER_G: [f64; 11] = [
    256_000.0, 128_000.0, 64_000.0, 4000.0, 2000.0, 1250.0, 1200.0, 1000.0, 800.0, 500.0, 250.0,
];

/// Counts for one of `run.toml`'s units, with the reason.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    /// The file's quantity per second for one rad/s or m/s².
    pub value: Vector3<f64>,
    /// What it may be off by, relative, as far as the record shows.
    pub off: f64,
    /// Whether the file names the unit.
    pub is_named: bool,
    pub why: String,
}

impl Scale {
    /// Of a unit that the file names and that is another number of one of `run.toml`'s.
    pub fn of_unit(sensor: Sensor, unit: Unit) -> Option<Self> {
        let of_one = unit_scale(sensor, unit.word).filter(|_| unit.times != 1.0)?;
        Some(Self {
            value: Vector3::repeat(of_one / unit.times),
            off: 0.0,
            is_named: true,
            why: format!("one is {} {}, as the file says", unit.times, unit.word),
        })
    }

    /// Of the accelerometers' axes by gravity at rest, in the file's quantity per second for one m/s².
    pub fn of_gravity(gravity: &Gravity, per_second: f64) -> Self {
        let scale = gravity.scale * per_second;
        let found = Chosen::new(scale, gravity.sigma, gravity.by_axis, powers_and(&PER_G));
        let sure = gravity.sigma < TOLERANCE;
        let mut why = match gravity.rests {
            1 => format!("{} at rest", listed(&scale, gravity.by_axis)),
            rests => format!(
                "{} ± {} % by gravity at {rests} rests",
                listed(&scale, gravity.by_axis),
                percent(gravity.sigma)
            ),
        };
        if !sure {
            why += ", if it says nothing at zero: gravity lies in too few directions to show that";
        }
        if found.of_sheet {
            why = format!("{} counts for one g; {why}", found.words());
        } else if sure {
            why = format!("for one g {why}; the data sheet knows better");
        } else {
            let often = likely_for_g(scale.mean());
            why = format!("for one g {why}; {often}: the data sheet knows better");
        }
        Self {
            value: found.value / STANDARD_GRAVITY,
            off: found.off,
            is_named: false,
            why,
        }
    }

    /// Of the gyros' axes by what they turn, in the file's quantity per second for one rad/s.
    pub fn of_axes(axes: &Axes, row: f64, output: Output) -> Self {
        let by = format!(
            " ± {} % by the turns of gravity over {} moves",
            percent(axes.sigma),
            axes.moves
        );
        Self::of_turns(axes.scale * row, axes.sigma, axes.by_axis, output, &by)
    }

    /// Of one scale that gravity's direction shows from step to step.
    pub fn of_steps(scale: f64, output: Output) -> Self {
        let by = " by the turns of gravity";
        Self::of_turns(Vector3::repeat(scale), TOLERANCE, false, output, by)
    }

    fn of_turns(scale: Vector3<f64>, sigma: f64, by_axis: bool, output: Output, by: &str) -> Self {
        let per_degree = scale * DEGREE;
        // Pulses are made as each instrument makes them.
        let sheet = if output == Output::Rate {
            &PER_DEGREE[..]
        } else {
            &[]
        };
        let found = Chosen::new(per_degree, sigma, by_axis, |_| sheet.to_vec());
        let measured = listed(&per_degree.abs(), by_axis);
        let why = if found.of_sheet {
            format!("{} counts for 1 deg/s; {measured}{by}", found.words())
        } else {
            format!("for 1 deg/s {measured}{by}; the data sheet knows better")
        };
        Self {
            value: found.value / DEGREE,
            off: found.off,
            is_named: false,
            why,
        }
    }
}

/// The figures of data sheets where they are as near as sheets allow, else those of the record.
struct Chosen {
    value: Vector3<f64>,
    of_sheet: bool,
    off: f64,
    by_axis: bool,
}

impl Chosen {
    fn new(
        measured: Vector3<f64>,
        sigma: f64,
        by_axis: bool,
        sheet: impl Fn(f64) -> Vec<f64>,
    ) -> Self {
        let common = measured.abs().map(f64::ln).mean().exp();
        let figure = |axis: usize| {
            if by_axis {
                measured[axis].abs()
            } else {
                common
            }
        };
        let stated = |axis: usize| nearest(&sheet(figure(axis)), figure(axis));
        let of_sheet = (0..3).all(|axis| stated(axis).is_some());
        let value = Vector3::from_fn(|axis, _| {
            let size = stated(axis).filter(|_| of_sheet);
            size.unwrap_or_else(|| short(figure(axis)))
                .copysign(measured[axis])
        });
        let off = (0..3).map(|axis| (value[axis].abs() / figure(axis) - 1.0).abs());
        let off = off.fold(0.0, f64::max);
        Self {
            value,
            of_sheet,
            off: if of_sheet { off } else { off.max(2.0 * sigma) },
            by_axis,
        }
    }

    fn words(&self) -> String {
        let sizes = self.value.abs();
        if self.by_axis {
            return listed(&sizes, true);
        }
        sizes.x.to_string()
    }
}

fn listed(figures: &Vector3<f64>, by_axis: bool) -> String {
    if by_axis {
        let [x, y, z] = <[f64; 3]>::from(*figures).map(short);
        format!("{x}, {y} and {z}")
    } else {
        short(figures.map(f64::ln).mean().exp()).to_string()
    }
}

fn percent(part: f64) -> f64 {
    format!("{:.1e}", 100.0 * part).parse().unwrap_or(part)
}

/// What a data sheet states nearest to a measured figure, if it is as near as sheets allow.
fn nearest(sheet: &[f64], measured: f64) -> Option<f64> {
    let off = |stated: &f64| (stated / measured - 1.0).abs();
    let nearest = sheet.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    nearest.copied().filter(|stated| off(stated) < TOLERANCE)
}

/// Powers of two about a figure, then others.
fn powers_and(others: &[f64]) -> impl Fn(f64) -> Vec<f64> {
    move |figure| {
        let power = 2f64.powf(figure.log2().round());
        std::iter::once(power)
            .chain(others.iter().copied())
            .collect()
    }
}

/// What registers often say for one g that say this with a zero that is not known.
pub(super) fn likely_for_g(per_g: f64) -> String {
    let power = 2f64.powf(per_g.log2().floor());
    format!("often {power} or {} counts for one g", 2.0 * power)
}

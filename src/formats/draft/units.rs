//! What a row holds, and in which units.

use nalgebra::Vector3;

use super::columns::Columns;
use super::data_sheet::{Scale, likely_for_g};
use super::motion::Motion;
use super::name::{self, Name};
use super::registers::Registers;
use super::stated::Stated;
use super::time::{Clock, PERIODS};
use crate::formats::Sheet;
use crate::formats::quantity::{OUTPUTS, units};
use crate::imu::{Output, PerSensor, Sensor};
use crate::units::{ARCSEC, DEG_PER_H, DEGREE, STANDARD_GRAVITY};

/// Gravity at rest tells units that differ by more than this factor: raw sensors are off by tenths.
const GRAVITY_FACTOR: f64 = 1.25;
/// So do turns.
const TURN_FACTOR: f64 = 1.3;
/// Sums of pulses vary less than sums of readings by more than this factor.
const PULSE_SUMS: f64 = 0.5;
/// What is known of the unit of a triad.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Unit {
    /// The word for `run.toml`, if it is known.
    pub word: Option<&'static str>,
    pub why: String,
    /// Whether motion shows it, or the user states it.
    pub is_shown: bool,
    /// For counts, where something shows it …
    pub scale: Option<Scale>,
    /// … and what is likely where nothing does.
    pub likely: Option<String>,
}

/// What rows hold.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Quantities {
    pub output: Output,
    pub output_why: String,
    pub units: PerSensor<Unit>,
    /// Whether gyros and accelerometers turn opposite ways.
    pub opposed: bool,
}

impl Quantities {
    pub fn find(
        sheet: &Sheet,
        columns: &Columns,
        clock: &Clock,
        whole: PerSensor<bool>,
        motion: Option<&Motion>,
    ) -> Self {
        let mut found = Self {
            output: Output::Rate,
            output_why: "as most logs have it".to_owned(),
            units: PerSensor::default(),
            opposed: false,
        };
        let named = PerSensor::from_fn(|sensor| {
            let first = columns.triads.get(sensor).map(|triad| triad[0])?;
            Name::of(&sheet.names[first])
                .unit
                .or_else(|| name::unit(&sheet.units[first]))
        });
        let Some(motion) = motion else {
            "too few rows hold numbers to show it".clone_into(&mut found.units.gyro.why);
            found.units.accel.why.clone_from(&found.units.gyro.why);
            return found;
        };
        found.opposed = motion.angle.is_some_and(|angle| angle < 0.0);
        let period = clock.period;
        let words = PerSensor::from_fn(|sensor| named.get(sensor).map(|unit| unit.word));
        if !found.scaled(Sensor::Accel, named.accel, motion, period) {
            found.accelerometers(words.accel, whole.accel, motion, period);
        }
        if !found.scaled(Sensor::Gyro, named.gyro, motion, period) {
            found.gyros(words.gyro, whole.gyro, motion, period);
        }
        for sensor in Sensor::ALL {
            if columns.triads.get(sensor).is_none() {
                *found.units.get_mut(sensor) = Unit::default();
            }
        }
        found
    }

    /// Takes the units that the user states.
    pub fn state(&mut self, stated: &Stated) {
        let of = |sensor: &Sensor| match sensor {
            Sensor::Gyro => &stated.gyro_unit,
            Sensor::Accel => &stated.accel_unit,
        };
        for sensor in Sensor::ALL {
            let Some(word) = of(&sensor) else { continue };
            let known = OUTPUTS.into_iter().find_map(|(_, output)| {
                let mut words = units(sensor, output).iter();
                let (word, _) = words.find(|(known, _)| known == word)?;
                Some((*word, output))
            });
            if let Some((word, output)) = known {
                if word != "count" {
                    self.output = output;
                }
                let unit = self.units.get_mut(sensor);
                unit.word = Some(word);
                unit.is_shown = true;
                unit.why = "as stated".to_owned();
                unit.scale = unit.scale.take().filter(|_| word == "count");
            }
        }
    }

    /// Whether a triad holds counts of no known size.
    pub fn has_counts(&self) -> bool {
        Sensor::ALL.into_iter().any(|sensor| self.is_count(sensor))
    }

    pub fn is_count(&self, sensor: Sensor) -> bool {
        self.units.get(sensor).word == Some("count")
    }

    /// Takes in what the record shows of the registers behind its counts.
    pub fn of_registers(&mut self, found: &Registers, period: Option<f64>) {
        let per_second = self.per_second(period.unwrap_or(f64::NAN));
        let accel = &mut self.units.accel;
        if accel.word == Some("count") && accel.scale.as_ref().is_none_or(|of| !of.is_named) {
            accel.scale = found
                .gravity
                .as_ref()
                .filter(|_| per_second.is_finite())
                .map(|gravity| Scale::of_gravity(gravity, per_second));
        }
        let row = match self.output {
            Output::Rate => period.unwrap_or(f64::NAN),
            Output::Pulse | Output::Increment => 1.0,
        };
        let gyro = &mut self.units.gyro;
        let Some(axes) = found.axes.as_ref().filter(|_| row.is_finite()) else {
            return;
        };
        let is_named = gyro.scale.as_ref().is_some_and(|of| of.is_named);
        if gyro.word.is_none_or(|word| word == "count") && !is_named {
            if gyro.word.is_none() {
                gyro.word = Some("count");
                gyro.why = "no known unit fits the turns of gravity".to_owned();
            }
            let scale = Scale::of_axes(axes, row, self.output);
            gyro.scale = Some(scale);
            self.opposed = false;
        }
    }

    /// Rows to rates.
    pub fn per_second(&self, period: f64) -> f64 {
        match self.output {
            Output::Rate => 1.0,
            Output::Pulse | Output::Increment => period.recip(),
        }
    }

    /// The file's quantity per second for one rad/s or m/s², if it is known.
    pub fn scale(&self, sensor: Sensor) -> Option<f64> {
        let unit = self.units.get(sensor);
        unit.scale
            .as_ref()
            .map(|scale| scale.value.abs().mean())
            .or_else(|| crate::formats::unit_scale(sensor, unit.word?))
    }

    /// Takes a unit of which the file states how many of `run.toml`'s one is, unless motion contradicts it.
    fn scaled(
        &mut self,
        sensor: Sensor,
        named: Option<name::Unit>,
        motion: &Motion,
        period: Option<f64>,
    ) -> bool {
        let Some(scale) = named.and_then(|unit| Scale::of_unit(sensor, unit)) else {
            return false;
        };
        let of_one = scale.value.x;
        let factor = match sensor {
            Sensor::Accel => motion.gravity / (of_one * STANDARD_GRAVITY),
            Sensor::Gyro => {
                let turned = motion.angle.zip(period);
                turned.map_or(1.0, |(angle, period)| angle.abs() * of_one / period)
            }
        };
        if turns_fit(factor) {
            *self.units.get_mut(sensor) = Unit {
                word: Some("count"),
                why: "as the file says".to_owned(),
                is_shown: true,
                scale: Some(scale),
                likely: None,
            };
        }
        turns_fit(factor)
    }

    fn accelerometers(
        &mut self,
        named: Option<&'static str>,
        whole: bool,
        motion: &Motion,
        period: Option<f64>,
    ) {
        let Motion {
            gravity,
            sum_variance,
            ..
        } = *motion;
        let size = format!("{} at rest", short(gravity));
        let seconds = period.unwrap_or(f64::NAN);
        let known = [
            ("m/s^2", Output::Rate, STANDARD_GRAVITY),
            ("g", Output::Rate, 1.0),
            ("mg", Output::Rate, 1e3),
            ("m/s", Output::Increment, STANDARD_GRAVITY * seconds),
            ("g*s", Output::Increment, seconds),
        ];
        let fits = |expected: f64| {
            let factor = gravity / expected;
            factor < GRAVITY_FACTOR && factor > GRAVITY_FACTOR.recip()
        };
        let by_name = known.iter().find(|(unit, ..)| Some(*unit) == named);
        let by_size: Vec<_> = known
            .iter()
            .filter(|&&(.., expected)| fits(expected))
            .collect();
        let mut unit = Unit::default();
        match (by_name, by_size.first()) {
            (Some(&(name, _, expected)), Some(&&(word, output, _))) if !fits(expected) => {
                self.output = output;
                unit.word = Some(word);
                unit.why = format!("{size}, although the file says {name}");
            }
            (Some(&(word, output, expected)), _) => {
                self.output = output;
                unit.word = Some(word);
                unit.why = format!("as the file says; {size}");
                if !fits(expected) {
                    unit.why += &format!(", but gravity should be {}", short(expected));
                }
            }
            (None, Some(&&(word, output, _))) if !whole && named.is_none() => {
                self.output = output;
                unit.word = Some(word);
                unit.why = size;
                for (other, ..) in &by_size[1..] {
                    unit.why += &format!("; it may as well be {other}");
                }
            }
            _ => {
                let pulses = whole && sum_variance.is_some_and(|ratio| ratio < PULSE_SUMS);
                self.output = if pulses { Output::Pulse } else { Output::Rate };
                unit.word = Some("count");
                unit.why = why_count(whole, named, &format!("no known unit makes {size}"));
                let per_g = gravity * self.per_second(seconds);
                unit.likely = per_g.is_finite().then(|| likely_for_g(per_g));
            }
        }
        let shown = known.iter().find(|(word, ..)| Some(*word) == unit.word);
        unit.is_shown = shown.is_some_and(|&(.., expected)| fits(expected));
        self.units.accel = unit;
        self.output_why = output_why(self.output, seconds);
    }

    fn gyros(
        &mut self,
        named: Option<&'static str>,
        whole: bool,
        motion: &Motion,
        period: Option<f64>,
    ) {
        let (angle, is_turned) = (motion.angle.map(f64::abs), motion.is_turned);
        let seconds = period.unwrap_or(f64::NAN);
        let known = angle_units(self.output);
        let row = if self.output == Output::Rate {
            seconds
        } else {
            1.0
        };
        let turns = |unit: f64| {
            angle
                .map(|angle| angle / (unit * row))
                .filter(|f| f.is_finite())
        };
        let fits = |unit: f64| turns(unit).is_some_and(turns_fit);
        let by_name = known.iter().find(|(word, _)| Some(*word) == named);
        let by_turn = known.iter().find(|&&(_, unit)| fits(unit));
        // Without a clock each unit needs a period of its own.
        let unknown = angle.filter(|_| !row.is_finite() && !whole && named.is_none());
        // Counts per second for one rad/s: rows add up to the angle.
        let measured = angle
            .map(|angle| row / angle)
            .filter(|scale| scale.is_finite());
        let mut unit = Unit::default();
        match (by_name, by_turn) {
            (Some(&(name, value)), _) if turns(value).is_some_and(|factor| !turns_fit(factor)) => {
                let why = why_named(turns(value));
                match by_turn {
                    Some(&(word, _)) => {
                        unit.word = Some(word);
                        unit.why = format!("gravity turns as far, although the file says {name}");
                    }
                    None => {
                        unit.word = Some("count");
                        unit.why = format!("{name} {why}");
                        unit.scale = measured.map(|value| Scale::of_steps(value, self.output));
                    }
                }
            }
            (Some(&(word, value)), _) => {
                unit.word = Some(word);
                unit.why = why_named(turns(value));
            }
            (None, Some(&(word, _))) if !whole => {
                unit.word = Some(word);
                unit.why = "gravity turns as far".to_owned();
            }
            _ if let Some(angle) = unknown => match usual_period(known, angle) {
                Some((word, period)) => {
                    unit.word = Some(word);
                    let rate = short(period.recip());
                    unit.why = format!("gravity turns as far at about {rate} Hz");
                }
                None => unit.why = "with no time from row to row turns do not show it".to_owned(),
            },
            _ if whole || self.output == Output::Pulse || angle.is_some() || named.is_some() => {
                unit.word = Some("count");
                unit.why = why_count(whole, named, "no known unit fits the turns of gravity");
                unit.scale = measured.map(|value| Scale::of_steps(value, self.output));
            }
            _ if is_turned => {
                unit.why = "gravity turns too seldom or too roughly to show it".to_owned();
            }
            _ => unit.why = "gravity does not turn, so nothing shows it".to_owned(),
        }
        let shown = known.iter().find(|(word, _)| Some(*word) == unit.word);
        unit.is_shown = shown.is_some_and(|&(_, value)| fits(value)) || unit.scale.is_some();
        self.units.gyro = unit;
    }
}

/// Why a triad is taken to hold counts.
fn why_count(whole: bool, named: Option<&str>, unfit: &str) -> String {
    match (whole, named) {
        (true, _) => "whole numbers".to_owned(),
        (false, Some(named)) => {
            format!("{named} has no word of its own here: a count with a scale")
        }
        (false, None) => unfit.to_owned(),
    }
}

/// Why rows are taken to hold that, by the accelerometers.
fn output_why(output: Output, seconds: f64) -> String {
    match output {
        Output::Pulse => {
            "whole numbers whose sums vary less than they would if fractions were not carried over"
                .to_owned()
        }
        Output::Increment => format!("gravity times {} s a row", short(seconds)),
        Output::Rate => "gravity has the same magnitude whatever the rate of rows".to_owned(),
    }
}

/// Units of gyros, with the angle in one row of a unit of it.
fn angle_units(output: Output) -> &'static [(&'static str, f64)] {
    match output {
        Output::Rate => &[
            ("rad/s", 1.0),
            ("deg/s", DEGREE),
            ("deg/h", DEG_PER_H),
            ("mdps", 1e-3 * DEGREE),
        ],
        Output::Increment => &[("rad", 1.0), ("deg", DEGREE), ("arcsec", ARCSEC)],
        Output::Pulse => &[],
    }
}

fn turns_fit(factor: f64) -> bool {
    factor < TURN_FACTOR && factor > TURN_FACTOR.recip()
}

/// Why gyros have the unit that the file names, with what the turns of gravity say of it.
fn why_named(factor: Option<f64>) -> String {
    match factor {
        Some(factor) if !turns_fit(factor) => format!(
            "as the file says, but gravity turns {} times as far",
            short(factor)
        ),
        Some(_) => "as the file says, and as gravity turns".to_owned(),
        None => "as the file says".to_owned(),
    }
}

/// The only unit with which rows that turn by this angle come at a usual period, and the period.
fn usual_period(known: &[(&'static str, f64)], angle: f64) -> Option<(&'static str, f64)> {
    let periods = known.iter().map(|&(word, unit)| (word, angle / unit));
    let mut usual = periods.filter(|(_, period)| PERIODS.contains(period));
    usual.next().filter(|_| usual.next().is_none())
}

/// Half the range of a register of whole numbers whose zero is in its middle, where all values lie about that.
pub(super) fn offset(samples: &[Vector3<f64>]) -> Option<f64> {
    let values = || samples.iter().flat_map(|sample| sample.iter().copied());
    if values().any(|value| value.fract() != 0.0) {
        return None;
    }
    let (low, high) = values().fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| {
        (low.min(v), high.max(v))
    });
    let half = [
        2048.0,
        8192.0,
        32_768.0,
        524_288.0,
        8_388_608.0,
        2_147_483_648.0,
    ]
    .into_iter()
    .find(|&half| low >= 0.0 && low < half && high > half && high < 2.0 * half)?;
    let mean = values().sum::<f64>() / (3 * samples.len()) as f64;
    ((mean / half - 1.0).abs() < 0.5).then_some(half)
}

/// Takes the zero of registers from their samples, and says what it is.
pub(super) fn centre(triads: &mut PerSensor<Vec<Vector3<f64>>>) -> PerSensor<f64> {
    PerSensor::from_fn(|sensor| {
        let samples = triads.get_mut(sensor);
        let zero = offset(samples).unwrap_or(0.0);
        samples
            .iter_mut()
            .for_each(|sample| sample.add_scalar_mut(-zero));
        zero
    })
}

/// A number to four digits.
pub(super) fn short(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

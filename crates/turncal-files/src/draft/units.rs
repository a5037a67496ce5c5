//! Quantity and units of a row: each unit of `run.toml` is compared with gravity at rest or its rotation.

mod data_sheet;
mod hypothesis;

use data_sheet::Scale;
pub use hypothesis::TURNS_TOLD_APART;
use hypothesis::{Hypothesis, TriadRows};

use super::columns::Columns;
use super::motion::Motion;
use super::name::{self, Name};
use super::stated::{Stated, StatedUnit};
use super::time::{Clock, PERIODS};
use crate::quantity::{Of, units};
use crate::{Sheet, unit_scale};
use turncal::imu::{Output, PerSensor, Sensor};
use turncal::number::rounded;

/// Sums of pulses vary less than sums of readings by more than this factor.
const PULSE_SUMS: f64 = 0.5;

/// Unit of a triad, as far as it is known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Unit {
    /// Name in `run.toml`, if it is known.
    pub word: Option<&'static str>,
    pub why: String,
    /// Whether the unit is confirmed by motion or stated by the user.
    pub is_shown: bool,
    /// Whether the rows fit no known unit, or fit a unit other than the one stated in the file.
    pub is_unfit: bool,
    /// Scale of the counts, if it could be determined.
    pub scale: Option<Scale>,
}

impl Unit {
    fn open(why: &str) -> Self {
        Self {
            why: why.to_owned(),
            ..Self::default()
        }
    }
}

/// Quantity in the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantities {
    pub output: Output,
    pub output_why: String,
    pub units: PerSensor<Unit>,
    /// Whether gyros and accelerometers have opposite signs.
    pub opposed: bool,
}

impl Quantities {
    /// The quantities to assume if there are too few numeric rows.
    pub fn unknown() -> Self {
        Self {
            output: Output::Rate,
            output_why: "as in most logs".to_owned(),
            units: PerSensor::from_fn(|_| {
                Unit::open("there are too few numeric rows to determine the units")
            }),
            opposed: false,
        }
    }

    pub fn find(
        sheet: &Sheet,
        columns: &Columns,
        clock: &Clock,
        whole: PerSensor<bool>,
        motion: &Motion,
    ) -> Self {
        let mut found = Self::unknown();
        found.opposed = motion.angle.is_some_and(|angle| angle < 0.0);
        // The accelerometers show which quantity the rows contain.
        for sensor in [Sensor::Accel, Sensor::Gyro] {
            let triad = *columns.triads.get(sensor);
            let named = |k: usize| Name::of_column(&sheet.names[k], &sheet.units[k]).unit;
            let rows = TriadRows {
                motion,
                period: clock.period.unwrap_or(f64::NAN),
                is_stated: clock.is_stated,
                named: triad.into_iter().flatten().find_map(named),
                whole: *whole.get(sensor),
            };
            let unit = found.unit(sensor, &rows);
            *found.units.get_mut(sensor) = match triad {
                Some(_) => unit,
                None => Unit::default(),
            };
        }
        found
    }

    fn unit(&mut self, sensor: Sensor, rows: &TriadRows) -> Unit {
        if let Some(unit) = scaled(sensor, rows) {
            return unit;
        }
        let outputs = match sensor {
            Sensor::Accel => &[Output::Rate, Output::Increment][..],
            Sensor::Gyro => &[self.output],
        };
        let of_output = |&output: &Output| {
            let known = units(sensor, output).filter_map(|(word, per_si)| Some((word, per_si?)));
            known.map(move |unit| Hypothesis::new(sensor, unit, output, rows))
        };
        let all: Vec<Hypothesis> = outputs.iter().flat_map(of_output).collect();
        let named = rows.named.map(|unit| unit.word);
        let by_name = all.iter().find(|of| Some(of.word) == named);
        let mut by_motion = all.iter().filter(|of| of.fits());
        let shown = by_motion.next();
        let evidence = shown.map_or(String::new(), |of| of.evidence(sensor, rows.motion));
        let (chosen, why) = match (by_name, shown) {
            (Some(name), Some(shown)) if name.is_contradicted() => {
                let why = format!("{evidence}, although the file states {}", name.word);
                (shown, why)
            }
            (Some(name), _) if !name.is_contradicted() || sensor == Sensor::Accel => {
                (name, name.why_named(sensor, rows.motion))
            }
            (None, Some(shown)) if !rows.whole && (named.is_none() || sensor == Sensor::Gyro) => {
                let others = by_motion.map(|of| format!("; could also be {}", of.word));
                (shown, evidence + &others.collect::<String>())
            }
            _ => {
                return match sensor {
                    Sensor::Accel => self.counts_of_accelerometers(rows),
                    Sensor::Gyro => self.counts_of_gyros(rows, by_name, &all),
                };
            }
        };
        if sensor == Sensor::Accel {
            self.hold(chosen.output, rows);
        }
        // Gravity alone overrules a stated unit of accelerometers; turns need the clock as well.
        let is_overruled =
            sensor == Sensor::Gyro && by_name.is_some_and(|of| of.word != chosen.word);
        Unit {
            word: Some(chosen.word),
            is_shown: chosen.fits(),
            is_unfit: is_overruled,
            ..Unit::open(&why)
        }
    }

    /// Sets the row quantity from the accelerometers.
    fn hold(&mut self, output: Output, rows: &TriadRows) {
        self.output = output;
        self.output_why = match output {
            Output::Pulse => {
                "the values are whole counts, and the remainder of each row is carried into the next, as in pulse \
                 outputs"
                    .into()
            }
            Output::Increment => {
                let period = rounded(rows.period, 4);
                format!("the specific force at rest is g times {period} s per row")
            }
            Output::Rate => {
                "the specific force at rest is g, not g times the sample period".into()
            }
        };
    }

    fn counts_of_accelerometers(&mut self, rows: &TriadRows) -> Unit {
        let gravity = rows.motion.gravity;
        let is_carried = |ratio: f64| rows.whole && ratio < PULSE_SUMS;
        let output = if rows.motion.sum_variance.is_some_and(is_carried) {
            Output::Pulse
        } else {
            Output::Rate
        };
        self.hold(output, rows);
        let per_g = gravity * self.per_second(rows.period);
        let unfit = format!("no known unit gives {} at rest", rounded(gravity, 4));
        Unit {
            word: Some("count"),
            why: why_count(rows, &unfit),
            is_unfit: !rows.whole,
            scale: per_g.is_normal().then(|| Scale::of_gravity(per_g)),
            ..Unit::default()
        }
    }

    fn counts_of_gyros(
        &self,
        rows: &TriadRows,
        by_name: Option<&Hypothesis>,
        all: &[Hypothesis],
    ) -> Unit {
        let angle = rows.motion.angle.map(f64::abs);
        let row = self.row(rows.period);
        let is_bare = !rows.whole && rows.named.is_none();
        match angle {
            // Without a clock, each unit implies its own sample period.
            Some(angle) if !row.is_finite() && is_bare => {
                let Some((word, period)) = usual_period(all, angle) else {
                    return Unit::open("cannot be estimated from turns without time stamps");
                };
                let rate = rounded(period.recip(), 4);
                let why = format!(
                    "integrated gyro angles match the change of gravity direction at about {rate} Hz"
                );
                return Unit {
                    word: Some(word),
                    ..Unit::open(&why)
                };
            }
            // No unit fits at the rate, which is only stated, but one fits at another rate.
            Some(angle) if is_bare && rows.is_stated && row.is_finite() => {
                if let Some((word, period)) = usual_period(all, angle) {
                    let [stated, usual] = [rows.period, period].map(|of| rounded(of.recip(), 4));
                    return Unit::open(&format!(
                        "no unit fits the change of gravity direction at {stated} Hz; {word} would at about {usual} Hz. \
                         Check the rate"
                    ));
                }
            }
            None if is_bare && self.output != Output::Pulse => {
                return Unit::open(if rows.motion.is_turned {
                    "there are too few usable turns to estimate the unit"
                } else {
                    "the gravity direction does not change, so the unit cannot be estimated"
                });
            }
            _ => {}
        }
        let why = match by_name {
            Some(name) => {
                let why = name.why_named(Sensor::Gyro, rows.motion);
                format!("{} {why}", name.word)
            }
            None => why_count(rows, "no known unit fits the change of gravity direction"),
        };
        // The sum of the rows is the angle.
        let measured = angle.map(|angle| row / angle);
        let measured = measured.filter(|scale| scale.is_finite());
        // A unit of the file that turns contradict is in doubt, as are fractions in no unit.
        let is_unfit = !rows.whole || by_name.is_some();
        Unit {
            word: Some("count"),
            is_shown: measured.is_some() && !is_unfit,
            is_unfit: measured.is_some() && is_unfit,
            scale: measured.map(|per_rad| Scale::of_turns(per_rad, self.output)),
            ..Unit::open(&why)
        }
    }

    /// The first stated unit that the motion contradicts while it confirms another unit: evidence, stated unit, remedy.
    pub fn contradiction(
        &self,
        stated: &Stated,
        motion: &Motion,
        period: f64,
    ) -> Option<[String; 3]> {
        let rows = TriadRows {
            motion,
            period,
            is_stated: false,
            named: None,
            whole: false,
        };
        stated.units().find_map(|(sensor, StatedUnit(of))| {
            let Of::Rows(_, output) = of.of else {
                return None;
            };
            let per_si = unit_scale(sensor, of.word)? / of.times;
            let unit = (of.word, per_si);
            let found = self.units.get(sensor);
            let shown = found.word.filter(|_| found.is_shown)?;
            let is_contradicted = Hypothesis::new(sensor, unit, output, &rows).is_contradicted();
            let (name, times) = (sensor.name(), of.times);
            let multiple = (times != 1.0).then(|| format!("{} ", rounded(times, 4)));
            let multiple = multiple.unwrap_or_default();
            is_contradicted.then(|| {
                [
                    format!("{name} rows in {shown} ({})", found.why),
                    format!("{multiple}{}, as stated", of.word),
                    format!("Correct or omit --{name}-unit, or check --rate."),
                ]
            })
        })
    }

    /// Applies the units stated by the user.
    pub fn state(&mut self, stated: &Stated) {
        for (sensor, StatedUnit(of)) in stated.units() {
            if let Of::Rows(_, output) = of.of {
                self.output = output;
                "follows from the stated unit".clone_into(&mut self.output_why);
            }
            let unit = self.units.get_mut(sensor);
            let found = unit.scale.take().filter(|_| of.word == "count");
            unit.scale = Scale::of_unit(sensor, of).or(found);
            unit.word = Some(unit.scale.as_ref().map_or(of.word, |_| "count"));
            (unit.is_shown, unit.is_unfit) = (true, false);
            unit.why = "as stated".to_owned();
        }
    }

    /// Whether a triad contains counts of unknown size.
    pub fn has_counts(&self) -> bool {
        Sensor::ALL.into_iter().any(|sensor| self.is_count(sensor))
    }

    pub fn is_count(&self, sensor: Sensor) -> bool {
        self.units.get(sensor).word == Some("count")
    }

    /// For rates: the sample period for which the turns fit the unit of the gyros, and whether this unit is stated,
    /// named in the file or detected.
    pub fn turned_period(
        &self,
        stated: &Stated,
        named: Option<name::Unit>,
        motion: &Motion,
    ) -> Option<f64> {
        let (sensor, unit) = (Sensor::Gyro, self.units.get(Sensor::Gyro));
        let stated = stated.gyro_unit.map(|StatedUnit(of)| of);
        let per_si = match stated.or(named) {
            Some(of) => unit_scale(sensor, of.word)? / of.times,
            None => unit_scale(sensor, unit.word.filter(|_| unit.scale.is_none())?)?,
        };
        let angle = motion.angle.filter(|_| self.output == Output::Rate)?;
        Some(angle.abs() * per_si)
    }

    /// Factor that converts row values to rates.
    pub fn per_second(&self, period: f64) -> f64 {
        match self.output {
            Output::Rate => 1.0,
            Output::Pulse | Output::Increment => period.recip(),
        }
    }

    /// Factor from a gyro row to its integral.
    fn row(&self, period: f64) -> f64 {
        period * self.per_second(period)
    }

    /// The file's quantity per second for one rad/s or m/s², if known.
    pub fn scale(&self, sensor: Sensor) -> Option<f64> {
        let unit = self.units.get(sensor);
        let measured = unit.scale.as_ref().map(|scale| scale.value);
        measured.or_else(|| unit_scale(sensor, unit.word?))
    }
}

/// Unit stated in the file as a multiple of a unit of `run.toml`, unless motion contradicts it.
fn scaled(sensor: Sensor, rows: &TriadRows) -> Option<Unit> {
    let unit = rows.named?;
    let scale = Scale::of_unit(sensor, unit)?;
    let per_si = scale.value;
    let of_it = Hypothesis::new(sensor, (unit.word, per_si), Output::Rate, rows);
    (!of_it.is_contradicted()).then(|| Unit {
        word: Some("count"),
        is_shown: true,
        scale: Some(scale),
        ..Unit::open("stated in the file")
    })
}

/// Reason for treating a triad as counts.
fn why_count(rows: &TriadRows, unfit: &str) -> String {
    match rows.named {
        _ if rows.whole => "whole numbers".to_owned(),
        Some(unit) => {
            let unit = unit.word;
            format!(
                "{unit} is not a built-in unit, so turncal treats it as a count with this scale"
            )
        }
        None => unfit.to_owned(),
    }
}

/// The only unit for which rows with this rotation have a usual period, and this period.
fn usual_period(all: &[Hypothesis], angle: f64) -> Option<(&'static str, f64)> {
    let periods = all.iter().map(|of| (of.word, of.per_si * angle));
    let mut usual = periods.filter(|(_, period)| PERIODS.contains(period));
    usual.next().filter(|_| usual.next().is_none())
}

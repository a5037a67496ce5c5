//! What every format is written from, and how it is put into words.

use nalgebra::{Matrix3, Vector3};

use super::Exported;
use crate::calibration::result::Calibration;
use crate::calibration::result::{EQUATION, Method};
use crate::calibration::{Correction, CorrectionError};
use crate::formats::unit_scale;
use crate::imu::{PerSensor, Sensor, Term};
use crate::run::Aiding;
use crate::run::Run;

/// A calibration and, perhaps, a run of its instrument.
pub(super) struct Source<'a> {
    pub record: &'a Calibration,
    pub run: Option<&'a Run>,
    pub correction: Correction,
}

/// A triad in rad/s or m/s²: `n = A u + b`, with `n = N / nominal`, along right, front, up.
pub(super) struct Normalised {
    /// What the file's quantity per second is divided by, axis by axis.
    pub nominal: Vector3<f64>,
    pub sensitivity: Matrix3<f64>,
    pub bias: Vector3<f64>,
}

impl<'a> Source<'a> {
    pub fn new(record: &'a Calibration, run: Option<&'a Run>) -> Result<Self, CorrectionError> {
        let correction = match run {
            Some(run) => Correction::for_run(record, run)?,
            None => Correction::of_record(record)?,
        };
        Ok(Self {
            record,
            run,
            correction,
        })
    }

    /// The unit of `N`. A count is one of a rate or, per second, of an increment: the record does not
    /// tell them apart.
    pub fn unit(&self, sensor: Sensor) -> String {
        match self.row_unit(sensor) {
            None => "an unnamed unit".to_owned(),
            Some(unit @ ("rad" | "deg" | "arcsec" | "m/s" | "g*s")) => format!("{unit}/s"),
            Some(unit) => unit.to_owned(),
        }
    }

    fn row_unit(&self, sensor: Sensor) -> Option<&str> {
        let unit = self.record.unit.as_ref()?;
        Some(unit.get(sensor))
    }

    /// Whose calibration this is, what `N` and `u` are.
    pub fn about(&self) -> Vec<String> {
        let record = self.record;
        let mut lines = vec![format!(
            "IMU calibration, exported by turncal {}",
            env!("CARGO_PKG_VERSION")
        )];
        let method = match (record.method, record.aiding) {
            (Some(Method::Ekf), Some(Aiding::Table)) => {
                "Kalman filter, standstill and table attitude"
            }
            (Some(Method::Ekf), _) => "Kalman filter, standstill alone",
            (Some(Method::SixPosition), _) => "closed form from static positions",
            (None, _) => "not stated",
        };
        lines.push(format!("method: {method}"));
        lines.extend(
            record
                .meta
                .iter()
                .map(|(name, value)| format!("{name}: {value}")),
        );
        if record.converged == Some(false) {
            lines.push("WARNING: the calibration did not converge".to_owned());
        }
        lines.extend(record.warnings.iter().map(|w| format!("warning: {w}")));
        lines.extend([
            String::new(),
            EQUATION.to_owned(),
            format!(
                "N: raw output per second, gyros in {}, accelerometers in {}; rows of pulses or \
                 increments are divided by the sample period, rows of rates stand as they are",
                self.unit(Sensor::Gyro),
                self.unit(Sensor::Accel)
            ),
            format!(
                "u: angular rate in rad/s, specific force in m/s^2, along: {}",
                record.body_frame.words()
            ),
            "axes of N and u: right, front, up; a log along front, right, down is (y, x, -z) of \
             this, along front, left, up (y, -x, z)"
                .to_owned(),
        ]);
        lines
    }

    /// A triad in rad/s or m/s². Without a run the nominal scale is that of the unit; for counts the
    /// calibrated scale factors, rounded to three digits.
    pub fn normalised(&self, sensor: Sensor) -> Normalised {
        let sensitivity = self.correction.sensitivity.get(sensor);
        let unit = self
            .row_unit(sensor)
            .and_then(|unit| unit_scale(sensor, unit));
        let nominal = match (self.run, unit) {
            (Some(run), _) => run.instrument.nominal.get(sensor).0,
            (None, Some(scale)) => Vector3::repeat(scale),
            (None, None) => Vector3::from_fn(|i, _| {
                let scale = sensitivity.row(i).norm().copysign(sensitivity[(i, i)]);
                format!("{scale:.2e}").parse().unwrap_or(scale)
            }),
        };
        Normalised {
            sensitivity: Matrix3::from_fn(|i, j| sensitivity[(i, j)] / nominal[i]),
            bias: self.correction.bias.get(sensor).component_div(&nominal),
            nominal,
        }
    }

    /// Parameters of error terms, a line each, in SI.
    pub fn term_lines(&self, has: impl Fn(Term) -> bool) -> Vec<String> {
        let line = |k: usize| {
            let term = Term::of(k).filter(|&term| has(term))?;
            let (name, value) = (Term::parameter_name(k)?, self.correction.terms[k]);
            Some(format!(
                "{name} = {value:e} {}, adds {}",
                term.entry().si_unit,
                term.entry().adds
            ))
        };
        self.correction.terms().filter_map(line).collect()
    }

    /// That error terms are not held, if there are any.
    pub fn terms_note(&self, held: impl Fn(Term) -> bool) -> Option<String> {
        let names: Vec<&str> = Term::ALL
            .into_iter()
            .filter(|&term| !held(term) && self.correction.has(term))
            .map(Term::name)
            .collect();
        (!names.is_empty()).then(|| {
            format!(
                "error terms are not corrected by it ({}); `turncal apply` corrects them",
                names.join(", ")
            )
        })
    }

    /// Raw outputs and what they become, a line each.
    pub fn test_vectors(&self) -> Vec<String> {
        let numbers = |values: &[f64; 6]| values.map(|v| format!("{v:e}")).join(", ");
        let vectors = self.record.test_vectors.iter();
        vectors
            .map(|v| format!("{} -> {}", numbers(&v.raw), numbers(&v.calibrated)))
            .collect()
    }
}

/// A file in the making.
pub(super) struct Document {
    mark: &'static str,
    text: String,
    notes: Vec<String>,
}

impl Document {
    /// Begins with what all formats say; `notes` are what this one does not hold, beside the error terms but for those
    /// of which `held` is true.
    pub fn holding(
        source: &Source,
        mark: &'static str,
        notes: impl IntoIterator<Item = String>,
        held: fn(Term) -> bool,
    ) -> Self {
        let notes = notes.into_iter().chain(source.terms_note(held));
        let mut document = Self::new(source, mark, notes);
        for line in source.term_lines(|term| !held(term)) {
            document.comment(&line);
        }
        document
    }

    /// The same of a format in which error terms have no place.
    pub fn new(
        source: &Source,
        mark: &'static str,
        notes: impl IntoIterator<Item = String>,
    ) -> Self {
        let mut document = Self {
            mark,
            text: String::new(),
            notes: notes.into_iter().collect(),
        };
        for line in source.about() {
            document.comment(&line);
        }
        for note in document.notes.clone() {
            document.comment(&format!("not held: {note}"));
        }
        document
    }

    /// Begins a file of code: it corrects K, E and D, and has terms and test vectors in comments.
    pub fn of_code(source: &Source, mark: &'static str) -> Self {
        let sigma = "sigma and covariance of the parameters; they are in calibration.json";
        let mut document = Self::holding(source, mark, [sigma.to_owned()], |_| false);
        let vectors = source.test_vectors();
        if !vectors.is_empty() {
            document.comment("");
            document.comment("test vectors, raw -> calibrated, gyros x y z, accelerometers x y z:");
            vectors.iter().for_each(|line| document.comment(line));
        }
        document
    }

    /// A comment of one line, whatever is in it: names and warnings come from files.
    pub fn comment(&mut self, line: &str) {
        let breaks = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
        let line = line.replace(breaks, " ");
        let line = line.trim_end();
        self.text += self.mark;
        if !line.is_empty() {
            self.text.push(' ');
            self.text += line;
        }
        // In C a backslash at the end, or its trigraph ??/, would take the next line in.
        if line.ends_with(['\\', '/']) {
            self.text.push('.');
        }
        self.text.push('\n');
    }

    pub fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    /// A line before all others.
    pub fn begin(&mut self, line: &str) {
        self.text.insert_str(0, &format!("{line}\n"));
    }

    /// Puts all so far between these, which only end a comment together.
    pub fn enclose(&mut self, open: &str, close: &str) {
        self.text = format!("{open}\n{}{close}\n", self.text.replace("--", "- -"));
    }

    pub fn finish(self) -> Exported {
        Exported {
            text: self.text,
            binary: None,
            notes: self.notes,
        }
    }
}

/// A number that YAML 1.1 takes for one: with a point, and a sign in its exponent.
pub(super) fn yaml_number(value: f64) -> String {
    let text = format!("{:e}", value + 0.0);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// Three numbers as a YAML list.
pub(super) fn yaml_list<'a>(values: impl IntoIterator<Item = &'a f64>) -> String {
    let values: Vec<String> = values.into_iter().map(|&v| yaml_number(v)).collect();
    format!("[{}]", values.join(", "))
}

/// What to divide raw output by, in words.
pub(super) fn divide(nominal: &PerSensor<[f64; 3]>) -> String {
    let list = |sensor| {
        let values: &[f64; 3] = nominal.get(sensor);
        yaml_list(values)
    };
    format!(
        "divide the raw output for that: gyros by {}, accelerometers by {}",
        list(Sensor::Gyro),
        list(Sensor::Accel)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_floats_of_yaml_1_1_and_keep_every_bit() {
        for (value, text) in [
            (0.0, "0.0e+0"),
            (-0.0, "0.0e+0"),
            (2e6, "2.0e+6"),
            (-1.5e-7, "-1.5e-7"),
            (0.1, "1.0e-1"),
        ] {
            assert_eq!(yaml_number(value), text);
        }
        for value in [std::f64::consts::PI, 1e-300 / 3.0, 2e300 / 7.0] {
            assert_eq!(yaml_number(value).parse(), Ok(value));
        }
    }
}

//! Comments above the values of a format: instrument, definitions, omissions.

use super::affine::{Affine, Residual};
use super::notation::{comment, list, numbers};
use super::values::Values;
use turncal::calibration::result::{EQUATION, Method};
use turncal::imu::{AxisOrder, PerSensor, Sensor, Term};
use turncal::run::Aiding;

/// Omission of nearly every format.
pub const SIGMA: &str = "sigma and covariance of the parameters; they are in calibration.json";

/// A calibration in a format.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// Text of the file.
    pub bytes: Vec<u8>,
    /// Omissions of the format, one sentence each, which are also in the file.
    pub notes: Vec<String>,
}

/// The comments of a file.
pub struct Remarks<'a> {
    values: &'a Values<'a>,
    mark: &'static str,
    omissions: Vec<String>,
    /// Definition of the values, below everything else.
    definitions: Vec<String>,
    /// Error terms that need no mention.
    is_included: fn(Term) -> bool,
}

impl<'a> Remarks<'a> {
    /// Comments that begin with `mark` and list these omissions and all error terms.
    pub fn new(values: &'a Values<'a>, mark: &'static str, omissions: &[&str]) -> Self {
        Self {
            values,
            mark,
            omissions: omissions.iter().copied().map(str::to_owned).collect(),
            definitions: Vec::new(),
            is_included: |_| false,
        }
    }

    /// Comments for a program that computes `matrix (n − offset)`: the residual errors are listed as omissions too.
    pub fn of_program(
        values: &'a Values<'a>,
        (mark, reads): (&'static str, &str),
        program: &PerSensor<Affine>,
        omissions: &[&str],
    ) -> Self {
        let residuals = Residual::all(values, program);
        let words = residuals.iter().map(Residual::words);
        let mut remarks = Self::new(values, mark, &[omissions, &[SIGMA]].concat()).reads(reads);
        remarks.omissions.splice(0..0, words);
        let lines = residuals.iter().flat_map(Residual::lines);
        remarks.definitions.extend(lines);
        remarks
    }

    /// A copy that does not mention these error terms.
    pub fn including(mut self, is_included: fn(Term) -> bool) -> Self {
        self.is_included = is_included;
        self
    }

    /// Adds the axes of the values, their direction or reader, and the divisor of raw output.
    pub fn reads(self, what: &str) -> Self {
        let axes = match self.values.order {
            AxisOrder::IDENTITY => "right, front, up",
            AxisOrder::FRONT_RIGHT_DOWN => "front, right, down",
            AxisOrder::FRONT_LEFT_UP => "front, left, up",
            _ => "the axes of the log",
        };
        let [gyro, accel] = Sensor::ALL.map(|sensor| list(&self.values.triads.get(sensor).nominal));
        self.defines([
            String::new(),
            format!("{what} along {axes};"),
            format!(
                "to convert the raw output, divide gyros by {gyro} and accelerometers by {accel}"
            ),
        ])
    }

    /// Adds further lines.
    pub fn defines(mut self, lines: impl IntoIterator<Item = String>) -> Self {
        self.definitions.extend(lines);
        self
    }

    /// Adds raw outputs and their calibrated values.
    pub fn with_test_vectors(self) -> Self {
        let lines = test_vectors(self.values);
        let blank = (!lines.is_empty()).then(String::new);
        self.defines(blank.into_iter().chain(lines))
    }

    /// The omissions, and the error terms that the format omits.
    fn omitted(&self) -> Vec<String> {
        let mut terms = Term::ALL.to_vec();
        terms.retain(|&term| !(self.is_included)(term) && self.values.correction.has(term));
        let terms: Vec<&str> = terms.into_iter().map(Term::name).collect();
        let note = (!terms.is_empty()).then(|| {
            let terms = terms.join(", ");
            format!("this format does not correct error terms ({terms}); `turncal apply` does")
        });
        self.omissions.iter().cloned().chain(note).collect()
    }

    /// Parameters of omitted error terms, one line each, in SI.
    fn terms(&self) -> impl Iterator<Item = String> {
        let correction = &self.values.correction;
        correction.terms().filter_map(|k| {
            let term = Term::of(k).filter(|&term| !(self.is_included)(term))?;
            let (name, value, entry) =
                (Term::parameter_name(k)?, correction.terms[k], term.entry());
            let (unit, adds) = (entry.si_unit, entry.adds);
            Some(format!("{name} = {value:e} {unit}, adds {adds}"))
        })
    }

    /// All lines as comments.
    pub fn text(&self) -> String {
        let omitted = self.omitted().into_iter();
        let omitted = omitted.map(|note| format!("not included: {note}"));
        let lines = about(self.values).into_iter().chain(omitted);
        let lines = lines
            .chain(self.terms())
            .chain(self.definitions.iter().cloned());
        lines.map(|line| comment(self.mark, &line)).collect()
    }

    /// A file that consists of these comments and a text.
    pub fn above(&self, text: &str) -> Exported {
        self.of_file((self.text() + text).into_bytes())
    }

    /// A file that contains these comments in its own form, or not at all.
    pub fn of_file(&self, bytes: Vec<u8>) -> Exported {
        Exported {
            bytes,
            notes: self.omitted(),
        }
    }
}

/// Instrument of the calibration, and definitions of `N` and `u`.
pub fn about(values: &Values) -> Vec<String> {
    let record = values.record;
    let method = match (record.method, record.aiding) {
        (Some(Method::Ekf), Some(Aiding::Table)) => "Kalman filter, standstill and table attitude",
        (Some(Method::Ekf), _) => "Kalman filter, standstill only",
        (Some(Method::SixPosition), _) => "closed form from static positions",
        (None, _) => "not stated",
    };
    let version = env!("CARGO_PKG_VERSION");
    let mut lines = vec![
        format!("IMU calibration, exported by turncal {version}"),
        format!("method: {method}"),
    ];
    let meta = record.meta.iter();
    lines.extend(meta.map(|(name, value)| format!("{name}: {value}")));
    if let Some(word) = record.word() {
        lines.push(format!("verdict of the calibration: {word}"));
    }
    if record.is_failed() {
        lines.push("WARNING: do not use these values".to_owned());
    }
    lines.extend(record.warnings.iter().map(|w| format!("warning: {w}")));
    let axes = match &record.columns {
        Some(PerSensor { gyro, accel }) => format!(
            "axes x, y, z of N and u (right, front, up): columns {} and {} of the log",
            gyro.join(", "),
            accel.join(", ")
        ),
        None => "axes of N and u: right, front, up; (y, x, -z) converts a log along front, right, down and (y, -x, z) \
                 one along front, left, up"
            .to_owned(),
    };
    lines.extend([
        String::new(),
        EQUATION.to_owned(),
        format!(
            "N: raw output per second, gyros in {}, accelerometers in {}; divide pulses or increments by the sample \
             period and use rates unchanged",
            values.unit(Sensor::Gyro),
            values.unit(Sensor::Accel)
        ),
        format!(
            "u: angular rate in rad/s, specific force in m/s^2, along: {}",
            record.body_frame.words()
        ),
        axes,
    ]);
    lines
}

/// Raw outputs with calibrated values, one line each below a title; nothing if the record has none.
pub fn test_vectors(values: &Values) -> Vec<String> {
    let vectors = values.record.test_vectors.iter();
    let lines = vectors.map(|v| format!("{} -> {}", numbers(&v.raw), numbers(&v.calibrated)));
    let title = "test vectors, raw -> calibrated, gyros x y z, accelerometers x y z:".to_owned();
    let title = (!values.record.test_vectors.is_empty()).then_some(title);
    title.into_iter().chain(lines).collect()
}

//! Comments above the values in a file, one line each: instrument, definitions, omissions.

use super::affine::{Affine, Residual};
use super::notation::{comment, list};
use super::values::Values;
use turncal::calibration::result::{Calibration, EQUATION, Method};
use turncal::imu::{AxisOrder, PerSensor, Sensor, Term};
use turncal::run::Aiding;

/// A part of the calibration that almost every format omits.
pub const SIGMA: &str = "sigma and covariance of the parameters; both are in calibration.json";

/// A calibration in a format.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// Text of the file.
    pub bytes: Vec<u8>,
    /// Omissions of the format, one sentence each; the file states them too.
    pub notes: Vec<String>,
}

/// The comments of a file.
pub struct Remarks<'a> {
    values: &'a Values<'a>,
    mark: &'static str,
    omissions: Vec<String>,
    /// Definition of the values.
    definitions: Vec<String>,
    /// Error terms that need no mention.
    is_included: fn(Term) -> bool,
}

impl<'a> Remarks<'a> {
    /// Comments that begin with `mark` and list the given omissions and all error terms.
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
        if values.record.is_of_magnetometer() {
            return Self::new(values, mark, &[SIGMA]);
        }
        let residuals = Residual::all(values, program);
        let mut remarks = Self::new(values, mark, &[omissions, &[SIGMA]].concat()).reads(reads);
        let words = residuals.iter().map(Residual::words);
        remarks.omissions.splice(0..0, words);
        remarks
    }

    /// Returns a copy that does not mention these error terms.
    pub fn including(mut self, is_included: fn(Term) -> bool) -> Self {
        self.is_included = is_included;
        self
    }

    /// Adds the axes of the values, the direction of these axes or the program that reads them, and the divisor of the
    /// raw output.
    pub fn reads(self, what: &str) -> Self {
        let axes = match self.values.order {
            AxisOrder::IDENTITY => "right, front, up",
            AxisOrder::FRONT_RIGHT_DOWN => "front, right, down",
            AxisOrder::FRONT_LEFT_UP => "front, left, up",
            _ => "the axes of the log",
        };
        let [gyro, accel] = Sensor::ALL.map(|sensor| list(&self.values.triads.get(sensor).nominal));
        let body = self.values.record.body_frame.words();
        self.defines([format!(
            "{what} along {axes} ({body}): the raw output per second divided by {gyro} (gyros) and {accel} \
             (accelerometers)"
        )])
    }

    /// Adds omissions.
    pub fn omitting(mut self, notes: impl IntoIterator<Item = String>) -> Self {
        self.omissions.extend(notes);
        self
    }

    /// Adds further lines.
    pub fn defines(mut self, lines: impl IntoIterator<Item = String>) -> Self {
        self.definitions.extend(lines);
        self
    }

    /// The omissions, and the error terms that the format omits.
    fn omitted(&self) -> Vec<String> {
        let mut terms = Term::ALL.to_vec();
        terms.retain(|&term| !(self.is_included)(term) && self.values.correction.has(term));
        let terms: Vec<&str> = terms.into_iter().map(Term::name).collect();
        let note = (!terms.is_empty()).then(|| {
            let terms = terms.join(", ");
            format!(
                "this format does not contain error terms ({terms}); `turncal apply` corrects them"
            )
        });
        self.omissions.iter().cloned().chain(note).collect()
    }

    /// Returns all lines of the comments.
    pub fn text(&self) -> String {
        let omitted = self.omitted().join("; ");
        let omitted = (!omitted.is_empty()).then(|| format!("not included: {omitted}"));
        let lines = [title(self.values.record)].into_iter();
        let lines = lines.chain(self.definitions.iter().cloned()).chain(omitted);
        lines.map(|line| comment(self.mark, &line)).collect()
    }

    /// A file that consists of these comments and the given text.
    pub fn above(&self, text: &str) -> Exported {
        self.of_file((self.text() + text).into_bytes())
    }

    /// A file to which no comments are added, because its format stores them elsewhere or has none.
    pub fn of_file(&self, bytes: Vec<u8>) -> Exported {
        Exported {
            bytes,
            notes: self.omitted(),
        }
    }
}

/// Program, method, instrument and verdict.
pub fn title(record: &Calibration) -> String {
    let method = match (record.method, record.aiding) {
        _ if record.is_of_magnetometer() => "ellipsoid of the magnetometer",
        (Some(Method::Ekf), Some(Aiding::Table)) => "Kalman filter, standstill and table attitude",
        (Some(Method::Ekf), _) => "Kalman filter, standstill only",
        (Some(Method::SixPosition), _) => "closed form with static positions",
        (None, _) => "not stated",
    };
    let mut parts = vec![
        format!("IMU calibration by turncal {}", env!("CARGO_PKG_VERSION")),
        format!("method: {method}"),
    ];
    let meta = record.meta.iter();
    parts.extend(meta.map(|(name, value)| format!("{name}: {value}")));
    parts.extend(record.word().map(|word| format!("verdict: {word}")));
    if record.is_failed() {
        parts.push("WARNING: do not use these values".to_owned());
    }
    if !record.warnings.is_empty() {
        parts.push("warnings are in calibration.json".to_owned());
    }
    parts.join("; ")
}

/// Definition of the values of the magnetometer, for formats that contain them unchanged.
pub fn magnetic_words(values: &Values) -> Option<String> {
    let mag = values.record.mag.as_ref()?;
    Some(format!(
        "magnetometer: {}; N in {}, field in {}, along {}",
        mag.equation,
        mag.unit,
        mag.field.unit,
        if mag.ellipsoid.is_some() {
            "right, front, up; the matrix is symmetric by convention"
        } else {
            "the axes of u"
        }
    ))
}

/// Definitions of `N` and `u`, for formats that contain the values of the calibration file unchanged.
pub fn equation(values: &Values) -> Vec<String> {
    let record = values.record;
    if record.is_of_magnetometer() {
        return Vec::new();
    }
    let axes = match &record.columns {
        Some(PerSensor { gyro, accel }) => format!(
            "axes x, y, z of N and u (right, front, up): columns {} and {} of the log",
            gyro.join(", "),
            accel.join(", ")
        ),
        None => "axes of N and u: right, front, up; (y, x, -z) converts values along front, right, down, and (y, -x, \
        z) converts values along front, left, up"
            .to_owned(),
    };
    vec![
        format!(
            "{EQUATION}; N: raw output per second (pulses and increments divided by the sample period), gyros in {}, \
             accelerometers in {}",
            values.unit(Sensor::Gyro),
            values.unit(Sensor::Accel)
        ),
        format!(
            "u: angular rate in rad/s, specific force in m/s^2, along: {}; {axes}",
            record.body_frame.words()
        ),
    ]
}

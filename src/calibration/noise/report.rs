//! Report on the noise of a recording.

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::policy::NoisePolicy;
use super::source::Source;
use crate::calibration::{Finding, FindingKind as Kind, Problem};
use crate::imu::{NoiseKeys, PerSensor};
use crate::number::three_digits;

/// The noise used by a calibration, and its origin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoiseReport {
    /// The requested policy.
    pub policy: NoisePolicy,
    /// Whether the noise was estimated; if it was not, the stated noise was used.
    pub learnt: bool,
    /// The test of the stated noise; `None` if no figure was tested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test: Option<NoiseTest>,
    /// Every possible source of the recording.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<SourceFigures>,
}

/// Test whether the stated noise agrees with the estimated noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NoiseTest {
    /// The largest squared distance of a stated figure from the estimate: logarithm of the ratio, in units of its σ.
    #[serde(default)]
    pub ratio: f64,
    /// Limit of the squared distance for correct stated noise (χ², p < 0.001 over all figures).
    #[serde(rename = "ratio_limit")]
    pub limit: f64,
    /// Whether a stated figure beyond this limit is too small by a factor of more than 1.5.
    pub rejected: bool,
}

/// 1σ of a source, in the given unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SourceFigures {
    /// The source.
    pub source: Source,
    /// Name.
    pub name: String,
    /// Unit of the figures.
    pub unit: String,
    /// The stated value, or the value measured in dwells before the filter; `None` if neither exists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stated: Option<f64>,
    /// The value used.
    pub used: f64,
    /// 95 % interval of the estimate; `None` if the source was not estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
}

impl NoiseReport {
    /// The finding, if noise was estimated because the data contradict the stated noise.
    pub(in crate::calibration) fn finding(&self, problem: &Problem) -> Option<Finding> {
        let test = self.test.filter(|test| self.learnt && test.rejected)?;
        noise_learnt(problem, (test.ratio, test.limit), &self.sources)
    }

    /// Noise as stated, not tested.
    pub(in crate::calibration) fn stated(policy: NoisePolicy) -> Self {
        Self {
            policy,
            learnt: false,
            test: None,
            sources: Vec::new(),
        }
    }
}

impl fmt::Display for NoiseReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.learnt {
            return f.write_str("Stated noise was used.");
        }
        f.write_str("Noise estimated from the recording:")?;
        for (number, figures) in self.sources.iter().filter(|s| s.counts()).enumerate() {
            f.write_str(if number == 0 { " " } else { "; " })?;
            write!(f, "{figures}")?;
        }
        f.write_str(".")
    }
}

impl SourceFigures {
    /// Figures from σ in SI and radians.
    pub(in crate::calibration) fn new(
        source: Source,
        stated: Option<f64>,
        used: f64,
        interval: Option<[f64; 2]>,
    ) -> Self {
        let (unit, value) = source.unit();
        Self {
            source,
            name: source.name().to_owned(),
            unit: unit.to_owned(),
            stated: stated.map(|sigma| sigma / value),
            used: used / value,
            interval: interval.map(|ends| ends.map(|sigma| sigma / value)),
        }
    }

    /// Whether the source is present, because it was stated or estimated.
    pub fn counts(&self) -> bool {
        self.used > 0.0 || self.stated.is_some()
    }
}

impl fmt::Display for SourceFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name, unit, used, ..
        } = self;
        let unit = symbol(unit);
        write!(f, "{name} {}", three_digits(*used))?;
        if let Some([low, high]) = self.interval.map(|ends| ends.map(three_digits)) {
            write!(f, " ({low} to {high})")?;
        }
        write!(f, " {unit}")?;
        if let Some(stated) = self.stated {
            write!(f, ", stated {}", three_digits(stated))?;
        }
        Ok(())
    }
}

/// A noise unit as in tables, such as °/√h.
fn symbol(unit: &str) -> String {
    let marks = [
        ("deg", "°"),
        ("arcsec", "″"),
        ("ug", "µg"),
        ("sqrt(", "√"),
        (")", ""),
    ];
    marks.iter().fold(unit.to_owned(), |unit, (word, mark)| {
        unit.replace(word, mark)
    })
}

/// A finding lists a stated figure if the estimate is more than this many times as large as the figure.
pub const NAMED: f64 = 1.5;

/// The finding on estimated noise, with the squared distance of the worst stated figure and its limit. `None` if no
/// noise was stated.
fn noise_learnt(
    problem: &Problem,
    (ratio, limit): (f64, f64),
    sources: &[SourceFigures],
) -> Option<Finding> {
    let stated = problem.run().instrument.noise_is_stated;
    if !(stated.gyro || stated.accel) {
        return None;
    }
    let named = sources.iter().filter_map(|figures| {
        let stated = figures.stated?;
        let (table, line) = (figures.source.stated_in().0, figures.line());
        let is_sure = figures.interval.is_none_or(|[low, _]| low > stated);
        let [used, stated_as] = [figures.used, stated].map(three_digits);
        let (name, unit) = (&figures.name, symbol(&figures.unit));
        let words = format!("{name} {used} instead of {stated_as} {unit}");
        (is_sure && figures.used > NAMED * stated).then_some((words, (table, line)))
    });
    let (words, lines): (Vec<String>, Vec<(&str, String)>) = named.unzip();
    let tables = lines.chunk_by(|(one, _), (other, _)| one == other);
    let tables = tables.map(|lines| {
        let each: Vec<&str> = lines.iter().map(|(_, line)| line.as_str()).collect();
        format!("in [{}]: {}", lines[0].0, each.join(", "))
    });
    let tables: Vec<String> = tables.collect();
    let lines: Vec<&String> = lines.iter().map(|(_, line)| line).collect();
    let text = format!(
        "The noise is larger than stated: {} (squared distance {ratio:.0}; limit {limit:.0}). turncal used its own \
         estimate, which every σ includes. To use this estimate for the next recording, state {}.",
        words.join("; "),
        tables.join("; ")
    );
    let figures = json!({ "ratio": ratio, "limit": limit, "sources": sources, "lines": lines });
    Some(Finding::new(Kind::NoiseLearnt, text, figures))
}

impl SourceFigures {
    /// The line of `run.toml` that states the estimated value.
    fn line(&self) -> String {
        let (_, (name, unit)) = self.source.stated_in();
        let value = self.used * self.source.unit().1 / unit;
        format!("{name} = {}", rounded(value))
    }
}

/// Tables of `run.toml` that state noise.
const TABLES: [&str; 3] = ["imu.noise", "standstill", "turntable"];

impl NoiseReport {
    /// The lines of `run.toml` that state the estimated noise, each below the table it belongs to; `None` if no
    /// noise was estimated. `correlation_time` is that of each triad's Gauss–Markov bias in s.
    pub fn run_toml(&self, correlation_time: PerSensor<Option<f64>>) -> Option<String> {
        if !self.learnt {
            return None;
        }
        let used = self.sources.iter().filter(|figures| figures.used > 0.0);
        let lines = used.flat_map(|figures| {
            let source = figures.source;
            let (table, _) = source.stated_in();
            let varies = matches!(source, Source::GyroGaussMarkov | Source::AccelGaussMarkov);
            let time = correlation_time.get(source.triad()).filter(|_| varies);
            let time = time.map(|time| (NoiseKeys::of(source.triad()).correlation_time, time));
            let time = time.map(|(name, value)| format!("{name} = {}", rounded(value)));
            let lines = [figures.line()].into_iter().chain(time);
            lines.map(move |line| (table, line))
        });
        let lines: Vec<(&str, String)> = lines.collect();
        let of_table = |table: &str| -> Option<String> {
            let of_table = lines.iter().filter(|(of, _)| *of == table);
            let lines: String = of_table.map(|(_, line)| format!("{line}\n")).collect();
            (!lines.is_empty()).then(|| format!("[{table}]\n{lines}"))
        };
        let tables: Vec<String> = TABLES.into_iter().filter_map(of_table).collect();
        Some(tables.join("\n"))
    }
}

/// A TOML number of four digits.
fn rounded(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}

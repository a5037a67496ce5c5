//! Parameters that drift during the positions of the closed form.

use nalgebra::DMatrix;
use serde_json::json;

use super::finding::triad_name;
use super::residuals::Residuals;
use crate::calibration::{Finding, FindingKind as Kind};
use crate::imu::{AXES, ParameterKind, Sensor};
use crate::statistics::{FALSE_ALARM, chi_square_limit};
use crate::units::{DEG_PER_H, MICRO_G, PPM};

/// Number of tests: scale and bias of both triads.
const TESTS: f64 = 4.0;

/// Design of the residuals' equations for one kind of a triad's parameters.
pub struct Changing {
    pub sensor: Sensor,
    /// Scale or bias.
    pub kind: ParameterKind,
    /// Columns of the unknown axes in the equations, in normalised units.
    pub columns: DMatrix<f64>,
    /// Indices of these axes.
    pub axes: Vec<usize>,
}

/// Parameters whose linear drift explains the residuals significantly, and better than a single wrong position
/// or turn.
///
/// The log-likelihoods of the two hypotheses differ by the decrease of χ². A drift leaves residuals that are each
/// small, so that the sum of all squares may still pass its test.
pub fn drift(
    residuals: &Residuals,
    changing: &[Changing],
    times: &[f64],
    without_worst: f64,
) -> Option<Finding> {
    let first = times.iter().copied().fold(f64::INFINITY, f64::min);
    let last = times.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let span = last - first;
    if span.is_nan() || span <= 0.0 {
        return None;
    }
    let least = residuals.chi_square() - without_worst;
    let each = changing.iter().filter_map(|changing| {
        let mut columns = changing.columns.clone();
        for (mut row, time) in columns.row_iter_mut().zip(times) {
            row *= (time - first) / span - 0.5;
        }
        let explained = residuals.explained_by(&columns);
        let limit = chi_square_limit(explained.degrees as f64, FALSE_ALARM / TESTS);
        let rings = explained.degrees > 0 && explained.fall > limit && explained.fall > least;
        rings.then_some((changing, explained, limit))
    });
    let (changing, explained, limit) = each.max_by(|a, b| a.1.fall.total_cmp(&b.1.fall))?;
    let (parameters, unit, of_one) = match (changing.kind, changing.sensor) {
        (ParameterKind::Bias, Sensor::Gyro) => ("bias", "°/h", DEG_PER_H),
        (ParameterKind::Bias, Sensor::Accel) => ("bias", "µg", MICRO_G),
        _ => ("scale factor", "ppm", PPM),
    };
    let axes = changing.axes.iter().zip(&explained.coefficients);
    let changes = axes.map(|(&axis, change)| (AXES[axis], change / of_one));
    let changes: Vec<(char, f64)> = changes.collect();
    let (fall, each) = (explained.fall, changes.iter());
    let each: Vec<String> = each
        .map(|(axis, by)| format!("{axis} by {by:+.4} {unit}"))
        .collect();
    let text = format!(
        "{} {parameters} appears to drift between {first:.1} s and {last:.1} s: {} (χ² falls by {fall:.0}; limit \
         {limit:.0}). σ are valid only for constant parameters. Let the instrument warm up and keep its temperature \
         constant, look for a step, or state the bias instability in [imu.noise].",
        triad_name(changing.sensor),
        each.join(", ")
    );
    let figures = json!({
        "of": changing.sensor.name(), "parameters": parameters, "unit": unit, "changes": changes,
        "times": [first, last], "fall": fall, "limit": limit
    });
    Some(Finding::new(Kind::ChangesInTime, text, figures))
}

#[cfg(test)]
mod tests {
    use crate::calibration::{Options, Problem, six_position};
    use crate::run::Aiding;
    use crate::simulation::Scenario;
    use crate::units::{MICRO_G, PPM};

    /// What is said to drift of a run whose accelerometers' rows change by so much over it, m/s² and parts.
    fn drifts(seed: u64, bias: f64, scale: f64, with_table: bool) -> Option<(String, f64)> {
        let scenario = Scenario::load("mems").unwrap();
        let mut run = scenario.simulate(seed, 0).unwrap().run;
        let imu = &mut run.recording.imu;
        let (count, period) = (imu.len() as f64, imu.period);
        for (k, row) in imu.accel.to_mut().iter_mut().enumerate() {
            let part = k as f64 / count;
            *row *= 1.0 + scale * part;
            row.x += bias * part * period;
        }
        let aiding = match with_table {
            true => Aiding::Table,
            false => Aiding::Velocity,
        };
        let problem = Problem::new(&run, &Options::default().aiding(aiding));
        let findings = six_position(&problem).unwrap().findings;
        let mut drifts = findings.into_iter().filter(|f| f.kind == "changes-in-time");
        let figures = drifts.next()?.figures;
        let parameters = figures["parameters"].as_str()?.to_owned();
        Some((parameters, figures["changes"][0][1].as_f64()?))
    }

    #[test]
    fn a_drift_of_biases_or_scale_factors_is_named_with_its_size_and_none_where_they_stay() {
        for with_table in [true, false] {
            for seed in 1..=6 {
                assert_eq!(drifts(seed, 0.0, 0.0, with_table), None, "seed {seed}");
            }
            let (what, change) = drifts(1, 5000.0 * MICRO_G, 0.0, with_table).unwrap();
            assert_eq!(what, "bias");
            assert!((change - 5000.0).abs() < 1500.0, "{change} µg");
        }
        let (what, change) = drifts(1, 0.0, 3000.0 * PPM, true).unwrap();
        assert_eq!(what, "scale factor");
        assert!((change - 3000.0).abs() < 1000.0, "{change} ppm");
    }
}

//! The values of a calibration: K, E and D of each axis with their σ.

use super::prelude::*;
use turncal::calibration::{Calibration, FindingKind, Word};
use turncal::imu::{AXES, Sensor};

/// The unit of raw numbers; for these, a scale factor relative to the nominal one is of little use.
const RAW: &str = "count";

/// One row per axis.
pub fn table(calibration: &Calibration) -> Table {
    let columns = ["", "K", "E to x, ″", "to y, ″", "to z, ″", "D"];
    let axes = Sensor::ALL
        .into_iter()
        .flat_map(|sensor| AXES.map(|axis| (sensor, axis)));
    let rows = axes.map(|(sensor, axis)| row(calibration, sensor, axis));
    let table = Table::new("", columns).section(rows);
    let scale = Sensor::ALL.map(|sensor| {
        let input = match sensor {
            Sensor::Gyro => "rad/s",
            Sensor::Accel => "m/s²",
        };
        match unit(calibration, sensor) {
            Some(RAW) => format!("counts per second for 1 {input}"),
            _ => "relative to the nominal scale".to_owned(),
        }
    });
    let scale = match scale {
        [gyro, accel] if gyro == accel => gyro,
        [gyro, accel] => format!("{gyro} (gyros), {accel} (accelerometers)"),
    };
    table.note(format!(
        "In parentheses: 1σ in units of the last digit. K: {scale}; D: °/h and µg."
    ))
}

/// The magnetometer: one row per axis, if it was calibrated.
pub fn magnetometer(calibration: &Calibration) -> Option<Table> {
    let mag = calibration.mag.as_ref()?;
    let (_, size) = mag.shown_field();
    let with_sigma = |name: &str, size: f64| {
        let value = mag.get(name)?;
        Some(match mag.sigma_of(name) {
            Some(sigma) => with_last_digits(value / size, sigma / size),
            None => three_digits(value / size),
        })
    };
    let rows = AXES.map(|axis| {
        let of_matrix = AXES.map(|to| with_sigma(&format!("mag.matrix.{axis}{to}"), 1.0 / size));
        let bias = with_sigma(&format!("mag.bias.{axis}"), 1.0);
        let values = of_matrix.into_iter().chain([bias]);
        let values = values.map(|value| value.unwrap_or_else(|| NONE.to_owned()));
        std::iter::once(format!("mag    {axis}")).chain(values)
    });
    let [of_matrix, of_bias] = mag.shown_units();
    let (first, last) = (
        format!("to x, {of_matrix}"),
        format!("hard iron, {of_bias}"),
    );
    let columns = ["", &first, "to y", "to z", &last];
    let rows = rows.map(|row| row.collect::<Vec<_>>());
    Some(Table::new("", columns).section(rows))
}

fn unit(calibration: &Calibration, sensor: Sensor) -> Option<&str> {
    let units = calibration.unit.as_ref()?;
    Some(units.get(sensor))
}

/// Name, scale factor, misalignments to x, y and z, and bias of an axis.
fn row(calibration: &Calibration, sensor: Sensor, axis: char) -> Vec<String> {
    let name = sensor.name();
    let nominal = nominal(calibration, sensor, axis);
    let scale = if unit(calibration, sensor) == Some(RAW) {
        1.0
    } else {
        nominal
    };
    let of = |kind: &str, axes: String, size: f64| {
        let parameter = format!("{name}.{kind}.{axes}");
        cell(calibration, &parameter, size)
    };
    let bias = match sensor {
        Sensor::Gyro => DEG_PER_H,
        Sensor::Accel => MICRO_G,
    };
    let angles = AXES.map(|to| {
        if to == axis {
            NONE.to_owned()
        } else {
            of("installation", format!("{axis}{to}"), ARCSEC)
        }
    });
    let first = [
        format!("{name:<5}  {axis}"),
        of("scale", axis.into(), scale),
    ];
    let last = of("bias", axis.into(), nominal * bias);
    first.into_iter().chain(angles).chain([last]).collect()
}

/// Nominal scale of an axis, in the file's quantity.
fn nominal(calibration: &Calibration, sensor: Sensor, axis: char) -> f64 {
    let place = AXES.iter().position(|&of| of == axis).unwrap_or(0);
    let nominal = calibration
        .provenance
        .as_ref()
        .map(|of| of.nominal.get(sensor)[place]);
    // A file without provenance has no other nominal scale.
    nominal.unwrap_or_else(|| calibration.triad(sensor).scale[place].abs())
}

/// A parameter over a size; a dash if it is zero by definition or was not determined.
fn cell(calibration: &Calibration, name: &str, size: f64) -> String {
    let Some(&value) = calibration.get(name) else {
        return NONE.to_owned();
    };
    let sigma = calibration.sigma_of(name).copied().unwrap_or(0.0);
    let is_estimated = calibration.parameters.iter().any(|of| of == name);
    // A truth has no σ.
    let is_fixed = calibration.sigma.is_none() || (value != 0.0 && sigma == 0.0);
    if is_estimated {
        with_last_digits(value / size, sigma / size.abs())
    } else if is_fixed {
        three_digits(value / size)
    } else {
        NONE.to_owned()
    }
}

/// Whether the calibration may be used, and how many parameters were determined.
pub fn verdict(calibration: &Calibration) -> Option<(Word, String)> {
    let word = calibration.verdict.as_ref()?.word;
    let findings = several(calibration.findings.len(), "finding");
    if calibration.is_of_magnetometer() && word != Word::Failed {
        return Some((word, format!("magnetometer alone, {findings}")));
    }
    let all = calibration.parameters.len() + calibration.undetermined().count();
    let known = all - unobserved(calibration);
    let of_it = match word {
        Word::Failed => "do not use values or σ",
        Word::Partial => &determined(calibration),
        _ => &format!("{known} of {all} parameters determined"),
    };
    Some((word, format!("{of_it}, {findings}")))
}

/// Number of parameters that a finding lists as not observed.
fn unobserved(calibration: &Calibration) -> usize {
    let findings = calibration.findings.iter();
    let named = findings
        .filter(|finding| finding.is(FindingKind::NotObserved))
        .filter_map(|finding| finding.figures["parameters"].as_array());
    let is_own = |name: &&Value| {
        let is_it = |own: &String| *name == own;
        calibration.parameters.iter().any(is_it) || calibration.undetermined().any(is_it)
    };
    named.flatten().filter(is_own).count()
}

/// Determined values of each triad, such as `gyros: D only; accelerometers: 6 of 9 (K, D)`.
fn determined(calibration: &Calibration) -> String {
    let of_triad = |sensor: Sensor| {
        let kinds = [("scale", "K"), ("installation", "E"), ("bias", "D")];
        let counts = kinds.map(|(kind, letter)| {
            let of_kind = format!("{}.{kind}.", sensor.name());
            let is_it = |name: &&String| name.starts_with(&of_kind);
            let known = calibration.parameters.iter().filter(is_it).count();
            let missing = calibration.undetermined().filter(is_it).count();
            (letter, known, known + missing)
        });
        let asked: usize = counts.iter().map(|of| of.2).sum();
        let known: usize = counts.iter().map(|of| of.1).sum();
        let parts: Vec<String> = counts
            .iter()
            .filter(|of| of.1 > 0)
            .map(|(letter, known, asked)| {
                if known == asked {
                    (*letter).to_owned()
                } else {
                    format!("{letter} ({known} of {asked})")
                }
            })
            .collect();
        // A record names the columns only of both triads.
        if known == 0 && sensor == Sensor::Gyro && calibration.columns.is_none() {
            return Some("no gyros".to_owned());
        }
        let words = match (known, &parts[..]) {
            (0, _) => "nothing".to_owned(),
            _ if known == asked => format!("{known} of {asked}"),
            (_, [one]) => format!("{one} only"),
            _ => format!("{known} of {asked} ({})", parts.join(", ")),
        };
        (asked > 0).then(|| format!("{}: {words}", triad_name(sensor)))
    };
    let triads: Vec<String> = Sensor::ALL.into_iter().filter_map(of_triad).collect();
    triads.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use turncal::calibration::result::TriadRecord;
    use turncal::calibration::{Finding, Level, Verdict};
    use turncal::imu::PerSensor;

    /// A calibration of three parameters, of which the recording does not show `gyro.scale.x`.
    fn calibration(fixed: &[&str], level: Level) -> Calibration {
        let figures = json!({ "parameters": ["gyro.scale.x"] });
        let finding = Finding::new(FindingKind::NotObserved, String::new(), figures).at(level);
        let names = ["gyro.scale.x", "gyro.bias.x", "gyro.bias.y"];
        let own = |name: &&&str| !fixed.contains(*name);
        let sigma = TriadRecord {
            scale: [0.1; 3],
            ..TriadRecord::default()
        };
        Calibration {
            parameters: names
                .iter()
                .filter(own)
                .map(|name| name.to_string())
                .collect(),
            fixed: fixed.iter().map(|name| name.to_string()).collect(),
            sigma: Some(PerSensor::from_fn(|_| sigma)),
            verdict: Some(Verdict::of(std::slice::from_ref(&finding))),
            findings: vec![finding],
            ..Calibration::default()
        }
    }

    #[test]
    fn what_a_finding_names_is_not_determined_whether_it_kept_its_value_or_not() {
        let words = |calibration| verdict(&calibration).unwrap().1;
        let partial = calibration(&["gyro.scale.x"], Level::Partial);
        assert_eq!(words(partial), "gyros: D only, one finding");
        let care = calibration(&[], Level::Care);
        assert_eq!(words(care), "2 of 3 parameters determined, one finding");
    }
}

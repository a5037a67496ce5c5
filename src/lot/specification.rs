//! `specification.toml`: limits for units of a type.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use crate::calibration::{DayToDay, Group, parameter_name};
use crate::imu::{InstallationForm, ParameterKind, Sensor};
use crate::lot::{Limit, Specification};
use turncal_input::FileError;
use turncal_input::small_file;
use turncal_input::{Document, Finite, Positive};

/// The version of the file format.
const FORMAT: &str = "turncal-specification/1";
/// Default confidence.
const CONFIDENCE: f64 = 0.95;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SpecificationFile {
    confidence: Option<f64>,
    #[serde(default)]
    gyro: BTreeMap<String, LimitsFile>,
    #[serde(default)]
    accel: BTreeMap<String, LimitsFile>,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "a number above zero, or a table with `within` and `nominal`"
)]
enum LimitsFile {
    OfAll(Positive),
    /// `within`, `nominal` and single axes.
    Each(BTreeMap<String, Finite>),
}

impl Specification {
    /// Reads and checks a specification.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let text = small_file::text(
            path,
            "the specification",
            "Give the path of a specification.toml.",
        )?;
        Self::of_text(path, &text)
    }

    /// Checks the text of a specification that was read from a file.
    pub fn of_text(path: &Path, text: &str) -> Result<Self, FileError> {
        let document = Document::of(path, text);
        let file: SpecificationFile = document.fill(document.of_format(FORMAT)?)?;
        let confidence = file.confidence.unwrap_or(CONFIDENCE);
        if !(0.5..1.0).contains(&confidence) {
            let expected = "a number of at least 0.5 and below 1";
            return Err(document.wrong("confidence", expected, "Correct this value."));
        }
        let mut limits = Vec::new();
        for (sensor, stated) in [(Sensor::Gyro, &file.gyro), (Sensor::Accel, &file.accel)] {
            let groups = || Group::all().filter(|group| group.sensor() == sensor);
            let keys: Vec<String> = groups().map(|group| key(group).0).collect();
            document.only(sensor.name(), stated.keys(), &keys)?;
            for group in groups() {
                if let Some(of_group) = stated.get(&key(group).0) {
                    limits.extend(limits_of(document, group, of_group)?);
                }
            }
        }
        if limits.is_empty() {
            let meaning = "a table of limits, such as [gyro] with scale_ppm = 500";
            return Err(document.missing("gyro", meaning));
        }
        Ok(Self { confidence, limits })
    }
}

/// The key of a group in the table of its sensor, and its unit in SI.
fn key(group: Group) -> (String, f64) {
    let (key, unit) = DayToDay::key(group);
    (key[group.sensor().name().len() + 1..].to_owned(), unit)
}

/// The limits of the parameters of a group.
fn limits_of(
    document: Document,
    group: Group,
    stated: &LimitsFile,
) -> Result<Vec<Limit>, FileError> {
    let form = InstallationForm::General;
    let (key, unit) = key(group);
    let path = format!("{}.{key}", group.sensor().name());
    let axis = |index| {
        let name = parameter_name(form, index)?;
        Some((index, name.rsplit('.').next()?.to_owned()))
    };
    let parameters: Vec<(usize, String)> =
        (group.parameters(form).into_iter().filter_map(axis)).collect();
    let base = match group.kind() {
        ParameterKind::Scale => 1.0,
        ParameterKind::Installation | ParameterKind::Bias => 0.0,
    };
    let limit = |parameter, nominal: f64, within: f64| Limit {
        parameter,
        nominal: base + nominal * unit,
        within: within * unit,
    };
    let table = match stated {
        LimitsFile::OfAll(within) => {
            let all = parameters.iter();
            return Ok(all.map(|&(index, _)| limit(index, 0.0, within.0)).collect());
        }
        LimitsFile::Each(table) => table,
    };
    let axes = parameters.iter().map(|(_, axis)| axis.as_str());
    let known: Vec<&str> = ["within", "nominal"].into_iter().chain(axes).collect();
    document.only(&path, table.keys(), &known)?;
    let negative = |(name, value): &(&String, &Finite)| *name != "nominal" && value.0 <= 0.0;
    if let Some((name, _)) = table.iter().find(negative) {
        let path = format!("{path}.{name}");
        return Err(document.wrong(&path, "a number above zero", "Correct this value."));
    }
    let get = |name: &str| table.get(name).map(|value| value.0);
    let nominal = get("nominal").unwrap_or(0.0);
    let limits: Vec<Limit> = parameters
        .iter()
        .filter_map(|(index, axis)| {
            let within = get(axis).or_else(|| get("within"))?;
            Some(limit(*index, nominal, within))
        })
        .collect();
    if limits.is_empty() {
        Err(document.missing(
            &format!("{path}.within"),
            "the largest allowed deviation from nominal, or a limit for a named axis",
        ))
    } else {
        Ok(limits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{ARCSEC, DEG_PER_H};

    fn read(text: &str) -> Result<Specification, FileError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("specification.toml");
        std::fs::write(&path, text).unwrap();
        Specification::read(&path)
    }

    #[test]
    fn limits_are_read_in_field_units_for_a_group_or_an_axis() {
        let found = read(
            "format = \"turncal-specification/1\"\nconfidence = 0.99\n[gyro]\nscale_ppm = 500\n\
             bias_deg_per_h = { nominal = 25.0, within = 3.0, z = 1.0 }\n[accel]\n\
             installation_arcsec = { xy = 60.0 }\n",
        )
        .unwrap();
        assert_eq!((found.confidence, found.limits.len()), (0.99, 7));
        assert_eq!(found.limits[0].nominal, 1.0);
        assert!((found.limits[0].within - 5e-4).abs() < 1e-15);
        let within: Vec<f64> = found.limits[3..6]
            .iter()
            .map(|l| (l.within / DEG_PER_H).round())
            .collect();
        assert_eq!(within, [3.0, 3.0, 1.0]);
        assert!((found.limits[3].nominal / DEG_PER_H - 25.0).abs() < 1e-12);
        assert!((found.limits[6].within / ARCSEC - 60.0).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_a_limit_is_named_with_its_place() {
        let format = "format = \"turncal-specification/1\"\n";
        for (text, expected) in [
            ("[gyro]\nscale = 500\n", "scale_ppm"),
            ("[gyro]\nscale_ppm = -5\n", "above zero"),
            (
                "[accel]\nbias_ug = { nominal = 3.0 }\n",
                "largest allowed deviation",
            ),
            (
                "[gyro]\nscale_ppm = { within = 3, w = 1 }\n",
                "unknown field `w`",
            ),
            ("confidence = 95\n[gyro]\nscale_ppm = 3\n", "at least 0.5"),
            ("confidence = 0.9\n", "limits"),
        ] {
            let message = read(&format!("{format}{text}")).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}

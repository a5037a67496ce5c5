//! `specification.toml`: within which limits units of a type must be.

use std::path::Path;

use super::error::FileError;
use super::fields::{Document, Field, Fields};
use super::small_file;
use crate::calibration::{Group, parameter_name};
use crate::imu::{InstallationForm, ParameterKind, Sensor};
use crate::lot::{Limit, Specification};
use crate::units::{ARCSEC, DEG_PER_H, MICRO_G, PPM};

/// The version of the format.
const FORMAT: &str = "turncal-specification/1";
/// Unless the file says otherwise.
const CONFIDENCE: f64 = 0.95;

impl Specification {
    /// Reads and checks a specification.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let text = small_file::text(path).map_err(|error| {
            let advice = "Give the path of a specification.toml.";
            FileError::io(path, "read the specification", &error, advice)
        })?;
        let document = Document {
            file: path,
            text: &text,
        };
        let table = document.parse()?;
        let top = Fields::top(document, &table, &["format", "confidence", "gyro", "accel"])?;
        top.need("format", "the format of this file")?
            .choice(&[(FORMAT, ())])?;
        let confidence = match top.get("confidence") {
            Some(field) => field.within(0.5, 1.0 - 1e-9)?,
            None => CONFIDENCE,
        };
        let mut limits = Vec::new();
        for sensor in Sensor::ALL {
            let keys = Group::all()
                .filter(|g| g.sensor() == sensor)
                .map(|g| unit(g).0);
            let keys: Vec<&str> = keys.collect();
            let Some(fields) = top.table(sensor.name(), &keys)? else {
                continue;
            };
            for group in Group::all().filter(|group| group.sensor() == sensor) {
                let (key, unit) = unit(group);
                if let Some(field) = fields.get(key) {
                    limits.extend(limits_of(group, unit, &fields, key, &field)?);
                }
            }
        }
        if limits.is_empty() {
            let meaning = "a table of limits, such as [gyro] with scale_ppm = 500";
            return Err(top.missing("gyro", meaning));
        }
        Ok(Self { confidence, limits })
    }
}

/// The key of a group in its sensor's table, and its unit in SI.
fn unit(group: Group) -> (&'static str, f64) {
    match (group.kind(), group.sensor()) {
        (ParameterKind::Scale, _) => ("scale_ppm", PPM),
        (ParameterKind::Installation, _) => ("installation_arcsec", ARCSEC),
        (ParameterKind::Bias, Sensor::Gyro) => ("bias_deg_per_h", DEG_PER_H),
        (ParameterKind::Bias, Sensor::Accel) => ("bias_ug", MICRO_G),
    }
}

/// A number for all axes, or a table with `within`, `nominal` and single axes.
fn limits_of(
    group: Group,
    unit: f64,
    fields: &Fields,
    key: &str,
    field: &Field,
) -> Result<Vec<Limit>, FileError> {
    let form = InstallationForm::General;
    let parameters: Vec<(usize, String)> = group
        .parameters(form)
        .into_iter()
        .filter_map(|index| {
            let name = parameter_name(form, index)?;
            Some((index, name.rsplit('.').next()?.to_owned()))
        })
        .collect();
    let base = match group.kind() {
        ParameterKind::Scale => 1.0,
        ParameterKind::Installation | ParameterKind::Bias => 0.0,
    };
    let limit = |parameter, nominal: f64, within: f64| Limit {
        parameter,
        nominal: base + nominal * unit,
        within: within * unit,
    };
    if !field.is_table() {
        let within = field.positive()?;
        let all = parameters
            .iter()
            .map(|&(index, _)| limit(index, 0.0, within));
        return Ok(all.collect());
    }
    let known: Vec<&str> = ["within", "nominal"]
        .into_iter()
        .chain(parameters.iter().map(|(_, axis)| axis.as_str()))
        .collect();
    let Some(table) = fields.table(key, &known)? else {
        return Ok(Vec::new());
    };
    let within = table.get("within").map(|f| f.positive()).transpose()?;
    let nominal = table.get("nominal").map(|f| f.number()).transpose()?;
    let mut limits = Vec::new();
    for (index, axis) in &parameters {
        let own = table.get(axis).map(|f| f.positive()).transpose()?;
        if let Some(within) = own.or(within) {
            limits.push(limit(*index, nominal.unwrap_or(0.0), within));
        }
    }
    if limits.is_empty() {
        return Err(table.missing(
            "within",
            "the largest distance from nominal that is allowed, or one axis by its name",
        ));
    }
    Ok(limits)
}

#[cfg(test)]
mod tests {
    use super::*;

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
            ("[accel]\nbias_ug = { nominal = 3.0 }\n", "largest distance"),
            (
                "[gyro]\nscale_ppm = { within = 3, w = 1 }\n",
                "unknown field `w`",
            ),
            ("confidence = 95\n[gyro]\nscale_ppm = 3\n", "0.5 to"),
            ("confidence = 0.9\n", "limits"),
        ] {
            let message = read(&format!("{format}{text}")).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}

//! `lab.toml`: laboratory data for a calibration certificate.

use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use turncal::laboratory::{Condition, Laboratory};
use turncal_input::{Document, FileError, list, small_file};

/// The version of the format.
const FORMAT: &str = "turncal-laboratory/1";

/// A lab.toml to be completed.
pub const LABORATORY_DRAFT: &str = include_str!("laboratory.toml");

/// Tables and fields required in every certificate by ISO/IEC 17025.
const REQUIRED: [(&str, &[&str]); 8] = [
    ("laboratory", &["name", "street", "city", "country"]),
    ("customer", &["name", "street", "city", "country"]),
    (
        "certificate",
        &["number", "issued", "begin", "end", "place"],
    ),
    ("item", &["name", "model", "serial", "state"]),
    ("method", &["procedure"]),
    ("conditions", &["temperature_degc"]),
    ("traceability", &["statement"]),
    ("authorised", &["name", "function"]),
];

/// Reads and checks a lab.toml. `meta` contains metadata of the run, which complete `[item]`.
///
/// # Errors
/// [`FileError`] that names every required field that is missing, or the first invalid one.
pub fn read_laboratory(
    path: &Path,
    meta: impl Fn(&str) -> Option<String>,
) -> Result<Laboratory, FileError> {
    let text = small_file::text(path, "the laboratory data", "Give the path of a lab.toml.")?;
    let document = Document::of(path, &text);
    let of_item = [("model", meta("instrument")), ("serial", meta("serial"))];
    let mut table = document.of_format(FORMAT)?;
    let values = table.get_mut().iter_mut();
    for (name, value) in values.filter(|(name, _)| name.get_ref() != "conditions") {
        document.as_written(value);
        say_something(document, name.get_ref(), value)?;
    }
    let file: Result<Laboratory, FileError> = document.fill(table.clone());
    // All that is missing is named at once, unless another error comes first.
    if !matches!(&file, Err(error) if !error.message.starts_with("found no ")) {
        check_complete(path, table.get_ref(), &of_item)?;
    }
    let mut file = file?;
    let fields = [&mut file.item.model, &mut file.item.serial];
    for (field, (_, of_run)) in fields.into_iter().zip(of_item) {
        if field.is_empty() {
            *field = of_run.unwrap_or_default();
        }
    }
    check_values(document, &file)?;
    Ok(file)
}

/// Checks conditions, dates and countries.
fn check_values(document: Document, file: &Laboratory) -> Result<(), FileError> {
    let conditions = &file.conditions;
    for (name, of) in [
        ("temperature_degc", Some(conditions.temperature_degc)),
        ("humidity_percent", conditions.humidity_percent),
    ] {
        let is_sound = |of: &Condition| {
            of.value.is_finite() && of.uncertainty.is_finite() && of.uncertainty >= 0.0
        };
        if !of.as_ref().is_none_or(is_sound) {
            let expected = "a finite value and an uncertainty of at least zero";
            let path = format!("conditions.{name}");
            return Err(document.wrong(&path, expected, "Correct this value."));
        }
    }
    let days = &file.certificate;
    if days.end < days.begin || days.issued < days.end {
        let expected = "begin, end and issued in chronological order";
        return Err(document.wrong("certificate.end", expected, "Correct these dates."));
    }
    for (of, contact) in [("laboratory", &file.contact), ("customer", &file.customer)] {
        let country = &contact.country;
        if country.len() != 2 || !country.bytes().all(|b| b.is_ascii_uppercase()) {
            let expected = "two capital letters of ISO 3166-1, such as \"DE\"";
            let path = format!("{of}.country");
            return Err(document.wrong(&path, expected, "Correct this value."));
        }
    }
    Ok(())
}

/// Names every required field that is missing.
fn check_complete(
    path: &Path,
    table: &DeTable,
    of_item: &[(&str, Option<String>)],
) -> Result<(), FileError> {
    let is_there = |of: &str, name: &str| {
        let mut of_run = of_item.iter().filter(|(_, of_run)| of_run.is_some());
        let fields = table.get(of).and_then(|fields| fields.get_ref().as_table());
        fields.is_some_and(|fields| fields.contains_key(name))
            || (of == "item" && of_run.any(|(item, _)| *item == name))
    };
    let missing = REQUIRED.iter().flat_map(|(of, names)| {
        let names = names.iter().filter(|name| !is_there(of, name));
        names.map(move |name| format!("{of}.{name}"))
    });
    let missing: Vec<String> = missing.collect();
    let fields = match missing.len() {
        0 => return Ok(()),
        1 => "1 required field".to_owned(),
        count => format!("{count} required fields"),
    };
    let missing = list(missing.iter().map(String::as_str));
    let found = format_args!("{fields} missing");
    let expected = format_args!("the fields required by ISO/IEC 17025, 7.8.2 and 7.8.4: {missing}");
    let advice = "Add them; `turncal certificate --draft` shows an example.";
    Err(FileError::of(path, found, expected, advice))
}

/// Refuses empty texts and normalises white space for page and XML.
fn say_something(
    document: Document,
    path: &str,
    value: &mut Spanned<DeValue>,
) -> Result<(), FileError> {
    match value.get_mut() {
        DeValue::Table(fields) => {
            let mut fields = fields.iter_mut();
            fields.try_for_each(|(name, value)| {
                say_something(document, &format!("{path}.{}", name.get_ref()), value)
            })
        }
        DeValue::String(text) => {
            let words: Vec<&str> = text.split_whitespace().collect();
            if words.is_empty() {
                let expected = "non-empty text";
                return Err(document.wrong(path, expected, "Complete this value."));
            }
            *text = words.join(" ").into();
            Ok(())
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) const LAB: &str = include_str!("../../../../examples/lab.toml");

    fn read(text: &str) -> Result<Laboratory, FileError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("lab.toml");
        std::fs::write(&path, text).unwrap();
        read_laboratory(&path, |_| None)
    }

    #[test]
    fn the_example_is_complete_and_every_required_field_that_is_missing_is_named() {
        let lab = read(LAB).unwrap();
        assert_eq!(lab.contact.country, "DE");
        assert_eq!(lab.certificate.begin.to_string(), "2026-03-02");
        assert_eq!(lab.traceability.equipment.len(), 2);
        let empty = read("format = \"turncal-laboratory/1\"\n")
            .unwrap_err()
            .to_string();
        for (table, names) in REQUIRED {
            for name in names {
                assert!(empty.contains(&format!("{table}.{name}")), "{table}.{name}");
            }
        }
        let without = LAB.replace("number = ", "# number = ");
        let message = read(&without).unwrap_err().to_string();
        assert!(message.contains("certificate.number") && !message.contains("customer"));
        assert!(
            message.contains("found 1 required field missing"),
            "{message}"
        );
    }

    #[test]
    fn what_cannot_be_right_is_named_with_its_place() {
        for (from, to, expected) in [
            ("issued = 2026-03-06", "issued = \"yesterday\"", "yesterday"),
            (
                "issued = 2026-03-06",
                "issued = 2026-01-06",
                "in chronological order",
            ),
            ("country = \"DE\"", "country = \"Germany\"", "ISO 3166-1"),
            ("rule = \"guard-band\"", "rule = \"guard\"", "guard-band"),
            ("name = \"Example", "nam = \"Example", "unknown field"),
            ("\"T-17\", ", "", "serial number"),
            ("uncertainty = 0.5", "uncertainty = -0.5", "at least zero"),
        ] {
            let text = LAB.replacen(from, to, 1);
            assert_ne!(text, LAB, "{from}");
            let message = read(&text).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}

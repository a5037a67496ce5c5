//! `lab.toml`: what a laboratory states in a calibration certificate.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{Document, Finite, Names, NonNegative};
use crate::certificate::{Condition, Contact, Day, DecisionRule, Equipment, Laboratory, Place};
use crate::formats::error::{FileError, Place as At, list};
use crate::formats::small_file;

/// The version of the format.
const FORMAT: &str = "turncal-laboratory/1";

/// Table, field and meaning of what ISO/IEC 17025 asks for in every certificate.
const REQUIRED: [(&str, &str, &str); 22] = [
    ("laboratory", "name", "the laboratory"),
    ("laboratory", "street", "its address"),
    ("laboratory", "city", "its address"),
    ("laboratory", "country", "two letters of ISO 3166-1"),
    ("customer", "name", "who asked for the calibration"),
    ("customer", "street", "the customer's address"),
    ("customer", "city", "the customer's address"),
    ("customer", "country", "two letters of ISO 3166-1"),
    (
        "certificate",
        "number",
        "a number that no other certificate has",
    ),
    ("certificate", "issued", "the day of issue"),
    ("certificate", "begin", "the first day of the calibration"),
    ("certificate", "end", "its last day"),
    ("certificate", "place", "where it was performed"),
    ("item", "name", "what was calibrated"),
    ("item", "model", "its model"),
    ("item", "serial", "its serial number"),
    ("item", "state", "the state in which it was received"),
    ("method", "procedure", "the laboratory's procedure"),
    (
        "conditions",
        "temperature_degc",
        "the air's temperature and its uncertainty",
    ),
    (
        "traceability",
        "statement",
        "how results are traceable to the SI",
    ),
    ("authorised", "name", "who authorises the certificate"),
    ("authorised", "function", "and as what"),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LaboratoryFile {
    laboratory: Contact,
    customer: Contact,
    certificate: CertificateFile,
    item: ItemFile,
    method: MethodFile,
    conditions: ConditionsFile,
    traceability: TraceabilityFile,
    authorised: AuthorisedFile,
    decision: Option<DecisionFile>,
    remarks: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CertificateFile {
    number: String,
    issued: Day,
    received: Option<Day>,
    begin: Day,
    end: Day,
    place: Place,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ItemFile {
    name: String,
    manufacturer: Option<String>,
    /// As the run states it where this file does not.
    model: Option<String>,
    serial: Option<String>,
    state: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MethodFile {
    procedure: String,
    deviations: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ConditionsFile {
    temperature_degc: ConditionFile,
    humidity_percent: Option<ConditionFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ConditionFile {
    value: Finite,
    uncertainty: NonNegative,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TraceabilityFile {
    statement: String,
    /// Name, serial number and certificate of each.
    #[serde(default)]
    equipment: Vec<Names<3>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AuthorisedFile {
    name: String,
    function: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DecisionFile {
    rule: Option<DecisionRule>,
}

impl Laboratory {
    /// Reads and checks a lab.toml. `meta` holds what the run said of the item, by which `[item]` is completed.
    ///
    /// # Errors
    /// [`FileError`] that names every required field that is missing, or the first that cannot be right.
    pub fn read(path: &Path, meta: impl Fn(&str) -> Option<String>) -> Result<Self, FileError> {
        let text = small_file::text(path).map_err(|error| {
            let advice = "Give the path of a lab.toml.";
            FileError::io(path, "read what the laboratory states", &error, advice)
        })?;
        let document = Document {
            file: path,
            text: &text,
        };
        let of_item = [("model", meta("instrument")), ("serial", meta("serial"))];
        let mut table = document.of_format(FORMAT)?;
        let values = table.get_mut().iter_mut();
        for (name, value) in values.filter(|(name, _)| name.get_ref() != "conditions") {
            document.as_written(value);
            say_something(document, name.get_ref(), value)?;
        }
        let file: Result<LaboratoryFile, FileError> = document.fill(table.clone());
        // All that is missing is named at once, unless another error comes first.
        if !matches!(&file, Err(error) if !error.message.starts_with("found no ")) {
            check_complete(path, table.get_ref(), &of_item)?;
        }
        let file = file?;
        let [(_, model), (_, serial)] = of_item;
        let days = &file.certificate;
        if days.end < days.begin || days.issued < days.end {
            let expected = "begin, end and issued in this order";
            return Err(document.wrong("certificate.end", expected, "Correct these days."));
        }
        for (of, contact) in [
            ("laboratory", &file.laboratory),
            ("customer", &file.customer),
        ] {
            let country = &contact.country;
            if country.len() != 2 || !country.bytes().all(|b| b.is_ascii_uppercase()) {
                let expected = "two capital letters of ISO 3166-1, such as \"DE\"";
                let path = format!("{of}.country");
                return Err(document.wrong(&path, expected, "Correct this value."));
            }
        }
        Ok(file.laboratory(model, serial))
    }
}

/// Names every required field that is missing.
fn check_complete(
    path: &Path,
    table: &DeTable,
    of_item: &[(&str, Option<String>)],
) -> Result<(), FileError> {
    let is_there = |of: &str, name: &str| {
        let of_run = of_item
            .iter()
            .any(|(item, of_run)| *item == name && of_run.is_some());
        let fields = table.get(of).and_then(|fields| fields.get_ref().as_table());
        fields.is_some_and(|fields| fields.contains_key(name)) || (of == "item" && of_run)
    };
    let missing: Vec<String> = REQUIRED
        .into_iter()
        .filter(|(of, name, _)| !is_there(of, name))
        .map(|(of, name, meaning)| format!("{of}.{name} ({meaning})"))
        .collect();
    let fields = match missing.len() {
        0 => return Ok(()),
        1 => "1 required field".to_owned(),
        count => format!("{count} required fields"),
    };
    let missing = list(missing.iter().map(String::as_str));
    Err(FileError::new(
        path,
        At::File,
        format_args!("{fields} missing"),
        format_args!("what ISO/IEC 17025, 7.8.2 and 7.8.4, ask for: {missing}"),
        "Add what is missing.",
    ))
}

/// Texts are not empty, and white space in them is put in order, as a page and XML want it.
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
                let expected = "a text that is not empty";
                return Err(document.wrong(path, expected, "Complete this value."));
            }
            *text = words.join(" ").into();
            Ok(())
        }
        _ => Ok(()),
    }
}

impl LaboratoryFile {
    fn laboratory(self, model: Option<String>, serial: Option<String>) -> Laboratory {
        let condition = |of: ConditionFile| Condition {
            value: of.value.0,
            uncertainty: of.uncertainty.0,
        };
        let equipment = |Names([name, serial, certificate])| Equipment {
            name,
            serial,
            certificate,
        };
        Laboratory {
            contact: self.laboratory,
            customer: self.customer,
            number: self.certificate.number,
            issued: self.certificate.issued,
            received: self.certificate.received,
            performed: (self.certificate.begin, self.certificate.end),
            place: self.certificate.place,
            item: self.item.name,
            manufacturer: self.item.manufacturer,
            model: self.item.model.or(model).unwrap_or_default(),
            serial: self.item.serial.or(serial).unwrap_or_default(),
            state: self.item.state,
            procedure: self.method.procedure,
            deviations: self.method.deviations,
            temperature: condition(self.conditions.temperature_degc),
            humidity: self.conditions.humidity_percent.map(condition),
            traceability: self.traceability.statement,
            equipment: self
                .traceability
                .equipment
                .into_iter()
                .map(equipment)
                .collect(),
            authorised: (self.authorised.name, self.authorised.function),
            rule: self.decision.and_then(|of| of.rule),
            remarks: self.remarks,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) const LAB: &str = include_str!("../../../examples/lab.toml");

    fn read(text: &str) -> Result<Laboratory, FileError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("lab.toml");
        std::fs::write(&path, text).unwrap();
        Laboratory::read(&path, |_| None)
    }

    #[test]
    fn the_example_is_complete_and_every_required_field_that_is_missing_is_named() {
        let lab = read(LAB).unwrap();
        assert_eq!(lab.contact.country, "DE");
        assert_eq!(lab.performed.0.to_string(), "2026-03-02");
        assert_eq!(lab.equipment.len(), 2);
        let empty = read("format = \"turncal-laboratory/1\"\n")
            .unwrap_err()
            .to_string();
        for (table, name, _) in REQUIRED {
            assert!(empty.contains(&format!("{table}.{name}")), "{table}.{name}");
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
                "in this order",
            ),
            ("country = \"DE\"", "country = \"Germany\"", "ISO 3166-1"),
            ("rule = \"guard-band\"", "rule = \"guard\"", "guard-band"),
            ("name = \"Example", "nam = \"Example", "unknown field"),
        ] {
            let text = LAB.replacen(from, to, 1);
            assert_ne!(text, LAB, "{from}");
            let message = read(&text).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}

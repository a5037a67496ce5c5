//! `lab.toml`: what a laboratory states in a calibration certificate.

use std::path::Path;

use super::error::{FileError, Place as At, list};
use super::fields::{Document, Field, Fields};
use super::small_file;
use crate::certificate::{Condition, Contact, Day, DecisionRule, Equipment, Laboratory, Place};

/// The version of the format.
const FORMAT: &str = "turncal-laboratory/1";

const CONTACT: [&str; 7] = [
    "name",
    "street",
    "post_code",
    "city",
    "country",
    "email",
    "phone",
];

/// Table, field and meaning of what ISO/IEC 17025 asks for in every certificate.
const REQUIRED: [(&str, &str, &str); 21] = [
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
        "traceability",
        "statement",
        "how results are traceable to the SI",
    ),
    ("authorised", "name", "who authorises the certificate"),
    ("authorised", "function", "and as what"),
];

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
        let table = document.parse()?;
        let tables = [
            "format",
            "laboratory",
            "customer",
            "certificate",
            "item",
            "method",
            "conditions",
            "traceability",
            "authorised",
            "decision",
            "remarks",
        ];
        let top = Fields::top(document, &table, &tables)?;
        top.need("format", "the format of this file")?
            .choice(&[(FORMAT, ())])?;
        let read = Tables {
            laboratory: top.table("laboratory", &CONTACT)?,
            customer: top.table("customer", &CONTACT)?,
            certificate: top.table(
                "certificate",
                &["number", "issued", "received", "begin", "end", "place"],
            )?,
            item: top.table(
                "item",
                &["name", "manufacturer", "model", "serial", "state"],
            )?,
            method: top.table("method", &["procedure", "deviations"])?,
            conditions: top.table("conditions", &["temperature_degc", "humidity_percent"])?,
            traceability: top.table("traceability", &["statement", "equipment"])?,
            authorised: top.table("authorised", &["name", "function"])?,
            decision: top.table("decision", &["rule"])?,
            meta: &meta,
        };
        read.check(path)?;
        let remarks = top
            .get("remarks")
            .map(|field| text_of(&field))
            .transpose()?;
        read.laboratory(remarks)
    }
}

struct Tables<'a, M> {
    laboratory: Option<Fields<'a>>,
    customer: Option<Fields<'a>>,
    certificate: Option<Fields<'a>>,
    item: Option<Fields<'a>>,
    method: Option<Fields<'a>>,
    conditions: Option<Fields<'a>>,
    traceability: Option<Fields<'a>>,
    authorised: Option<Fields<'a>>,
    decision: Option<Fields<'a>>,
    meta: &'a M,
}

impl<'a, M: Fn(&str) -> Option<String>> Tables<'a, M> {
    fn table(&self, name: &str) -> Option<&Fields<'a>> {
        let of = match name {
            "laboratory" => &self.laboratory,
            "customer" => &self.customer,
            "certificate" => &self.certificate,
            "item" => &self.item,
            "method" => &self.method,
            "conditions" => &self.conditions,
            "traceability" => &self.traceability,
            _ => &self.authorised,
        };
        of.as_ref()
    }

    fn field(&self, table: &str, name: &str) -> Option<Field<'a>> {
        self.table(table)?.get(name)
    }

    /// What the run itself says of the item.
    fn of_run(&self, table: &str, name: &str) -> Option<String> {
        match (table, name) {
            ("item", "model") => (self.meta)("instrument"),
            ("item", "serial") => (self.meta)("serial"),
            _ => None,
        }
    }

    fn check(&self, path: &Path) -> Result<(), FileError> {
        let temperature = (
            "conditions",
            "temperature_degc",
            "the air's temperature and its uncertainty",
        );
        let required = REQUIRED.into_iter().chain([temperature]);
        let missing: Vec<String> = required
            .filter(|(table, name, _)| {
                self.field(table, name).is_none() && self.of_run(table, name).is_none()
            })
            .map(|(table, name, meaning)| format!("{table}.{name} ({meaning})"))
            .collect();
        if missing.is_empty() {
            return Ok(());
        }
        let fields = match missing.len() {
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

    fn needed(&self, table: &str, name: &str) -> Result<String, FileError> {
        match self.field(table, name) {
            Some(field) => text_of(&field),
            None => Ok(self.of_run(table, name).unwrap_or_default()),
        }
    }

    fn optional(&self, table: &str, name: &str) -> Result<Option<String>, FileError> {
        self.field(table, name)
            .map(|field| text_of(&field))
            .transpose()
    }

    fn contact(&self, table: &str) -> Result<Contact, FileError> {
        let country = self.needed(table, "country")?;
        let two = country.len() == 2 && country.bytes().all(|b| b.is_ascii_uppercase());
        if let Some(field) = self.field(table, "country").filter(|_| !two) {
            let expected = "two capital letters of ISO 3166-1, such as \"DE\"";
            return Err(field.error(expected, "Correct this value."));
        }
        Ok(Contact {
            name: self.needed(table, "name")?,
            street: self.needed(table, "street")?,
            post_code: self.optional(table, "post_code")?,
            city: self.needed(table, "city")?,
            country,
            email: self.optional(table, "email")?,
            phone: self.optional(table, "phone")?,
        })
    }

    fn day(&self, name: &str) -> Result<Option<Day>, FileError> {
        let Some(field) = self.field("certificate", name) else {
            return Ok(None);
        };
        let day = Day::parse(&field.as_written()?);
        let expected = "a day such as 2026-03-31";
        Ok(Some(day.ok_or_else(|| {
            field.error(expected, "Correct this value.")
        })?))
    }

    fn needed_day(&self, name: &str) -> Result<Day, FileError> {
        let missing = || {
            let at = self.certificate.as_ref();
            at.map(|at| at.missing(name, "a day"))
        };
        match self.day(name)? {
            Some(day) => Ok(day),
            // `check` has seen it.
            None => Err(missing().unwrap_or_else(|| {
                FileError::new(Path::new(""), At::File, "no day", "a day", "Add it.")
            })),
        }
    }

    fn condition(&self, name: &str) -> Result<Option<Condition>, FileError> {
        let Some(conditions) = &self.conditions else {
            return Ok(None);
        };
        let Some(fields) = conditions.table(name, &["value", "uncertainty"])? else {
            return Ok(None);
        };
        Ok(Some(Condition {
            value: fields.need("value", "what was measured")?.number()?,
            uncertainty: fields
                .need("uncertainty", "expanded uncertainty, k = 2")?
                .not_negative()?,
        }))
    }

    fn equipment(&self) -> Result<Vec<Equipment>, FileError> {
        let Some(field) = self.field("traceability", "equipment") else {
            return Ok(Vec::new());
        };
        let expected = "lists of three texts: name, serial number, certificate";
        let wrong = || field.error(expected, "Correct this value.");
        let rows = field.rows_of_texts().ok_or_else(wrong)?;
        rows.into_iter()
            .map(|row| match <[&str; 3]>::try_from(row) {
                Ok([name, serial, certificate]) => Ok(Equipment {
                    name: name.to_owned(),
                    serial: serial.to_owned(),
                    certificate: certificate.to_owned(),
                }),
                Err(_) => Err(wrong()),
            })
            .collect()
    }

    fn laboratory(&self, remarks: Option<String>) -> Result<Laboratory, FileError> {
        let places = [
            ("laboratory", Place::Laboratory),
            ("customer", Place::Customer),
            ("laboratory-branch", Place::LaboratoryBranch),
            ("other", Place::Other),
        ];
        let place = self.field("certificate", "place");
        let place = place.map(|field| field.choice(&places)).transpose()?;
        let performed = (self.needed_day("begin")?, self.needed_day("end")?);
        let issued = self.needed_day("issued")?;
        if let Some(field) = self.field("certificate", "end")
            && (performed.1 < performed.0 || issued < performed.1)
        {
            let expected = "begin, end and issued in this order";
            return Err(field.error(expected, "Correct these days."));
        }
        let rules = [
            ("guard-band", DecisionRule::GuardBand),
            ("simple-acceptance", DecisionRule::SimpleAcceptance),
        ];
        let rule = self.decision.as_ref().and_then(|of| of.get("rule"));
        Ok(Laboratory {
            contact: self.contact("laboratory")?,
            customer: self.contact("customer")?,
            number: self.needed("certificate", "number")?,
            issued,
            received: self.day("received")?,
            performed,
            place: place.unwrap_or(Place::Laboratory),
            item: self.needed("item", "name")?,
            manufacturer: self.optional("item", "manufacturer")?,
            model: self.needed("item", "model")?,
            serial: self.needed("item", "serial")?,
            state: self.needed("item", "state")?,
            procedure: self.needed("method", "procedure")?,
            deviations: self.optional("method", "deviations")?,
            temperature: self.condition("temperature_degc")?.unwrap_or(Condition {
                value: f64::NAN,
                uncertainty: f64::NAN,
            }),
            humidity: self.condition("humidity_percent")?,
            traceability: self.needed("traceability", "statement")?,
            equipment: self.equipment()?,
            authorised: (
                self.needed("authorised", "name")?,
                self.needed("authorised", "function")?,
            ),
            rule: rule.map(|field| field.choice(&rules)).transpose()?,
            remarks,
        })
    }
}

/// A text that says something: white space is put in order, as a page and XML want it.
fn text_of(field: &Field) -> Result<String, FileError> {
    let text = field.as_written()?;
    let words: Vec<&str> = text.split_whitespace().collect();
    match words.is_empty() {
        true => Err(field.error("a text that is not empty", "Complete this value.")),
        false => Ok(words.join(" ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) const LAB: &str = include_str!("../../examples/lab.toml");

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
        assert!(empty.contains("conditions.temperature_degc"));
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

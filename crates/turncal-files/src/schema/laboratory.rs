//! `lab.toml`: laboratory data for a calibration certificate.

use std::ops::RangeInclusive;
use std::path::Path;

use toml::de::{DeTable, DeValue};

use turncal::laboratory::{Condition, Laboratory};
use turncal_input::{Document, FileError, small_file};

/// The version of the file format.
const FORMAT: &str = "turncal-laboratory/1";

/// A lab.toml to be completed.
pub const LABORATORY_DRAFT: &str = include_str!("laboratory.toml");

/// Tables and fields required in every certificate by ISO/IEC 17025, in the order of the draft.
const REQUIRED: [(&str, &[&str]); 8] = [
    ("laboratory", &["name", "street", "city", "country"]),
    ("customer", &["name", "street", "city", "country"]),
    (
        "certificate",
        &["number", "begin", "end", "issued", "place"],
    ),
    ("item", &["name", "model", "serial", "state"]),
    ("method", &["procedure"]),
    ("conditions", &["temperature_degc"]),
    ("traceability", &["statement"]),
    ("authorised", &["name", "function"]),
];

/// Air temperatures of calibrations, °C; kelvins are above them.
const TEMPERATURES: RangeInclusive<f64> = -100.0..=200.0;
/// Relative humidities, percent.
const HUMIDITIES: RangeInclusive<f64> = 0.0..=100.0;

/// Country codes of ISO 3166-1, alpha-2.
const COUNTRIES: &str = "AD AE AF AG AI AL AM AO AQ AR AS AT AU AW AX AZ BA BB BD BE BF BG BH BI BJ BL BM BN BO BQ BR \
    BS BT BV BW BY BZ CA CC CD CF CG CH CI CK CL CM CN CO CR CU CV CW CX CY CZ DE DJ DK DM DO DZ EC EE EG EH ER ES ET \
    FI FJ FK FM FO FR GA GB GD GE GF GG GH GI GL GM GN GP GQ GR GS GT GU GW GY HK HM HN HR HT HU ID IE IL IM IN IO IQ \
    IR IS IT JE JM JO JP KE KG KH KI KM KN KP KR KW KY KZ LA LB LC LI LK LR LS LT LU LV LY MA MC MD ME MF MG MH MK ML \
    MM MN MO MP MQ MR MS MT MU MV MW MX MY MZ NA NC NE NF NG NI NL NO NP NR NU NZ OM PA PE PF PG PH PK PL PM PN PR PS \
    PT PW PY QA RE RO RS RU RW SA SB SC SD SE SG SH SI SJ SK SL SM SN SO SR SS ST SV SX SY SZ TC TD TF TG TH TJ TK TL \
    TM TN TO TR TT TV TW TZ UA UG UM US UY UZ VA VC VE VG VI VN VU WF WS YE YT ZA ZM ZW";

/// Reads and checks a lab.toml. `meta` contains metadata of the run, to complete `[item]`.
///
/// # Errors [`FileError`] that lists all empty or missing fields, or gives the first invalid one.
pub fn read_laboratory(
    path: &Path,
    meta: impl Fn(&str) -> Option<String>,
) -> Result<Laboratory, FileError> {
    let text = small_file::text(path, "the laboratory data", "Give the path of a lab.toml.")?;
    let document = Document::of(path, &text);
    let of_item = [("model", meta("instrument")), ("serial", meta("serial"))];
    let mut table = document.of_format(FORMAT)?;
    let values = table.get_mut().iter_mut();
    for (_, value) in values.filter(|(name, _)| name.get_ref() != "conditions") {
        document.as_written(value);
    }
    let mut open = Vec::new();
    take_empty(table.get_mut(), "", &mut open);
    let file: Result<Laboratory, FileError> = document.fill(table.clone());
    // All open fields are reported at once, unless another error comes first.
    if !matches!(&file, Err(error) if !error.message.starts_with("found no ")) {
        open.extend(missing(table.get_ref(), &of_item, &open));
        check_complete(document, open)?;
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

/// Removes empty texts and adds their paths; normalises the white space of the others for page and XML.
fn take_empty(fields: &mut DeTable, path: &str, open: &mut Vec<String>) {
    let mut empty = Vec::new();
    for (name, value) in fields.iter_mut() {
        let name = name.get_ref().to_string();
        let path = format!("{path}{name}");
        let is_empty = match value.get_mut() {
            DeValue::Table(fields) => {
                take_empty(fields, &format!("{path}."), open);
                false
            }
            value => has_empty(value),
        };
        if is_empty {
            open.push(path);
            empty.push(name);
        }
    }
    empty
        .iter()
        .for_each(|name| drop(fields.remove(name.as_str())));
}

/// Whether a text, or one in a list, is empty; white space is normalised on the way.
fn has_empty(value: &mut DeValue) -> bool {
    match value {
        DeValue::String(text) => {
            let words: Vec<&str> = text.split_whitespace().collect();
            *text = words.join(" ").into();
            text.is_empty()
        }
        DeValue::Array(all) => {
            let empty = all.iter_mut().map(|value| has_empty(value.get_mut()));
            empty.fold(false, |any, this| any | this)
        }
        _ => false,
    }
}

/// Required fields that are missing, by path, except those that the run or `open` contains.
fn missing(table: &DeTable, of_item: &[(&str, Option<String>)], open: &[String]) -> Vec<String> {
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
    missing.filter(|path| !open.contains(path)).collect()
}

/// Lists every open field, in the order of the tables in the file and, within a table, in the order of the draft.
fn check_complete(document: Document, mut open: Vec<String>) -> Result<(), FileError> {
    let place = |path: &String| {
        let (table, name) = path.split_once('.').unwrap_or(("", path));
        let heading = document.text.find(&format!("[{table}]"));
        let fields = REQUIRED.iter().find(|(of, _)| *of == table);
        let field = fields.and_then(|(_, names)| names.iter().position(|of| *of == name));
        (heading.unwrap_or(usize::MAX), field.unwrap_or(usize::MAX))
    };
    open.sort_by_key(place);
    let fields = match open.len() {
        0 => return Ok(()),
        1 => "1 open field".to_owned(),
        count => format!("{count} open fields"),
    };
    let all = open.join(", ");
    let expected = "a text or value in each field (ISO/IEC 17025, 7.8.2 and 7.8.4)";
    let advice = format_args!("Complete {all}.");
    Err(FileError::of(document.file, fields, expected, advice))
}

/// Checks conditions, dates and countries.
fn check_values(document: Document, file: &Laboratory) -> Result<(), FileError> {
    let conditions = &file.conditions;
    for (name, of, possible) in [
        (
            "temperature_degc",
            Some(conditions.temperature_degc),
            TEMPERATURES,
        ),
        ("humidity_percent", conditions.humidity_percent, HUMIDITIES),
    ] {
        let (low, high) = (possible.start(), possible.end());
        let is_sound = |of: Condition| {
            let size = 0.0..=high - low;
            possible.contains(&of.value) && size.contains(&of.uncertainty)
        };
        if !of.is_none_or(is_sound) {
            let expected =
                format_args!("a value from {low} to {high}, and an uncertainty of at least zero");
            let path = format!("conditions.{name}");
            return Err(document.wrong(&path, expected, "Correct this value."));
        }
    }
    let days = &file.certificate;
    let received = days.received.unwrap_or(days.begin);
    if days.begin < received || days.end < days.begin || days.issued < days.end {
        let expected = "received, begin, end and issued in chronological order";
        return Err(document.wrong("certificate.end", expected, "Correct these dates."));
    }
    for (of, contact) in [("laboratory", &file.contact), ("customer", &file.customer)] {
        if !COUNTRIES.split(' ').any(|code| code == contact.country) {
            let expected = "two capital letters of ISO 3166-1, such as \"DE\"";
            let path = format!("{of}.country");
            return Err(document.wrong(&path, expected, "Correct this value."));
        }
    }
    Ok(())
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
        assert!(message.contains("found 1 open field"), "{message}");
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
            ("value = 22.4", "value = -300.0", "from -100 to 200"),
            ("value = 22.4", "value = 295.55", "from -100 to 200"),
            ("value = 45.0", "value = 120.0", "from 0 to 100"),
            ("country = \"DE\"", "country = \"ZZ\"", "ISO 3166-1"),
            (
                "received = 2026-02-27",
                "received = 2026-03-03",
                "in chronological order",
            ),
        ] {
            let text = LAB.replacen(from, to, 1);
            assert_ne!(text, LAB, "{from}");
            let message = read(&text).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}

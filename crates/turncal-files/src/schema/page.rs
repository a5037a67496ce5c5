//! TOML text that is generated from the structs that read it, with comments for users.

use std::fmt::Display;

use serde::Serialize;
use serde_json::{Map, Value};

/// Tables written inline, after the name of a field.
const INLINE: [&str; 4] = ["accel_from", "columns", "instance", "mag_from"];

/// Comments on fields and tables; the key is the path of the field, `table.field`.
#[derive(Debug, Default)]
pub struct Remarks {
    all: Vec<(String, Place, String)>,
    /// The fields that the user must complete, each with the reason.
    pub open: Vec<(String, String)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// Remark on a line before the field or the table.
    Before,
    /// Remark after the value, if there is one.
    Behind,
    /// Remark after the name of a missing field, or after a value that becomes a comment.
    Suggestion,
}

impl Remarks {
    /// Adds a line before a field or a table.
    pub fn before(&mut self, path: &str, remark: impl Display) {
        self.add(path, Place::Before, remark);
    }

    /// Adds the reason for the value of a field.
    pub fn reason(&mut self, path: &str, why: impl Display) {
        self.add(path, Place::Behind, why);
    }

    /// Adds the purpose of an optional field; if the field has a value, the value becomes a comment.
    pub fn suggestion(&mut self, path: &str, why: impl Display) {
        self.add(path, Place::Suggestion, why);
    }

    /// Adds the purpose of a field that must be completed.
    pub fn open(&mut self, path: &str, why: impl Display) {
        self.suggestion(path, format_args!("TODO: {why}"));
        let field = path.rsplit('.').next().unwrap_or_default();
        self.open.push((field.to_owned(), why.to_string()));
    }

    /// Adds the purpose of part of a field that must be completed, on a line before the field.
    pub fn open_before(&mut self, path: &str, why: impl Display) {
        self.before(path, format_args!("TODO: {why}"));
        self.open.push((String::new(), why.to_string()));
    }

    fn add(&mut self, path: &str, place: Place, words: impl Display) {
        self.all.push((path.to_owned(), place, words.to_string()));
    }

    fn at(&self, path: &str, place: Place) -> impl Iterator<Item = &str> {
        let at = move |of: &&(String, Place, String)| (&*of.0, of.1) == (path, place);
        self.all.iter().filter(at).map(|(.., words)| words.as_str())
    }
}

/// The text of a document in this format, with the given fields.
pub fn text(format: &str, fields: &impl Serialize, remarks: &Remarks) -> String {
    let text = String::new();
    let mut page = Page { text, remarks };
    page.field("format", "format", &format.into());
    if let Ok(Value::Object(fields)) = serde_json::to_value(fields) {
        page.fields("", &fields);
    }
    page.text
}

struct Page<'a> {
    text: String,
    remarks: &'a Remarks,
}

impl Page<'_> {
    /// The fields of a table, then the tables in it.
    fn fields(&mut self, table: &str, fields: &Map<String, Value>) {
        for (key, value) in fields {
            let path = match table {
                "" => key.clone(),
                _ => format!("{table}.{key}"),
            };
            match value {
                Value::Null if table.is_empty() => self.missing_table(&path),
                Value::Object(fields) if !INLINE.contains(&key.as_str()) => {
                    self.table(&path, &format!("[{path}]"), fields);
                }
                Value::Array(tables) if tables.iter().any(Value::is_object) => {
                    for fields in tables.iter().filter_map(Value::as_object) {
                        self.table(&path, &format!("[[{path}]]"), fields);
                    }
                }
                value => self.field(&path, key, value),
            }
        }
    }

    /// A table; without a header if it has no fields of its own.
    fn table(&mut self, path: &str, header: &str, fields: &Map<String, Value>) {
        let (text, remarks) = (String::new(), self.remarks);
        let mut inside = Page { text, remarks };
        inside.fields(path, fields);
        if !inside.text.is_empty() && !inside.text.starts_with('\n') {
            self.text.push('\n');
            self.before(path);
            self.text += &format!("{header}\n");
        }
        self.text += &inside.text;
    }

    fn missing_table(&mut self, path: &str) {
        let line = self.text.len();
        self.before(path);
        if self.text.len() > line {
            self.text.insert(line, '\n');
        }
    }

    fn field(&mut self, path: &str, key: &str, value: &Value) {
        self.before(path);
        let remark = |place| self.remarks.at(path, place).next();
        let (mark, why) = match remark(Place::Suggestion) {
            Some(why) => ("# ", Some(why)),
            None if value.is_null() => return,
            None => ("", remark(Place::Behind)),
        };
        let value = match value {
            Value::Null => String::new(),
            value => format!(" {}", inline(value)),
        };
        let why = why.map_or_else(String::new, |why| format!("  # {why}"));
        self.text += &format!("{mark}{key} ={value}{why}\n");
    }

    fn before(&mut self, path: &str) {
        for line in self.remarks.at(path, Place::Before) {
            self.text += &format!("# {line}\n");
        }
    }
}

/// A value on one line.
fn inline(value: &Value) -> String {
    let joined = |values: Vec<String>| values.join(", ");
    match value {
        Value::String(text) => toml::Value::from(text.as_str()).to_string(),
        Value::Array(values) => format!("[{}]", joined(values.iter().map(inline).collect())),
        Value::Object(fields) => {
            let fields = fields.iter().filter(|(_, value)| !value.is_null());
            let fields = fields.map(|(key, value)| format!("{key} = {}", inline(value)));
            format!("{{ {} }}", joined(fields.collect()))
        }
        Value::Null | Value::Bool(_) | Value::Number(_) => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::{FORMAT, RunFile};
    use serde_json::json;
    use turncal_input::Document;

    #[test]
    fn remarks_are_at_their_fields_and_open_fields_are_comments() {
        let fields = json!({
            "site": { "latitude_deg": 48.5, "height_m": null, "longitude_deg": null },
            "imu": {
                "file": "a.csv",
                "columns": { "time": "t", "gyro": null },
                "prior": { "gyro": { "bias": [1.0, -2.5, 1e-9] }, "accel": {} },
            },
            "turntable": null,
            "recording": [{ "run": "a" }, { "run": "b" }],
        });
        let mut remarks = Remarks::default();
        remarks.before("site", "the place");
        remarks.reason("site.latitude_deg", "as stated");
        remarks.open("site.height_m", "above the ellipsoid");
        remarks.reason("site.longitude_deg", "of no value");
        remarks.open_before("imu.columns", "gyro");
        remarks.suggestion("imu.columns", "unfit");
        remarks.before("turntable", "no table");
        let expected = r#"format = "a/1"

# the place
[site]
latitude_deg = 48.5  # as stated
# height_m =  # TODO: above the ellipsoid

[imu]
file = "a.csv"
# TODO: gyro
# columns = { time = "t" }  # unfit

[imu.prior.gyro]
bias = [1.0, -2.5, 1e-9]

# no table

[[recording]]
run = "a"

[[recording]]
run = "b"
"#;
        assert_eq!(text("a/1", &fields, &remarks), expected);
        let open: Vec<&str> = remarks.open.iter().map(|(key, _)| &**key).collect();
        assert_eq!(open, ["height_m", ""]);
    }

    /// A field of each kind.
    const RUN: &str = r#"format = "turncal-run/1"
site = { latitude_deg = 48.123456789012345, gravity_m_s2 = 9.80, gravity_sigma_mgal = 1 }
meta = { serial = "№ \"7\"\\", notes = "one\ntwo" }
[imu]
file = "log 'a'.csv"
salvage = true
accel_from = { stream = "b", time = ["s", "ns"], time_unit = "ms", sample_period_s = 0.01 }
output = "increment"
gyro_unit = "deg"
time_unit = 1e-7
time_stamp = "middle"
instance = { column = "i", number = 3 }
temperature_unit = "degF"
body_axes = "flu"
columns = { time = "t", gyro = ["x", "-y", "z"], temperature = { gyro = "a", accel = ["b", "c", "d"] } }
noise = { angle_random_walk_deg_per_sqrt_h = 0.1 }
prior = { gyro = { scale = 3, bias = [1e-9, -2.5, 1e20] } }
terms = { time-offset = { sigma = 0.3 } }
[turntable]
file = "table.csv"
columns = { time = "t", quaternion = ["w", "x", "y", "z"], angles = ["o"], axes = ["z"] }
position_sigma_arcsec = 2
reading_sigma_arcsec = 0.1
"#;

    #[test]
    fn what_is_written_reads_back_to_the_same_fields() {
        let read = |text: &str| -> serde_json::Value {
            let document = Document::of("run.toml".as_ref(), text);
            let fields = document.of_format(FORMAT).unwrap();
            let file: RunFile = document.fill(fields).unwrap();
            serde_json::to_value(file).unwrap()
        };
        let fields = read(RUN);
        let written = text(FORMAT, &fields, &Remarks::default());
        assert_eq!(read(&written), fields, "{written}");
        assert!(written.contains("number = 3 }"), "{written}");
    }
}

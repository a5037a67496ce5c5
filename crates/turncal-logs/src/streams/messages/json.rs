//! JSON messages: each number of a message is a column, named by its path.

use serde_json::Value;

use crate::streams::Column;
use crate::streams::bytes::Broken;

/// Maximum length of a list that becomes columns.
const LONGEST: usize = 64;
/// Maximum number of columns, as in a spreadsheet.
const MOST: usize = 16_384;

/// The numbers of a message with their names; a time of seconds and nanoseconds is one number.
fn numbers(bytes: &[u8], offset: u64) -> Result<Vec<(String, f64)>, Broken> {
    let value: Value =
        serde_json::from_slice(bytes).map_err(|error| Broken::new(offset, error, "JSON"))?;
    let mut all = Vec::new();
    flatten(&value, "", &mut all);
    all.truncate(MOST);
    Ok(all)
}

fn flatten(value: &Value, path: &str, all: &mut Vec<(String, f64)>) {
    let below = |name: &str| {
        if path.is_empty() {
            name.to_owned()
        } else {
            format!("{path}.{name}")
        }
    };
    match value {
        Value::Number(number) => all.push((path.to_owned(), number.as_f64().unwrap_or(f64::NAN))),
        Value::Bool(flag) => all.push((path.to_owned(), f64::from(u8::from(*flag)))),
        Value::Array(items) if items.len() <= LONGEST => {
            for (index, item) in items.iter().enumerate() {
                flatten(item, &format!("{path}[{index}]"), all);
            }
        }
        Value::Object(fields) => {
            let of = |names: &[&str]| names.iter().find_map(|name| fields.get(*name)?.as_f64());
            let seconds = of(&["sec", "secs", "seconds"]);
            let nanoseconds = of(&["nsec", "nsecs", "nanosec", "nanos"]);
            if let (2, Some(seconds), Some(nanoseconds)) = (fields.len(), seconds, nanoseconds) {
                all.push((path.to_owned(), seconds + 1e-9 * nanoseconds));
                return;
            }
            for (name, field) in fields {
                flatten(field, &below(name), all);
            }
        }
        Value::Null | Value::String(_) | Value::Array(_) => {}
    }
}

/// The columns of the first message of a stream.
pub fn columns(bytes: &[u8], offset: u64) -> Result<Vec<Column>, Broken> {
    let all = numbers(bytes, offset)?;
    Ok(all
        .into_iter()
        .map(|(name, _)| Column::new(name, ""))
        .collect())
}

/// The numbers of a message in these columns; NaN if missing.
pub fn values(
    columns: &[Column],
    bytes: &[u8],
    offset: u64,
    row: &mut Vec<f64>,
) -> Result<(), Broken> {
    let all = numbers(bytes, offset)?;
    for (place, column) in columns.iter().enumerate() {
        // Usually all messages have the same fields.
        let same = all.get(place).filter(|(name, _)| *name == column.name);
        let found = same.or_else(|| all.iter().find(|(name, _)| *name == column.name));
        row.push(found.map_or(f64::NAN, |&(_, value)| value));
    }
    Ok(())
}

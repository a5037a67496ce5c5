//! Statements in the lines above the rows: rate, units, orientation.

use super::clock_text::ClockText;

/// The unit of a column of times as text.
const CLOCK: &str = "h:m:s";
/// Unit keys in camera logs (`.gcsv`): key, prefix of column names, unit.
const SCALES: [(&str, char, &str); 3] = [
    ("tscale", 't', "s"),
    ("gscale", 'g', "rad/s"),
    ("ascale", 'a', "g"),
];

/// Units from a line of units, from clocks and from the scales stated in a preamble.
pub fn units_with(
    units: Option<Vec<String>>,
    names: &[String],
    clocks: &[Option<ClockText>],
    says: &[&str],
) -> Option<Vec<String>> {
    let is_said = units.is_some();
    let mut all = units.unwrap_or_else(|| vec![String::new(); names.len()]);
    for ((unit, clock), name) in all.iter_mut().zip(clocks).zip(names) {
        let begins = |(_, letter, _): &&(_, char, _)| name.starts_with(*letter);
        if clock.is_some() {
            CLOCK.clone_into(unit);
        } else if let Some((key, _, of)) = SCALES.iter().find(begins)
            && let Some(scale) = value(says, key)
        {
            *unit = format!("{scale} {of}");
        }
    }
    let has_some = all.iter().any(|unit| !unit.is_empty());
    (is_said || has_some).then_some(all)
}

/// Remark on an orientation stated in a preamble.
pub fn orientation(says: &[&str]) -> Option<String> {
    let letters = value(says, "orientation")?;
    Some(format!(
        "turncal did not apply the orientation {letters} that the file states; it used the columns unchanged."
    ))
}

/// Value of a key in a preamble line.
fn value<'a>(says: &[&'a str], key: &str) -> Option<&'a str> {
    says.iter().find_map(|line| {
        let (found, value) = line.split_once([',', ';', '=', ':', '\t'])?;
        (found.trim().eq_ignore_ascii_case(key)).then(|| value.trim())
    })
}

/// The rate in Hz from a line such as `Update Rate: 100.0Hz` or `sampling rate,100`.
pub fn rate(remark: &str) -> Option<f64> {
    let remark = remark.to_lowercase();
    let key = || remark.strip_prefix("fs").map(|rest| ("sample", rest));
    let named = remark.split_once("rate").or(remark.split_once("freq"));
    let (before, rest) = named.or_else(key)?;
    let begin = rest.find(|c: char| c.is_ascii_digit())?;
    let number = &rest[begin..];
    let end = number.find(|c: char| !c.is_ascii_digit() && c != '.');
    let (number, unit) = number.split_at(end.unwrap_or(number.len()));
    let unit = unit.trim_matches(|c: char| !c.is_alphanumeric());
    let is_of_rows = || {
        ["sampl", "output", "update", "data"]
            .iter()
            .any(|word| before.contains(word))
    };
    let in_hertz =
        unit.starts_with("hz") || rest[..begin].contains("hz") || unit.is_empty() && is_of_rows();
    let rate = number.parse().ok().filter(|rate| *rate > 0.0);
    rate.filter(|_| in_hertz)
}

/// A number alone in its line above the rows, if it can be a rate in Hz.
pub fn lone_rate(remark: &str) -> Option<f64> {
    let rate = remark.parse().ok()?;
    (5.0..=5000.0).contains(&rate).then_some(rate)
}

//! Times as text: a date and time of day, a time of day, or seconds with a fraction that lost its leading zeros.

/// Converts the texts of a column to times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockText {
    /// Number of digits of fractions written without leading zeros.
    unpadded: Option<usize>,
}

/// Days from 1970 to a Gregorian date; months start with March, so that leap days are last.
fn days(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = match month {
        3.. => (year, month - 3),
        _ => (year - 1, month + 9),
    };
    365 * year + year.div_euclid(4) - year.div_euclid(100)
        + year.div_euclid(400)
        + (153 * month + 2) / 5
        + day
        - 719_469
}

/// Days of a date that begins with its year. Other dates give zero, because the order of day and month is ambiguous;
/// the time of day then continues beyond midnight.
fn date(text: &str) -> i64 {
    let numbers: Vec<&str> = text
        .split(|c: char| !c.is_ascii_digit())
        .filter(|digits| !digits.is_empty())
        .collect();
    let numbers = match numbers[..] {
        [whole] if whole.len() == 8 => [&whole[..4], &whole[4..6], &whole[6..]],
        [year, month, day] if year.len() == 4 => [year, month, day],
        _ => return 0,
    };
    let [year, month, day] = numbers.map(|digits| digits.parse().unwrap_or(0));
    if (1..=12).contains(&month) && (1..=31).contains(&day) {
        days(year, month, day)
    } else {
        0
    }
}

/// Whole seconds and the digits of a fraction.
fn parts(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let Some(colon) = text.find(':') else {
        let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
        let is_whole = |digits: &str| digits.bytes().all(|byte| byte.is_ascii_digit());
        return whole
            .parse()
            .ok()
            .filter(|_| is_whole(fraction))
            .map(|whole| (whole, fraction));
    };
    let is_digit = |c: char| c.is_ascii_digit();
    let start = text[..colon].trim_end_matches(is_digit).len();
    let mut rest = &text[start..];
    let mut numbers = [0.0; 3];
    for (place, number) in numbers.iter_mut().enumerate() {
        let digits = rest.len() - rest.trim_start_matches(is_digit).len();
        *number = rest[..digits].parse().ok()?;
        rest = &rest[digits..];
        match rest.strip_prefix(':') {
            Some(more) if place < 2 => rest = more,
            _ => break,
        }
    }
    let behind = rest.strip_prefix(['.', ',', ':']).unwrap_or("");
    let fraction = behind.len() - behind.trim_start_matches(is_digit).len();
    let zone = match behind {
        "" => rest,
        _ => &behind[fraction..],
    };
    let [mut hour, minute, second] = numbers;
    if hour > 24.0 || minute > 59.0 || second > 60.0 {
        return None;
    }
    match zone.trim().to_lowercase().as_str() {
        "am" => hour %= 12.0,
        "pm" => hour = hour % 12.0 + 12.0,
        _ => {}
    }
    let day = date(&text[..start]) as f64;
    Some((
        86_400.0 * day + 3600.0 * hour + 60.0 * minute + second,
        &behind[..fraction],
    ))
}

impl ClockText {
    /// The conversion for a column with these texts in the first rows; `None` if the texts are plain numbers.
    pub fn of(texts: &[&str]) -> Option<Self> {
        let parts: Vec<_> = texts.iter().filter_map(|text| parts(text)).collect();
        if parts.is_empty() || 2 * parts.len() < texts.len() {
            return None;
        }
        let plain = texts
            .iter()
            .any(|text| text.contains(':'))
            .then_some(Self { unpadded: None });
        let digits = parts.iter().map(|(_, fraction)| fraction.len()).max()?;
        let counted = Self {
            unpadded: Some(digits),
        };
        let steps_back = |of: Self| {
            let times: Vec<f64> = parts
                .iter()
                .map(|&(whole, fraction)| of.seconds_of(whole, fraction))
                .collect();
            times.windows(2).filter(|pair| pair[1] < pair[0]).count()
        };
        let (as_written, as_counted) = (steps_back(Self { unpadded: None }), steps_back(counted));
        // Values of a sensor decrease as often as they increase.
        let goes_on = 4 * as_written < parts.len();
        if goes_on && as_written > 4 * as_counted {
            Some(counted)
        } else {
            plain
        }
    }

    /// Time of a text, s.
    pub fn seconds(self, text: &str) -> Option<f64> {
        parts(text).map(|(whole, fraction)| self.seconds_of(whole, fraction))
    }

    fn seconds_of(self, whole: f64, fraction: &str) -> f64 {
        let digits = self.unpadded.unwrap_or(fraction.len());
        let count: f64 = fraction.parse().unwrap_or(0.0);
        whole + count / 10f64.powi(i32::try_from(digits).unwrap_or(0))
    }

    /// Remark on assumptions about the texts of the column, if any were made.
    pub fn remark(self, name: &str) -> Option<String> {
        let digits = self.unpadded?;
        Some(format!(
            "Fractions of a second in `{name}` have lost their leading zeros. turncal read them as whole multiples \
                of 10^-{digits} s."
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_many_programs_are_times() {
        let plain = ClockText { unpadded: None };
        for (text, seconds) in [
            ("1970-01-01T00:00:01.5Z", 1.5),
            ("2000-03-01 00:00:00", 951_868_800.0),
            ("20000229T23:59:59.25+01:00", 951_868_799.25),
            ("07/01/2021 23:59:20,01", 86_360.01),
            ("12:00:01 AM", 1.0),
            ("1:02:03.004 pm", 46_923.004),
            ("10:11:12:013", 36_672.013),
            ("10:11", 36_660.0),
        ] {
            let found = plain.seconds(text).unwrap_or(f64::NAN);
            assert!((found - seconds).abs() < 1e-6, "{text} {found}");
        }
        for text in ["", "12:99:00", "a:b", "up"] {
            assert_eq!(plain.seconds(text), None, "{text}");
        }
    }

    #[test]
    fn fractions_without_their_zeros_are_told_by_times_that_would_go_back() {
        let of =
            |texts: &[String]| ClockText::of(&texts.iter().map(String::as_str).collect::<Vec<_>>());
        let unpadded: Vec<String> = (0..300)
            .map(|k| format!("12:07:{:02}.{}", k / 50, k % 50 * 20))
            .collect();
        let clock = of(&unpadded).unwrap();
        assert_eq!(clock.seconds("12:07:01.5"), Some(43_621.005));
        let decimal: Vec<String> = (0..300)
            .map(|k| format!("{}", f64::from(k) * 0.02))
            .collect();
        assert_eq!(of(&decimal), None);
        let rates: Vec<String> = (0..300)
            .map(|k| format!("{}", f64::from(k).sin()))
            .collect();
        assert_eq!(of(&rates), None);
    }
}

//! Number formatting: values are printed up to the second significant digit of σ.

use crate::units::{HOUR, MINUTE};

const MINUS: char = '−';

/// Decimals that show two digits of `sigma`.
fn decimals(sigma: f64) -> usize {
    if sigma > 0.0 && sigma.is_finite() {
        (1.0 - sigma.log10().floor()).clamp(0.0, 9.0) as usize
    } else {
        3
    }
}

/// A value with the digits that are significant given its σ; a dash if it is not a number.
pub fn value(value: f64, sigma: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let text = format!("{value:.*}", decimals(sigma));
    match text.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| matches!(c, '0' | '.')) => zero.to_owned(),
        Some(magnitude) => format!("{MINUS}{magnitude}"),
        None => text,
    }
}

/// A value rounded to this number of significant digits.
pub fn rounded(value: f64, digits: usize) -> f64 {
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    text.parse().unwrap_or(value)
}

/// An accuracy, rounded to two digits.
pub fn sigma(sigma: f64) -> String {
    value(sigma, sigma)
}

/// A quantity, rounded to three digits.
pub fn three_digits(x: f64) -> String {
    if x.is_finite() && x.abs() >= 999.5 {
        let last = 10f64.powf(x.abs().log10().floor() - 2.0);
        return whole((x / last).round() * last);
    }
    value(x, x.abs() / 10.0)
}

/// A quantity rounded to a whole number, in groups of three digits.
pub fn whole(x: f64) -> String {
    if !x.is_finite() {
        return value(x, x);
    }
    // Beyond this size, the last digit of a floating-point number has no meaning.
    if x.abs() >= 1e15 {
        return format!("{x:.2e}").replace('-', "−");
    }
    let sign = if x.round() < 0.0 { "−" } else { "" };
    format!("{sign}{}", count(x.abs().round() as usize))
}

/// A number with all its digits.
pub fn plain(x: f64) -> String {
    if x.fract() == 0.0 {
        whole(x)
    } else {
        x.to_string().replace('-', "−")
    }
}

/// Rounds a number to twelve digits: further digits are only rounding errors.
pub fn to_twelve_digits(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

/// A number as the user stated it, without the rounding errors of a unit conversion.
pub fn stated(x: f64) -> String {
    plain(to_twelve_digits(x))
}

/// Stated values of three axes; one number if all are equal.
pub fn stated_axes(of: [f64; 3]) -> String {
    let mut all = of.map(stated).to_vec();
    all.dedup();
    match &all[..] {
        [one] => one.clone(),
        _ => of.map(stated).join(", "),
    }
}

/// A whole number in groups of three digits.
pub fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        // A narrow no-break space, as in ISO 80000-1.
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// An interval with the digits that are significant given its width.
pub fn interval((low, high): (f64, f64)) -> String {
    let fine = 0.5 * (high - low);
    format!("{}…{}", value(low, fine), value(high, fine))
}

/// A value with the digits that are significant given its interval, and the interval.
pub fn with_interval(of: f64, (low, high): (f64, f64)) -> [String; 2] {
    [value(of, 0.5 * (high - low)), interval((low, high))]
}

/// A value with its 1σ; if there is no σ, the value is rounded to three digits.
pub fn plus_minus(of: f64, own: f64) -> String {
    if own <= 0.0 {
        return three_digits(of);
    }
    format!("{} ± {}", value(of, own), sigma(own))
}

/// A value with its 1σ in units of the last digit, such as `0.99998(44)`.
pub fn with_last_digits(of: f64, own: f64) -> String {
    let last = 10f64.powi(-(decimals(own) as i32));
    format!("{}({:.0})", value(of, own), own / last)
}

/// A number or a dash.
pub fn or_dash(of: Option<f64>, shown: impl FnOnce(f64) -> String) -> String {
    of.map_or_else(|| "–".to_owned(), shown)
}

/// The first unit, from the largest to the smallest, that does not exceed a size in SI units; the last unit if all
/// exceed the size.
pub fn readable(units: &[(&'static str, f64)], size: f64) -> (&'static str, f64) {
    let fits = units.iter().find(|(_, unit)| size >= *unit);
    fits.or(units.last()).copied().unwrap_or(("", 1.0))
}

/// Units of time with their size in s.
pub const TIMES: [(&str, f64); 3] = [("h", HOUR), ("min", MINUTE), ("s", 1.0)];

/// A probability.
pub fn chance(p: f64) -> String {
    if p < 1e-4 {
        "< 0.0001".to_owned()
    } else {
        value(p, 0.1 * p.max(0.01))
    }
}

/// A time in minutes with its unit.
pub fn minutes(seconds: f64) -> String {
    format!("{} min", three_digits(seconds / MINUTE))
}

/// An axis tick label for ticks `step` apart.
pub fn tick(x: f64, step: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let places = (-step.log10()).ceil().clamp(0.0, 12.0) as usize;
    value(x, 10f64.powi(1 - places as i32))
}

/// A power of ten, written out if it is short.
pub fn power_of_ten(exponent: i32) -> String {
    if (-3..=4).contains(&exponent) {
        let step = 10f64.powi(exponent);
        return tick(step, step);
    }
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised: String = exponent
        .to_string()
        .chars()
        .map(|c| c.to_digit(10).map_or('⁻', |d| digits[d as usize]))
        .collect();
    format!("10{raised}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_shows_two_digits_of_its_sigma() {
        assert_eq!(value(2000.1234, 0.27), "2000.12");
        assert_eq!(value(-49.98765, 0.0034), "−49.9877");
        assert_eq!(value(1234.5, 40.0), "1234");
        assert_eq!(value(-0.001, 0.5), "0.00");
        assert_eq!(value(f64::NAN, 1.0), "–");
        assert_eq!(sigma(0.0034), "0.0034");
        assert_eq!(three_digits(21502.0), "21\u{202f}500");
        assert_eq!(three_digits(-0.012345), "−0.0123");
    }

    #[test]
    fn sigma_follows_in_units_of_the_last_digit() {
        assert_eq!(with_last_digits(0.999984, 0.00044), "0.99998(44)");
        assert_eq!(with_last_digits(-152.3, 23.4), "−152(23)");
        assert_eq!(with_last_digits(35288.0, 155.0), "35288(155)");
    }

    #[test]
    fn ticks_carry_only_the_decimals_of_their_step() {
        assert_eq!(tick(0.30000000000000004, 0.1), "0.3");
        assert_eq!(tick(-200.0, 50.0), "−200");
        assert_eq!(power_of_ten(-2), "0.01");
        assert_eq!(power_of_ten(-7), "10⁻⁷");
        assert_eq!(count(59500), "59\u{202f}500");
    }
}

//! A noise figure in every convention.

use crate::noise::conventions::{Conversion, Line};
use crate::report::prelude::*;

/// Interpretation of the figure, and one line per convention.
pub fn document(conversion: &Conversion) -> Document {
    let (value, given) = conversion.given;
    let at = conversion
        .rate
        .map_or(String::new(), |rate| format!(" at {rate} Hz"));
    let mut document = Document::new(format!("{value} {}{at}", given.unit));
    document.lead = vec![format!(
        "Interpreted as {}. Equivalent values:",
        given.meaning
    )];
    let row = |&(value, of): &Line| {
        let name = format!("{:>11} {}", digits(value), of.unit);
        (name, of.meaning)
    };
    let rows = conversion.lines.iter().map(row);
    document.both(Facts::new("", rows));
    document.data = json!({
        "quantity": conversion.quantity.name,
        "sensor": conversion.quantity.sensor.name(),
        "given": data(&conversion.given),
        "rate_hz": conversion.rate,
        "figures": conversion.lines.iter().map(data).collect::<Value>(),
    });
    document
}

fn data(&(value, of): &Line) -> Value {
    json!({ "value": value, "unit": of.unit, "meaning": of.meaning })
}

/// Five digits, with a power of ten if shorter.
fn digits(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e6).contains(&value) {
        return format!("{value:.4e}");
    }
    let whole = value.abs().max(1e-3).log10().floor() as i32 + 1;
    format!("{value:.*}", (5 - whole).clamp(0, 7) as usize)
}

#[cfg(test)]
mod tests {
    use super::super::terminal;
    use super::*;
    use crate::noise::conventions::convert;

    #[test]
    fn figures_are_shown_with_five_digits() {
        let shown = [0.3, 18.0, 8.726_646e-5, 123_456.7, 0.005].map(digits);
        assert_eq!(
            shown,
            ["0.30000", "18.000", "8.7266e-5", "123457", "0.0050000"]
        );
    }

    #[test]
    fn a_figure_is_shown_in_every_convention() {
        let conversion = convert(0.3, "deg/sqrt(h)", Some(100.0)).unwrap();
        insta::assert_snapshot!(terminal::text(&document(&conversion), Some(80)));
    }
}

//! Report on a noise figure in every convention.

use crate::prelude::*;
use turncal::noise::conventions::{Conversion, Figure};

/// States how the figure was interpreted, with one line per convention.
pub fn document(conversion: &Conversion) -> Document {
    let Figure { value, convention } = conversion.given;
    let at = conversion
        .rate_hz
        .map_or(String::new(), |rate| format!(" at {rate} Hz"));
    let mut document = Document::new(format!("{value} {}{at}", convention.unit));
    let meaning = convention.meaning;
    document.lead = vec![format!("Interpreted as {meaning}. Equivalent values:")];
    let row = |&Figure { value, convention }: &Figure| {
        let name = format!("{:>11} {}", digits(value), convention.unit);
        (name, convention.meaning)
    };
    document.both(Facts::new("", conversion.figures.iter().map(row)));
    document.data = json!(conversion);
    document
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
    use turncal::noise::conventions::convert;

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

//! A noise figure in every convention, as text and as a document.

use serde::Serialize;

use crate::noise::conventions::{Conversion, Line};

#[derive(Serialize)]
struct Document {
    quantity: &'static str,
    sensor: &'static str,
    given: Figure,
    rate_hz: Option<f64>,
    figures: Vec<Figure>,
}

#[derive(Serialize)]
struct Figure {
    value: f64,
    unit: &'static str,
    meaning: &'static str,
}

impl From<&Line> for Figure {
    fn from(line: &Line) -> Self {
        Self {
            value: line.value,
            unit: line.unit,
            meaning: line.meaning,
        }
    }
}

/// The conversion as one document.
pub fn document(conversion: &Conversion) -> impl Serialize {
    Document {
        quantity: conversion.quantity,
        sensor: conversion.sensor.name(),
        given: (&conversion.given).into(),
        rate_hz: conversion.rate,
        figures: conversion.lines.iter().map(Figure::from).collect(),
    }
}

/// The conversion as text: how the figure was taken, and a line for each convention.
pub fn text(conversion: &Conversion) -> String {
    let Line {
        value,
        unit,
        meaning,
    } = conversion.given;
    let at = match conversion.rate {
        Some(rate) => format!(" at {rate} Hz"),
        None => String::new(),
    };
    let longest = conversion
        .lines
        .iter()
        .map(|line| line.unit.chars().count());
    let longest = longest.max().unwrap_or(0);
    let mut text = format!(
        "{value} {unit}{at}, read as {}: {meaning}\n\n",
        conversion.quantity
    );
    for line in &conversion.lines {
        text.push_str(&format!(
            "{:>12}  {:<longest$}  {}\n",
            digits(line.value),
            line.unit,
            line.meaning
        ));
    }
    text
}

/// Five digits, with a power of ten where that is shorter.
fn digits(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e6).contains(&value) {
        return format!("{value:.4e}");
    }
    let whole = value.abs().max(1e-3).log10().floor() as i32 + 1;
    format!("{value:.*}", (5 - whole).clamp(0, 7) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_shown_with_five_digits() {
        let shown = [0.3, 18.0, 8.726_646e-5, 123_456.7, 0.005].map(digits);
        assert_eq!(
            shown,
            ["0.30000", "18.000", "8.7266e-5", "123457", "0.0050000"]
        );
    }
}

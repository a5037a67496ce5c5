//! Report on outputs at rest against temperature.

use crate::calibration::{AtRest, AxisAtRest, Calibration, parameter};
use crate::imu::{AXES, PARAMETERS as PER_TRIAD, RATE};
use crate::report::prelude::*;
use crate::run::Run;

/// Maximum number of points of a curve and of drawn seconds.
const POINTS: usize = 101;
const DRAWN: usize = 1500;

/// The complete report.
pub fn document(at_rest: &AtRest, run: &Run, calibration: &Calibration) -> Document {
    let name = &run.recording.name;
    let mut document = Document::new(format!("{name}: outputs at rest against temperature"));
    let range = at_rest.range.gyro;
    document.lead.push(format!(
        "Run {name} stays in one attitude for {:.0} s while its temperature covers {:.1} to {:.1} °C. It can show \
         only bias against temperature; the accelerometer values also contain the scale-factor error times gravity \
         in this attitude.",
        run.recording.imu.duration(),
        range.lowest,
        range.highest
    ));
    document.warnings.items.extend(calibration.warnings.clone());
    document.both(table(at_rest));
    document.page(curves(at_rest));
    document.page(hysteresis(at_rest));
    document.data = data(at_rest);
    document
}

fn group(of: &AxisAtRest) -> Group {
    Group::of(parameter(of.sensor, PER_TRIAD - 3 + of.axis))
}

fn name(of: &AxisAtRest) -> String {
    format!("{} {}", of.sensor.name(), AXES[of.axis])
}

/// Order of the polynomial, and whether it has a rate term.
fn order(of: &AxisAtRest) -> String {
    let order = of.functions.iter().filter(|&&f| f != RATE).count();
    match of.functions.contains(&RATE) {
        true => format!("{order} and rate"),
        false => order.to_string(),
    }
}

fn table(at_rest: &AtRest) -> Table {
    let row = |of: &AxisAtRest| {
        let (unit, symbol) = (group(of).unit_value(), group(of).unit());
        let (value, sigma) = of.at_reference;
        let hysteresis = of.hysteresis.iter().map(|(_, y)| *y);
        let largest = hysteresis.max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let figures = [of.about_mean, of.residual, of.cross_validated, of.cubic];
        let mut row = cells![
            name(of),
            symbol,
            plus_minus(value / unit, sigma / unit),
            order(of)
        ];
        row.extend(figures.map(|figure| three_digits(figure / unit)));
        row.push(or_dash(largest, |y| three_digits(y / unit)));
        row
    };
    let sections = at_rest
        .axes
        .chunks(3)
        .map(|of| of.iter().map(row).collect::<Vec<_>>());
    Table::new(
        "Outputs against temperature",
        columns(
            "output | unit | at the reference ± 1σ | order | RMS about its mean | RMS residual | cross-validated | \
             cubic | largest hysteresis",
        ),
    )
    .sections(sections)
    .note(format!(
        "Reference: {:.1} °C. Cross-validated: RMS of alternate 100 s blocks against a fit to the others; the order \
         and the rate term minimise it. Cubic: the same for a cubic in temperature. Hysteresis: cooling minus \
         heating at the same temperature.",
        at_rest.range.gyro.reference
    ))
}

fn curves(at_rest: &AtRest) -> Plot {
    let panel = |of: &AxisAtRest| {
        let range = at_rest.range.get(of.sensor);
        let unit = group(of).unit_value();
        let step = of.seconds.len().div_ceil(DRAWN).max(1);
        let marks = |cools: bool| {
            let seconds = of.seconds.iter().step_by(step);
            let of_sense = seconds.filter(move |s| (s.rate < 0.0) == cools);
            of_sense
                .map(|s| (s.temperature, (s.output - of.at_reference.0) / unit))
                .collect::<Vec<_>>()
        };
        let curve = steps(range.lowest, range.highest, POINTS).map(|temperature| {
            let (change, sigma) = of.at(range, temperature);
            (temperature, change / unit, sigma / unit)
        });
        let [band, line] = Series::curve(&curve.collect::<Vec<_>>());
        let x = Axis::linear("temperature, °C").room(0.02, 0.02);
        let title = format!("{}, {}", name(of), group(of).unit());
        Panel::new(title, x, Axis::linear("").room(0.02, 0.02))
            .with(band)
            .with_all(
                [(false, 1, "heating"), (true, 2, "cooling")].map(|(cools, n, name)| {
                    let marks = Series::marks(Mark::Dot, marks(cools)).nth(n);
                    marks.width(0.5).key(name)
                }),
            )
            .with(line.width(2.0))
    };
    let (heading, panels) = (
        "Outputs at rest against temperature",
        at_rest.axes.iter().map(panel),
    );
    Plot::new("temperature.svg", heading, (3, 300), panels).caption(
        "Change from the output at the reference temperature. Line: polynomial at constant temperature; band: ±1σ of \
         one-second means, by cross-validation. If heating and cooling differ, the temperature sensor lags the \
         instrument, or the instrument has hysteresis.",
    )
}

fn hysteresis(at_rest: &AtRest) -> Plot {
    let panel = |of: &AxisAtRest| {
        let unit = group(of).unit_value();
        let points = of.hysteresis.iter().map(|&(t, y)| (t, y / unit));
        let title = format!("{}, {}", name(of), group(of).unit());
        let y = Axis::linear("").room(0.05, 0.05);
        Panel::new(title, Axis::linear("temperature, °C"), y)
            .with(Series::zero())
            .with(Series::line(points))
    };
    let (heading, panels) = (
        "Hysteresis: cooling minus heating",
        at_rest.axes.iter().map(panel),
    );
    Plot::new("hysteresis.svg", heading, (3, 220), panels)
        .caption("Mean output during cooling minus mean output during heating, in 2 K bins.")
}

fn data(at_rest: &AtRest) -> Value {
    let axes = at_rest.axes.iter().map(|of| {
        let (value, sigma) = of.at_reference;
        let si = json!({
            "at_reference": value,
            "sigma": sigma,
            "functions": of.functions,
            "coefficients": of.coefficients.as_slice(),
            "rms_about_mean": of.about_mean,
            "rms_residual": of.residual,
            "rms_cross_validated": of.cross_validated,
            "rms_cross_validated_cubic": of.cubic,
            "cooling_less_heating": of.hysteresis,
        });
        (format!("{}.{}", of.sensor.name(), AXES[of.axis]), si)
    });
    Value::Object(axes.collect())
}

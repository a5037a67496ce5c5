//! Report on the biases of an instrument at rest against temperature.

use super::calibration::in_order;
use super::calibration::temperature::{curves, hysteresis, orders};
use super::values;
use crate::prelude::*;
use turncal::calibration::{AtRest, Calibration, MeanAtRest};
use turncal::run::Run;

/// The complete report.
pub fn document(at_rest: &AtRest, run: &Run, calibration: &Calibration) -> Document {
    let name = &run.recording.name;
    let mut document = Document::new(format!("{name}: biases at rest against temperature"));
    let (outputs, thermal) = (&at_rest.outputs, &at_rest.thermal);
    let range = thermal.model.range.gyro;
    document.lead.push(format!(
        "In the run {name}, the instrument stays in one attitude for {:.0} s while the temperature changes from {:.1} \
         to {:.1} °C. Such a recording can show only the biases as a function of temperature; the accelerometer \
         values also contain the scale-factor error times gravity in this attitude.",
        run.recording.imu.duration(),
        range.lowest,
        range.highest
    ));
    document.verdict = values::verdict(calibration);
    document.findings = in_order(&calibration.findings);
    document.brief.push(values::table(calibration).into());
    let magnetometer = values::magnetometer(calibration);
    document.brief.extend(magnetometer.map(Into::into));
    document.brief.push(orders(outputs.form(), thermal).into());
    document.both(hysteresis(outputs.form(), thermal));
    let changes = |index: usize| {
        let means = at_rest.means.iter().filter(|(bias, _)| *bias == index);
        let means = means.flat_map(|(_, means)| means);
        means.map(|mean| (mean.temperature, mean.change)).collect()
    };
    document.page(curves(outputs, thermal, "means over blocks", changes));
    document.page(residuals(at_rest));
    document
}

/// Residuals of the polynomials, separately for heating and cooling.
fn residuals(at_rest: &AtRest) -> Plot {
    let form = at_rest.outputs.form();
    let panel = |(bias, means): &(usize, Vec<MeanAtRest>)| {
        let unit = Group::of(*bias).unit_value();
        let title = format!("{}, {}", short_name(form, *bias), Group::of(*bias).unit());
        let x = Axis::linear("temperature, °C").room(0.02, 0.02);
        let marks = [(false, "heating"), (true, "cooling")].map(|(cools, name)| {
            let of_sense = means.iter().filter(|mean| (mean.rate < 0.0) == cools);
            let points = of_sense.map(|mean| (mean.temperature, mean.residual / unit));
            let nth = usize::from(cools) + 1;
            Series::marks(Mark::Ring, points).nth(nth).key(name)
        });
        Panel::new(title, x, Axis::linear("").room(0.05, 0.05))
            .with(Series::zero())
            .with_all(marks)
    };
    let heading = "Residuals of the biases against temperature";
    let panels = at_rest.means.iter().map(panel);
    Plot::new("residuals-temperature.svg", heading, (3, 260), panels).caption(
        "Mean output over a block of samples minus the polynomial with its rate term. If the heating and cooling \
         curves differ, the temperature sensor lags the inertial sensor, or the instrument has hysteresis.",
    )
}

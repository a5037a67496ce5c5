//! Report on the noise of an instrument: Allan deviations, detected processes, and values for run.toml.

mod data;
mod figure;
mod quantity;
mod tables;
mod words;

use crate::prelude::*;
use turncal::noise::NoiseAnalysis;

pub use figure::smooth;
pub use quantity::deviation_unit;

/// The complete report on the noise of a run with this name.
pub fn document(run: &str, analysis: &NoiseAnalysis) -> Document {
    let NoiseAnalysis {
        stretch, period, ..
    } = analysis;
    let mut document = Document::new(format!(
        "Noise of {run}: {}, {}, {} samples at {} Hz",
        stretch.name,
        duration(analysis.duration()),
        count(stretch.samples.len()),
        three_digits(period.recip())
    ));
    document.warnings.items = words::warnings(analysis);
    for &sensor in &analysis.sensors {
        document.page(figure::figure(analysis, sensor));
    }
    for &sensor in &analysis.sensors {
        document.both(tables::coefficients(analysis, sensor));
    }
    document.both(List::new("Not found", words::advice(analysis)));
    let toml = data::noise_table(analysis);
    document.both(Block::Code("For run.toml".to_owned(), toml));
    document.page(Block::Text("Method".to_owned(), words::METHOD.to_owned()));
    document.data = data::data(run, analysis);
    document
}

#[cfg(test)]
mod tests {
    use super::super::{svg, terminal};
    use super::*;
    use turncal::noise::Stretch;
    use turncal::simulation::Scenario;

    #[test]
    fn the_noise_of_a_simulated_instrument_is_shown() {
        let mut scenario = Scenario::load("demo-six-position").unwrap();
        scenario.integrator.period = 0.1;
        let run = scenario.simulate(1, 0).unwrap().run;
        let stretch = Stretch::find(&run, None).unwrap();
        let document = document("made-up", &NoiseAnalysis::new(&run, stretch));
        insta::assert_snapshot!(terminal::layout(&document, 100));
        let drawn = svg::drawn(document.plots());
        assert!(drawn[0].contains("cluster time") && drawn[1].contains("accel z, µg"));
    }
}

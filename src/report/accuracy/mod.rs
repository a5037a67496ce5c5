//! The report of a study of accuracy.

mod data;
mod facts;
mod figures;
mod tables;
#[cfg(test)]
mod tests;
mod verdict;

use super::document::{Document, List};
use super::effects;
use super::number::count;
use crate::imu::Sensor;
use crate::study::accuracy::{Journey, Region};
use crate::study::{Accuracy, Figures};
use crate::units::NAUTICAL_MILE;

/// Everything that is said of the study.
pub fn document(accuracy: &Accuracy) -> Document {
    let mut document = Document::new(format!(
        "Accuracy of the filter over {} simulated runs of {}",
        count(accuracy.trials.len()),
        accuracy.study.scenario.name
    ));
    let (good, bad) = verdict::verdict(accuracy);
    document.conclusions = List::new("What holds", good);
    document.warnings = List::new("To be noted", bad);
    document.both(facts::facts(accuracy));
    document.both(tables::bound(accuracy));
    document.both(tables::gain(accuracy));
    document.both(tables::consistency(accuracy));
    document.both(tables::auxiliary(accuracy));
    document.both(effects::costs(&accuracy.effects));
    document.both(effects::explained(&accuracy.effects));
    document.both(tables::containment(accuracy));
    for plot in figures::figures(accuracy) {
        document.page(plot);
    }
    document.data = data::data(accuracy);
    document
}

/// Something whose error is compared, with how it is shown.
struct Compared<'a> {
    title: String,
    /// The triad; none of a position.
    sensor: Option<Sensor>,
    /// Symbol of the unit.
    unit: &'static str,
    /// The unit in SI.
    unit_value: f64,
    figures: &'a Figures,
}

/// The parameters group by group, then the position after each mission.
fn compared(accuracy: &Accuracy) -> Vec<Compared<'_>> {
    let groups = accuracy.groups.iter().map(|of| Compared {
        title: of.group.title(),
        sensor: Some(of.group.sensor()),
        unit: of.group.unit(),
        unit_value: of.group.unit_value(),
        figures: &of.figures,
    });
    let positions = accuracy.navigation.iter().map(|of| Compared {
        title: format!("position, {}", journey_name(of.journey)),
        sensor: None,
        unit: "nmile",
        unit_value: NAUTICAL_MILE,
        figures: &of.figures,
    });
    groups.chain(positions).collect()
}

/// A mission in a word.
fn journey_name(journey: Journey) -> &'static str {
    match journey {
        Journey::Standing => "stationary",
        Journey::Flight => "flight",
    }
}

/// A region in words.
fn region_name(region: Region) -> String {
    match region {
        Region::East => "east within 1σ".to_owned(),
        Region::North => "north within 1σ".to_owned(),
        Region::Ellipse(sigmas) => format!("inside the {sigmas}σ ellipse"),
    }
}

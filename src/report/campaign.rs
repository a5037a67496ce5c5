//! Report on a study of campaigns.

use super::accuracy::tables::against_bound;
use crate::report::prelude::*;
use crate::study::CampaignAccuracy;

/// The complete report on a study.
pub fn document(accuracy: &CampaignAccuracy) -> Document {
    let study = &accuracy.study;
    let mut document = Document::new(format!("Accuracy of campaigns: {}", study.campaign.name));
    document.lead.push(format!(
        "{} simulated campaigns of {} recording(s), seed {}; {} gave no calibration. Errors refer to the parameters \
         at the reference temperature and the selected Legendre coefficients.",
        study.runs,
        study.campaign.recordings.len(),
        study.seed,
        accuracy.failures,
    ));
    if let Some((anees, interval)) = accuracy.anees() {
        let good = (interval.0..=interval.1).contains(&anees);
        document.say(
            good,
            format!(
                "NEES/n of all parameters and coefficients is {anees:.4} (99 % interval for correct σ: {:.4} to \
                 {:.4}).",
                interval.0, interval.1
            ),
        );
    }
    document.both(figures(accuracy));
    if accuracy.functions().len() > 1 {
        document.both(orders(accuracy));
    }
    document.data = data(accuracy);
    document
}

fn figures(accuracy: &CampaignAccuracy) -> Table {
    let row = |group: Group, function: Option<usize>| {
        let (of, campaigns) = accuracy.figures(group, function)?;
        let name = format!("{}, {}", group.short(), function_name(function));
        let row = cells![name, group.unit(), count(campaigns)];
        Some([row, against_bound(&of, group.unit_value())].concat())
    };
    let sections = Group::all().map(|group| {
        let functions = accuracy.functions().into_iter();
        functions
            .filter_map(|function| row(group, function))
            .collect::<Vec<_>>()
    });
    Table::new(
        "RMS errors against σ and bound",
        columns("| unit | campaigns | RMS error | RMS σ | RMS bound | error/bound | 99 % interval"),
    )
    .sections(sections)
    .note("Bound: Cramér–Rao bound, linearised at the truth with the selected orders.")
}

fn orders(accuracy: &CampaignAccuracy) -> Table {
    let rows = Group::all().map(|group| {
        let (right, all) = accuracy.right_orders(group);
        vec![group.short(), format!("{right} of {all}")]
    });
    Table::new("Orders selected correctly", ["", "campaigns"]).section(rows)
}

fn data(accuracy: &CampaignAccuracy) -> Value {
    let mut groups = Map::new();
    for group in Group::all() {
        let mut of_group = Map::new();
        for function in accuracy.functions() {
            if let Some((of, campaigns)) = accuracy.figures(group, function)
                && let Some(ratio) = of.ratio
            {
                let unit = group.unit_value();
                let figures = json!({
                    "campaigns": campaigns,
                    "rms_error": of.filter / unit,
                    "rms_sigma": of.claimed / unit,
                    "rms_bound": of.bound / unit,
                    "ratio": ratio.value,
                    "ratio_interval": [ratio.interval.0, ratio.interval.1],
                });
                of_group.insert(function_name(function), figures);
            }
        }
        let (right, all) = accuracy.right_orders(group);
        of_group.insert("order_right".to_owned(), json!([right, all]));
        groups.insert(group.key(), Value::Object(of_group));
    }
    let anees = accuracy.anees();
    json!({
        "campaign": accuracy.study.campaign.name,
        "runs": accuracy.study.runs,
        "failures": accuracy.failures,
        "anees": anees.map(|(mean, _)| mean),
        "anees_interval_99": anees.map(|(_, interval)| [interval.0, interval.1]),
        "groups": groups,
    })
}

//! Position errors after each mission over the σ that were predicted of them.

use std::f64::consts::TAU;

use plotters::style::text_anchor::{HPos, VPos};

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, INK, Pen, QUIET};
use super::super::number::count;
use super::super::panel::{Margins, Mark, Panel};
use super::super::{Figure, ReportError};
use super::merit::journey_name;
use super::tables::percent;
use crate::study::accuracy::{Position, Region};
use crate::study::{Accuracy, NavigationAccuracy};

/// The least half width of the axes, in σ.
const REACH: f64 = 4.0;
const CIRCLE: usize = 180;

/// Such that both axes of a panel have the same scale.
const SIZE: (u32, u32) = (1200, 570);
const MARGINS: Margins = Margins {
    left: 60.0,
    right: 38.0,
};

pub(super) fn figure(accuracy: &Accuracy) -> Result<Option<Figure>, ReportError> {
    let navigated = &accuracy.navigation;
    if navigated.is_empty() {
        return Ok(None);
    }
    let clouds: Vec<Vec<(f64, f64)>> = navigated
        .iter()
        .map(|of| {
            let whitened = of.positions.iter().filter_map(Position::whitened);
            whitened.map(|z| (z.x, z.y)).collect()
        })
        .collect();
    let sizes = clouds.iter().flatten().flat_map(|p| [p.0.abs(), p.1.abs()]);
    let reach = sizes.fold(REACH, |most, size| most.max(1.1 * size));
    let caption = String::from(
        "Horizontal position error of the EKF after 40 h over the σ predicted from its covariance, one \
         dot for each run, the same axes for all. Across: east over its σ; up: what north differs from \
         that which east lets expect, over the σ of that. So the ellipses of all runs are circles: \
         solid 1σ, dashed 2.45σ. Where the axes end far beyond ±4 the σ are too small, and the circles \
         a speck in the middle.",
    );
    Figure::draw(
        "position.svg",
        "Position errors over predicted σ",
        caption,
        SIZE,
        |area| {
            let areas = area.split_evenly((1, navigated.len().max(2)));
            for ((of, cloud), area) in navigated.iter().zip(&clouds).zip(areas) {
                panel(&area, of, cloud, reach)?;
            }
            Ok(())
        },
    )
    .map(Some)
}

fn panel(
    area: &Area,
    of: &NavigationAccuracy,
    cloud: &[(f64, f64)],
    reach: f64,
) -> Result<(), DrawError> {
    let mut panel = Panel::new(
        area,
        &format!("{}: north given east, σ", journey_name(of.journey)),
        MARGINS,
        (Axis::linear(-reach, reach), Axis::linear(-reach, reach)),
        "east, σ",
        &[],
    )?;
    for line in [[(-reach, 0.0), (reach, 0.0)], [(0.0, -reach), (0.0, reach)]] {
        panel.line(&line, Pen::solid(QUIET, 0.75))?;
    }
    let ellipses = Region::ALL.into_iter().filter_map(|region| match region {
        Region::Ellipse(sigmas) => Some(sigmas),
        Region::East | Region::North => None,
    });
    for (n, sigmas) in ellipses.enumerate() {
        let circle: Vec<(f64, f64)> = (0..=CIRCLE)
            .map(|k| TAU * k as f64 / CIRCLE as f64)
            .map(|angle| (sigmas * angle.cos(), sigmas * angle.sin()))
            .collect();
        let pen = if n == 0 {
            Pen::solid(INK, 1.5)
        } else {
            Pen::dashed(INK, 1.5)
        };
        panel.line(&circle, pen)?;
    }
    panel.marks(cloud, Mark::Dot, Pen::nth(0, 1.0))?;
    let mut notes = vec![format!("{} runs", count(cloud.len()))];
    for held in &of.containment {
        if let Region::Ellipse(sigmas) = held.region {
            notes.push(format!(
                "within {sigmas}σ: {} %, claimed {} %",
                percent(held.within as f64 / held.runs as f64),
                percent(held.region.probability()),
            ));
        }
    }
    for (line, note) in notes.iter().enumerate() {
        let below = (6.0, 6.0 + 17.0 * line as f64);
        panel.text((-reach, reach), below, note, (HPos::Left, VPos::Top))?;
    }
    panel.finish()
}

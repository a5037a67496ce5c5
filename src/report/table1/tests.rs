//! What holds of the report of any table.

use std::sync::OnceLock;

use serde_json::Value;

use super::*;
use crate::study::Table1Study;
use crate::units::DEGREE;

fn small() -> &'static Table1 {
    static TABLE: OnceLock<Table1> = OnceLock::new();
    TABLE.get_or_init(|| {
        let study = Table1Study {
            samples: 60,
            seed: 4,
            hours: 40.0,
            latitude: 45.78 * DEGREE,
        };
        study.run().unwrap()
    })
}

#[test]
fn every_figure_of_the_paper_is_a_file_and_on_the_page() {
    let directory = tempfile::tempdir().unwrap();
    write(small(), directory.path()).unwrap();
    let read = |name: &str| std::fs::read_to_string(directory.path().join(name)).unwrap();
    let page = read("index.html");
    let mut lines = Vec::new();
    for number in 2..=9 {
        let name = format!("figure-{number}.svg");
        assert!(page.contains(&name), "{name}");
        lines.push(read(&name).matches("<polyline").count());
    }
    // Fifty courses, their mean and ±σ in each panel, beside grids.
    assert!(lines.iter().all(|&n| n > 2 * 51), "{lines:?}");
    for text in [page, summary(small())] {
        assert!(!text.contains("NaN") && !text.contains("inf"));
    }
}

#[test]
fn each_figure_stands_beside_the_papers_with_its_verdict() {
    let text = summary(small());
    for expected in [
        "39.4",
        "0.000000055",
        "Gyros, six-angle form (Eq. 8): not reproducible by a correct program, which gives zero",
        "a slip gives the paper's figures: E_zy of the wrong sign",
        "Gyros, three-angle form (Eq. 10): not reproduced as stated, but under another reading: angles \
         ±0.2°, 48 h. With angles ±0.2° all agree but position",
        "Accelerometers, six-angle form (Eq. 8): zero but for rounding",
        "Accelerometers, three-angle form (Eq. 10): reproduced as stated",
    ] {
        assert!(text.contains(expected), "no {expected:?} in\n{text}");
    }
}

#[test]
fn a_document_gives_every_reading_in_the_units_of_its_keys() {
    let document: Value = serde_json::to_value(document(small())).unwrap();
    assert_eq!(document["samples"], 60);
    let rows = document["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 12);
    let stated = &rows[3];
    assert_eq!(
        (stated["sensor"].as_str(), stated["form"].as_str()),
        (Some("gyro"), Some("three-angle"))
    );
    let paper = stated["paper_mean"]["position_nmile"].as_f64().unwrap();
    assert!((paper - 39.42).abs() < 1e-12, "{paper}");
    let mean = small().columns[1].stated.sample[4].mean;
    assert_eq!(stated["mean"]["position_nmile"], mean / 1852.0);
}

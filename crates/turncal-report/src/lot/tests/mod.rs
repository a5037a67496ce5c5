//! What is said of a drawn lot.

use super::super::{svg, terminal};
use super::*;
mod drawn;

use drawn::{Draw, drawn};
use turncal::lot::{Limit, Specification};

/// Twenty units, one of them apart and one that failed, against a limit on the first scale factor.
fn lot() -> Lot {
    let mut units = drawn(
        20,
        Draw {
            spread: 30.0 * PPM,
            sigma: 1.0 * PPM,
            shared: 0.0,
        },
        5,
    );
    if let Ok(of) = &mut units[4].calibrated {
        of.calibration.gyro.scale[0] *= 1.001;
    }
    units[7].calibrated = Err("no log".to_owned());
    let limit = Limit {
        parameter: 0,
        nominal: 1.0,
        within: 500.0 * PPM,
    };
    let specification = Specification {
        confidence: 0.95,
        limits: vec![limit],
    };
    Lot::new(units, None, Some(specification))
}

#[test]
fn what_is_wrong_with_a_lot_is_said_with_the_names_of_its_units() {
    let document = document(&lot());
    assert_eq!(document.warnings.items, ["unit-7: no log"]);
    let text = terminal::text(&document, Some(100));
    assert!(
        text.contains("1 of 20 limits exceeded, 18 met, 1 undecided"),
        "{text}"
    );
    assert!(text.contains("fail: gyro K x") && text.contains("not calibrated"));
    // The outlier, in the table of units and in that of parameters.
    for (start, end) in [("unit-4 ", "gyro K x"), ("gyro K x ", "1 of 19")] {
        let mut lines = text.lines();
        let is_it = |line: &str| line.starts_with(start) && line.ends_with(end);
        assert!(lines.any(is_it), "{start} {end}\n{text}");
    }
}

#[test]
fn every_figure_is_drawn_and_every_value_written() {
    let document = document(&lot());
    for plot in document.plots() {
        let drawn = svg::draw(plot);
        assert!(!drawn.contains("NaN"), "{}", plot.file);
    }
    // Six scale factors of nineteen units, a row for the one without, and the header.
    let (name, table) = &document.files[0];
    assert_eq!(
        (name.as_str(), table.lines().count()),
        ("lot.csv", 6 * 19 + 2)
    );
    let of = |name: &str| {
        let quantities = document.data["quantities"].as_array().unwrap();
        quantities
            .iter()
            .find(|q| q["name"] == name)
            .unwrap()
            .clone()
    };
    let scale = of("gyro.scale.x");
    assert_eq!(scale["outliers"][0], "unit-4");
    let [low, high] = [0, 1].map(|k| scale["spread_interval"][k].as_f64().unwrap());
    assert!(low < 30.0 && 30.0 < high && high < 60.0, "{low} {high}");
    assert_eq!(document.data["units"][4]["outside"][0], "gyro.scale.x");
    let value = &document.data["units"][4]["values"]["gyro.scale.x"];
    assert!(
        (value["value"].as_f64().unwrap() - 1000.0).abs() < 200.0,
        "{value}"
    );
    assert_eq!(
        (&value["unit"], &value["verdict"]),
        (&"ppm".into(), &"fail".into())
    );
}

#[test]
fn a_lot_without_units_limits_or_figures_is_still_a_document() {
    let document = document(&Lot::new(Vec::new(), None, None));
    svg::drawn(document.plots());
    assert!(terminal::text(&document, Some(80)).contains("Comparison of 0 calibrations"));
}

#[test]
fn a_single_unit_has_every_limit_and_nothing_of_a_lot() {
    let draw = Draw {
        spread: 30.0 * PPM,
        sigma: 1.0 * PPM,
        shared: 0.0,
    };
    let limit = |parameter| Limit {
        parameter,
        nominal: 1.0,
        within: if parameter == 0 { 1e-9 } else { 4000.0 * PPM },
    };
    let specification = Specification {
        confidence: 0.95,
        limits: vec![limit(1), limit(0)],
    };
    let document = document(&Lot::new(drawn(1, draw, 5), None, Some(specification)));
    assert_eq!(document.plots().count(), 0);
    let text = terminal::text(&document, Some(80));
    let [failed, passed] = ["gyro K x", "gyro K y"].map(|name| text.find(name));
    assert!(failed < passed && passed.is_some(), "{text}");
    assert!(
        text.contains("±4\u{202f}000") && !text.contains("χ²"),
        "{text}"
    );
}

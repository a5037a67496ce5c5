//! Properties of every figure.

use super::super::plot::{Axis, Mark, Panel, Plot, Series};
use super::canvas::{LETTER, width};
use super::*;

/// The value of an attribute.
fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = tag.split_once(&format!(" {name}=\""))?;
    rest.split_once('"').map(|(value, _)| value)
}

fn number(tag: &str, name: &str) -> f64 {
    let of = attribute(tag, name).and_then(|value| value.parse().ok());
    of.unwrap_or_else(|| panic!("{name} of {tag}"))
}

/// Left, right, upper and lower end of every text, in shown pixels.
fn texts(svg: &str) -> Vec<(String, [f64; 4])> {
    let tags = svg.split("<text").skip(1);
    tags.map(|tag| {
        let (tag, rest) = tag.split_once('>').unwrap();
        let text = rest.split_once("</text>").unwrap().0.trim().to_owned();
        let [x, y, size] = ["x", "y", "font-size"].map(|name| number(tag, name) / canvas::FINE);
        let width = width(&text.replace("&lt;", "<"), size / LETTER);
        // Upward names end at their point.
        if attribute(tag, "transform").is_some() {
            return (text, [x - 0.5 * size, x + 0.5 * size, y, y + width]);
        }
        let start = match attribute(tag, "text-anchor") {
            Some("middle") => x - 0.5 * width,
            Some("end") => x - width,
            _ => x,
        };
        let foot = match attribute(tag, "dy") {
            Some("0.76em") => y + 0.76 * size,
            Some(_) => y + 0.25 * size,
            None => y,
        };
        (
            text,
            [start, start + width, foot - 0.8 * size, foot + 0.25 * size],
        )
    })
    .collect()
}

/// Requirements for any figure: complete, finite numbers, labels inside.
pub fn assert_sound(figures: &[String]) {
    for svg in figures {
        let head = &svg[..svg.find('>').unwrap()];
        let [wide, height] = ["width", "height"].map(|name| number(head, name));
        assert!(svg.ends_with("</svg>\n"));
        for bad in [
            "NaN",
            "inf\"",
            "inf,",
            "inf ",
            "points=\"\"",
            "<script",
            "href",
        ] {
            assert!(!svg.contains(bad), "{bad}");
        }
        for (text, [left, right, top, bottom]) in texts(svg) {
            let inside = left >= 0.0 && right <= wide && top >= 0.0 && bottom <= height;
            assert!(
                inside,
                "`{text}` from {left} to {right}, {top} to {bottom} of {height}"
            );
        }
    }
}

/// Figures that were drawn and meet the requirements.
pub fn drawn<'a>(plots: impl Iterator<Item = &'a Plot>) -> Vec<String> {
    let plots: Vec<&Plot> = plots.collect();
    for width in WIDTHS {
        let figures: Vec<String> = plots.iter().map(|plot| draw_at(plot, width)).collect();
        assert_sound(&figures);
    }
    plots.into_iter().map(draw).collect()
}

fn of(panels: impl IntoIterator<Item = Panel>) -> String {
    draw(&Plot::new("a.svg", "A", (2, 200), panels))
}

#[test]
fn a_figure_has_its_size() {
    let svg = of([]);
    assert!(svg.starts_with(r#"<svg width="1200" height="200" viewBox="0 0 1200 200""#));
}

#[test]
fn names_at_the_ends_of_lines_never_overlap_and_long_ones_are_cut() {
    let long = "a calibration with a name that nobody can read to its end".repeat(3);
    let line = |n: i32| Series::line([(0.0, 1.0), (1.0, 1.0 + 1e-3 * f64::from(n))]);
    let panel = Panel::new("title", Axis::linear("x"), Axis::linear(""))
        .with_all((0..8).map(|n| line(n).label(format!("line {n}"))))
        .with(line(9).label(long));
    let svg = of([panel.clone(), panel]);
    assert_sound(std::slice::from_ref(&svg));
    let mut names: Vec<_> = texts(&svg)
        .into_iter()
        .filter(|(t, _)| t.starts_with("line"))
        .collect();
    assert_eq!(names.len(), 16);
    names.sort_by(|a, b| (a.1[0] as i64, a.1[2] as i64).cmp(&(b.1[0] as i64, b.1[2] as i64)));
    for pair in names.chunks(8).flat_map(|column| column.windows(2)) {
        assert!(pair[1].1[2] - pair[0].1[2] > 13.0, "{pair:?}");
    }
    assert!(svg.contains('…'));
}

#[test]
fn numbers_that_are_none_are_drawn_as_gaps() {
    let nan = (f64::NAN, f64::NAN);
    let points = [
        (0.0, 1.0),
        (1.0, f64::INFINITY),
        nan,
        (2.0, 3.0),
        (3.0, 4.0),
        nan,
    ];
    let panel = Panel::new("", Axis::linear(""), Axis::log(""))
        .with(Series::line(points))
        .with(Series::marks(Mark::Ring, points))
        .with(Series::band(vec![nan; 3], vec![nan; 3]))
        .with(Series::level(2.0).label("level"));
    assert_sound(&[of([panel])]);
}

#[test]
fn ticks_leave_each_other_room() {
    let places = (0..40).map(|k| format!("place number {k}"));
    let panel = Panel::new("", Axis::places(places), Axis::log("").between(1.0, 1e9))
        .with(Series::line([(0.0, 0.0)]));
    let svg = draw(&Plot::new("a.svg", "A", (1, 120), [panel]));
    let ticks: Vec<f64> = texts(&svg)
        .into_iter()
        .filter(|(text, _)| text.contains("10") && !text.contains("place"))
        .map(|(_, ends)| ends[2])
        .collect();
    for (k, y) in ticks.iter().enumerate() {
        assert!(
            ticks[..k].iter().all(|other| (other - y).abs() > 12.0),
            "{ticks:?}"
        );
    }
}

#[test]
fn who_hovers_over_a_mark_sees_its_name_place_and_interval() {
    let places = ["x", "y"].map(str::to_owned);
    let panel = Panel::new("bias, °/h", Axis::places(places), Axis::linear(""))
        .with(Series::measured(Mark::Dot, [(0.1, 1.5, 0.25), (1.1, 2.0, f64::NAN)]).key("EKF <1>"));
    let svg = of([panel]);
    assert!(
        svg.contains("<title>EKF &lt;1&gt;\nx\nbias, °/h: 1.50 (1.25 … 1.75)</title>"),
        "{svg}"
    );
    assert!(svg.contains("\ny\nbias, °/h: 2.00</title>"), "{svg}");
    assert_sound(&[svg]);
}

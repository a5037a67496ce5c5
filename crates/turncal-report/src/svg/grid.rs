//! Panels in rows: scales, margins, frames, ticks, titles, tags and notes.

use plotters::style::RGBColor;

use super::super::plot::{Panel, Plot, Scale};
use super::canvas::{
    Canvas, Frame, HPos, INK, LETTER, QUIET, SMALL, VPos, WIDTH, rgb, shortened, width,
};
use super::series;

/// Grid lines.
const GRID: RGBColor = RGBColor(218, 218, 214);
/// Shading of dwells.
const SHADE: RGBColor = RGBColor(243, 243, 238);
/// Space above the axes for the title.
const TOP: f64 = 26.0;
/// Distance between lines of text.
const LINE: f64 = 17.0;
/// Number of lines over which tags are spread.
const TAG_LINES: usize = 3;
/// Relative size of the letters of tags.
const TAG: f64 = 0.85;
/// Maximum fraction of the width of a panel for names at the ends of lines.
const LABELS: f64 = 0.3;

/// Draws it and returns the height of the figure.
pub fn draw(on: &mut Canvas, plot: &Plot) -> u32 {
    let panel_width = f64::from(WIDTH) / plot.columns as f64;
    for column in 0..plot.columns {
        let panels = plot.panels.iter().skip(column).step_by(plot.columns);
        let scaled: Vec<(&Panel, (Scale, Scale))> = panels.map(|p| (p, p.scales())).collect();
        // All panels of a column have the same margins.
        let left = scaled.iter().map(|(_, (_, y))| widest(&y.ticks) + 14.0);
        let right = scaled
            .iter()
            .map(|(panel, (x, _))| right(panel, x, panel_width));
        let [left, right] = [left.fold(14.0, f64::max), right.fold(14.0, f64::max)];
        let origin = panel_width * column as f64;
        let across = (origin + left, origin + panel_width - right);
        for (row, (panel, (x, y))) in scaled.into_iter().enumerate() {
            let names = names(&x, (across.1 - across.0) / x.ticks.len().max(1) as f64);
            let lines = names.iter().map(Vec::len).max().unwrap_or(1).max(1);
            let lines = lines + usize::from(!panel.x.title.is_empty());
            let top = f64::from(plot.height) * row as f64;
            let bottom = top + f64::from(plot.height) - 12.0 - LINE * lines as f64;
            let down = (top + TOP, bottom);
            let square = (across.0, across.0 + down.1 - down.0);
            let frame = Frame {
                panel,
                x,
                y,
                across: if panel.square { square } else { across },
                down,
                end: origin + panel_width,
            };
            of_panel(on, &frame, &names);
        }
    }
    plot.height * plot.panels.len().div_ceil(plot.columns).max(1) as u32
}

fn widest(ticks: &[(f64, String)]) -> f64 {
    let widths = ticks.iter().map(|(_, label)| width(label, SMALL));
    widths.fold(0.0, f64::max)
}

/// Space for names at the ends of lines, or for half of the last tick label.
fn right(panel: &Panel, x: &Scale, panel_width: f64) -> f64 {
    let labels = panel
        .series
        .iter()
        .filter_map(|series| series.label.as_ref());
    let widest = labels
        .map(|text| width(text, SMALL) + 18.0)
        .fold(0.0, f64::max);
    let last = x.ticks.iter().max_by(|a, b| a.0.total_cmp(&b.0));
    let half = last.filter(|_| panel.x.places.is_empty());
    let half = half.map_or(0.0, |(_, label)| 0.5 * width(label, SMALL) + 4.0);
    widest.min(LABELS * panel_width).max(half)
}

/// Minimum number of letters in a line of a name.
const LETTERS: usize = 6;

/// Labels of the horizontal ticks; names are broken into as many lines as needed.
fn names(x: &Scale, room: f64) -> Vec<Vec<String>> {
    let letters = (room / (0.6 * LETTER * SMALL)) as usize;
    let lines = |label: &String| {
        if width(label, SMALL) < room || letters < LETTERS {
            return vec![label.clone()];
        }
        let lines = textwrap::wrap(label, textwrap::Options::new(letters).break_words(false));
        lines.into_iter().map(|line| line.into_owned()).collect()
    };
    x.ticks.iter().map(|(_, label)| lines(label)).collect()
}

fn of_panel(on: &mut Canvas, frame: &Frame, names: &[Vec<String>]) {
    let (panel, (left, right), (top, bottom)) = (frame.panel, frame.across, frame.down);
    for range in &panel.shading {
        let (start, end) = (range.start.max(frame.x.low), range.end.min(frame.x.high));
        if end > start {
            let corners = [(frame.at_x(start), top), (frame.at_x(end), bottom)];
            on.rectangle(corners, SHADE);
        }
    }
    ticks(on, frame, names);
    on.stroke(&[(left, top), (left, bottom), (right, bottom)], QUIET, 0.75);
    let at = (left, top - TOP + 6.0);
    on.text(&panel.title, at, (HPos::Left, VPos::Top), INK, 1.0);
    keys(on, frame, top - TOP + 6.0);
    for series in &panel.series {
        series::draw(on, frame, series);
    }
    tags(on, frame);
    for (line, note) in panel.notes.iter().enumerate() {
        let at = (right - 6.0, top + 6.0 + LINE * line as f64);
        on.text(note, at, (HPos::Right, VPos::Top), INK, SMALL);
    }
    labels(on, frame)
}

fn ticks(on: &mut Canvas, frame: &Frame, names: &[Vec<String>]) {
    let ((left, right), (top, bottom)) = (frame.across, frame.down);
    let mut taken: Vec<f64> = Vec::new();
    for (value, label) in &frame.y.ticks {
        let y = frame.at_y(*value);
        if taken.iter().any(|other| (other - y).abs() < LETTER) {
            continue;
        }
        taken.push(y);
        on.stroke(&[(left, y), (right, y)], GRID, 0.75);
        on.stroke(&[(left - 3.0, y), (left, y)], QUIET, 0.75);
        on.text(
            label,
            (left - 6.0, y),
            (HPos::Right, VPos::Center),
            INK,
            SMALL,
        );
    }
    let mut taken: Vec<(f64, f64)> = Vec::new();
    for ((value, _), lines) in frame.x.ticks.iter().zip(names) {
        let x = frame.at_x(*value);
        let half = 0.5
            * lines
                .iter()
                .map(|line| width(line, SMALL))
                .fold(0.0, f64::max);
        let is_place = !frame.panel.x.places.is_empty();
        let shown = if is_place {
            x.clamp(left + half, (right - half).max(left + half))
        } else {
            x
        };
        let gap = if is_place { 0.0 } else { 6.0 };
        let near = |&(other, of): &(f64, f64)| (other - shown).abs() < half + of + gap;
        on.stroke(&[(x, top), (x, bottom)], GRID, 0.75);
        on.stroke(&[(x, bottom), (x, bottom + 3.0)], QUIET, 0.75);
        if taken.iter().any(near) {
            continue;
        }
        taken.push((shown, half));
        for (n, line) in lines.iter().enumerate() {
            let at = (shown, bottom + 6.0 + LINE * n as f64);
            on.text(line, at, (HPos::Center, VPos::Top), INK, SMALL);
        }
    }
    let lines = names.iter().map(Vec::len).max().unwrap_or(1).max(1) as f64;
    let at = (0.5 * (left + right), bottom + 6.0 + LINE * lines);
    let title = &frame.panel.x.title;
    if title.is_empty() {
        return;
    }
    on.text(title, at, (HPos::Center, VPos::Top), INK, SMALL)
}

/// Names with a colour sample, from the right end of the title line.
fn keys(on: &mut Canvas, frame: &Frame, y: f64) {
    let mut x = frame.across.1;
    for series in frame.panel.series.iter().rev() {
        let Some(key) = &series.key else { continue };
        x -= width(key, SMALL);
        on.text(key, (x, y), (HPos::Left, VPos::Top), INK, SMALL);
        let sample = [(x - 16.0, y + 3.0), (x - 5.0, y + 14.0)];
        on.rectangle(sample, rgb(series.pen.color));
        x -= 28.0;
    }
}

/// Tags in the first line with space; tags without space are omitted.
fn tags(on: &mut Canvas, frame: &Frame) {
    let (left, right) = frame.across;
    let mut taken = [f64::NEG_INFINITY; TAG_LINES];
    for (x, text) in &frame.panel.tags {
        let half = 0.5 * width(text, TAG);
        if half > 0.5 * (right - left) {
            continue;
        }
        let at = frame.at_x(*x).clamp(left + half, right - half);
        let Some(line) = taken.iter().position(|end| *end < at - half) else {
            continue;
        };
        taken[line] = at + half + 6.0;
        let place = (at, frame.down.0 + 3.0 + 15.0 * line as f64);
        on.text(text, place, (HPos::Center, VPos::Top), QUIET, TAG);
    }
}

/// Names at the ends of lines, pushed apart where they would overlap, each with a leader to its line.
fn labels(on: &mut Canvas, frame: &Frame) {
    let labelled = frame.panel.series.iter();
    let labelled = labelled.filter_map(|s| {
        let end = s.shape.end().filter(|end| end.1.is_finite())?;
        Some((frame.at(end), s.label.as_ref()?, rgb(s.pen.color)))
    });
    let mut labels: Vec<_> = labelled.collect();
    labels.sort_by(|a, b| a.0.1.total_cmp(&b.0.1));
    let heights: Vec<f64> = labels.iter().map(|label| label.0.1).collect();
    let right = frame.across.1;
    for (((x, y), text, color), shown_at) in labels.into_iter().zip(spread(&heights, frame.down)) {
        on.stroke(&[(x, y), (right, y)], color, 0.4);
        on.stroke(&[(right + 1.0, y), (right + 9.0, shown_at)], color, 0.75);
        let text = shortened(text, frame.end - right - 12.0);
        let at = (right + 11.0, shown_at);
        on.text(&text, at, (HPos::Left, VPos::Center), color, SMALL);
    }
}

/// Ascending heights moved at least one line apart, within the frame if space permits.
fn spread(heights: &[f64], (top, bottom): (f64, f64)) -> Vec<f64> {
    let most = (bottom - top) / heights.len().max(1) as f64;
    let spacing = LETTER.min(most);
    let mut heights = heights.to_vec();
    let mut free = top;
    for height in &mut heights {
        *height = height.max(free);
        free = *height + spacing;
    }
    let mut free = bottom;
    for height in heights.iter_mut().rev() {
        *height = height.min(free);
        free = *height - spacing;
    }
    heights
}

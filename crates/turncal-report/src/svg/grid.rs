//! Panels in rows: scales, margins, frames, ticks, titles, tags and notes.

use super::super::plot::{Panel, Plot, Scale, Series, Shape};
use super::canvas::{
    BAND, Canvas, Frame, GRID, HPos, INK, LETTER, QUIET, SHADE, SMALL, VPos, rgb, shortened, width,
};
use super::series;
use super::words::{LINE, Names, UPWARD, keys, title};

/// Space above the axes for the title.
const TOP: f64 = 26.0;
/// Space below the names of the horizontal axis.
const BOTTOM: f64 = 12.0;
/// Minimum width of a panel next to another.
const NARROWEST: u32 = 340;
/// Number of lines over which tags are spread.
const TAG_LINES: usize = 3;
/// Relative size of the letters of tags.
const TAG: f64 = 0.88;
/// Maximum fraction of the width of a panel for names at the ends of lines.
const LABELS: f64 = 0.3;
/// Minimum distance between upward names.
const CLOSEST: f64 = 10.0;

/// A panel with its scales.
type Scaled<'p> = (&'p Panel, (Scale, Scale));

/// Draws the figure in this width and returns its height.
pub fn draw(on: &mut Canvas, plot: &Plot, width: u32) -> u32 {
    let columns = plot.columns.min((width / NARROWEST).max(1) as usize);
    let panel_width = f64::from(width) / columns as f64;
    let scaled: Vec<Scaled> = plot.panels.iter().map(|p| (p, p.scales())).collect();
    let across: Vec<(f64, f64)> = (0..columns)
        .map(|column| {
            let panels = scaled.iter().skip(column).step_by(columns);
            axes(panels, panel_width * column as f64, panel_width)
        })
        .collect();
    let mut top = 0.0;
    for row in scaled.chunks(columns) {
        let placed = row.iter().zip(&across);
        let keys: Vec<Vec<Vec<&Series>>> = placed
            .map(|(scaled, across)| keys(scaled.0, across.1 - across.0))
            .collect();
        // Axes of a row begin at one height.
        let lines = row.iter().zip(&keys);
        let lines = lines.map(|((panel, _), keys)| title(panel, panel_width).len() + keys.len());
        let above = TOP + LINE * (lines.max().unwrap_or(2) - 2) as f64;
        let is_square = row.iter().any(|(panel, _)| panel.square);
        let most = if is_square {
            panel_width + TOP
        } else {
            f64::INFINITY
        };
        let bottom = top + above - TOP + f64::from(plot.height).min(most);
        for (column, ((panel, (x, y)), keys)) in row.iter().zip(&keys).enumerate() {
            let (mut across, origin) = (across[column], panel_width * column as f64);
            let is_places = !panel.x.places.is_empty();
            let mut length = across.1 - across.0;
            if panel.square {
                // The names below the panel take some of its height.
                length = length.min(0.9 * (bottom - top - above));
            }
            let names = Names::new(x, is_places, length, f64::from(plot.height));
            let title = LINE * f64::from(u8::from(!panel.x.title.is_empty()));
            let mut down = (top + above, bottom - BOTTOM - names.height() - title);
            if panel.square {
                let side = (down.1 - down.0).min(across.1 - across.0);
                (across.1, down.1) = (across.0 + side, down.0 + side);
            }
            let frame = Frame {
                panel,
                x: x.clone(),
                y: y.clone(),
                across,
                down,
                ends: (origin, origin + panel_width),
                top,
            };
            of_panel(on, &frame, &names, keys);
        }
        top = bottom;
    }
    let empty = plot.panels.is_empty().then_some(plot.height);
    empty.unwrap_or(top.ceil() as u32)
}

/// Ends of the horizontal axes of a column, which all have the same margins.
fn axes<'p>(
    panels: impl Iterator<Item = &'p Scaled<'p>> + Clone,
    origin: f64,
    panel_width: f64,
) -> (f64, f64) {
    let left = panels.clone().map(|(_, (_, y))| widest(&y.ticks) + 14.0);
    let right = panels.map(|(panel, (x, _))| right(panel, x, panel_width));
    let [left, right] = [left.fold(14.0, f64::max), right.fold(14.0, f64::max)];
    (origin + left, origin + panel_width - right)
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

fn of_panel(on: &mut Canvas, frame: &Frame, names: &Names, keys: &[Vec<&Series>]) {
    let (panel, (left, right), (top, bottom)) = (frame.panel, frame.across, frame.down);
    for range in &panel.shading {
        let (start, end) = (range.start.max(frame.x.low), range.end.min(frame.x.high));
        if end > start {
            let corners = [(frame.at_x(start), top), (frame.at_x(end), bottom)];
            on.rectangle(corners, SHADE);
        }
    }
    vertical_ticks(on, frame);
    horizontal_ticks(on, frame, names);
    if !panel.x.is_bare {
        on.stroke(&[(left, top), (left, bottom), (right, bottom)], QUIET, 0.75);
    }
    let title = title(panel, frame.ends.1 - frame.ends.0);
    let line_at = |line: usize| frame.top + 6.0 + LINE * line as f64;
    for (n, line) in title.iter().enumerate() {
        // A line wider than the axes begins at the edge of the panel.
        let start = left.min(frame.ends.1 - width(line, 1.0)).max(frame.ends.0);
        on.text(line, (start, line_at(n)), (HPos::Left, VPos::Top), INK, 1.0);
    }
    for (n, keys) in keys.iter().enumerate() {
        key_line(on, right, line_at(title.len() - 1 + n), keys);
    }
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

fn vertical_ticks(on: &mut Canvas, frame: &Frame) {
    let (left, right) = frame.across;
    let is_places = !frame.panel.y.places.is_empty();
    let (scale, closest) = if is_places {
        (UPWARD, CLOSEST)
    } else {
        (SMALL, LETTER)
    };
    let mut taken: Vec<f64> = Vec::new();
    for (value, label) in &frame.y.ticks {
        let y = frame.at_y(*value);
        if taken.iter().any(|other| (other - y).abs() < closest) {
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
            scale,
        );
    }
}

fn horizontal_ticks(on: &mut Canvas, frame: &Frame, names: &Names) {
    let ((left, right), (top, bottom)) = (frame.across, frame.down);
    let is_place = !frame.panel.x.places.is_empty();
    let mut taken: Vec<(f64, f64)> = Vec::new();
    for (nth, (value, _)) in frame.x.ticks.iter().enumerate() {
        let x = frame.at_x(*value);
        let (half, gap) = match names {
            Names::Upward(_) => (0.5 * CLOSEST, 0.0),
            Names::Across(names) => {
                let widths = names[nth].iter().map(|line| width(line, SMALL));
                let gap = if is_place { 0.0 } else { 6.0 };
                (0.5 * widths.fold(0.0, f64::max), gap)
            }
        };
        let shown = if is_place {
            x.clamp(left + half, (right - half).max(left + half))
        } else {
            x
        };
        let near = |&(other, of): &(f64, f64)| (other - shown).abs() < half + of + gap;
        on.stroke(&[(x, top), (x, bottom)], GRID, 0.75);
        on.stroke(&[(x, bottom), (x, bottom + 3.0)], QUIET, 0.75);
        if taken.iter().any(near) {
            continue;
        }
        taken.push((shown, half));
        match names {
            Names::Upward(names) => on.upward(&names[nth], (x, bottom + 6.0), INK, UPWARD),
            Names::Across(names) => {
                for (n, line) in names[nth].iter().enumerate() {
                    let at = (shown, bottom + 6.0 + LINE * n as f64);
                    on.text(line, at, (HPos::Center, VPos::Top), INK, SMALL);
                }
            }
        }
    }
    let title = &frame.panel.x.title;
    if !title.is_empty() {
        let at = (0.5 * (left + right), bottom + 6.0 + names.height());
        on.text(title, at, (HPos::Center, VPos::Top), INK, SMALL)
    }
}

/// Names with a colour sample, from the right end of a line.
fn key_line(on: &mut Canvas, right: f64, y: f64, keys: &[&Series]) {
    let mut x = right;
    for series in keys.iter().rev() {
        let key = series.key.as_deref().unwrap_or_default();
        x -= width(key, SMALL);
        on.text(key, (x, y), (HPos::Left, VPos::Top), INK, SMALL);
        let sample = [(x - 16.0, y + 3.0), (x - 5.0, y + 14.0)];
        let color = match series.shape {
            Shape::Band(..) => BAND,
            _ => rgb(series.pen.color),
        };
        on.rectangle(sample, color);
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
        let text = shortened(text, frame.ends.1 - right - 12.0);
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

//! Names along axes and in title lines. If space is short, names are broken, turned to read upwards, or moved to
//! separate lines.

use super::super::plot::{Panel, Scale, Series};
use super::canvas::{LETTER, SMALL, shortened, width};

/// Distance between lines of text.
pub const LINE: f64 = 17.0;
/// Relative size of names that read upwards, which are closest together.
pub const UPWARD: f64 = 0.87;
/// Minimum number of letters in a line of a name.
const LETTERS: usize = 6;
/// Maximum number of lines of a name.
const LINES: usize = 3;
/// Maximum fraction of the height of a panel for upward names.
const PART: f64 = 0.35;
/// Space before the name of a series for its colour sample, and after it.
const SAMPLE: f64 = 28.0;

/// Labels of the horizontal ticks.
pub enum Names {
    /// The lines of each label below the axis.
    Across(Vec<Vec<String>>),
    /// Upward labels.
    Upward(Vec<String>),
}

impl Names {
    /// Labels of the ticks of an axis of this length, in a panel of this height; names that do not fit side by side are
    /// written upwards.
    pub fn new(x: &Scale, is_places: bool, length: f64, height: f64) -> Self {
        let room = if is_places {
            x.step(length)
        } else {
            length / x.ticks.len().max(1) as f64
        };
        let letters = (room / (0.6 * LETTER * SMALL)) as usize;
        let lines = |label: &String| {
            if width(label, SMALL) < room || letters < LETTERS {
                return vec![label.clone()];
            }
            let lines = textwrap::wrap(label, textwrap::Options::new(letters).break_words(false));
            lines.into_iter().map(|line| line.into_owned()).collect()
        };
        let names: Vec<Vec<String>> = x.ticks.iter().map(|(_, label)| lines(label)).collect();
        let fits = |lines: &Vec<String>| {
            lines.len() <= LINES && lines.iter().all(|line| width(line, SMALL) <= room)
        };
        if !is_places || names.iter().all(fits) {
            return Self::Across(names);
        }
        let cut = |(_, label): &(f64, String)| shortened(label, PART * height);
        Self::Upward(x.ticks.iter().map(cut).collect())
    }

    /// Height of the labels below the axis.
    pub fn height(&self) -> f64 {
        match self {
            Self::Across(names) => {
                LINE * names.iter().map(Vec::len).max().unwrap_or(1).max(1) as f64
            }
            Self::Upward(names) => {
                let widths = names.iter().map(|name| width(name, UPWARD));
                widths.fold(0.0, f64::max)
            }
        }
    }
}

/// Title lines for a panel of this width.
pub fn title(panel: &Panel, room: f64) -> Vec<String> {
    if width(&panel.title, 1.0) <= room {
        return vec![panel.title.clone()];
    }
    let letters = textwrap::Options::new((room / (0.63 * LETTER)) as usize);
    let lines = textwrap::wrap(&panel.title, letters);
    lines.into_iter().map(|line| line.into_owned()).collect()
}

/// Lines with the names of the series. The first line is next to the title, and is empty if there is no space for
/// names.
pub fn keys(panel: &Panel, room: f64) -> Vec<Vec<&Series>> {
    let mut lines: Vec<(f64, Vec<&Series>)> = vec![(0.0, Vec::new())];
    for series in &panel.series {
        let Some(key) = &series.key else { continue };
        let own = width(key, SMALL) + SAMPLE;
        match lines.last_mut() {
            Some((taken, line)) if *taken + own <= room => {
                *taken += own;
                line.push(series);
            }
            _ => lines.push((own, vec![series])),
        }
    }
    let is_beside = lines.len() == 1 && width(&panel.title, 1.0) + lines[0].0 <= room;
    let mut lines: Vec<Vec<&Series>> = lines.into_iter().map(|(_, line)| line).collect();
    if !is_beside {
        lines.insert(0, Vec::new());
    }
    lines
}

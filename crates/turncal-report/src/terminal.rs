//! A document as text for a terminal of any width.

use textwrap::core::display_width;
use textwrap::{Options, WordSplitter};

use super::document::{Block, Document, Facts, List, Table};
use turncal::calibration::Finding;

/// Minimum width, in characters, of the lines of a broken column heading.
const HEADING: usize = 9;
/// Space between two columns.
const GAP: usize = 2;

/// Lines of one screen.
const SCREEN: usize = 40;
/// Most lines of a problem, and of its remedy.
const LINES: usize = 2;
/// Most findings on a screen.
const SHOWN: usize = 3;
/// Assumed screen width if unknown.
const USUAL_WIDTH: usize = 80;
/// Prefix of a finding: its code.
const CODE: &str = "       ";

/// The short form for one screen: the verdict, the findings in one or two lines each, and a few figures.
pub fn brief(document: &Document, width: Option<usize>) -> String {
    let width = width.unwrap_or(USUAL_WIDTH);
    let mut head = vec![cut(&titled(document), width)];
    if let Some((word, of_it)) = &document.verdict {
        head.extend(wrapped(&format!("{word}   {of_it}"), "", Some(width)));
    }
    let brief = document.brief.iter();
    let brief: Vec<_> = brief.map(|block| shown(block, Some(width))).collect();
    // Parts separated by an empty line.
    let taken: usize = brief.iter().chain([&head]).map(|part| part.len() + 1).sum();
    let findings = findings(&document.findings, width, SCREEN.saturating_sub(taken));
    laid([head, findings].into_iter().chain(brief).collect())
}

/// Title with method and data.
fn titled(document: &Document) -> String {
    let first = document.lead.first().map_or("", String::as_str);
    format!("{}: {first}", document.title)
}

/// The first problems with their remedies, as far as space permits.
fn findings(all: &[Finding], width: usize, room: usize) -> Vec<String> {
    let of_one = |finding: &Finding| {
        let (what, next) = finding.headline();
        let code = format!("  {}  ", finding.code);
        let next = next.map(|next| format!("{CODE}→ {next}"));
        let next: Vec<String> = next
            .iter()
            .flat_map(|next| wrapped(next, "         ", Some(width)))
            .collect();
        let what = wrapped(&format!("{code}{what}"), CODE, Some(width));
        at_most(LINES, what, width)
            .chain(at_most(LINES, next, width))
            .collect::<Vec<String>>()
    };
    let mut lines = Vec::new();
    for (place, finding) in all.iter().enumerate() {
        let mut more = of_one(finding);
        let is_last = place + 1 == all.len();
        let fits = lines.len() + more.len() + usize::from(!is_last) <= room;
        if place == 0 {
            // At least the problem is shown.
            let room = room.saturating_sub(usize::from(!is_last)).max(LINES);
            more = at_most(room, more, width).collect();
        }
        if place == SHOWN || (place > 0 && !fits) {
            let count = all.len() - place;
            let mut codes: Vec<&str> = all[place..].iter().map(|of| of.code.as_str()).collect();
            codes.dedup();
            let more = format!("{CODE}and {count} more: {}", codes.join(", "));
            lines.push(cut(&more, width));
            break;
        }
        lines.extend(more);
    }
    lines
}

/// The first lines, the last of which shows that some follow.
fn at_most(count: usize, mut lines: Vec<String>, width: usize) -> impl Iterator<Item = String> {
    if lines.len() > count {
        lines.truncate(count);
        let last = lines.pop().unwrap_or_default();
        let blank = if display_width(&last) + 2 > width {
            ""
        } else {
            " "
        };
        lines.push(cut(&format!("{last}{blank}…"), width));
    }
    lines.into_iter()
}

/// A line cut to the available width.
fn cut(text: &str, width: usize) -> String {
    if display_width(text) <= width {
        return text.to_owned();
    }
    let mut room = width.saturating_sub(1);
    let fits = |letter: &char| {
        let wide = display_width(letter.encode_utf8(&mut [0; 4]));
        let is_room = wide <= room;
        room = room.saturating_sub(wide);
        is_room
    };
    text.chars().take_while(fits).chain(['…']).collect()
}

/// The document as text: the method, the tables and, at the end, where a reader looks first, the conclusions and
/// warnings. Lines have at most `width` characters; without a width, as for a file or a pipe, each row and each
/// sentence is one line.
pub fn text(document: &Document, width: Option<usize>) -> String {
    let mut parts = vec![paragraphs(&[&document.title], width)];
    let verdict = document.verdict.as_ref();
    let verdict = verdict.map(|(word, of_it)| format!("{word}   {of_it}"));
    let lead = verdict.iter().chain(&document.lead);
    parts[0].extend(lead.flat_map(|text| paragraphs(&[text], width)));
    let brief = document.brief.iter();
    let blocks = document.blocks.iter();
    let blocks = blocks.filter(|(page_only, _)| !page_only);
    let all = brief.chain(blocks.map(|(_, block)| block));
    parts.extend(all.map(|block| shown(block, width)));
    parts.push(list(&document.conclusions, "  ", width));
    parts.push(list(&document.warnings, "! ", width));
    let findings = document.findings.iter();
    let findings = findings.map(|finding| format!("{}  {finding}", finding.code));
    parts.push(list(&List::new("Findings", findings), "  ", width));
    laid(parts)
}

fn shown(block: &Block, width: Option<usize>) -> Vec<String> {
    match block {
        Block::Facts(of) => facts(of, width),
        Block::Table(of) => table(of, width),
        Block::List(of) => list(of, "  ", width),
        Block::Text(heading, text) => paragraphs(&[heading, text], width),
        Block::Code(heading, code) => vec![heading.clone(), code.trim_end().to_owned()],
        Block::Plot(_) | Block::Fold(_) => Vec::new(),
    }
}

fn paragraphs(texts: &[&str], width: Option<usize>) -> Vec<String> {
    let texts = texts.iter().filter(|text| !text.is_empty());
    texts.flat_map(|text| wrapped(text, "", width)).collect()
}

/// Parts separated by an empty line.
fn laid(parts: Vec<Vec<String>>) -> String {
    let parts = parts.into_iter().filter(|part| !part.is_empty());
    let parts: Vec<String> = parts.map(|part| part.join("\n")).collect();
    let text = parts.join("\n\n");
    let lines = text.lines().map(|line| line.trim_end().to_owned() + "\n");
    printable(&lines.collect::<String>())
}

/// Breaks text into lines of at most `width` characters, all indented except the first; preformatted text is unchanged.
pub fn wrapped(text: &str, indent: &str, width: Option<usize>) -> Vec<String> {
    let fits = |width: &usize| display_width(text) > *width;
    let Some(width) = width.filter(fits) else {
        return vec![text.to_owned()];
    };
    let options = Options::new(width)
        .subsequent_indent(indent)
        .word_splitter(WordSplitter::NoHyphenation)
        .break_words(false);
    let lines = textwrap::wrap(text, options).into_iter();
    lines.map(|line| line.into_owned()).collect()
}

fn list(of: &List, mark: &str, width: Option<usize>) -> Vec<String> {
    if of.items.is_empty() {
        return Vec::new();
    }
    let items = of.items.iter();
    let items = items.flat_map(|item| wrapped(&format!("{mark}{item}"), "  ", width));
    headed(&of.heading, items)
}

/// Values aligned below each other.
fn facts(of: &Facts, width: Option<usize>) -> Vec<String> {
    let names = of.rows.iter().map(|(name, _)| name.chars().count());
    let longest = names.max().unwrap_or(0);
    let indent = " ".repeat(longest + 4);
    let rows = of.rows.iter();
    let rows = rows
        .flat_map(|(name, value)| wrapped(&format!("  {name:<longest$}  {value}"), &indent, width));
    headed(&of.heading, rows)
}

/// Lines below a heading, if there is one.
fn headed(heading: &str, lines: impl Iterator<Item = String>) -> Vec<String> {
    let heading = Some(heading.to_owned()).filter(|heading| !heading.is_empty());
    heading.into_iter().chain(lines).collect()
}

/// A table narrowed step by step: headings on several lines, then without optional columns, and finally split into
/// parts that repeat the first column.
fn table(of: &Table, width: Option<usize>) -> Vec<String> {
    let mut lines = headed(&of.heading, std::iter::empty());
    let all: Vec<usize> = (0..of.columns.len()).collect();
    let Some(width) = width else {
        lines.extend(laid_out(of, &all, false));
        lines.extend(of.notes.clone());
        return lines;
    };
    let wide = |columns: &[usize], broken: bool| {
        let widths = columns
            .iter()
            .map(|&column| column_width(of, column, broken) + GAP);
        widths.sum::<usize>().saturating_sub(GAP) > width
    };
    let broken = wide(&all, false);
    let mut columns = all;
    let mut optional = of.optional.iter();
    while wide(&columns, broken)
        && let Some(least) = optional.next_back()
    {
        columns.retain(|column| column != least);
    }
    let mut rest = columns.split_off(columns.len().min(1));
    let first = columns;
    while !rest.is_empty() {
        let mut count = rest.len();
        while count > 1 && wide(&[&first, &rest[..count]].concat(), broken) {
            count -= 1;
        }
        let later = rest.split_off(count);
        lines.extend(laid_out(of, &[first.as_slice(), &rest].concat(), broken));
        if !later.is_empty() {
            lines.push(String::new());
        }
        rest = later;
    }
    lines.extend(
        of.notes
            .iter()
            .flat_map(|note| wrapped(note, "", Some(width))),
    );
    lines
}

fn cell_width(of: &Table, column: usize) -> usize {
    let cells = of
        .sections
        .iter()
        .flatten()
        .filter_map(|row| row.get(column));
    let widths = cells.map(|cell| display_width(cell));
    widths.max().unwrap_or(0)
}

fn heading(of: &Table, column: usize, broken: bool) -> String {
    let heading = &of.columns[column];
    if !broken {
        return heading.clone();
    }
    let room = cell_width(of, column).max(HEADING);
    textwrap::fill(heading, Options::new(room).break_words(false))
}

fn column_width(of: &Table, column: usize, broken: bool) -> usize {
    let heading = heading(of, column, broken);
    let lines = heading.lines().map(display_width);
    lines.max().unwrap_or(0).max(cell_width(of, column))
}

/// Some columns with a rule before each section: the first left-aligned, the others right-aligned.
fn laid_out(of: &Table, columns: &[usize], broken: bool) -> Vec<String> {
    let widths = columns
        .iter()
        .map(|&column| column_width(of, column, broken));
    let widths: Vec<usize> = widths.collect();
    let line = |cell: &dyn Fn(usize) -> String| {
        let cells = columns.iter().zip(&widths).enumerate();
        let cells = cells.map(|(place, (&column, width))| {
            let cell = cell(column);
            let free = " ".repeat(width.saturating_sub(display_width(&cell)));
            match place {
                0 => cell + &free,
                _ => free + &cell,
            }
        });
        cells.collect::<Vec<_>>().join(&" ".repeat(GAP))
    };
    let heading = |column: usize, n: usize| {
        let heading = heading(of, column, broken);
        heading.lines().nth(n).unwrap_or_default().to_owned()
    };
    let heights = columns
        .iter()
        .map(|&column| self::heading(of, column, broken).lines().count());
    let heading_lines = 0..heights.max().unwrap_or(0).max(1);
    let mut lines: Vec<String> = heading_lines
        .map(|n| line(&|column| heading(column, n)))
        .collect();
    let wide = widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1);
    for section in &of.sections {
        lines.push("─".repeat(wide));
        let row = |row: &Vec<String>| line(&|column| row.get(column).cloned().unwrap_or_default());
        lines.extend(section.iter().map(row));
    }
    lines
}

/// The text with 0 for every digit: the form of a result, independent of its values.
#[cfg(test)]
pub fn layout(document: &Document, width: usize) -> String {
    text(document, Some(width)).replace(|letter: char| letter.is_ascii_digit(), "0")
}

/// Text with terminal controls (except line ends) and bidirectional marks escaped.
pub fn printable(text: &str) -> String {
    let obeyed = |c: char| {
        let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        (c.is_control() && c != '\n') || turns
    };
    if !text.contains(obeyed) {
        return text.to_owned();
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if obeyed(c) {
            shown.extend(c.escape_default())
        } else {
            shown.push(c)
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::super::document::cells;
    use super::*;

    fn document() -> Document {
        let mut document = Document::new("A result");
        document
            .lead
            .push("What was done to what, in a sentence that continues.".to_owned());
        document.both(Facts::new(
            "Facts",
            [("long name", "one two three four five six seven")],
        ));
        let mut table = Table::new("Table", ["", "first number", "second number", "the last"])
            .section([cells!["gyro x", "1.0", "22.0 ± 0.1", "–"]])
            .section([cells!["gyro y", "−1.0", "2.0 ± 0.1", "3"]])
            .note("How it is read, which takes some words more than fit.");
        table.optional = vec![2];
        document.both(table);
        document
            .warnings
            .items
            .push("Something must be known before this is used.".to_owned());
        document
    }

    #[test]
    fn text_for_a_pipe_has_a_line_for_each_row_and_sentence() {
        insta::assert_snapshot!(text(&document(), None));
    }

    #[test]
    fn text_fits_a_terminal_and_leaves_out_what_it_can_do_without() {
        insta::assert_snapshot!(text(&document(), Some(40)));
        for width in [24, 32, 40, 60] {
            let text = text(&document(), Some(width));
            let longest = text.lines().map(textwrap::core::display_width).max();
            assert!(longest <= Some(width), "{width}:\n{text}");
        }
        assert!(!text(&document(), Some(24)).contains("22.0"));
    }

    #[test]
    fn what_a_terminal_would_obey_is_shown_escaped() {
        assert_eq!(printable("a\u{1b}[31mb\nc"), "a\\u{1b}[31mb\nc");
        assert_eq!(printable("\u{9b}2J\u{202e}\r"), "\\u{9b}2J\\u{202e}\\r");
        assert_eq!(printable("µg °/√h ″"), "µg °/√h ″");
    }

    #[test]
    fn a_line_that_is_cut_ends_in_one_ellipsis() {
        for length in 5..12 {
            let lines = vec!["x".repeat(length), "further".to_owned()];
            let shown: Vec<String> = at_most(1, lines, 10).collect();
            assert_eq!(shown.len(), 1);
            assert!(display_width(&shown[0]) <= 10, "{shown:?}");
            assert_eq!(shown[0].matches('…').count(), 1, "{shown:?}");
            assert!(shown[0].ends_with('…'));
        }
    }
}

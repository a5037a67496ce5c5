//! Layout of the parts of a document on pages.

use crate::document::{Block, Document, Facts, List, Table};
use crate::pdf::font::Fonts;

/// A4, pt.
pub const WIDTH: f32 = 595.28;
pub const HEIGHT: f32 = 841.89;
const MARGIN: f32 = 54.0;
const TOP: f32 = 74.0;
const BOTTOM: f32 = HEIGHT - 62.0;
const TITLE: f32 = 19.0;
const HEADING: f32 = 10.5;
const BODY: f32 = 9.0;
const NOTE: u8 = 85;
const INK: u8 = 20;
/// Line spacing divided by font size.
const LEADING: f32 = 1.38;
/// Width of the name column of facts.
const NAMES: f32 = 128.0;
/// Space between table columns.
const GAP: f32 = 14.0;

/// The content drawn on a page.
#[derive(Debug, Clone, PartialEq)]
pub enum Drawn {
    Text {
        at: (f32, f32),
        text: String,
        style: Style,
    },
    Rule {
        from: (f32, f32),
        to: f32,
        width: f32,
    },
}

/// Font style.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    pub size: f32,
    pub bold: bool,
    pub grey: u8,
}

const PLAIN: Style = Style {
    size: BODY,
    bold: false,
    grey: INK,
};
const STRONG: Style = Style {
    bold: true,
    ..PLAIN
};
const FAINT: Style = Style {
    grey: NOTE,
    ..PLAIN
};
const REMARK: Style = Style { size: 8.0, ..FAINT };
const MARGINAL: Style = Style { size: 7.5, ..FAINT };
/// Width of a line of text.
const LINE: f32 = WIDTH - 2.0 * MARGIN;

/// Pages under construction.
pub struct Layout<'a> {
    fonts: &'a Fonts,
    frame: &'a Frame,
    pages: Vec<Vec<Drawn>>,
    /// Position of the next line.
    y: f32,
}

impl<'a> Layout<'a> {
    pub fn new(fonts: &'a Fonts, frame: &'a Frame) -> Self {
        Self {
            fonts,
            frame,
            pages: vec![Vec::new()],
            y: TOP,
        }
    }

    /// All pages of a document.
    pub fn pages(mut self, document: &Document) -> Result<Vec<Vec<Drawn>>, PdfError> {
        self.strong(&document.title, TITLE);
        self.y += 0.6 * TITLE;
        for text in &document.lead {
            self.paragraph(text, PLAIN);
        }
        for (_, block) in &document.blocks {
            self.block(block);
        }
        if !document.warnings.items.is_empty() {
            self.list(&document.warnings);
        }
        self.y += 10.0;
        self.need(2.0 * BODY);
        let end = self.shortened(&self.frame.end, REMARK, LINE);
        let at = 0.5 * (WIDTH - self.width(&end, REMARK));
        self.text(at, &end, REMARK);
        self.frames();
        self.check()?;
        Ok(self.pages)
    }

    fn block(&mut self, block: &Block) {
        match block {
            Block::Facts(of) => self.facts(of),
            Block::Table(of) => self.table(of),
            Block::List(of) => self.list(of),
            Block::Text(heading, text) | Block::Code(heading, text) => {
                self.heading(heading, 3.0 * BODY);
                self.paragraph(text, PLAIN);
            }
            Block::Plot(_) | Block::Fold(_) => {}
        }
    }

    /// A heading, with at least this much space for the following text.
    fn heading(&mut self, heading: &str, follows: f32) {
        if heading.is_empty() {
            return;
        }
        self.y += 9.0;
        self.need(HEADING * LEADING + follows);
        self.strong(heading, HEADING);
        self.y += 4.0;
    }

    fn strong(&mut self, text: &str, size: f32) {
        self.y += size;
        self.text(MARGIN, text, Style { size, ..STRONG });
    }

    fn facts(&mut self, facts: &Facts) {
        self.heading(&facts.heading, 2.0 * BODY * LEADING);
        for (name, value) in &facts.rows {
            for (n, line) in self.broken(value, PLAIN, LINE - NAMES).enumerate() {
                let name = if n == 0 { name } else { "" };
                self.line(&[(MARGIN, name, FAINT), (MARGIN + NAMES, line, PLAIN)]);
            }
        }
    }

    fn list(&mut self, list: &List) {
        self.heading(&list.heading, 2.0 * BODY * LEADING);
        for item in &list.items {
            self.paragraph(&format!("• {item}"), PLAIN);
        }
    }

    fn paragraph(&mut self, text: &str, style: Style) {
        for line in self.broken(text, style, LINE) {
            self.line(&[(MARGIN, line, style)]);
        }
        self.y += 2.0;
    }

    /// Texts next to each other on a line of the size of the last one.
    fn line(&mut self, texts: &[(f32, &str, Style)]) {
        let size = texts.last().map_or(BODY, |(.., style)| style.size);
        self.need(size * LEADING);
        self.y += size;
        for (x, text, style) in texts {
            self.text(*x, text, *style);
        }
        self.y += size * (LEADING - 1.0);
    }

    /// A table on one page if it fits; if it is too wide, in smaller letters.
    fn table(&mut self, table: &Table) {
        let rows = || table.sections.iter().flatten();
        let widths = table.columns.iter().enumerate().map(|(k, heading)| {
            let cells = rows().filter_map(|row| row.get(k));
            let widest = cells
                .map(|cell| self.width(cell, PLAIN))
                .fold(0.0, f32::max);
            widest.max(self.width(heading, STRONG))
        });
        let widths: Vec<f32> = widths.collect();
        let all = widths.iter().sum::<f32>() + GAP * (widths.len().max(1) - 1) as f32;
        let shrink = (LINE / all).min(1.0);
        let mut columns = Vec::new();
        let mut left = MARGIN;
        for width in widths {
            columns.push((left, left + width * shrink));
            left += (width + GAP) * shrink;
        }
        let right = columns.last().map_or(MARGIN, |column| column.1);
        let leading = BODY * shrink * LEADING;
        let whole = leading * (rows().count() + 1) as f32 + 2.0 * table.sections.len() as f32;
        let fits = whole + HEADING * LEADING < BOTTOM - TOP;
        self.heading(&table.heading, if fits { whole } else { 5.5 * leading });
        let style = |style: Style| Style {
            size: BODY * shrink,
            ..style
        };
        let mut needs_heading = true;
        for section in &table.sections {
            for row in section {
                if self.y + leading > BOTTOM {
                    self.next_page();
                    needs_heading = true;
                }
                if std::mem::take(&mut needs_heading) {
                    self.row(&table.columns, &columns, style(STRONG));
                    self.rule(right, 0.7);
                }
                self.row(row, &columns, style(PLAIN));
            }
            self.rule(right, 0.3);
        }
        self.y += 2.0;
        for note in &table.notes {
            self.paragraph(note, REMARK);
        }
    }

    /// Cells of a row between the ends of their columns: the first left-aligned, the others right-aligned.
    fn row(&mut self, cells: &[String], columns: &[(f32, f32)], style: Style) {
        self.y += style.size;
        for (k, (cell, (left, right))) in cells.iter().zip(columns).enumerate() {
            let x = match k {
                0 => *left,
                _ => right - self.width(cell, style),
            };
            self.text(x, cell, style);
        }
        self.y += style.size * (LEADING - 1.0);
    }

    fn rule(&mut self, to: f32, width: f32) {
        let y = self.y - 0.5;
        self.draw(Drawn::Rule {
            from: (MARGIN, y),
            to,
            width,
        });
        self.y += 1.5;
    }

    /// Adds the margins to every page, once the number of pages is known.
    fn frames(&mut self) {
        let Frame {
            left, right, foot, ..
        } = self.frame;
        let total = self.pages.len();
        for page in 0..total {
            let number = format!("Page {} of {total}", page + 1);
            let head = (44.0, left, right, 50.0);
            let foot = (HEIGHT - 36.0, foot, &number, HEIGHT - 46.0);
            for (y, left, right, rule) in [head, foot] {
                let right = self.shortened(right, MARGINAL, 0.5 * LINE);
                let width = self.width(&right, MARGINAL);
                let left = self.shortened(left, MARGINAL, LINE - width - GAP);
                let end = WIDTH - MARGIN;
                let texts = [(MARGIN, left), (end - width, right)];
                self.pages[page].extend(texts.map(|(x, text)| Drawn::Text {
                    at: (x, y),
                    text,
                    style: MARGINAL,
                }));
                self.pages[page].push(Drawn::Rule {
                    from: (MARGIN, rule),
                    to: end,
                    width: 0.5,
                });
            }
        }
    }

    /// An error if a font lacks a character.
    fn check(&self) -> Result<(), PdfError> {
        for drawn in self.pages.iter().flatten() {
            if let Drawn::Text { text, style, .. } = drawn
                && let Some(character) = self.fonts.get(style.bold).lacks(text).next()
            {
                return Err(PdfError::NoGlyph {
                    character,
                    text: text.clone(),
                });
            }
        }
        Ok(())
    }

    fn text(&mut self, x: f32, text: &str, style: Style) {
        if !text.is_empty() {
            self.draw(Drawn::Text {
                at: (x, self.y),
                text: text.to_owned(),
                style,
            });
        }
    }

    fn draw(&mut self, drawn: Drawn) {
        if let Some(page) = self.pages.last_mut() {
            page.push(drawn);
        }
    }

    /// Starts a new page if less space than this remains.
    fn need(&mut self, room: f32) {
        if self.y + room > BOTTOM {
            self.next_page();
        }
    }

    fn next_page(&mut self) {
        self.pages.push(Vec::new());
        self.y = TOP;
    }

    fn width(&self, text: &str, style: Style) -> f32 {
        self.fonts.get(style.bold).width(text, style.size)
    }

    /// The part of a text that fits into a line of this width.
    fn shortened(&self, text: &str, style: Style, room: f32) -> String {
        let mut lines = self.broken(text, style, room - self.width("…", style));
        let first = lines.next().unwrap_or_default();
        let more = lines.next().map_or("", |_| "…");
        format!("{first}{more}")
    }

    /// A text in lines of at most this width, broken at spaces; longer words are broken anywhere.
    fn broken<'t>(
        &self,
        text: &'t str,
        style: Style,
        room: f32,
    ) -> impl Iterator<Item = &'t str> + use<'a, 't> {
        let typeface = self.fonts.get(style.bold);
        let mut rest = Some(text);
        std::iter::from_fn(move || {
            let text = rest.take()?;
            let (mut filled, mut space) = (0.0, None);
            for (at, character) in text.char_indices() {
                filled += typeface.width(character.encode_utf8(&mut [0; 4]), style.size);
                if character == ' ' {
                    space = Some(at);
                }
                if filled > room && at > 0 {
                    let (line, after) = text.split_at(space.unwrap_or(at));
                    rest = Some(after.strip_prefix(' ').unwrap_or(after));
                    return Some(line);
                }
            }
            Some(text)
        })
    }
}

/// Error in creating a PDF.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PdfError {
    /// A character has no glyph.
    #[error(
        "found the character {character:?} in {text:?}, expected Latin, Greek or Cyrillic, which the certificate \
         fonts support. Rewrite the text in these scripts."
    )]
    NoGlyph {
        /// The character.
        character: char,
        /// Position.
        text: String,
    },
    /// The file would violate the standard.
    #[error("the certificate cannot be written as PDF/A-3: {reason}")]
    Standard {
        /// The reason.
        reason: String,
    },
}

/// Page margins and file metadata.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Text at the upper left, also used as the author in the metadata.
    pub left: String,
    /// Upper right.
    pub right: String,
    /// Text at the foot of the page, before the page number.
    pub foot: String,
    /// Text below the last line of the document.
    pub end: String,
    /// Year, month and day for the metadata.
    pub day: (u16, u8, u8),
}

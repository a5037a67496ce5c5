//! Fonts of a printed page: glyphs and widths of characters.
//!
//! Both fonts are Noto Sans (SIL Open Font License 1.1, see the file next to the fonts), reduced to Latin, Greek,
//! Cyrillic and a few signs.

use krilla::text::{Font, GlyphId, KrillaGlyph};
use skrifa::charmap::Charmap;
use skrifa::metrics::GlyphMetrics;
use skrifa::prelude::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider};

const REGULAR: &[u8] = include_bytes!("../certificate/fonts/NotoSans-Regular.ttf");
const BOLD: &[u8] = include_bytes!("../certificate/fonts/NotoSans-Bold.ttf");

/// A font.
pub struct Typeface {
    characters: Charmap<'static>,
    metrics: GlyphMetrics<'static>,
    units_per_em: f32,
    pub font: Font,
}

/// Regular and bold.
pub struct Fonts {
    pub regular: Typeface,
    pub bold: Typeface,
}

impl Fonts {
    /// Returns `None` if the fonts cannot be read; the tests ensure that this does not happen.
    pub fn new() -> Option<Self> {
        Some(Self {
            regular: Typeface::new(REGULAR)?,
            bold: Typeface::new(BOLD)?,
        })
    }

    pub fn get(&self, bold: bool) -> &Typeface {
        if bold { &self.bold } else { &self.regular }
    }
}

impl Typeface {
    fn new(data: &'static [u8]) -> Option<Self> {
        let font = FontRef::new(data).ok()?;
        let (size, location) = (Size::unscaled(), LocationRef::default());
        Some(Self {
            characters: font.charmap(),
            metrics: font.glyph_metrics(size, location),
            units_per_em: f32::from(font.metrics(size, location).units_per_em),
            font: Font::new(data.into(), 0)?,
        })
    }

    fn glyph(&self, character: char) -> Option<skrifa::GlyphId> {
        let glyph = self.characters.map(shape(character))?;
        (glyph != skrifa::GlyphId::NOTDEF).then_some(glyph)
    }

    /// Advance of a glyph for a font size of one.
    fn advance(&self, glyph: skrifa::GlyphId) -> f32 {
        self.metrics.advance_width(glyph).unwrap_or(0.0) / self.units_per_em
    }

    /// The characters of a text that the font cannot show.
    pub fn lacks<'a>(&'a self, text: &'a str) -> impl Iterator<Item = char> + 'a {
        text.chars()
            .filter(|&character| self.glyph(character).is_none())
    }

    /// Glyphs of a text, one per character, with advances for a font size of one.
    pub fn glyphs(&self, text: &str) -> Vec<KrillaGlyph> {
        let glyph = |(at, character): (usize, char)| {
            let glyph = self.glyph(character).unwrap_or_default();
            KrillaGlyph::new(
                GlyphId::new(glyph.to_u32()),
                self.advance(glyph),
                0.0,
                0.0,
                0.0,
                at..at + character.len_utf8(),
                None,
            )
        };
        text.char_indices().map(glyph).collect()
    }

    /// Width of the text, pt.
    pub fn width(&self, text: &str, size: f32) -> f32 {
        let advance = |character| self.advance(self.glyph(character).unwrap_or_default());
        text.chars().map(advance).sum::<f32>() * size
    }
}

/// Glyph of a character; breaking and non-breaking spaces have the same width.
fn shape(character: char) -> char {
    match character {
        '\u{202f}' | '\u{a0}' | '\u{2009}' => ' ',
        other => other,
    }
}

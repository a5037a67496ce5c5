//! Fonts of a printed page: glyphs and widths of characters.
//!
//! Both are Noto Sans (SIL Open Font License 1.1, see the file next to the fonts), reduced to Latin, Greek, Cyrillic
//! and a few signs.

use krilla::text::{Font, GlyphId, KrillaGlyph};
use ttf_parser::Face;

const REGULAR: &[u8] = include_bytes!("../../certificate/fonts/NotoSans-Regular.ttf");
const BOLD: &[u8] = include_bytes!("../../certificate/fonts/NotoSans-Bold.ttf");

/// A font.
pub struct Typeface {
    face: Face<'static>,
    pub font: Font,
}

/// Regular and bold.
pub struct Fonts {
    pub regular: Typeface,
    pub bold: Typeface,
}

impl Fonts {
    /// `None` if they cannot be read, which the tests exclude.
    pub fn new() -> Option<Self> {
        Some(Self {
            regular: Typeface::new(REGULAR)?,
            bold: Typeface::new(BOLD)?,
        })
    }

    pub fn get(&self, bold: bool) -> &Typeface {
        match bold {
            true => &self.bold,
            false => &self.regular,
        }
    }
}

impl Typeface {
    fn new(data: &'static [u8]) -> Option<Self> {
        Some(Self {
            face: Face::parse(data, 0).ok()?,
            font: Font::new(data.into(), 0)?,
        })
    }

    /// The characters of a text that it cannot show.
    pub fn lacks<'a>(&'a self, text: &'a str) -> impl Iterator<Item = char> + 'a {
        let shown = |c: &char| self.face.glyph_index(shape(*c)).is_none();
        text.chars().filter(shown)
    }

    /// Glyphs of a text, one per character, with advances for a font size of one.
    pub fn glyphs(&self, text: &str) -> Vec<KrillaGlyph> {
        let units = f32::from(self.face.units_per_em());
        let glyph = |(at, character): (usize, char)| {
            let glyph = self.face.glyph_index(shape(character)).unwrap_or_default();
            let advance = f32::from(self.face.glyph_hor_advance(glyph).unwrap_or(0)) / units;
            let range = at..at + character.len_utf8();
            KrillaGlyph::new(
                GlyphId::new(glyph.0.into()),
                advance,
                0.0,
                0.0,
                0.0,
                range,
                None,
            )
        };
        text.char_indices().map(glyph).collect()
    }

    /// Width of the text, pt.
    pub fn width(&self, text: &str, size: f32) -> f32 {
        self.glyphs(text)
            .iter()
            .map(|glyph| glyph.x_advance)
            .sum::<f32>()
            * size
    }
}

/// Glyph of a character; breaking and non-breaking spaces have the same width.
fn shape(character: char) -> char {
    match character {
        '\u{202f}' | '\u{a0}' | '\u{2009}' => ' ',
        other => other,
    }
}

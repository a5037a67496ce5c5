//! What stands on every page of a PDF, and why one cannot be made.

/// A document that could not be made a PDF.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PdfError {
    /// A character has no glyph.
    #[error(
        "found the character {character:?} in {text:?}, expected Latin, Greek or Cyrillic: the fonts of the \
         certificate have no other. Write it in those."
    )]
    NoGlyph {
        /// The character.
        character: char,
        /// Where it stands.
        text: String,
    },
    /// The file would not be what the standard asks for.
    #[error("the certificate cannot be written as PDF/A-3: {reason}")]
    Standard {
        /// What is in the way.
        reason: String,
    },
}

/// What stands on every page, and what the file says of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Upper left.
    pub left: String,
    /// Upper right.
    pub right: String,
    /// At the foot, before the page's number.
    pub foot: String,
    /// Below the last line.
    pub end: String,
    /// Author in the metadata.
    pub author: String,
    /// Year, month and day of the metadata.
    pub day: (u16, u8, u8),
}

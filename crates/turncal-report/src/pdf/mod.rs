//! A document as a PDF/A-3 file: facts, tables and paragraphs on A4 pages, with files attached.

mod font;
mod layout;

use font::Fonts;
use krilla::color::rgb;
use krilla::configure::{Archival, ConfigurationBuilder};
use krilla::embed::{AssociationKind, EmbeddedFile, MimeType};
use krilla::geom::{PathBuilder, Point};
use krilla::metadata::{DateTime, Metadata};
use krilla::page::PageSettings;
use krilla::paint::{Fill, Stroke};
use krilla::surface::Surface;
use krilla::{Document as Pdf, SerializeSettings};
use layout::{Drawn, HEIGHT, Layout, WIDTH};

use super::document::Document;
pub use layout::{Frame, PdfError};

/// A file in a PDF.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attached {
    /// Name.
    pub name: String,
    /// Its MIME type.
    pub mime: &'static str,
    /// Description.
    pub description: String,
    /// Whether the file has the same content as the pages, in machine-readable form.
    pub alternative: bool,
    /// Content.
    pub bytes: Vec<u8>,
}

/// The bytes of a PDF/A-3 file; equal documents give equal bytes.
///
/// # Errors
/// Returns [`PdfError`] if a character cannot be shown.
pub fn write(
    document: &Document,
    frame: &Frame,
    files: Vec<Attached>,
) -> Result<Vec<u8>, PdfError> {
    let fonts = Fonts::new().ok_or_else(|| standard("its fonts cannot be read"))?;
    let pages = Layout::new(&fonts, frame).pages(document)?;
    let configuration = ConfigurationBuilder::new()
        .with_archival_validator(Archival::A3_U)
        .finish()
        .map_err(|error| standard(&format!("{error:?}")))?;
    let mut pdf = Pdf::new_with(SerializeSettings {
        configuration,
        ..SerializeSettings::default()
    });
    for page in &pages {
        let size = PageSettings::from_wh(WIDTH, HEIGHT).ok_or_else(|| standard("no page"))?;
        let mut on = pdf.start_page_with(size);
        let mut surface = on.surface();
        for drawn in page {
            draw(&mut surface, &fonts, drawn);
        }
        surface.finish();
        on.finish();
    }
    let day = midnight(frame.day);
    for file in files {
        let name = file.name.clone();
        pdf.embed_file(embedded(file, day))
            .ok_or_else(|| standard(&format!("two attached files are named {name}")))?;
    }
    pdf.set_metadata(
        Metadata::new()
            .title(document.title.clone())
            .language("en".to_owned())
            .creator(concat!("turncal ", env!("CARGO_PKG_VERSION")).to_owned())
            .authors(vec![frame.left.clone()])
            .keywords(vec![
                "fonts: Noto Sans, SIL Open Font License 1.1".to_owned(),
            ])
            .creation_date(day),
    );
    pdf.finish()
        .map_err(|error| standard(&format!("{error:?}")))
}

fn standard(reason: &str) -> PdfError {
    PdfError::Standard {
        reason: reason.to_owned(),
    }
}

/// Start of a day in UTC.
fn midnight((year, month, day): (u16, u8, u8)) -> DateTime {
    let day = DateTime::new(year)
        .month(month)
        .day(day)
        .hour(0)
        .minute(0)
        .second(0);
    day.utc_offset_hour(0).utc_offset_minute(0)
}

fn draw(surface: &mut Surface, fonts: &Fonts, drawn: &Drawn) {
    match drawn {
        Drawn::Text {
            at: (x, y),
            text,
            style,
        } => {
            let typeface = fonts.get(style.bold);
            let color = rgb::Color::new(style.grey, style.grey, style.grey);
            surface.set_stroke(None);
            surface.set_fill(Some(Fill {
                paint: color.into(),
                ..Fill::default()
            }));
            let (at, glyphs) = (Point::from_xy(*x, *y), typeface.glyphs(text));
            surface.draw_glyphs(at, &glyphs, typeface.font.clone(), text, style.size, false);
        }
        Drawn::Rule {
            from: (x, y),
            to,
            width,
        } => {
            let mut path = PathBuilder::new();
            path.move_to(*x, *y);
            path.line_to(*to, *y);
            surface.set_fill(None);
            surface.set_stroke(Some(Stroke {
                paint: rgb::Color::new(90, 90, 90).into(),
                width: *width,
                ..Stroke::default()
            }));
            if let Some(path) = path.finish() {
                surface.draw_path(&path);
            }
        }
    }
}

fn embedded(file: Attached, day: DateTime) -> EmbeddedFile {
    EmbeddedFile {
        path: file.name,
        mime_type: MimeType::new(file.mime),
        description: Some(file.description),
        association_kind: if file.alternative {
            AssociationKind::Alternative
        } else {
            AssociationKind::Data
        },
        data: file.bytes.into(),
        modification_date: Some(day),
        compress: Some(true),
        location: None,
    }
}

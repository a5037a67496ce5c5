//! What other programs read: calibrated samples, and calibrations in their own formats.
//!
//! Every format says in comments what `N` and `u` are, and names what it cannot hold.

mod c;
mod kalibr;
mod kf_gins;
mod octave;
mod samples;
mod source;
mod text;

pub use samples::{HEADER, sample_rows, write_samples};

use crate::calibration::CorrectionError;
use crate::calibration::result::Calibration;
use crate::run::Run;
use source::Source;

/// A format of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Kalibr's IMU intrinsics, model `scale-misalignment`.
    Kalibr,
    /// The part of a KF-GINS configuration that is about the IMU.
    KfGins,
    /// A C99 header with a function.
    C,
    /// An Octave or MATLAB function file.
    Octave,
    /// Every value with its name, σ and unit.
    Text,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 5] = [
        Self::Kalibr,
        Self::KfGins,
        Self::C,
        Self::Octave,
        Self::Text,
    ];
}

/// A calibration in a format.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The file.
    pub text: String,
    /// What the format does not hold, a sentence each. The file says it, too.
    pub notes: Vec<String>,
}

/// Writes a calibration in a format. A run of the same instrument gives noise figures, sample rate and
/// the nominal scales that counts are to be divided by, for formats that want rad/s and m/s².
///
/// # Errors
/// If the calibration has no inverse or an unknown term, or is not one of the run's instrument.
pub fn write(
    record: &Calibration,
    format: Format,
    run: Option<&Run>,
) -> Result<Exported, CorrectionError> {
    let source = Source::new(record, run)?;
    Ok(match format {
        Format::Kalibr => kalibr::write(&source),
        Format::KfGins => kf_gins::write(&source),
        Format::C => c::write(&source),
        Format::Octave => octave::write(&source),
        Format::Text => text::write(&source),
    })
}

//! The sequence of increments of a triad, packed if there are many.

mod packed;

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::Vector3;

use packed::Packed;
pub use packed::{Packer, finest_step};

/// Increments of a triad along the right, front and up axes, rad or m/s per sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    whole: Vec<Vector3<f64>>,
    /// Packed increments, which replace the plain ones.
    packed: Option<Packed>,
}

/// Number of samples that are unpacked at once in sequential reading.
const AT_ONCE: usize = 4096;

impl Series {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.packed.as_ref().map_or(self.whole.len(), Packed::len)
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether the increments are packed. Reading packed increments is slower, and unpacking many of them at once takes
    /// memory.
    pub fn is_packed(&self) -> bool {
        self.packed.is_some()
    }

    /// The mean packing step of the axes; zero if they are not packed.
    pub fn step(&self) -> f64 {
        self.packed.as_ref().map_or(0.0, Packed::step)
    }

    /// The increment of a sample; zero beyond the end.
    pub fn at(&self, k: usize) -> Vector3<f64> {
        self.part(k..k + 1).first().copied().unwrap_or_default()
    }

    /// A range of increments, which is shorter at the end of the recording.
    pub fn part(&self, samples: Range<usize>) -> Cow<'_, [Vector3<f64>]> {
        let end = samples.end.min(self.len());
        let samples = samples.start.min(end)..end;
        match &self.packed {
            None => Cow::Borrowed(&self.whole[samples]),
            Some(packed) => Cow::Owned(packed.part(samples)),
        }
    }

    /// A range of increments in parts of this length; the last part may be shorter.
    pub fn parts(
        &self,
        samples: Range<usize>,
        length: usize,
    ) -> impl Iterator<Item = Cow<'_, [Vector3<f64>]>> {
        let (end, length) = (samples.end.min(self.len()), length.max(1));
        let begins = samples.start..end;
        let begins = begins.step_by(length);
        begins.map(move |begin| self.part(begin..(begin + length).min(end)))
    }

    /// Iterates over a range of increments.
    pub fn within(&self, samples: Range<usize>) -> impl Iterator<Item = Vector3<f64>> {
        let length = if self.is_packed() {
            AT_ONCE
        } else {
            samples.len()
        };
        self.parts(samples, length).flat_map(|part| {
            let (borrowed, owned) = match part {
                Cow::Borrowed(samples) => (Some(samples), None),
                Cow::Owned(samples) => (None, Some(samples)),
            };
            let borrowed = borrowed.into_iter().flatten().copied();
            borrowed.chain(owned.into_iter().flatten())
        })
    }

    /// Iterates over all increments.
    pub fn iter(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.within(0..self.len())
    }

    /// Sum over a range of increments.
    pub fn sum(&self, samples: Range<usize>) -> Vector3<f64> {
        match self.packed {
            None => self.part(samples).iter().sum(),
            Some(_) => self.within(samples).sum(),
        }
    }

    /// Sums over a range of increments, `length` at a time; an incomplete sum at the end is dropped.
    pub fn sums(&self, samples: Range<usize>, length: usize) -> impl Iterator<Item = Vector3<f64>> {
        let length = length.max(1);
        let whole = samples.len() / length * length;
        let at_once = AT_ONCE.div_ceil(length) * length;
        let parts = self.parts(samples.start..samples.start + whole, at_once);
        parts.flat_map(move |part| {
            let sums = part
                .chunks_exact(length)
                .map(|samples| samples.iter().sum());
            sums.collect::<Vec<Vector3<f64>>>()
        })
    }

    /// Unpacks all increments, so that they can be modified.
    pub fn to_mut(&mut self) -> &mut Vec<Vector3<f64>> {
        if let Some(packed) = self.packed.take() {
            self.whole = packed.part(0..packed.len());
        }
        &mut self.whole
    }
}

/// Collects samples of the quantity in a file (rates or increments), plain or packed.
pub enum SeriesWriter {
    /// Samples as numbers.
    Whole(Vec<Vector3<f64>>),
    /// The samples are stored as whole numbers of the finest step.
    Packed(Packer),
}

impl Default for SeriesWriter {
    fn default() -> Self {
        Self::Whole(Vec::new())
    }
}

impl SeriesWriter {
    /// Number of samples so far.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        match self {
            Self::Whole(samples) => samples.len(),
            Self::Packed(packer) => packer.len(),
        }
    }

    /// Appends a sample.
    pub fn push(&mut self, sample: [f64; 3]) {
        match self {
            Self::Whole(samples) => samples.push(sample.into()),
            Self::Packed(packer) => packer.push(sample),
        }
    }

    /// The samples times `seconds`, divided by the nominal scale `nominal` of the file's quantity.
    pub fn finish(self, seconds: f64, nominal: Vector3<f64>) -> Series {
        match self {
            Self::Whole(mut samples) => {
                for sample in &mut samples {
                    *sample = (*sample * seconds).component_div(&nominal);
                }
                samples.into()
            }
            Self::Packed(packer) => Series {
                whole: Vec::new(),
                packed: Some(packer.finish(nominal.map(|n| seconds / n).into())),
            },
        }
    }
}

impl From<Vec<Vector3<f64>>> for Series {
    fn from(samples: Vec<Vector3<f64>>) -> Self {
        Self {
            whole: samples,
            packed: None,
        }
    }
}

impl FromIterator<Vector3<f64>> for Series {
    fn from_iter<T: IntoIterator<Item = Vector3<f64>>>(samples: T) -> Self {
        samples.into_iter().collect::<Vec<_>>().into()
    }
}

//! Increments of a triad, one after the other: as they are, or packed where there are too many of them.

mod packed;

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::Vector3;

use packed::Packed;
pub(crate) use packed::{Packer, finest_step};

/// Increments of a triad along right-front-up, rad or m/s a sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    whole: Vec<Vector3<f64>>,
    /// In place of the whole ones.
    packed: Option<Packed>,
}

/// Samples that are unpacked at once where they are read one after the other.
const AT_ONCE: usize = 4096;

impl Series {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.packed.as_ref().map_or(self.whole.len(), Packed::len)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether they are packed: then reading them takes longer, and to have many at once takes memory.
    pub fn is_packed(&self) -> bool {
        self.packed.is_some()
    }

    /// The step of packed ones, on average over the axes; else zero.
    pub(crate) fn step(&self) -> f64 {
        self.packed.as_ref().map_or(0.0, Packed::step)
    }

    /// One of them; zero where there is none.
    pub fn at(&self, k: usize) -> Vector3<f64> {
        self.part(k..k + 1).first().copied().unwrap_or_default()
    }

    /// Some that follow one another, at once; fewer where the record ends.
    pub fn part(&self, samples: Range<usize>) -> Cow<'_, [Vector3<f64>]> {
        let end = samples.end.min(self.len());
        let samples = samples.start.min(end)..end;
        match &self.packed {
            None => Cow::Borrowed(&self.whole[samples]),
            Some(packed) => Cow::Owned(packed.part(samples)),
        }
    }

    /// Some that follow one another, in parts of this length; the last may be shorter.
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

    /// Some that follow one another, one by one.
    pub fn within(&self, samples: Range<usize>) -> impl Iterator<Item = Vector3<f64>> {
        let length = match self.is_packed() {
            true => AT_ONCE,
            false => samples.len(),
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

    /// All of them, one by one.
    pub fn iter(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.within(0..self.len())
    }

    /// Sum of some that follow one another.
    pub fn sum(&self, samples: Range<usize>) -> Vector3<f64> {
        match self.packed {
            None => self.part(samples).iter().sum(),
            Some(_) => self.within(samples).sum(),
        }
    }

    /// The sums of some that follow one another, `length` at a time; the rest at the end is left out.
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

    /// All of them, to be changed; packed ones are no longer so.
    pub fn to_mut(&mut self) -> &mut Vec<Vector3<f64>> {
        if let Some(packed) = self.packed.take() {
            self.whole = packed.part(0..packed.len());
        }
        &mut self.whole
    }
}

/// Takes samples as they come, in the quantity of a file: to keep them as they are, or packed.
pub enum SeriesWriter {
    Whole(Vec<Vector3<f64>>),
    Packed(Packer),
}

impl Default for SeriesWriter {
    fn default() -> Self {
        Self::Whole(Vec::new())
    }
}

impl SeriesWriter {
    pub fn push(&mut self, sample: [f64; 3]) {
        match self {
            Self::Whole(samples) => samples.push(sample.into()),
            Self::Packed(packer) => packer.push(sample),
        }
    }

    /// The samples times `seconds`, one of the output being `nominal` in the quantity that came.
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

//! Which samples of an axis are what the instrument sensed.

use std::ops::Range;

/// A bit a sample, set where it is not sound, and behind the last one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sound {
    unsound: Vec<u64>,
    len: usize,
}

const BITS: usize = u64::BITS as usize;

impl Sound {
    /// So many samples that are all sound.
    pub fn new(len: usize) -> Self {
        let mut unsound = vec![0; len.div_ceil(BITS)];
        if let Some(last) = unsound.last_mut()
            && !len.is_multiple_of(BITS)
        {
            *last = u64::MAX << (len % BITS);
        }
        Self { unsound, len }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether this sample is there and sound.
    pub fn is(&self, k: usize) -> bool {
        let word = self.unsound.get(k / BITS);
        word.is_some_and(|word| word >> (k % BITS) & 1 == 0)
    }

    /// Says of samples whether they are sound.
    pub fn set(&mut self, samples: Range<usize>, sound: bool) {
        for k in samples.start..samples.end.min(self.len) {
            let bit = 1 << (k % BITS);
            match sound {
                true => self.unsound[k / BITS] &= !bit,
                false => self.unsound[k / BITS] |= bit,
            }
        }
    }

    /// As many samples as there are bits, from this one on.
    fn unsound_from(&self, k: usize) -> u64 {
        let word = |index: usize| self.unsound.get(index).copied().unwrap_or(u64::MAX);
        let (index, bit) = (k / BITS, k % BITS);
        match bit {
            0 => word(index),
            _ => word(index) >> bit | word(index + 1) << (BITS - bit),
        }
    }
}

/// Samples that are asked for together, wherever they begin.
#[derive(Debug)]
pub(super) struct Pattern {
    first: usize,
    /// A bit for each sample from the first one on.
    asked: Vec<u64>,
}

impl Pattern {
    /// These samples, which come in runs one behind the other.
    pub fn new(runs: &[Range<usize>]) -> Self {
        let (first, end) = match runs {
            [first, .., last] => (first.start, last.end),
            [only] => (only.start, only.end),
            [] => (0, 0),
        };
        let mut asked = vec![0; (end - first).div_ceil(BITS)];
        for k in runs.iter().flat_map(Range::clone) {
            asked[(k - first) / BITS] |= 1 << ((k - first) % BITS);
        }
        Self { first, asked }
    }

    /// Whether they are all sound so many samples later.
    pub fn is_sound(&self, sound: &Sound, later: isize) -> bool {
        let first = self.first.checked_add_signed(later);
        first.is_some_and(|first| {
            let mut words = self.asked.iter().zip((first..).step_by(BITS));
            words.all(|(asked, k)| asked & sound.unsound_from(k) == 0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_is_sound_where_each_of_its_samples_is() {
        for len in [128, 150, 200] {
            let mut sound = Sound::new(len);
            for k in (0..len).filter(|k| k % 29 == 11) {
                sound.set(k..k + 1, false);
            }
            let runs = [5..11, 12..40, 41..69, 70..75];
            let pattern = Pattern::new(&runs);
            let mut places = 0;
            for later in -10..len as isize {
                let mut each = runs.iter().flat_map(Range::clone);
                let all = each.all(|k| k.checked_add_signed(later).is_some_and(|k| sound.is(k)));
                assert_eq!(pattern.is_sound(&sound, later), all, "{len} {later}");
                places += usize::from(all);
            }
            assert!(places > 0);
        }
    }
}

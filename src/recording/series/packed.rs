//! Compressed samples.
//!
//! A sample is a whole number of steps of its axis. The remainder is carried into the next sample, as in an
//! instrument that counts pulses, so that sums stay within half a step of their true values. Each frame of samples
//! is coded by differences of the order that needs the fewest bits, all of the same width (the fixed predictors of
//! lossless audio coders; Robinson, SHORTEN, 1994).

use std::ops::Range;

use nalgebra::Vector3;

/// Number of samples in a frame.
const FRAME: usize = 256;
/// Differences of orders below this are tried.
const ORDERS: usize = 3;
/// Number of bytes that can be read at once beyond the last bit.
const PADDING: usize = 16;

/// Samples of three axes, packed.
#[derive(Debug, Clone, PartialEq)]
pub struct Packed {
    /// Step of each axis.
    steps: Vector3<f64>,
    frames: Vec<Box<[u8]>>,
    len: usize,
}

impl Packed {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Mean step of the axes.
    pub fn step(&self) -> f64 {
        self.steps.abs().mean()
    }

    /// Returns a range of samples, which must exist.
    pub fn part(&self, samples: Range<usize>) -> Vec<Vector3<f64>> {
        let mut part = Vec::with_capacity(samples.len());
        let mut axes = [[0i64; FRAME]; 3];
        let mut at = samples.start;
        while at < samples.end {
            let first = at / FRAME * FRAME;
            let Some(frame) = self.frames.get(at / FRAME) else {
                break;
            };
            let until = samples.end.min(first + FRAME);
            let mut rest = &frame[..];
            for axis in &mut axes {
                rest = decoded(rest, &mut axis[..FRAME.min(self.len - first)]);
            }
            let [x, y, z] = &axes;
            part.extend((at - first..until - first).map(|k| {
                Vector3::new(x[k] as f64, y[k] as f64, z[k] as f64).component_mul(&self.steps)
            }));
            at = until;
        }
        part
    }
}

/// Packs samples of three axes one by one.
#[derive(Debug)]
pub struct Packer {
    /// Step of each axis, in the input quantity.
    steps: [f64; 3],
    /// Remainder of the samples so far, in steps.
    carried: [f64; 3],
    pending: [Vec<i64>; 3],
    frames: Vec<Box<[u8]>>,
    len: usize,
}

impl Packer {
    /// A packer for axes with these steps.
    pub fn new(steps: [f64; 3]) -> Self {
        Self {
            steps,
            carried: [0.0; 3],
            pending: [const { Vec::new() }; 3],
            frames: Vec::new(),
            len: 0,
        }
    }

    /// Number of samples so far.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Packs one more sample.
    pub fn push(&mut self, sample: [f64; 3]) {
        for (axis, value) in sample.into_iter().enumerate() {
            let steps = value / self.steps[axis] + self.carried[axis];
            let whole = steps.round();
            self.carried[axis] = steps - whole;
            self.pending[axis].push(whole as i64);
        }
        self.len += 1;
        if self.len.is_multiple_of(FRAME) {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let mut frame = Vec::new();
        for axis in &mut self.pending {
            encode(axis, &mut frame);
            axis.clear();
        }
        frame.extend([0; PADDING]);
        self.frames.push(frame.into_boxed_slice());
    }

    /// The packed samples; `units` is the value of one unit of the input quantity, for each axis.
    pub fn finish(mut self, units: [f64; 3]) -> Packed {
        if !self.pending[0].is_empty() {
            self.flush();
        }
        self.frames.shrink_to_fit();
        Packed {
            steps: Vector3::from_fn(|axis, _| self.steps[axis] * units[axis]),
            frames: self.frames,
            len: self.len,
        }
    }
}

/// Length of the frames in which noise is measured.
const QUIET: usize = 64;
/// Quantile of the frames that gives the noise of the axis.
const AT_REST: f64 = 0.1;
/// Steps per σ of the noise: packing adds at most a fortieth to the variance of a sample, and at most half a step
/// to a sum over samples.
const STEPS_OF_NOISE: f64 = 4.0;
/// Number of packing steps per step of the grid of the values.
const STEPS_OF_GRID: f64 = 16.0;
/// Number of steps up to the largest value, if no noise is found.
const STEPS_OF_RANGE: f64 = 4_294_967_296.0;

/// The largest step for which the packing error of an axis with these values is negligible compared with its noise.
pub fn finest_step(values: &[f64]) -> f64 {
    let bend = |three: &[f64]| (three[0] - 2.0 * three[1] + three[2]).powi(2);
    let of_frame = |frame: &[f64]| {
        let bends = frame.windows(3).map(bend);
        // The variance of a second difference is six times that of its values.
        (bends.sum::<f64>() / (6 * (frame.len() - 2)) as f64).sqrt()
    };
    let frames = values.chunks_exact(QUIET).map(of_frame);
    let mut noise: Vec<f64> = frames.filter(|sigma| *sigma > 0.0).collect();
    let changes = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let grid = changes.filter(|change| *change > 0.0).reduce(f64::min);
    let range = values.iter().fold(0.0, |range: f64, v| range.max(v.abs()));
    let rank = (AT_REST * noise.len() as f64) as usize;
    let noise = if noise.is_empty() {
        0.0
    } else {
        *noise.select_nth_unstable_by(rank, f64::total_cmp).1
    };
    let step = (noise / STEPS_OF_NOISE)
        .max(grid.unwrap_or(0.0) / STEPS_OF_GRID)
        .max(range / STEPS_OF_RANGE);
    if step > 0.0 { step } else { 1.0 }
}

/// Replaces numbers by differences of the next order, after as many starting values.
fn differences(numbers: &mut [i64], order: usize) {
    for k in (order..numbers.len()).rev() {
        numbers[k] = numbers[k].wrapping_sub(numbers[k - 1]);
    }
}

/// Number of bits for the numbers from `order` on, and the smallest of them.
fn width(numbers: &[i64], order: usize) -> (u32, i64) {
    let rest = numbers.get(order..).unwrap_or_default();
    let (Some(&low), Some(&high)) = (rest.iter().min(), rest.iter().max()) else {
        return (0, 0);
    };
    (
        u64::BITS - (high.wrapping_sub(low) as u64).leading_zeros(),
        low,
    )
}

fn encode(numbers: &[i64], frame: &mut Vec<u8>) {
    let mut tried = numbers.to_vec();
    let mut best = (u32::MAX, 0, 0, Vec::new());
    for order in 0..ORDERS {
        if order > 0 {
            differences(&mut tried, order);
        }
        let (bits, low) = width(&tried, order);
        if bits < best.0 {
            best = (bits, order, low, tried.clone());
        }
    }
    let (bits, order, low, coded) = best;
    frame.extend([order as u8, bits as u8]);
    frame.extend(low.to_le_bytes());
    let (first, rest) = coded.split_at(order.min(coded.len()));
    for number in first {
        frame.extend(number.to_le_bytes());
    }
    let (mut held, mut filled) = (0u128, 0);
    for number in rest {
        held |= u128::from(number.wrapping_sub(low) as u64) << filled;
        filled += bits;
        while filled >= 8 {
            frame.push(held as u8);
            held >>= 8;
            filled -= 8;
        }
    }
    if filled > 0 {
        frame.push(held as u8);
    }
}

/// Decodes the numbers of one axis, and returns the remainder of the frame.
fn decoded<'a>(frame: &'a [u8], numbers: &mut [i64]) -> &'a [u8] {
    let number = |at: usize| {
        let bytes = frame
            .get(at..at + 8)
            .and_then(|bytes| bytes.try_into().ok());
        i64::from_le_bytes(bytes.unwrap_or_default())
    };
    let [order, bits] = [frame[0], frame[1]].map(usize::from);
    let low = number(2);
    let first = order.min(numbers.len());
    for (k, value) in numbers[..first].iter_mut().enumerate() {
        *value = number(10 + 8 * k);
    }
    let frame = &frame[10 + 8 * first..];
    let mask = match bits {
        64 => u64::MAX,
        bits => (1 << bits) - 1,
    };
    let coded = &mut numbers[first..];
    let count = coded.len();
    for (k, value) in coded.iter_mut().enumerate() {
        let (byte, bit) = (k * bits / 8, k * bits % 8);
        let read = match bits {
            0..=57 => {
                let bytes = frame[byte..byte + 8].try_into().unwrap_or_default();
                u64::from_le_bytes(bytes) >> bit
            }
            _ => {
                let bytes = frame[byte..byte + 16].try_into().unwrap_or_default();
                (u128::from_le_bytes(bytes) >> bit) as u64
            }
        };
        *value = low.wrapping_add((read & mask) as i64);
    }
    for order in (1..=first).rev() {
        for k in order..numbers.len() {
            numbers[k] = numbers[k].wrapping_add(numbers[k - 1]);
        }
    }
    &frame[(count * bits).div_ceil(8)..]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packed(values: &[[f64; 3]], steps: [f64; 3]) -> Packed {
        let mut packer = Packer::new(steps);
        values.iter().for_each(|&value| packer.push(value));
        packer.finish([1.0; 3])
    }

    #[test]
    fn whole_numbers_come_back_as_they_were() {
        let wild = [i64::MAX >> 12, -7, 0, 1 << 50, i64::MIN >> 12];
        let value = |k: usize| {
            let ramp = (k * k) as f64;
            [(k % 3) as f64, -ramp, wild[k % 5] as f64]
        };
        for count in [1, 2, 255, 256, 257, 1000] {
            let values: Vec<_> = (0..count).map(value).collect();
            let packed = packed(&values, [1.0; 3]);
            assert_eq!(packed.len(), count);
            let back = packed.part(0..count);
            for (back, value) in back.iter().zip(&values) {
                assert_eq!(*back, Vector3::from(*value));
            }
            assert_eq!(packed.part(count / 2..count), back[count / 2..]);
        }
    }

    #[test]
    fn sums_stay_within_half_a_step_of_what_they_were() {
        let value = |k: usize| [(k as f64).sin(), 1e-3 * k as f64, -0.3];
        let values: Vec<_> = (0..5000).map(value).collect();
        let back = packed(&values, [0.25, 0.1, 1.0]).part(0..5000);
        let (mut off, mut largest) = (Vector3::zeros(), Vector3::<f64>::zeros());
        for (back, value) in back.iter().zip(&values) {
            off += back - Vector3::from(*value);
            largest = largest.sup(&off.abs());
        }
        assert!(largest.x <= 0.1251 && largest.y <= 0.0501 && largest.z <= 0.5001);
    }

    #[test]
    fn noise_takes_the_bits_that_its_range_has() {
        let value = |k: usize| {
            let fraction = (k as f64 * 0.618_033_988_749_895).fract();
            [(15.9 * fraction).floor(); 3]
        };
        let values: Vec<_> = (0..25_600).map(value).collect();
        let packed = packed(&values, [1.0; 3]);
        let bytes: usize = packed.frames.iter().map(|frame| frame.len()).sum();
        assert!(bytes < 25_600 * 3 * 5 / 8, "{bytes}");
    }
}

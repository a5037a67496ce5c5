//! Registers behind the rows: zero, range, and unusable encodings.

use nalgebra::Vector3;

use super::columns::Columns;
use super::motion::Motion;
use super::raw_run::{Gravity, RawRun, Turns};
use super::raw_samples::RawSamples;
use turncal::imu::PerSensor;

/// Registers detected from counts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Registers {
    pub has_rests: bool,
    pub gravity: Option<Gravity>,
    pub turns: Option<Turns>,
}

impl Registers {
    /// From rows and their detected motion.
    pub fn find(rows: &RawSamples, motion: &Motion) -> Self {
        let found = |mut raw: RawRun| {
            let (has_rests, gravity) = (raw.rests() > 0, raw.gravity());
            Self {
                has_rests,
                turns: gravity.as_ref().and_then(|_| raw.turns()),
                gravity,
            }
        };
        let whole = found(RawRun::new(rows, &rows.breaks, motion));
        // Where gyros carry gravity from rest to rest no sections were laid end to end.
        if whole.turns.is_some() || motion.cuts.is_empty() {
            return whole;
        }
        let breaks = [&rows.breaks[..], &motion.cuts].concat();
        found(RawRun::new(rows, &breaks, motion).of_sections())
    }

    /// Subtracts the nominal register zero and reorders the gyro columns to match the accelerometers.
    pub fn apply(
        &self,
        samples: &mut PerSensor<Vec<Vector3<f64>>>,
        columns: &mut Columns,
        is_count: &PerSensor<bool>,
    ) {
        let zero = self.gravity.as_ref().and_then(|gravity| gravity.own_zero);
        if let Some(zero) = zero.filter(|_| is_count.accel) {
            samples.accel.iter_mut().for_each(|sample| *sample -= zero);
        }
        if let Some(turns) = self.turns.as_ref().filter(|_| is_count.gyro) {
            for sample in &mut samples.gyro {
                *sample = Vector3::from(turns.columns.map(|k| sample[k]));
            }
            if let Some(triad) = &mut columns.triads.gyro {
                *triad = turns.columns.map(|k| triad[k]);
            }
        }
    }
}

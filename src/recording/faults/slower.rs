//! Detection of parts of a recording with a lower row rate, in which the same number of rows is missing at each place.

use std::f64::consts::LN_2;
use std::ops::Range;

use super::chance::Limit;
use super::{Fault, FaultKind};
use crate::recording::ImuSamples;

/// A part of a recording with a lower row rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Slower {
    /// The samples from the first sample without a row to the last sample without a row.
    pub samples: Range<usize>,
    /// Line of the row before these samples.
    pub line: u64,
    /// Number of samples from one row to the next.
    pub step: usize,
    /// Number of places with missing samples between rows.
    pub places: usize,
    /// Number of these places that are bridged.
    pub bridged: usize,
}

impl Slower {
    /// Whether this fault is one of the places in this part.
    pub fn holds(&self, fault: &Fault) -> bool {
        fault.kind == FaultKind::Missing && self.samples.contains(&fault.samples.start)
    }

    /// Number of samples that have no row.
    pub fn missing(&self) -> usize {
        self.places * (self.step - 1)
    }
}

impl ImuSamples {
    /// Parts in which gaps of one length alternate with single rows for longer than chance allows, even if every other
    /// row is missing at random.
    pub fn slower(&self) -> Vec<Slower> {
        let of_kind = |fault: &&Fault| fault.kind == FaultKind::Missing;
        let mut holes: Vec<&Fault> = self.faults.iter().filter(of_kind).collect();
        holes.sort_by_key(|hole| hole.samples.start);
        let missing: usize = holes.iter().map(|hole| hole.samples.len()).sum();
        let rows = self.len() - missing;
        let follows = |a: &&Fault, b: &&Fault| {
            b.samples.start == a.samples.end + 1 && b.samples.len() == a.samples.len()
        };
        let limit = Limit::of_rows(rows).nats / LN_2;
        let beyond_chance = |run: &&[&Fault]| run.len() as f64 > limit;
        let part = |run: &[&Fault]| Slower {
            samples: run[0].samples.start..run[run.len() - 1].samples.end,
            line: run[0].line,
            step: run[0].samples.len() + 1,
            places: run.len(),
            bridged: run.iter().filter(|hole| hole.bridged).count(),
        };
        let runs = holes.chunk_by(follows).filter(beyond_chance);
        runs.map(part).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::notes;
    use super::*;

    /// A record at 100 Hz that lacks these samples.
    fn record(lacks: impl Fn(usize) -> bool) -> ImuSamples {
        let values = vec![Vector3::zeros(); 4000];
        let mut imu = ImuSamples::made(0.0, 0.01, values.clone(), values);
        let holes = super::super::ranges(imu.len(), lacks);
        let fault = |samples: Range<usize>| Fault {
            kind: FaultKind::Missing,
            axis: None,
            line: samples.start as u64,
            bridged: samples.start.is_multiple_of(4),
            samples,
        };
        imu.faults = holes.into_iter().map(fault).collect();
        imu
    }

    #[test]
    fn a_rate_that_falls_is_told_as_one_and_rows_that_are_missing_beside_as_such() {
        let imu = record(|k| k == 70 || (k > 2000 && k % 3 != 2 && k < 3999));
        let [part] = imu.slower().try_into().unwrap();
        assert_eq!((part.samples, part.step, part.places), (2001..3998, 3, 666));
        let said = notes(&imu);
        assert!(
            said[0].starts_with(
                "From line 2001 (20.01 s) to 39.98 s, the interval between rows is 30.000 ms instead of 10.000 ms: \
                 turncal interpolated the missing samples, but attitude and velocity restart in 499 of 666 places"
            ),
            "{said:?}"
        );
        assert!(
            said[1].starts_with("1 row is missing (first after line 70"),
            "{said:?}"
        );
        assert_eq!(said.len(), 2);
    }

    #[test]
    fn rows_that_are_missing_by_chance_or_now_and_then_are_no_lower_rate() {
        assert!(record(|_| false).slower().is_empty());
        assert!(record(|k| k % 7 == 3).slower().is_empty());
        assert!(
            record(|k| [50, 52, 54, 3000].contains(&k))
                .slower()
                .is_empty()
        );
        // Every other one, as a generator draws it.
        let mut state = 1u64;
        let mut drawn = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            state >> 63 == 1
        };
        let lacks: Vec<bool> = (0..4000).map(|_| drawn()).collect();
        assert!(record(|k| lacks[k]).slower().is_empty());
    }
}

//! Elimination of errors that several rows have in common, at a cost proportional to the number of events.
//!
//! Common errors are unknowns with a prior: they enter with the first event that they affect, and leave after the last.
//! At the end, one triangular factor of the parameters remains (square-root information filter; Bierman 1977,
//! *Factorization Methods for Discrete Sequential Estimation*, ch. V).

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, RowVector3};

use super::equations::{Common, Equations, Rows};
use crate::imu::{PerSensor, Sensor};

/// Smallest variance of a mean bias variation given its previous value, divided by the stationary variance; smaller
/// values are rounding errors.
const ROUNDING: f64 = 1e-8;

/// A row divided by the σ of its independent error.
struct Scaled<'a> {
    errors: Vec<(Common, RowVector3<f64>)>,
    /// The observation; `None` for the prior of errors.
    of: Option<(&'a Rows<1>, f64)>,
}

impl Scaled<'_> {
    /// The prior of one component of an error with this σ.
    fn prior(of: Common, axis: usize, sigma: f64) -> Self {
        Self {
            errors: vec![(of, unit(axis) / sigma)],
            of: None,
        }
    }
}

fn unit(axis: usize) -> RowVector3<f64> {
    RowVector3::from_fn(|_, column| f64::from(u8::from(column == axis)))
}

/// Triangular factor: three columns for each remaining error, then the unknowns and the residual.
pub struct Eliminated {
    errors: Vec<Common>,
    r: DMatrix<f64>,
}

impl Eliminated {
    /// The factor of the unknowns and the residual.
    pub fn of_unknowns(&self) -> DMatrix<f64> {
        let first = 3 * self.errors.len();
        let (rows, columns) = self.r.shape();
        let left = (rows.saturating_sub(first), columns - first);
        self.r.view((first, first), left).into_owned()
    }

    /// Response of the unknowns, whose covariance is given, to each error of the table; it equals the negative
    /// covariance of the unknowns with the estimated error.
    pub fn by_table(&self, covariance: &DMatrix<f64>) -> BTreeMap<usize, DMatrix<f64>> {
        let first = 3 * self.errors.len();
        let of_errors = self.r.view((0, 0), (first, first));
        let across = self.r.view((0, first), (first, covariance.nrows()));
        let responses = of_errors.solve_upper_triangular(&(across * covariance));
        let of_table = |(place, of): (usize, &Common)| match of {
            Common::Table(number) => {
                let response = responses.as_ref()?.rows(3 * place, 3).transpose();
                Some((*number, response))
            }
            _ => None,
        };
        self.errors
            .iter()
            .enumerate()
            .filter_map(of_table)
            .collect()
    }

    /// Adds the rows of an event, and eliminates the errors that affect no later event.
    fn take(&mut self, unknown: &[usize], rows: &[Scaled], is_over: impl Fn(&Common) -> bool) {
        let new = rows
            .iter()
            .flat_map(|row| row.errors.iter().map(|(of, _)| *of));
        let all: BTreeSet<Common> = self.errors.iter().copied().chain(new).collect();
        let (over, left): (Vec<_>, Vec<_>) = all.into_iter().partition(is_over);
        let order: BTreeMap<Common, usize> = over
            .iter()
            .chain(&left)
            .copied()
            .zip((0..).step_by(3))
            .collect();
        let (before, first) = (self.r.nrows(), 3 * order.len());
        let of_unknowns = unknown.len() + 1;
        let mut all = DMatrix::zeros(before + rows.len(), first + of_unknowns);
        for (k, of) in self.errors.iter().enumerate() {
            let mut columns = all.view_mut((0, order[of]), (before, 3));
            columns.copy_from(&self.r.columns(3 * k, 3));
        }
        let mut columns = all.view_mut((0, first), (before, of_unknowns));
        columns.copy_from(&self.r.columns(3 * self.errors.len(), of_unknowns));
        for (row, Scaled { errors, of }) in (before..).zip(rows) {
            for (error, by) in errors {
                let mut columns = all.fixed_view_mut::<1, 3>(row, order[error]);
                columns += by;
            }
            let Some((of, sigma)) = of else { continue };
            for (column, &index) in (first..).zip(unknown) {
                all[(row, column)] = of.partials[index] / sigma;
            }
            all[(row, first + unknown.len())] = of.residual.x / sigma;
        }
        let r = all.qr().r();
        let gone = 3 * over.len();
        self.r = r
            .view((gone, gone), (r.nrows() - gone, r.ncols() - gone))
            .into_owned();
        self.errors = left;
    }
}

impl Equations {
    /// The rows with all errors eliminated except for those of the table.
    pub fn eliminated(&self) -> Eliminated {
        let mut events: BTreeMap<usize, Vec<&Rows<1>>> = BTreeMap::new();
        for row in &self.rows {
            events.entry(row.event).or_default().push(row);
        }
        let mut last: BTreeMap<Common, usize> = BTreeMap::new();
        for row in &self.rows {
            for (of, _) in row
                .common
                .iter()
                .filter(|(of, _)| self.variance_of(*of) > 0.0)
            {
                let last = last.entry(*of).or_default();
                *last = (*last).max(row.event);
            }
        }
        let mut eliminated = Eliminated {
            errors: Vec::new(),
            r: DMatrix::zeros(0, self.unknown.len() + 1),
        };
        let mut drifted: PerSensor<Option<usize>> = PerSensor::default();
        for (&event, rows) in &events {
            let all = rows
                .iter()
                .flat_map(|row| row.common.iter().map(|(of, _)| *of));
            let new: BTreeSet<Common> = all
                .filter(|of| last.contains_key(of) && !eliminated.errors.contains(of))
                .collect();
            let mut block: Vec<Scaled> = new
                .into_iter()
                .flat_map(|of| self.prior_of(of, &mut drifted))
                .collect();
            block.extend(rows.iter().map(|row| {
                let sigma = row.own.x.sqrt();
                let common = row.common.iter().filter(|(of, _)| last.contains_key(of));
                Scaled {
                    errors: common.map(|(of, by)| (*of, by / sigma)).collect(),
                    of: Some((*row, sigma)),
                }
            }));
            eliminated.take(&self.unknown, &block, |of| match of {
                Common::Table(_) => false,
                Common::Drift(sensor, at) => *drifted.get(*sensor) != Some(*at),
                _ => last.get(of).is_none_or(|last| *last <= event),
            });
        }
        eliminated
    }

    /// The prior of an error, given the preceding errors.
    fn prior_of(&self, of: Common, drifted: &mut PerSensor<Option<usize>>) -> Vec<Scaled<'static>> {
        let with_drift = match of {
            Common::Noise(sensor, event) => self.with_drift(sensor, event, drifted.get_mut(sensor)),
            _ => None,
        };
        let sigma = self.variance_of(of).sqrt();
        with_drift.unwrap_or_else(|| {
            let axes = 0..3;
            axes.map(|axis| Scaled::prior(of, axis, sigma)).collect()
        })
    }

    /// The prior of mean noise and of the bias variation at the end of an event, given the variation at the end of an
    /// earlier event; `None` if the bias does not vary.
    fn with_drift(
        &self,
        sensor: Sensor,
        number: usize,
        before: &mut Option<usize>,
    ) -> Option<Vec<Scaled<'static>>> {
        let event = &self.events[number];
        let drift = event.drift(sensor, before.map(|before| &self.events[before]))?;
        let least = ROUNDING * drift.variance;
        let of_mean = drift.mean * drift.since;
        let of_end = drift.decay * drift.since;
        // Covariance of mean and end value, given the previous value.
        let mean = (event.variance.get(sensor) - drift.variance * of_mean.powi(2)).max(least);
        let across = drift.variance * (drift.mean - of_mean * of_end);
        let slope = across / mean;
        let end = (drift.variance * (1.0 - of_end.powi(2)) - across * slope).max(least);
        let earlier = before.replace(number).filter(|_| drift.since > 0.0);
        let errors = |axis: usize, [noise, here, there]: [f64; 3], sigma: f64| {
            let mut errors = vec![
                (Common::Noise(sensor, number), unit(axis) * (noise / sigma)),
                (Common::Drift(sensor, number), unit(axis) * (here / sigma)),
            ];
            if let Some(earlier) = earlier {
                errors.push((Common::Drift(sensor, earlier), unit(axis) * (there / sigma)));
            }
            Scaled { errors, of: None }
        };
        let rows = (0..3).flat_map(|axis| {
            [
                errors(axis, [1.0, 0.0, -of_mean], mean.sqrt()),
                errors(axis, [-slope, 1.0, slope * of_mean - of_end], end.sqrt()),
            ]
        });
        Some(rows.collect())
    }
}

#[cfg(test)]
mod tests;

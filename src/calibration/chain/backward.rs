//! The disturbance smoother of the chain, which estimates every disturbance from all data.
//!
//! Source: Koopman and Shephard 1992, "Exact score for time series models in state space form", Biometrika 79(4), for
//! the score; de Jong 1991, "The diffuse Kalman filter", Annals of Statistics 19(2), for the columns of the constants.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::effects::Effect;
use super::forward::{Filtered, Passed};
use super::links::Link;
use super::states::States;
use crate::calibration::Posterior;

/// Mean squares and variances of the disturbances of one event, given all data.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    /// Derivative of −2 ln L with respect to the log variance of this event alone.
    pub slope: f64,
    /// Expected curvature of −2 ln L with respect to the log σ, from this event alone.
    pub curvature: f64,
    /// Sum of the squared means of the disturbances, divided by their prior variance.
    pub squares: f64,
    /// Sum of the variances of the disturbances, given all data, divided by their prior variance.
    pub unknown: f64,
    /// Number of disturbances.
    pub count: f64,
}

/// Moments of the disturbances of each event of each effect, given all data.
pub struct Smoothed(pub BTreeMap<(Effect, usize), Moments>);

/// Smoothing cumulants: the mean for the case that all constants are zero, the effect of the constants, and the
/// precision.
pub struct Cumulants {
    pub mean: DVector<f64>,
    pub by_constants: DMatrix<f64>,
    pub precision: DMatrix<f64>,
}

impl Cumulants {
    /// Goes back over the rows of a link.
    fn observe(&mut self, passed: &Passed) {
        let Passed { rows, across, .. } = passed;
        // (I − K H)ᵀ r = r − Hᵀ L⁻ᵀ (L⁻¹ H P) r
        let back = |r: &DMatrix<f64>| r - rows.tr_mul(&(across * r));
        let seen = rows.tr_mul(&passed.innovations);
        let told = across * &self.mean;
        self.mean += seen - rows.tr_mul(&told);
        self.by_constants = back(&self.by_constants) + rows.tr_mul(&passed.of_constants);
        let half = back(&self.precision);
        self.precision = back(&half.transpose()) + rows.tr_mul(rows);
    }

    /// Goes back over a transition.
    fn carry(&mut self, transition: &DMatrix<f64>) {
        self.mean = transition.tr_mul(&self.mean);
        self.by_constants = transition.tr_mul(&self.by_constants);
        self.precision = transition.tr_mul(&self.precision) * transition;
    }
}

impl Filtered<'_> {
    /// Runs backward through the links; passes to `visit` the number of each link and the cumulants of its rows and all
    /// later rows.
    pub fn backward(&self, mut visit: impl FnMut(usize, &Cumulants)) {
        let (n, c) = (self.chain.states.count, self.chain.constants.len());
        let mut cumulants = Cumulants {
            mean: DVector::zeros(n),
            by_constants: DMatrix::zeros(n, c),
            precision: DMatrix::zeros(n, n),
        };
        for (number, link) in self.chain.links.iter().enumerate().rev() {
            cumulants.observe(&self.passed[number]);
            visit(number, &cumulants);
            cumulants.carry(&link.transition.states);
        }
    }

    /// Smooths the disturbances with this posterior of the constants.
    pub fn smoothed(&self, posterior: &Posterior) -> Smoothed {
        let mut events = BTreeMap::<_, Moments>::new();
        self.backward(|number, cumulants| {
            let by_constants = &cumulants.by_constants;
            let mean = &cumulants.mean - by_constants * &posterior.mean;
            let of_constants = by_constants * &posterior.covariance * by_constants.transpose();
            let precision = &cumulants.precision - of_constants;
            for drive in &self.chain.links[number].transition.drives {
                let variance = self.sizes.of(drive.effect, drive.event);
                let precision = drive.by.tr_mul(&(&precision * &drive.by));
                let squares = variance * drive.by.tr_mul(&mean).norm_squared();
                let known = variance * precision.trace();
                let event = events.entry((drive.effect, drive.event)).or_default();
                event.slope += known - squares;
                event.curvature += 4.0 * variance.powi(2) * precision.norm_squared();
                event.squares += squares;
                event.unknown += drive.by.ncols() as f64 - known;
                event.count += drive.by.ncols() as f64;
            }
        });
        Smoothed(events)
    }

    /// Contribution of each effect to the covariance of the constants.
    pub fn parts(&self, posterior: &Posterior) -> BTreeMap<Effect, DMatrix<f64>> {
        let c = self.chain.constants.len();
        let mut parts = BTreeMap::new();
        self.backward(|number, cumulants| {
            let across = &cumulants.by_constants * &posterior.covariance;
            for drive in &self.chain.links[number].transition.drives {
                let variance = self.sizes.of(drive.effect, drive.event);
                let part = parts.entry(drive.effect);
                let part = part.or_insert_with(|| DMatrix::zeros(c, c));
                let across = drive.by.tr_mul(&across);
                part.gemm_tr(variance, &across, &across, 1.0);
            }
        });
        parts
    }
}

/// States at one time, given all data.
pub struct SmoothedStates {
    pub mean: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// Covariance of the constants (rows) with the states.
    pub with_constants: DMatrix<f64>,
}

impl SmoothedStates {
    fn new(passed: &Passed, cumulants: &Cumulants, posterior: &Posterior) -> Self {
        let p = &passed.covariance;
        let by = &passed.by_constants - p * &cumulants.by_constants;
        let with_constants = &posterior.covariance * by.transpose();
        Self {
            mean: &passed.mean + p * &cumulants.mean + &by * &posterior.mean,
            covariance: p - p * &cumulants.precision * p + by * &with_constants,
            with_constants,
        }
    }
}

impl Filtered<'_> {
    /// The states at the beginning of the part of each requested link, given all data, in order.
    pub fn states<'a>(
        &'a self,
        posterior: &Posterior,
        wanted: impl Fn(&Link) -> bool,
    ) -> Vec<(&'a Link, SmoothedStates)> {
        self.of_states(wanted, |passed, cumulants| {
            SmoothedStates::new(passed, cumulants, posterior)
        })
    }

    /// The means of these states, without covariances.
    pub fn means<'a>(
        &'a self,
        posterior: &Posterior,
        wanted: impl Fn(&Link) -> bool,
    ) -> Vec<(&'a Link, DVector<f64>)> {
        self.of_states(wanted, |passed, cumulants| {
            let unexplained = &cumulants.mean - &cumulants.by_constants * &posterior.mean;
            &passed.mean + &passed.by_constants * &posterior.mean + &passed.covariance * unexplained
        })
    }

    fn of_states<T>(
        &self,
        wanted: impl Fn(&Link) -> bool,
        of: impl Fn(&Passed, &Cumulants) -> T,
    ) -> Vec<(&Link, T)> {
        let mut all = Vec::new();
        self.backward(|number, cumulants| {
            let (link, passed) = (&self.chain.links[number], &self.passed[number]);
            if wanted(link) {
                all.push((link, of(passed, cumulants)));
            }
        });
        all.reverse();
        all
    }

    /// The layout of the states.
    pub fn layout(&self) -> &States {
        &self.chain.states
    }
}

impl Smoothed {
    /// Moments of the disturbances of all events of each effect.
    pub fn by_effect(&self) -> BTreeMap<Effect, Moments> {
        let mut sums = BTreeMap::<Effect, Moments>::new();
        for ((effect, _), of) in &self.0 {
            let sum = sums.entry(*effect).or_default();
            sum.slope += of.slope;
            sum.curvature += of.curvature;
            sum.squares += of.squares;
            sum.unknown += of.unknown;
            sum.count += of.count;
        }
        sums
    }
}

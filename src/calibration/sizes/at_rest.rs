//! Estimation of the noise at rest from the dwells alone.
//!
//! Each part of a dwell has its own free initial states and its own constant rates and forces, so the residuals show
//! white noise, sway and rotation by hand independently of the parameters.

use std::convert::Infallible;

use nalgebra::{DMatrix, DVector};

use super::descent::{Lowest, Slope, descend};
use super::usual::Usual;
use crate::calibration::chain::Dispersion;
use crate::calibration::chain::part::{Part, PartFilter, Whitened, filter_of, part_filters};
use crate::calibration::chain::states::States;
use crate::calibration::{Model, Problem, Script};

/// Step of a logarithm for differences.
const DIFFERENCE: f64 = 1e-3;
/// Prior 1σ of the initial states of a part, rad and m/s.
const BEGIN: f64 = 0.1;
/// Prior 1σ of the constant rates, rad/s, and specific forces, m/s², in a part.
const RATE: f64 = 1e-3;
const FORCE: f64 = 0.03;
/// Degrees of freedom of the prior of a dwell's variance relative to all dwells.
const BEFOREHAND: f64 = 6.0;
/// Smallest log of a size over the usual one: noise a hundred times smaller than usual is only rounding.
const LEAST: f64 = -4.605_170_185_988_091;

/// The noise at rest.
pub struct NoiseAtRest {
    /// Logarithms of the common sizes divided by the usual sizes.
    pub logs: DVector<f64>,
    /// 1σ of each logarithm.
    pub sigma: DVector<f64>,
    pub dispersion: Dispersion,
}

/// Residuals of the parts of a dwell if all quantities given to them are free.
#[derive(Debug, Clone, Copy, Default)]
struct Left {
    /// Log-determinant of the covariance.
    log_determinant: f64,
    /// Sum of squares over the variances common to all dwells.
    squares: f64,
    /// Degrees of freedom of the sum of squares.
    freedom: f64,
}

/// Residuals of all dwells with some models.
struct AllLeft {
    /// Residuals per model and dwell.
    dwells: Vec<Vec<Left>>,
    /// Changes per dwell.
    changes: Vec<Changes>,
}

/// Changes of the distribution of a dwell's observations from the first model to others, for Fisher's information.
struct Changes {
    /// Number of scalars.
    count: f64,
    /// Sum of the changes of the logarithms of σ, per model.
    logs: DVector<f64>,
    /// Sums of products of two changes of the logarithms.
    of_logs: DMatrix<f64>,
    /// Sums of products of two changes of the whitened scalars.
    of_scalars: DMatrix<f64>,
}

/// The scalars of a part.
#[derive(Default, Clone)]
struct Seen {
    /// Whitened scalars minus the part explained by the given quantities, each with its log σ.
    scalars: Vec<(f64, f64)>,
    /// Rows of the scalars with respect to the given quantities, one after the other.
    rows: Vec<f64>,
}

/// Dwells whose noise is estimated.
struct Dwells<'a> {
    problem: &'a Problem<'a>,
    script: &'a Script,
    usual: &'a [Usual],
    /// One pair of filters per model.
    filters: Vec<[Box<dyn PartFilter>; 2]>,
}

impl Dwells<'_> {
    /// Residuals of the dwells with the noise at rest of these models; `None` if a covariance is not positive definite.
    fn left(&mut self, dispersion: &Dispersion, models: &[Model]) -> Option<AllLeft> {
        let mut all = AllLeft {
            dwells: vec![Vec::new(); models.len()],
            changes: Vec::new(),
        };
        let mut seen = vec![Seen::default(); models.len()];
        for (number, stretch) in self.problem.stretches().iter().enumerate() {
            for rest in self.script.parts(number) {
                if rest.first {
                    all.changes.push(Changes::none(models.len() - 1));
                }
                let each = self.filters.iter_mut().zip(models).enumerate();
                for (k, (filters, model)) in each {
                    if rest.first {
                        all.dwells[k].push(Left::default());
                    }
                    let factor = dispersion.of(all.dwells[k].len() - 1);
                    let (root, seen) = (factor.sqrt(), &mut seen[k]);
                    seen.scalars.clear();
                    seen.rows.clear();
                    let filter = &mut filters[filter_of(rest)];
                    let part = filter.reduce((rest, stretch), model, &mut |of: Whitened| {
                        let scalar = |k: usize| (of.scalars[k] / root, of.root[(k, k)].ln());
                        seen.scalars.extend((0..3).map(scalar));
                        seen.rows.extend(of.rows.iter().map(|weight| weight / root));
                    })?;
                    let given = all.dwells[k]
                        .last_mut()?
                        .add(&part.dispersed(factor), factor)?;
                    seen.take_off(&given);
                }
                all.changes.last_mut()?.add(&seen);
            }
        }
        Some(all)
    }

    fn model_at(&self, at: &DVector<f64>) -> Model {
        let mut model = self.problem.model.clone();
        let sizes = self.usual.iter().zip(at);
        sizes.for_each(|(usual, by)| usual.set(&mut model, by.max(LEAST)));
        model
    }

    /// The most likely sizes common to all dwells, for any factor of each dwell, by Fisher scoring with finite
    /// differences (Gupta and Mehra 1974, IEEE Trans. Automatic Control 19(6)).
    fn common(&mut self, dispersion: &Dispersion, start: DVector<f64>) -> Lowest {
        let n = self.usual.len();
        let of_prior = |k: usize| self.usual[k].spread.powi(-2);
        let slope_at = |at: &DVector<f64>| {
            let penalty: f64 = (0..n).map(|k| at[k].powi(2) * of_prior(k)).sum();
            let mut models = vec![self.model_at(at)];
            models.extend((0..n).map(|k| {
                let mut there = at.clone();
                there[k] += DIFFERENCE;
                self.model_at(&there)
            }));
            let Some(all) = self.left(dispersion, &models) else {
                return Ok::<_, Infallible>(Slope::nowhere(n));
            };
            let deviance = |k: usize| all.dwells[k].iter().map(Left::deviance).sum::<f64>();
            let here = deviance(0);
            Ok(Slope {
                cost: here + penalty,
                gradient: DVector::from_fn(n, |k, _| {
                    (deviance(k + 1) - here) / DIFFERENCE + 2.0 * at[k] * of_prior(k)
                }),
                curvature: all.information() * (2.0 / DIFFERENCE.powi(2))
                    + DMatrix::from_fn(n, n, |i, j| if i == j { 2.0 * of_prior(i) } else { 0.0 }),
            })
        };
        let Ok(lowest) = descend(start, slope_at);
        lowest
    }
}

impl Seen {
    fn take_off(&mut self, given: &DVector<f64>) {
        let rows = self.rows.chunks_exact(given.len());
        for (scalar, row) in self.scalars.iter_mut().zip(rows) {
            let known = row.iter().zip(given.iter());
            scalar.0 -= known.map(|(weight, given)| weight * given).sum::<f64>();
        }
    }
}

impl AllLeft {
    /// Fisher information on the changes, for any factor of the variance of each dwell.
    fn information(&self) -> DMatrix<f64> {
        let n = self.dwells.len() - 1;
        let each = self.changes.iter().zip(&self.dwells[0]);
        each.fold(DMatrix::zeros(n, n), |sum, (of, left)| {
            let free = &of.logs * of.logs.transpose() / (0.5 * (of.count + BEFOREHAND));
            sum + &of.of_logs * 2.0 + &of.of_scalars / left.factor() - free
        })
    }
}

impl Changes {
    fn none(models: usize) -> Self {
        Self {
            count: 0.0,
            logs: DVector::zeros(models),
            of_logs: DMatrix::zeros(models, models),
            of_scalars: DMatrix::zeros(models, models),
        }
    }

    /// Adds the residuals of a part with all models.
    fn add(&mut self, seen: &[Seen]) {
        let Some((here, others)) = seen.split_first() else {
            return;
        };
        self.count += here.scalars.len() as f64;
        for (k, here) in here.scalars.iter().enumerate() {
            let changes = others.iter().map(|of| {
                let log = of.scalars[k].1 - here.1;
                // The whitened observation also changes with its σ.
                (log, of.scalars[k].0 - here.0 + log * here.0)
            });
            let (logs, scalars): (Vec<_>, Vec<_>) = changes.unzip();
            let (logs, scalars) = (DVector::from_vec(logs), DVector::from_vec(scalars));
            self.of_logs.ger(1.0, &logs, &logs, 1.0);
            self.of_scalars.ger(1.0, &scalars, &scalars, 1.0);
            self.logs += logs;
        }
    }
}

impl Left {
    /// Adds a part; returns its given quantities, as estimated from its rows.
    fn add(&mut self, part: &Part, factor: f64) -> Option<DVector<f64>> {
        let given = part.measured.ncols();
        let wide = |k: usize| match given - k {
            1..=3 => FORCE,
            4..=6 => RATE,
            _ => BEGIN,
        };
        let mut information = part.measured.tr_mul(&part.measured);
        (0..given).for_each(|k| information[(k, k)] += wide(k).powi(-2));
        let root = information.cholesky()?;
        let said = part.measured.tr_mul(&part.values);
        let mut told = said.clone();
        root.l_dirty().solve_lower_triangular_mut(&mut told);
        let determinant = 2.0 * root.l_dirty().diagonal().map(f64::ln).sum();
        let squares = part.squares + part.values.norm_squared() - told.norm_squared();
        self.squares += factor * squares;
        self.log_determinant += part.log_determinant + determinant;
        // Information of the part on its given quantities.
        let inverse = root.inverse();
        let told = (0..given).map(|k| 1.0 - wide(k).powi(-2) * inverse[(k, k)]);
        self.freedom += part.count as f64 - told.sum::<f64>();
        Some(inverse * said)
    }

    /// −2 ln of the likelihood, averaged over all factors of the variance: Student's t.
    fn deviance(&self) -> f64 {
        (BEFOREHAND + self.freedom) * (self.squares / BEFOREHAND).ln_1p() + self.log_determinant
    }

    /// The variance factor of the dwell, estimated from its residuals.
    fn factor(&self) -> f64 {
        (BEFOREHAND + self.squares) / (BEFOREHAND + self.freedom)
    }
}

/// The most likely noise at rest in the median dwell, with a prior for each size. The search starts from the noise at
/// an earlier linearisation point, if there is one.
pub fn likeliest(
    problem: &Problem,
    script: &Script,
    usual: &[Usual],
    before: Option<(Dispersion, DVector<f64>)>,
) -> NoiseAtRest {
    let states = States::new(&problem.model, problem.one_gravity());
    let filters = (0..=usual.len()).map(|_| part_filters(states.moving));
    let mut dwells = Dwells {
        problem,
        script,
        usual,
        filters: filters.collect(),
    };
    let (before, start) =
        before.unwrap_or_else(|| (Dispersion::alike(problem), DVector::zeros(usual.len())));
    let lowest = dwells.common(&before, start);
    let model = dwells.model_at(&lowest.at);
    let left = dwells.left(&before, &[model]);
    let factors = left.map(|left| left.dwells[0].iter().map(Left::factor).collect());
    let (dispersion, middle) = factors.map_or((before, 1.0), Dispersion::of_dwells);
    NoiseAtRest {
        logs: lowest.at.map(|log| (log + 0.5 * middle.ln()).max(LEAST)),
        sigma: lowest.sigma(),
        dispersion,
    }
}

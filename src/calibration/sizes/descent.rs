//! Minimisation of a cost, given with its gradient, as a function of a few logarithms of sizes.

use nalgebra::{DMatrix, DVector};

/// Longest step of a logarithm: a factor e.
const LONGEST: f64 = 1.0;
/// A step is abandoned if it does not lower the cost even at this fraction.
const SHORTEST: f64 = 0.05;
/// The descent ends if the expected decrease of −2 ln of a density is below this: a seventh of a σ.
const SETTLED: f64 = 0.02;
/// Maximum number of steps.
const STEPS: usize = 30;

/// A cost with its gradient.
#[derive(Debug, Clone)]
pub struct Slope {
    pub cost: f64,
    pub gradient: DVector<f64>,
    /// Positive-definite approximation of the second derivatives.
    pub curvature: DMatrix<f64>,
}

impl Slope {
    /// A point at which the cost is not defined.
    pub fn nowhere(size: usize) -> Self {
        Self {
            cost: f64::INFINITY,
            gradient: DVector::zeros(size),
            curvature: DMatrix::identity(size, size),
        }
    }

    fn inverse(&self) -> DMatrix<f64> {
        let root = self.curvature.clone().cholesky();
        root.map_or_else(
            || DMatrix::identity(self.gradient.len(), self.gradient.len()),
            |root| root.inverse(),
        )
    }
}

/// The lowest point found.
pub struct Lowest {
    pub at: DVector<f64>,
    /// Inverse of the second derivatives at the lowest point.
    inverse: DMatrix<f64>,
}

impl Lowest {
    /// 1σ of each logarithm, if the cost is −2 ln of a density.
    pub fn sigma(&self) -> DVector<f64> {
        self.inverse.diagonal().map(|of| (2.0 * of.max(0.0)).sqrt())
    }
}

/// The lowest point found from a start by Newton steps with the expected curvature (Fisher scoring).
pub fn descend<E>(
    start: DVector<f64>,
    mut slope_at: impl FnMut(&DVector<f64>) -> Result<Slope, E>,
) -> Result<Lowest, E> {
    let mut at = start;
    let mut here = slope_at(&at)?;
    // The actual curvature may be larger than expected; full steps then overshoot and oscillate.
    let mut bend = 1.0f64;
    for _ in 0..STEPS {
        let mut step = here.inverse() * &here.gradient / -bend;
        if -0.5 * step.dot(&here.gradient) < SETTLED {
            break;
        }
        step *= (LONGEST / step.amax()).min(1.0);
        let mut there = slope_at(&(&at + &step))?;
        let mut fraction = 1.0;
        while there.cost >= here.cost && fraction > SHORTEST {
            fraction *= 0.5;
            step *= 0.5;
            there = slope_at(&(&at + &step))?;
        }
        if there.cost >= here.cost {
            break;
        }
        let met = step.dot(&(&there.gradient - &here.gradient));
        bend = (met / step.dot(&(&here.curvature * &step))).max(1.0);
        at += step;
        here = there;
    }
    Ok(Lowest {
        at,
        inverse: here.inverse(),
    })
}

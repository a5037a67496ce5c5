//! Descent of a cost with its gradient, in a few logarithms of sizes.

use nalgebra::{DMatrix, DVector};

/// Longest step of a logarithm: a factor e.
const LONGEST: f64 = 1.0;
/// A step is given up if it does not lower the cost at this fraction.
const SHORTEST: f64 = 0.05;
/// A fall of −2 ln of a density that is expected to be below this ends the descent: a seventh of a σ.
const SETTLED: f64 = 0.02;
/// Most steps.
const STEPS: usize = 30;

/// A cost with its gradient.
#[derive(Debug, Clone)]
pub struct Slope {
    pub cost: f64,
    pub gradient: DVector<f64>,
    /// About what the second derivatives are, positive definite.
    pub curvature: DMatrix<f64>,
}

impl Slope {
    /// Where there is no cost.
    pub fn nowhere(size: usize) -> Self {
        Self {
            cost: f64::INFINITY,
            gradient: DVector::zeros(size),
            curvature: DMatrix::identity(size, size),
        }
    }
}

/// The lowest point found.
pub struct Lowest {
    pub at: DVector<f64>,
    /// Inverse of the second derivatives there.
    inverse: DMatrix<f64>,
}

impl Lowest {
    /// 1σ of each logarithm, the cost being −2 ln of a density.
    pub fn sigma(&self) -> DVector<f64> {
        self.inverse.diagonal().map(|of| (2.0 * of.max(0.0)).sqrt())
    }
}

/// The lowest point found from a start. The gradients improve the curvature (Broyden, Fletcher, Goldfarb, Shanno: Nocedal and Wright, *Numerical Optimization*, 2nd ed., §6.1).
pub fn descend<E>(
    start: DVector<f64>,
    mut slope_at: impl FnMut(&DVector<f64>) -> Result<Slope, E>,
) -> Result<Lowest, E> {
    let n = start.len();
    let mut at = start;
    let mut here = slope_at(&at)?;
    let inverse_of = |slope: &Slope| {
        let root = slope.curvature.clone().cholesky();
        root.map_or_else(|| DMatrix::identity(n, n), |root| root.inverse())
    };
    let mut inverse = inverse_of(&here);
    let mut is_fresh = true;
    for _ in 0..STEPS {
        let mut step = -(&inverse * &here.gradient);
        if -0.5 * step.dot(&here.gradient) < SETTLED {
            break;
        }
        step *= (LONGEST / step.amax()).min(1.0);
        let mut there = slope_at(&(&at + &step))?;
        let mut fraction = 1.0;
        let falls = |there: &Slope| there.cost < here.cost;
        while !falls(&there) && fraction > SHORTEST {
            fraction *= 0.5;
            step *= 0.5;
            there = slope_at(&(&at + &step))?;
        }
        if !falls(&there) {
            if is_fresh {
                break;
            }
            (inverse, is_fresh) = (inverse_of(&here), true);
            continue;
        }
        is_fresh = false;
        let change = &there.gradient - &here.gradient;
        let bent = change.dot(&step);
        if bent > 0.0 {
            let back = DMatrix::identity(n, n) - &step * change.transpose() / bent;
            inverse = &back * inverse * back.transpose() + &step * step.transpose() / bent;
        }
        at += step;
        here = there;
    }
    Ok(Lowest {
        at,
        inverse: inverse_of(&here),
    })
}

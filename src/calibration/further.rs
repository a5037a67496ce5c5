//! Constants that are estimated beside scale factors, installation and biases: errors of the table's
//! own geometry, then parameters of the instrument's further terms.

use nalgebra::{SMatrix, SVector};

use super::outcome::OBSERVED_BELOW;
use super::states::{ALL_STATES, BASE, PARAMETERS};
use crate::imu::{FURTHER, FurtherVector, Term};
use crate::run::{StateBlock, TABLE_GEOMETRY, table_geometry_name};

/// Number of constants of both kinds.
pub const CONSTANTS: usize = TABLE_GEOMETRY + FURTHER;
/// A vector of them: table (see [`crate::run::TableGeometry`]), then terms (see [`Term`]).
pub type ConstantVector = SVector<f64, CONSTANTS>;
/// A matrix of them.
pub type ConstantMatrix = SMatrix<f64, CONSTANTS, CONSTANTS>;
/// Covariance of the parameters of both triads (rows) with them.
pub type CrossMatrix = SMatrix<f64, PARAMETERS, CONSTANTS>;

const _: () = assert!(BASE + CONSTANTS == ALL_STATES);

/// Which kind of constant stands at an index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constant {
    /// An error of the table, by its index among them.
    Table(usize),
    /// A parameter of a term, by its index among those of all terms.
    Term(Term, usize),
}

impl Constant {
    /// The constant at an index; `None` beyond the last.
    pub fn of(index: usize) -> Option<Self> {
        match index.checked_sub(TABLE_GEOMETRY) {
            None => Some(Self::Table(index)),
            Some(parameter) => Some(Self::Term(Term::of(parameter)?, parameter)),
        }
    }

    /// The block that it belongs to.
    pub fn block(self) -> StateBlock {
        match self {
            Self::Table(0..3) => StateBlock::TableBase,
            Self::Table(_) => StateBlock::TableAxes,
            Self::Term(term, _) => StateBlock::Term(term),
        }
    }
}

/// The name of a constant in files; `None` beyond the last.
pub fn constant_name(index: usize) -> Option<String> {
    match Constant::of(index)? {
        Constant::Table(k) => table_geometry_name(k),
        Constant::Term(_, parameter) => Term::parameter_name(parameter),
    }
}

/// Errors of the table and parameters of terms as one vector.
pub fn constants(table: &SVector<f64, TABLE_GEOMETRY>, terms: &FurtherVector) -> ConstantVector {
    let mut all = ConstantVector::zeros();
    all.fixed_rows_mut::<TABLE_GEOMETRY>(0).copy_from(table);
    all.fixed_rows_mut::<FURTHER>(TABLE_GEOMETRY)
        .copy_from(terms);
    all
}

/// Correlation beyond which two terms are not told apart.
const INSEPARABLE: f64 = 0.99;

/// Estimates of the constants. What is off is zero in all of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Further {
    /// The estimates, rad for the table, SI for terms.
    pub values: ConstantVector,
    /// Their covariance.
    pub covariance: ConstantMatrix,
    /// Covariance of the parameters of both triads with them.
    pub cross: CrossMatrix,
    /// 1σ of each before the run, around zero.
    pub prior_sigma: ConstantVector,
}

impl Default for Further {
    fn default() -> Self {
        Self {
            values: ConstantVector::zeros(),
            covariance: ConstantMatrix::zeros(),
            cross: CrossMatrix::zeros(),
            prior_sigma: ConstantVector::zeros(),
        }
    }
}

impl Further {
    /// 1σ of each.
    pub fn sigma(&self) -> ConstantVector {
        self.covariance.diagonal().map(|v| v.max(0.0).sqrt())
    }

    /// Whether a term of the instrument was estimated.
    pub fn has_terms(&self) -> bool {
        let of_terms = self.prior_sigma.fixed_rows::<FURTHER>(TABLE_GEOMETRY);
        of_terms.iter().any(|&sigma| sigma > 0.0)
    }

    /// The estimated parameters of terms.
    pub fn terms(&self) -> FurtherVector {
        self.values.fixed_rows::<FURTHER>(TABLE_GEOMETRY).into()
    }

    /// Whether second order and asymmetry of an accelerometer are both estimated and hardly more than
    /// their sum is seen.
    pub fn even_terms_inseparable(&self) -> bool {
        let first = |term: Term| TABLE_GEOMETRY + term.parameters().start;
        let (second, asymmetry) = (first(Term::AccelSecondOrder), first(Term::AccelAsymmetry));
        let sigma = self.sigma();
        (0..3).any(|axis| {
            let (i, j) = (second + axis, asymmetry + axis);
            let both = sigma[i] * sigma[j];
            both > 0.0 && (self.covariance[(i, j)] / both).abs() > INSEPARABLE
        })
    }

    /// Indices of those that were estimated.
    pub fn estimated(&self) -> impl Iterator<Item = usize> + '_ {
        (0..CONSTANTS).filter(|&k| self.prior_sigma[k] > 0.0)
    }

    /// Indices of those that the run did not observe.
    pub fn unobserved(&self) -> impl Iterator<Item = usize> + '_ {
        let sigma = self.sigma();
        self.estimated()
            .filter(move |&k| sigma[k] > OBSERVED_BELOW * self.prior_sigma[k])
    }
}

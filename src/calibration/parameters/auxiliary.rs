//! Auxiliary constants, estimated in addition to scale factors, misalignments and biases: errors of the
//! table's geometry, then parameters of the instrument's error terms.

use nalgebra::{DMatrix, SVector};

use super::error_term::ErrorTerm;
use super::{OBSERVED_BELOW, PARAMETERS};
use crate::imu::{TERM_PARAMETERS, Term, TermVector};
use crate::turntable::{AXIS_ERRORS, AxisError, TABLE_GEOMETRY, table_geometry_name};

/// Number of parameters of both kinds.
pub const AUXILIARY: usize = TABLE_GEOMETRY + TERM_PARAMETERS;
/// A vector of all auxiliary parameters: table (see [`crate::turntable::TableGeometry`]), then terms (see [`Term`]).
pub type AuxiliaryVector = SVector<f64, AUXILIARY>;

/// Index of the first table axis among the auxiliary parameters.
pub const OF_AXES: usize = TABLE_GEOMETRY - AXIS_ERRORS;

/// Kind of an auxiliary parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AuxiliaryKind {
    /// An error of the table, by its index among them.
    Table(usize),
    /// A parameter of a term, by its index among those of all terms.
    Term(Term, usize),
}

impl AuxiliaryKind {
    /// The auxiliary parameter at an index; `None` if the index is beyond the last parameter.
    pub fn of(index: usize) -> Option<Self> {
        match index.checked_sub(TABLE_GEOMETRY) {
            None => Some(Self::Table(index)),
            Some(parameter) => Some(Self::Term(Term::of(parameter)?, parameter)),
        }
    }

    /// The error term to which the parameter belongs.
    pub fn error_term(self) -> ErrorTerm {
        match self {
            Self::Table(0..OF_AXES) => ErrorTerm::TableBase,
            Self::Table(k) => {
                let kind = AxisError::of(k - OF_AXES);
                ErrorTerm::TableAxes(kind.unwrap_or(AxisError::Encoder))
            }
            Self::Term(term, _) => ErrorTerm::Instrument(term),
        }
    }
}

/// The name of a parameter in files; `None` beyond the last.
pub fn auxiliary_name(index: usize) -> Option<String> {
    match AuxiliaryKind::of(index)? {
        AuxiliaryKind::Table(k) => table_geometry_name(k),
        AuxiliaryKind::Term(_, parameter) => Term::parameter_name(parameter),
    }
}

/// Errors of the table and parameters of terms as one vector.
pub fn auxiliary_vector(
    table: &SVector<f64, TABLE_GEOMETRY>,
    terms: &TermVector,
) -> AuxiliaryVector {
    let mut all = AuxiliaryVector::zeros();
    all.fixed_rows_mut::<TABLE_GEOMETRY>(0).copy_from(table);
    all.fixed_rows_mut::<TERM_PARAMETERS>(TABLE_GEOMETRY)
        .copy_from(terms);
    all
}

/// Correlation beyond which two terms cannot be distinguished.
const INSEPARABLE: f64 = 0.99;

/// Estimates of the auxiliary parameters; all figures of a disabled parameter are zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Auxiliary {
    /// The estimates, in rad for the table and in SI units for the terms.
    pub values: AuxiliaryVector,
    /// Covariance of the estimates, [`AUXILIARY`] square.
    pub covariance: DMatrix<f64>,
    /// Covariance of the parameters of both triads (rows) with the estimates.
    pub cross: DMatrix<f64>,
    /// Prior 1σ of each parameter, with mean zero.
    pub prior_sigma: AuxiliaryVector,
}

impl Default for Auxiliary {
    fn default() -> Self {
        Self {
            values: AuxiliaryVector::zeros(),
            covariance: DMatrix::zeros(AUXILIARY, AUXILIARY),
            cross: DMatrix::zeros(PARAMETERS, AUXILIARY),
            prior_sigma: AuxiliaryVector::zeros(),
        }
    }
}

impl Auxiliary {
    /// 1σ of each.
    pub fn sigma(&self) -> AuxiliaryVector {
        AuxiliaryVector::from_fn(|k, _| self.covariance[(k, k)].max(0.0).sqrt())
    }

    /// Whether a term of the instrument was estimated.
    pub fn has_terms(&self) -> bool {
        let of_terms = self
            .prior_sigma
            .fixed_rows::<TERM_PARAMETERS>(TABLE_GEOMETRY);
        of_terms.iter().any(|&sigma| sigma > 0.0)
    }

    /// The estimated parameters of terms.
    pub fn terms(&self) -> TermVector {
        self.values
            .fixed_rows::<TERM_PARAMETERS>(TABLE_GEOMETRY)
            .into()
    }

    /// Whether the second-order term and the asymmetry term of an accelerometer are both estimated, although the data
    /// determine hardly more than their sum.
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

    /// Index, among the parameters of error terms, of an auxiliary parameter of this kind.
    pub(in crate::calibration) fn of_terms(index: usize) -> Option<usize> {
        index.checked_sub(TABLE_GEOMETRY)
    }

    /// Indices of the estimated parameters.
    pub fn estimated(&self) -> impl Iterator<Item = usize> + '_ {
        (0..AUXILIARY).filter(|&k| self.prior_sigma[k] > 0.0)
    }

    /// Indices of the estimated parameters that the run did not observe.
    pub fn unobserved(&self) -> impl Iterator<Item = usize> + '_ {
        let sigma = self.sigma();
        self.estimated()
            .filter(move |&k| sigma[k] > OBSERVED_BELOW * self.prior_sigma[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_of_which_only_the_sum_or_only_the_difference_is_seen_are_not_told_apart() {
        let first = |term: Term| TABLE_GEOMETRY + term.parameters().start;
        let (i, j) = (first(Term::AccelSecondOrder), first(Term::AccelAsymmetry));
        for (correlation, inseparable) in [(-0.995, true), (0.995, true), (-0.9, false)] {
            let mut auxiliary = Auxiliary::default();
            (auxiliary.covariance[(i, i)], auxiliary.covariance[(j, j)]) = (4.0, 9.0);
            auxiliary.covariance[(i, j)] = 6.0 * correlation;
            assert_eq!(auxiliary.even_terms_inseparable(), inseparable);
        }
    }
}

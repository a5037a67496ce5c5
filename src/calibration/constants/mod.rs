//! The constants of a recording, with their prior and posterior.

mod candidate;
mod constant;
mod known;
mod posterior;
mod prior;

use crate::calibration::Coefficient;
pub use candidate::Candidate;
pub use constant::Constant;
pub use known::{Information, Known, Sites, inverse, triangle};
pub use posterior::{Posterior, of_parameters};
pub use prior::Prior;

/// The temperature coefficients among constants, with their positions in the list.
pub fn coefficients(constants: &[Constant]) -> impl Iterator<Item = (usize, Coefficient)> + '_ {
    let places = constants.iter().enumerate();
    places.filter_map(|(place, constant)| match constant {
        Constant::Thermal(coefficient) => Some((place, *coefficient)),
        _ => None,
    })
}

/// The parameters of both triads among constants: position in the list, and parameter index.
pub fn parameters(constants: &[Constant]) -> impl Iterator<Item = (usize, usize)> + '_ {
    let places = constants.iter().enumerate();
    places.filter_map(|(place, constant)| match constant {
        Constant::Parameter(index) => Some((place, *index)),
        _ => None,
    })
}

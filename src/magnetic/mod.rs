//! A magnetometer, and the magnetic field at a site.
//!
//! `N = M C_b_nᵀ e + D`: e is the direction of the local field along East-North-Up; M contains the magnitude of the
//! field, scale factors, soft iron and misalignments; D contains hard iron and biases. Only the product of magnitude
//! and scale factors has an effect, so the magnitude is known only from elsewhere. Inside the crate, N is divided by
//! its nominal scale, so that M and D are in tesla.

mod field;
mod triad;

pub use field::LocalField;
pub use triad::{MAGNETIC, MAGNETOMETER, MATRIX, MagneticResponse, MagneticTriad, MagneticVector};

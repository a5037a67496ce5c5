//! Evaluation of the residuals of equations: events that do not fit, and parameters that drift.

use super::equations::Equations;
use crate::calibration::checks::drift::{Changing, drift};
use crate::calibration::checks::residuals::{Residuals, Worst};
use crate::calibration::{Finding, parameter};
use crate::imu::{ParameterKind, Sensor};

/// Residuals without the part explained by the unknowns, and the worst-fitting events.
pub struct Judged {
    pub residuals: Residuals,
    pub worst: Worst,
    /// Start and end of the worst events, s.
    times: Vec<[f64; 2]>,
    drift: Option<Finding>,
}

/// Indices of the unknowns of the three axes among those of a triad, by kind.
pub type Places = [(ParameterKind, [usize; 3]); 2];

impl Judged {
    /// `None` if the errors of the equations have no covariance.
    pub fn new(equations: &Equations, sensors: &[Sensor], places: Places) -> Option<Self> {
        let (design, residual) = equations.scaled();
        let residuals = Residuals::new(&design, &residual, &equations.errors())?;
        let (events, groups): (Vec<_>, Vec<_>) = equations.by_event().into_iter().unzip();
        let times = |k: usize| equations.events[events[k]].times;
        let worst = residuals.worst(&groups);
        let mut middle = vec![0.0; equations.count()];
        for (k, group) in groups.iter().enumerate() {
            group
                .iter()
                .for_each(|&row| middle[row] = 0.5 * times(k).iter().sum::<f64>());
        }
        let changing = |(&sensor, (kind, of_axes)): (&Sensor, (ParameterKind, [usize; 3]))| {
            let of_axis = |axis: usize| {
                let index = parameter(sensor, of_axes[axis]);
                let column = equations.unknown.iter().position(|&k| k == index)?;
                Some((axis, column))
            };
            let (axes, columns): (Vec<_>, Vec<_>) = (0..3).filter_map(of_axis).unzip();
            let columns = design.select_columns(&columns);
            Changing {
                sensor,
                kind,
                columns,
                axes,
            }
        };
        let all = sensors
            .iter()
            .flat_map(|sensor| places.map(|place| (sensor, place)));
        let changing: Vec<Changing> = all.map(changing).collect();
        Some(Self {
            drift: drift(&residuals, &changing, &middle, worst.without),
            times: worst.groups.iter().map(|&k| times(k)).collect(),
            residuals,
            worst,
        })
    }

    /// A drift of biases or scale factors visible in the residuals.
    pub fn drift(&self) -> Option<Finding> {
        self.drift.clone()
    }

    /// The finding on residuals beyond chance, with the growth factor of σ.
    pub fn large(&self, of: &'static str, growth: f64, base: Option<f64>) -> Finding {
        let worst = (self.times.clone(), self.worst.without);
        self.residuals.large(of, growth, worst, base)
    }
}

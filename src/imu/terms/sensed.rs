//! What the terms add to what a body senses.

use nalgebra::Vector3;

use super::entry::{Columns, Effect, Sensed};
use super::{Term, TermResponse, TermVector};
use crate::imu::Sensor;

impl Sensed {
    /// `t(q)`: what terms with these parameters add to the input of a triad, rad/s or m/s².
    pub fn added(&self, sensor: Sensor, q: &TermVector) -> Vector3<f64> {
        let mut nonlinear = Vector3::zeros();
        let linear = self.columns(sensor, |term, effect, columns| match effect {
            Effect::Linear(response) => response(self, columns),
            Effect::Nonlinear { added, .. } => {
                nonlinear += added(self, &q.as_slice()[term.parameters()]);
            }
        });
        linear * q + nonlinear
    }

    /// `∂t/∂q` of one triad, in rad/s or m/s² by the unit of each parameter, where the parameters are
    /// these.
    pub fn response(&self, sensor: Sensor, q: &TermVector) -> TermResponse {
        self.columns(sensor, |term, effect, columns| match effect {
            Effect::Linear(response) => response(self, columns),
            Effect::Nonlinear { response, .. } => {
                response(self, &q.as_slice()[term.parameters()], columns);
            }
        })
    }

    /// A response whose columns are filled term by term.
    fn columns(
        &self,
        sensor: Sensor,
        mut fill: impl FnMut(Term, &Effect, &mut Columns),
    ) -> TermResponse {
        let mut response = TermResponse::zeros();
        for term in Term::ALL {
            if term.entry().sensor == sensor {
                let own = term.parameters();
                fill(
                    term,
                    &term.entry().effect,
                    &mut response.columns_mut(own.start, own.len()),
                );
            }
        }
        response
    }
}

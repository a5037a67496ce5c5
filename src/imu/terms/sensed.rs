//! What the terms add to what a body senses.

use nalgebra::Vector3;

use super::entry::Sensed;
use super::{Term, TermResponse, TermVector};
use crate::imu::Sensor;

impl Sensed {
    /// `t(q)`: what terms with these parameters add to the input of a triad, rad/s or m/s².
    pub fn added(&self, sensor: Sensor, q: &TermVector) -> Vector3<f64> {
        let mut linear = self.response(sensor, q);
        let mut others = Vector3::zeros();
        for term in Term::of_sensor(sensor) {
            if let Some(added) = term.entry().added {
                linear.columns_range_mut(term.parameters()).fill(0.0);
                others += added(self, &q.as_slice()[term.parameters()]);
            }
        }
        linear * q + others
    }

    /// `∂t/∂q` of one triad, in rad/s or m/s² by the unit of each parameter, where the parameters are
    /// these.
    pub fn response(&self, sensor: Sensor, q: &TermVector) -> TermResponse {
        let mut response = TermResponse::zeros();
        for term in Term::of_sensor(sensor) {
            let own = term.parameters();
            let columns = &mut response.columns_mut(own.start, own.len());
            (term.entry().response)(self, &q.as_slice()[own], columns);
        }
        response
    }
}

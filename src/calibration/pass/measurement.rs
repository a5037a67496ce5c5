//! Measurements: `z = H x + v`, three components at once, `v` white with the same variance R on each.

use nalgebra::{Matrix3, Vector3};

use crate::attitude::log;
use crate::calibration::innovation::Observation;
use crate::calibration::layout::{ATTITUDE, Layout, POSITION, VELOCITY};
use crate::calibration::model::Model;
use crate::calibration::problem::Stretch;
use crate::calibration::schedule::AtRest;
use crate::navigation::State;
use crate::turntable::AxisResponse;

/// A residual with its measurement model.
#[derive(Debug, Clone)]
pub(in crate::calibration) struct Measurement {
    /// z, computed − observed, East-North-Up.
    pub residual: Vector3<f64>,
    /// H, row by row: state and coefficient of what is not zero.
    pub rows: [Vec<(usize, f64)>; 3],
    /// The same for the auxiliary parameters that are tried, by their number.
    pub tried: [Vec<(usize, f64)>; 3],
    /// R, per axis.
    pub variance: f64,
}

/// One component of a measurement less what the filter expected of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::calibration) struct ScalarInnovation {
    pub innovation: f64,
    /// As the filter expects it.
    pub variance: f64,
}

impl Measurement {
    /// What is observed at the end of a step of a dwell, in order; `held` is the attitude that was computed
    /// when the body came to rest.
    pub fn of_rest(
        (stretch, model, layout): (&Stretch, &Model, &Layout),
        at_rest: &AtRest,
        computed: &State,
        held: &Matrix3<f64>,
    ) -> impl Iterator<Item = (Observation, Self)> + use<> {
        let velocity = Self::velocity(computed, stretch.velocity_variance(model));
        let table = at_rest.reading.as_ref().map(|(reading, count)| {
            let white = model.reading_sigma.powi(2) / *count as f64 + stretch.variance.attitude;
            Self::table(layout, computed, reading, at_rest.axes.as_ref(), white)
        });
        let variance = stretch.attitude_variance(model);
        let turn = Self::turn_at_rest(layout, computed, held, variance);
        [
            (Observation::Velocity, Some(velocity)),
            (Observation::Table, table),
            (Observation::Attitude, turn),
        ]
        .into_iter()
        .filter_map(|(kind, measurement)| Some((kind, measurement?)))
    }

    /// Zero velocity: `z = δV`.
    fn velocity(computed: &State, variance: f64) -> Self {
        Self::of(VELOCITY, computed.velocity, variance)
    }

    /// The site's position: `z = δp`.
    pub fn position(computed: &State, variance: f64) -> Self {
        Self::of(POSITION, computed.position, variance)
    }

    /// The attitude when the body came to rest: `z = φ − φ₀`, the turn at rest. None with a table.
    fn turn_at_rest(
        layout: &Layout,
        computed: &State,
        held: &Matrix3<f64>,
        variance: f64,
    ) -> Option<Self> {
        let residual = -log(&(computed.attitude * held.transpose()));
        Some(Self::of(layout.turn_at_rest()?, residual, variance))
    }

    /// The table's reading: `z = φ − τ − ε − Σ t_k α_k`, with the errors α of its axes and the direction
    /// t in which each turns the table.
    fn table(
        layout: &Layout,
        computed: &State,
        reading: &Matrix3<f64>,
        axes: Option<&AxisResponse>,
        variance: f64,
    ) -> Self {
        let residual = -log(&(computed.attitude * reading.transpose()));
        let mut measurement = Self::of(ATTITUDE, residual, variance);
        for (axis, row) in measurement.rows.iter_mut().enumerate() {
            let errors = layout
                .table_position()
                .into_iter()
                .chain(layout.table_base());
            row.extend(errors.map(|first| (first + axis, -1.0)));
            if let Some(response) = axes {
                let of_axes = layout.table_axes();
                row.extend(of_axes.map(|(state, k)| (state, -response[(axis, k)])));
            }
        }
        for (number, index) in layout.tried_of_table() {
            for (axis, row) in measurement.tried.iter_mut().enumerate() {
                let turn = match index.checked_sub(3) {
                    None => f64::from(index == axis),
                    Some(k) => axes.map_or(0.0, |response| response[(axis, k)]),
                };
                if turn != 0.0 {
                    row.push((number, -turn));
                }
            }
        }
        measurement
    }

    fn of(first: usize, residual: Vector3<f64>, variance: f64) -> Self {
        Self {
            residual,
            rows: [0, 1, 2].map(|axis| vec![(first + axis, 1.0)]),
            tried: Default::default(),
            variance,
        }
    }
}

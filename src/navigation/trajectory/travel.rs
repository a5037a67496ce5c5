//! A journey along a trajectory, step by step.

use nalgebra::Vector3;

use super::Trajectory;
use super::leg::Legs;
use crate::earth::Curvature;
use crate::navigation::{Increments, Solution};

/// Nodes in parts of a step's half and weights, Gauss–Legendre of sixth order.
const NODES: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];
/// A journey along a trajectory.
#[derive(Debug, Clone)]
pub struct Travel<'a> {
    trajectory: &'a Trajectory,
    period: f64,
    steps: u64,
    legs: Legs<'a>,
    truth: Solution,
}

impl<'a> Travel<'a> {
    pub(super) fn new(trajectory: &'a Trajectory, period: f64) -> Self {
        let mut travel = Self {
            trajectory,
            period,
            steps: 0,
            legs: Legs::new(trajectory),
            truth: trajectory.start().place(),
        };
        travel.legs.enter(0.0);
        travel.arrive(0.0);
        travel
    }

    /// The true state now.
    pub fn truth(&self) -> &Solution {
        &self.truth
    }

    /// Angular rate (rad/s) and specific force (m/s²) along body axes now.
    pub fn sensed(&self) -> (Vector3<f64>, Vector3<f64>) {
        let kinematics = self.legs.current.at(self.time());
        kinematics.sensed(&self.truth, self.trajectory.banks)
    }

    /// Goes on by a step and gives the integrals over it of what an ideal instrument senses.
    pub fn advance(&mut self) -> Increments {
        let mut now = self.time();
        self.steps += 1;
        let end = self.time();
        let mut increments = Increments::default();
        // No part reaches across a break, so quadrature keeps its order.
        while now < end {
            self.legs.enter(now);
            let to = self.legs.current.next_break(now).min(end);
            self.integrate(now, to, &mut increments);
            now = to;
        }
        self.legs.enter(end);
        self.arrive(end);
        increments
    }

    fn time(&self) -> f64 {
        self.steps as f64 * self.period
    }

    /// Sets velocity, attitude and height to those of a time.
    fn arrive(&mut self, time: f64) {
        self.truth = self
            .legs
            .current
            .at(time)
            .placed(&self.truth, self.trajectory.banks);
    }

    fn integrate(&mut self, from: f64, to: f64, increments: &mut Increments) {
        let half = 0.5 * (to - from);
        let start = self.legs.current.at(from);
        let (velocity, acceleration) = (start.velocity(), start.acceleration());
        let radius = Curvature::at(self.truth.latitude).meridian + start.height.angle;
        let mut moved = Vector3::zeros();
        for (node, weight) in NODES {
            let after = half * (1.0 + node);
            let kinematics = self.legs.current.at(from + after);
            // Millimetres are enough here: they change Earth rate and gravity by 1e-9 of themselves.
            let north = (velocity.y + 0.5 * acceleration.y * after) * after;
            let place = Solution {
                latitude: self.truth.latitude + north / radius,
                ..self.truth
            };
            let truth = kinematics.placed(&place, self.trajectory.banks);
            let (rate, force) = kinematics.sensed(&truth, self.trajectory.banks);
            let transport = truth.transport_rate();
            let weight = weight * half;
            increments.angle += rate * weight;
            increments.velocity += force * weight;
            moved += Vector3::new(transport.y / truth.latitude.cos(), -transport.x, 0.0) * weight;
        }
        self.truth.longitude += moved.x;
        self.truth.latitude += moved.y;
    }
}

//! A flight in closed form: position and attitude as functions of time, what an ideal instrument
//! senses by differentiating them on paper. Nothing here uses the equations of the navigation.

use nalgebra::{Matrix3, Vector3};
use turncal::attitude::from_pitch_roll_heading;
use turncal::earth::{Curvature, ROTATION_RATE, normal_gravity};
use turncal::navigation::{Height, Increments, Solution, Strapdown};

/// `start + rate t + amplitude (1 − cos(frequency t))`.
#[derive(Clone, Copy)]
pub struct Course {
    pub start: f64,
    pub rate: f64,
    pub amplitude: f64,
    pub frequency: f64,
}

impl Course {
    /// Value and first and second derivative.
    fn at(&self, t: f64) -> [f64; 3] {
        let (s, c) = (self.frequency * t).sin_cos();
        let speed = self.amplitude * self.frequency;
        [
            self.start + self.rate * t + self.amplitude * (1.0 - c),
            self.rate + speed * s,
            speed * self.frequency * c,
        ]
    }
}

#[derive(Clone, Copy)]
pub struct Flight {
    pub latitude: Course,
    pub longitude: Course,
    pub height: Course,
    pub pitch: Course,
    pub roll: Course,
    pub heading: Course,
}

impl Flight {
    pub fn truth(&self, t: f64) -> Solution {
        let [latitude, latitude_rate, _] = self.latitude.at(t);
        let [longitude, longitude_rate, _] = self.longitude.at(t);
        let [height, climb, _] = self.height.at(t);
        let radii = Curvature::at(latitude);
        Solution {
            attitude: self.attitude(t),
            velocity: Vector3::new(
                (radii.prime_vertical + height) * latitude.cos() * longitude_rate,
                (radii.meridian + height) * latitude_rate,
                climb,
            ),
            latitude,
            longitude,
            height,
        }
    }

    fn attitude(&self, t: f64) -> Matrix3<f64> {
        from_pitch_roll_heading(
            self.pitch.at(t)[0],
            self.roll.at(t)[0],
            self.heading.at(t)[0],
        )
    }

    /// Angular rate and specific force along body axes.
    pub fn sensed(&self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        let [l, l1, l2] = self.latitude.at(t);
        let [_, o1, o2] = self.longitude.at(t);
        let [h, h1, h2] = self.height.at(t);
        let (sin, cos) = l.sin_cos();
        let (at, slope) = (Curvature::at(l), Curvature::slope(l));
        let (r_m, r_n) = (at.meridian + h, at.prime_vertical + h);
        let (r_m1, r_n1) = (slope.meridian * l1 + h1, slope.prime_vertical * l1 + h1);
        let velocity = Vector3::new(r_n * cos * o1, r_m * l1, h1);
        let change = Vector3::new(
            r_n1 * cos * o1 - r_n * sin * l1 * o1 + r_n * cos * o2,
            r_m1 * l1 + r_m * l2,
            h2,
        );
        // East-North-Up turns against the Earth as latitude and longitude change.
        let frame =
            |longitude_rate: f64| Vector3::new(-l1, longitude_rate * cos, longitude_rate * sin);
        let mut force = change + frame(2.0 * ROTATION_RATE + o1).cross(&velocity);
        // The Earth's rate counts twice, that of latitude once.
        force.z += normal_gravity(l, h);

        let [_, pitch1, _] = self.pitch.at(t);
        let [_, roll1, _] = self.roll.at(t);
        let [heading, heading1, _] = self.heading.at(t);
        let attitude = self.attitude(t);
        let body = Vector3::new(heading.cos(), -heading.sin(), 0.0) * pitch1
            + attitude.column(1) * roll1
            - Vector3::z() * heading1;
        (
            attitude.tr_mul(&(frame(ROTATION_RATE + o1) + body)),
            attitude.tr_mul(&force),
        )
    }

    /// Integrals over a step, by five Gauss–Legendre points.
    pub fn increments(&self, from: f64, period: f64) -> Increments {
        const POINTS: [(f64, f64); 5] = [
            (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
            (-0.538_469_310_105_683, 0.478_628_670_499_366_5),
            (0.0, 0.568_888_888_888_888_9),
            (0.538_469_310_105_683, 0.478_628_670_499_366_5),
            (0.906_179_845_938_664, 0.236_926_885_056_189_1),
        ];
        let mut sum = Increments::default();
        for (point, weight) in POINTS {
            let (rate, force) = self.sensed(from + 0.5 * period * (1.0 + point));
            sum.angle += rate * (0.5 * period * weight);
            sum.velocity += force * (0.5 * period * weight);
        }
        sum
    }

    /// Where navigation ends after this many steps, its height held or free.
    pub fn navigate(&self, period: f64, steps: usize, free: bool) -> Solution {
        let mut navigation = Strapdown::new(self.truth(0.0), period).unwrap();
        for k in 0..steps {
            let increments = self.increments(k as f64 * period, period);
            let truth = self.truth((k + 1) as f64 * period);
            let height = if free {
                Height::Free
            } else {
                Height::Held {
                    height: truth.height,
                    velocity: truth.velocity.z,
                }
            };
            navigation.advance(&increments, height).unwrap();
        }
        *navigation.solution()
    }
}

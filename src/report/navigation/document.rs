//! The navigation as one JSON document.

use serde::{Serialize, Serializer};

use super::quantity::Quantity;
use super::{HOUR, Navigation, PAPER_HOURS};
use crate::attitude::to_pitch_roll_heading;
use crate::imu::BodyFrame;
use crate::study::navigation::{Epoch, Motion};
use crate::units::DEGREE;

#[derive(Serialize)]
struct Document<'a> {
    calibration: &'a str,
    truth: &'a str,
    body_frame: BodyFrame,
    errors: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    trajectory: Option<&'a str>,
    latitude_deg: f64,
    height_m: f64,
    /// Pitch, roll, heading of a body that stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    attitude_deg: Option<[f64; 3]>,
    hours: f64,
    series: Vec<Row>,
    /// Of the series.
    max_abs: Values,
    /// Of all minutes.
    max_abs_by_minute: Values,
    #[serde(rename = "final")]
    last: Option<Row>,
    /// Position at the end over the time.
    drift_nmile_per_h: Option<f64>,
    drift_nmile_per_40_h: Option<f64>,
}

#[derive(Serialize)]
struct Row {
    t_h: f64,
    #[serde(flatten)]
    errors: Values,
    /// Predicted; of horizontal lengths the root of the mean square.
    sigma: Option<Values>,
}

/// One number for each quantity, under its key.
struct Values([f64; 9]);

impl Values {
    fn largest<'m>(moments: impl Iterator<Item = &'m Epoch>) -> Self {
        let mut largest = [0f64; 9];
        for moment in moments {
            for (largest, quantity) in largest.iter_mut().zip(Quantity::ALL) {
                *largest = largest.max(quantity.error(&moment.error).abs());
            }
        }
        Self(largest)
    }
}

impl Serialize for Values {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(Quantity::ALL.map(Quantity::key).iter().zip(&self.0))
    }
}

fn row(moment: &Epoch) -> Row {
    Row {
        t_h: moment.time / HOUR,
        errors: Values(Quantity::ALL.map(|quantity| quantity.error(&moment.error))),
        sigma: moment.covariance.is_some().then(|| {
            Values(Quantity::ALL.map(|quantity| quantity.sigma(moment).unwrap_or_default()))
        }),
    }
}

pub(super) fn document<'a>(navigation: &Navigation<'a>) -> impl Serialize + use<'a> {
    let moments = navigation.moments;
    let hourly = || moments.iter().filter(|moment| moment.time % HOUR == 0.0);
    let (latitude, height, attitude) = match &navigation.mission.motion {
        Motion::Standing(at) => {
            let angles = to_pitch_roll_heading(&at.attitude);
            (at.latitude, at.height, Some(angles.map(|a| a / DEGREE)))
        }
        Motion::Moving(trajectory) => {
            let start = trajectory.start();
            (start.latitude, start.height, None)
        }
    };
    let drift = moments.last().filter(|last| last.time > 0.0).map(|last| {
        let [.., distance] = Quantity::ALL;
        distance.error(&last.error) / (last.time / HOUR)
    });
    Document {
        calibration: navigation.calibration,
        truth: navigation.truth,
        body_frame: navigation.body_frame,
        errors: navigation.only.map_or("both", |sensor| sensor.name()),
        trajectory: navigation.trajectory,
        latitude_deg: latitude / DEGREE,
        height_m: height,
        attitude_deg: attitude,
        hours: navigation.hours(),
        series: hourly().map(row).collect(),
        max_abs: Values::largest(hourly()),
        max_abs_by_minute: Values::largest(moments.iter()),
        last: moments.last().map(row),
        drift_nmile_per_h: drift,
        drift_nmile_per_40_h: drift.map(|drift| drift * PAPER_HOURS),
    }
}

//! Tests whether the gyros sense the Earth rate of the stated latitude.

use nalgebra::Vector3;
use serde_json::json;

use super::term::is_shown;
use crate::calibration::{
    Candidate, Constant, Finding, FindingKind as Kind, Group, Level, Outcome, Problem,
};
use crate::earth::{Site, normal_gravity};
use crate::imu::{ParameterKind, Sensor};
use crate::number::{three_digits, value};
use crate::units::{DEG_PER_H, DEGREE, PPM};

/// Gravity of a wrong latitude makes accelerometer scale factors useless beyond this many σ.
const USELESS: f64 = 4.0;

/// The finding, if the sensed Earth rate is not that of the stated latitude.
pub fn earth_rate(problem: &Problem, outcome: &Outcome) -> Option<Finding> {
    let candidates = &outcome.solved.effects.candidates;
    let count = candidates.absent().count();
    let mut absent = candidates.absent();
    let (_, absent) = absent.find(|(candidate, _)| *candidate == Candidate::EarthRate)?;
    if !is_shown(absent, count) {
        return None;
    }
    let posterior = &outcome.solved.posterior;
    let constants = posterior.constants.iter().zip(&posterior.mean);
    let mut rate = Vector3::zeros();
    for (constant, mean) in constants {
        if let Constant::EarthRate(axis) = constant {
            rate[*axis] = *mean;
        }
    }
    let site = &problem.run().site;
    let sensed = site.earth_rate_n() + rate;
    let latitude = sensed.z.atan2(sensed.x.hypot(sensed.y));
    // Earth rate to the east changes north; it gives no information on the latitude.
    let north = rate.x.atan2(sensed.y);
    let is_north = (latitude - site.latitude).abs() < north.abs();
    let off = if is_north {
        0.0
    } else {
        by_gravity(site, latitude)
    };
    let sigmas = off / scale_sigma(outcome);
    let text = if is_north {
        of_north(north)
    } else {
        of_latitude([latitude, site.latitude], (off, sigmas))
    };
    let figures = json!({
        "deg_per_h": Vec::from_iter(rate.iter().map(|of| of / DEG_PER_H)), "present": 1.0 - absent,
        "latitude_deg": latitude / DEGREE, "north_deg": north / DEGREE, "scale_error_ppm": off / PPM
    });
    let finding = Finding::new(Kind::EarthRateWrong, text, figures);
    Some(if sigmas > USELESS {
        finding.at(Level::Failed)
    } else if is_north {
        finding.at(Level::Note)
    } else {
        finding
    })
}

fn of_north(north: f64) -> String {
    format!(
        "The north of the table is off by {}°: the gyros sense the north of Earth rate {} of the stated north. \
         turncal estimated Earth rate, so K, E and D do not depend on this error. Correct the azimuth of the table.",
        value(north.abs() / DEGREE, 0.01),
        if north > 0.0 { "east" } else { "west" }
    )
}

/// Sensed and stated latitude; the error of the accelerometer scale factors due to gravity, and this error divided by
/// its σ.
fn of_latitude(latitudes: [f64; 2], (off, sigmas): (f64, f64)) -> String {
    let [sensed, stated] = latitudes.map(|of| value(of / DEGREE, 1.0));
    let gravity = if off > 0.0 {
        format!(
            ", but gravity of the wrong latitude makes accelerometer scale factors wrong by {} ppm ({} σ)",
            three_digits(off / PPM),
            three_digits(sigmas)
        )
    } else {
        String::new()
    };
    format!(
        "The gyros sense the Earth rate of latitude {sensed}°, but the stated latitude is {stated}°. turncal \
         estimated Earth rate{gravity}. Check latitude_deg and the north and level of the table."
    )
}

/// Relative error of gravity, if it was computed from the stated latitude but another latitude is right; zero if
/// gravity is stated.
fn by_gravity(site: &Site, latitude: f64) -> f64 {
    let [taken, right] = [site.latitude, latitude].map(|of| normal_gravity(of, site.height));
    if (taken - site.gravity).abs() <= site.gravity_sigma {
        (right / taken - 1.0).abs()
    } else {
        0.0
    }
}

/// RMS σ of the accelerometers' scale factors.
fn scale_sigma(outcome: &Outcome) -> f64 {
    let sigma = outcome.estimate.sigma();
    let scale =
        Group::all().find(|of| of.sensor() == Sensor::Accel && of.kind() == ParameterKind::Scale);
    let rms = scale.and_then(|of| of.rms(&sigma, &outcome.estimate));
    rms.map_or(f64::INFINITY, |rms| rms * PPM)
}

//! Detection of single unusual events: a wrong position, move or velocity, a bias step, or a slip.

use std::collections::BTreeMap;

use nalgebra::DVector;
use serde_json::json;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::calibration::chain::states::{ATTITUDE, VELOCITY};
use crate::calibration::chain::{Effect, Slip};
use crate::calibration::sizes::{FREEDOM, Weighed};
use crate::calibration::{Finding, FindingKind as Kind, Problem, Source};
use crate::imu::Sensor;
use crate::number::three_digits;
use crate::statistics::FALSE_ALARM;
use crate::units::{ARCSEC, DEG_PER_H, MICRO_G};

/// Kind of an unusual event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// The table's readings in one dwell.
    Position,
    /// A rotation that the gyros did not sense.
    Move,
    /// A change of velocity that the accelerometers did not sense.
    Velocity,
    /// A change of the biases of a triad.
    BiasStep(Sensor),
    /// A lasting rotation of the instrument on the table, or of the table on the ground.
    Slip(Slip),
    /// The magnetic field in one dwell.
    Field,
}

/// An event that is too large to result from its effect by chance, even if the effect has a heavy-tailed distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Kind.
    pub kind: EventKind,
    /// Number, from zero, of the dwell that contains or follows the event.
    pub dwell: usize,
    /// End of the first part of this dwell, s.
    pub time: f64,
    /// Size of the event, in rad, m/s, rad/s, m/s² or parts of the local field.
    pub size: f64,
    /// −2 ln of the p-value.
    pub significance: f64,
    /// Limit of the significance, for a false-alarm rate of 0.1 % over all events.
    pub limit: f64,
}

/// Evidence of all data for an event.
struct Told {
    time: f64,
    /// Sum of the squared mean disturbances of the event.
    squares: f64,
    /// Expectation of `squares` with the variance common to all events.
    known: f64,
    /// Sum of the squared eigenvalues of the covariance of the mean disturbances.
    spread: f64,
    count: f64,
    /// Change of the states.
    change: DVector<f64>,
}

impl Event {
    /// The events of a problem that stand out. With the weight κ of an event, the squares of its disturbances are `s`,
    /// and their expectation is `p` (the part, of one, that the data determine). With the common variance, the squares
    /// would be `s / p / (1 − p + p / κ)` times their expectation. With Student's t as the distribution of events, this
    /// ratio follows Fisher's F.
    pub(in crate::calibration) fn all(problem: &Problem, of: &Weighed) -> Vec<Self> {
        let told = told(of);
        let limit = -2.0 * (FALSE_ALARM / told.len().max(1) as f64).ln();
        let events = told.iter().filter_map(|(&(effect, dwell), told)| {
            let kind = EventKind::of(effect)?;
            let freedom = told.known.powi(2) / told.spread;
            let p = (told.known / told.count).clamp(0.0, 1.0);
            let factor = of.filtered.sizes.of_event(effect, dwell);
            let ratio = told.squares / told.known / (1.0 - p + p / factor);
            let law = FisherSnedecor::new(freedom, FREEDOM).ok()?;
            let chance = law.sf(ratio).max(f64::MIN_POSITIVE);
            Some(Self {
                kind,
                dwell,
                time: told.time,
                size: kind.size(of, &told.change),
                significance: -2.0 * chance.ln(),
                limit,
            })
        });
        let mut events: Vec<Self> = events.filter(|of| of.significance > of.limit).collect();
        // By hand, every move is different.
        let table = problem.model.aiding == crate::run::Aiding::Table;
        events.retain(|of| table || !matches!(of.kind, EventKind::Velocity));
        events.sort_by_key(|event| event.dwell);
        events
    }

    /// The finding on the event: kind, time and treatment.
    pub fn finding(&self) -> Finding {
        let Self {
            time,
            dwell,
            significance,
            limit,
            ..
        } = self;
        let number = dwell + 1;
        let text = self.kind.words(number, *time, self.size);
        let shown = three_digits(*significance);
        let text = format!("{text} (significance {shown}; limit {limit:.0}).");
        let figures = json!({
            "dwell": number, "time_s": time, "size": self.size,
            "significance": significance, "limit": limit
        });
        Finding::new(self.kind.kind(), text, figures)
    }
}

/// Evidence of all data for the events of effects with heavy tails.
fn told(of: &Weighed) -> BTreeMap<(Effect, usize), Told> {
    let (filtered, posterior) = (&of.filtered, &of.posterior);
    let mut all = BTreeMap::<(Effect, usize), Told>::new();
    filtered.backward(|number, cumulants| {
        let link = &filtered.chain.links[number];
        for drive in &link.transition.drives {
            let variance = filtered.sizes.of(drive.effect, drive.event);
            if !drive.effect.has_heavy_tails() || variance == 0.0 {
                continue;
            }
            let of_constants = drive.by.tr_mul(&cumulants.by_constants);
            let mean = drive.by.tr_mul(&cumulants.mean) - &of_constants * &posterior.mean;
            let precision = drive.by.tr_mul(&cumulants.precision) * &drive.by
                - &of_constants * &posterior.covariance * of_constants.transpose();
            let change = &drive.by * &mean * variance;
            let told = all.entry((drive.effect, drive.event)).or_insert(Told {
                time: link.time,
                squares: 0.0,
                known: 0.0,
                spread: 0.0,
                count: 0.0,
                change: DVector::zeros(change.len()),
            });
            told.time = link.time;
            told.squares += variance * mean.norm_squared();
            told.known += variance * precision.trace();
            told.spread += variance.powi(2) * precision.norm_squared();
            told.count += drive.by.ncols() as f64;
            told.change += change;
        }
    });
    all.retain(|_, told| told.known > 0.0 && told.spread > 0.0);
    all
}

impl EventKind {
    fn of(effect: Effect) -> Option<Self> {
        Some(match effect {
            Effect::Noise(Source::TablePosition) => Self::Position,
            Effect::Noise(Source::GyroMotion) => Self::Move,
            Effect::Noise(Source::AccelMotion) => Self::Velocity,
            Effect::Noise(Source::GyroGaussMarkov) => Self::BiasStep(Sensor::Gyro),
            Effect::Noise(Source::AccelGaussMarkov) => Self::BiasStep(Sensor::Accel),
            Effect::Noise(Source::MagneticDisturbance) => Self::Field,
            Effect::Slip(slip) => Self::Slip(slip),
            _ => return None,
        })
    }

    /// Size of a change of the states.
    fn size(self, of: &Weighed, change: &DVector<f64>) -> f64 {
        let layout = of.filtered.layout();
        let first = match self {
            Self::Position => layout.table,
            Self::Move => Some(ATTITUDE),
            Self::Velocity => Some(VELOCITY),
            Self::BiasStep(sensor) => Some(*layout.biases.get(sensor)),
            Self::Field => layout.magnetic,
            Self::Slip(Slip::Mount) => layout.slips.map(|[mount, _]| mount),
            Self::Slip(Slip::Base) => layout.slips.map(|[_, base]| base),
        };
        first.map_or(0.0, |first| change.rows(first, 3).norm())
    }

    /// Kind and text of the finding.
    fn kind(self) -> Kind {
        match self {
            Self::Position => Kind::PositionWrong,
            Self::Move => Kind::MoveWrong,
            Self::Velocity => Kind::VelocityWrong,
            Self::BiasStep(_) => Kind::BiasStep,
            Self::Field => Kind::FieldDisturbed,
            Self::Slip(_) => Kind::Slipped,
        }
    }

    fn words(self, number: usize, time: f64, size: f64) -> String {
        let angle = angle(size);
        match self {
            Self::Position => format!(
                "The table readings in dwell {number} (at {time:.1} s) are wrong by {angle}. turncal gave these readings \
                 next to no weight. Check the table log around this time for a bump or a wrong reading"
            ),
            Self::Move => format!(
                "In the move before dwell {number} (at {time:.1} s), the gyros missed a turn of {angle}. turncal \
                 estimated this angle. Check the log around this time for lost samples, rates beyond the measuring \
                 range, or a loose mount"
            ),
            Self::Velocity => format!(
                "In the move before dwell {number} (at {time:.1} s), the accelerometers missed a velocity of {size:.2e} \
                 m/s. turncal estimated this velocity. Check the log around this time for lost samples, forces beyond \
                 the measuring range, or a bump"
            ),
            Self::BiasStep(sensor) => {
                let (unit, name) = match sensor {
                    Sensor::Gyro => (DEG_PER_H, "°/h"),
                    Sensor::Accel => (MICRO_G, "µg"),
                };
                let (sensor, size) = (sensor.name(), three_digits(size / unit));
                format!(
                    "Before dwell {number} (at {time:.1} s), the {sensor} biases changed by about {size} {name}. The \
                     calibration contains the mean bias over the recording. Check the log around this time for a shock, \
                     or for a sudden change of temperature or supply voltage"
                )
            }
            Self::Field => format!(
                "In dwell {number} (at {time:.1} s) the magnetic field is off by {:.2} % of the local field. turncal \
                 gave the magnetometer next to no weight there. Keep steel, magnets and currents away, or hold the \
                 instrument elsewhere",
                100.0 * size
            ),
            Self::Slip(slip) => {
                let what = match slip {
                    Slip::Mount => "the instrument slipped on the table",
                    Slip::Base => "the table turned on the ground",
                };
                format!(
                    "Before dwell {number} (at {time:.1} s), {what} by {angle}. turncal estimated this angle; the \
                     misalignments refer to the mounting before this event. Fasten the instrument and the table, and \
                     repeat the recording"
                )
            }
        }
    }
}

fn angle(size: f64) -> String {
    let seconds = size / ARCSEC;
    match seconds {
        ..1000.0 => format!("{seconds:.0}″"),
        _ => format!("{:.3}°", seconds / 3600.0),
    }
}

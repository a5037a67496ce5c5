//! Conversion of the table clock to the IMU clock, with the offset and drift that follow from the moves in both logs.

use super::Run;
use super::doubts::clock::{Move, moves, resolved};
use super::turning::{self, STEP};
use crate::recording::TableLog;
use crate::statistics::{FALSE_ALARM, median_of_axes, student_limit};
use crate::units::PPM;

/// Minimum number of moves that show a drift beside an offset, and its σ.
const FEWEST: usize = 3;

/// A clock relative to another: offset at a time and drift, each with its 1σ.
struct Line {
    middle: f64,
    offset: [f64; 2],
    drift: [f64; 2],
}

impl Line {
    /// The line through the delays of these moves; without drift, if chance may have made it.
    fn of(moves: &[Move]) -> Option<Self> {
        let count = moves.len() as f64;
        let mean = |of: &dyn Fn(&Move) -> f64| moves.iter().map(of).sum::<f64>() / count;
        let (middle, offset) = (mean(&|m| m.time), mean(&|m| m.late));
        let spread = mean(&|m| (m.time - middle).powi(2));
        let drift = mean(&|m| (m.time - middle) * m.late) / spread;
        let squares = |drift: f64| mean(&|m| (m.late - offset - drift * (m.time - middle)).powi(2));
        let degrees = count - 2.0;
        let sigma = (squares(drift) / degrees).sqrt();
        let drift_sigma = sigma / spread.sqrt();
        let is_shown = drift.abs() > student_limit(degrees, 0.5 * FALSE_ALARM) * drift_sigma;
        let is_told = moves.len() >= FEWEST && drift.is_finite();
        is_told.then_some(Self {
            middle,
            offset: [offset, sigma],
            drift: if is_shown {
                [drift, drift_sigma]
            } else {
                [0.0; 2]
            },
        })
    }

    fn at(&self, time: f64) -> f64 {
        self.offset[0] + self.drift[0] * (time - self.middle)
    }
}

impl Run {
    /// If all moves are consistent with one offset and one drift of the table clock, converts the times of the table
    /// readings to the IMU clock, and returns a note about this conversion. It is unknown which of the two clocks
    /// drifts, so the drift is treated as an error of the sample period.
    pub fn align_table(&mut self) -> Option<String> {
        let table = self.recording.table.as_ref()?;
        if agree(self, &moves(self, table)) {
            return None;
        }
        let coarse = coarse(self, table)?;
        let moved = shifted(table, |_| coarse);
        let mut seen = moves(self, &moved);
        seen.retain(|of| !of.differs());
        let line = Line::of(&seen)?;
        let moved = shifted(&moved, |time| line.at(time));
        let seen = moves(self, &moved);
        if seen.len() < FEWEST || !agree(self, &seen) {
            return None;
        }
        self.recording.table = Some(moved);
        let period_sigma = &mut self.recording.imu.period_sigma;
        *period_sigma = period_sigma.hypot(line.drift[0]);
        Some(line.note(coarse, seen.len()))
    }
}

impl Line {
    fn note(&self, coarse: f64, moves: usize) -> String {
        let offset = coarse + self.offset[0];
        let way = if offset > 0.0 { "later" } else { "earlier" };
        let drift = match self.drift {
            [0.0, _] => String::new(),
            [drift, sigma] => format!(
                ", and the clocks drift apart by {:.1} ± {:.1} ppm, which is included in the σ of the gyro scale \
                 factors",
                drift / PPM,
                sigma / PPM
            ),
        };
        format!(
            "In all {moves} moves, the gyros turn {:.3} ± {:.3} s {way} than the table{drift}. turncal converted the \
             times of the table log to the clock of the IMU. To avoid this conversion, use the same clock in both \
             logs.",
            offset.abs(),
            self.offset[1],
        )
    }
}

/// Whether gyros and table turn by the same angles at the same times.
fn agree(run: &Run, moves: &[Move]) -> bool {
    let resolved = resolved(run, moves);
    !moves.is_empty()
        && moves
            .iter()
            .all(|of| !of.differs() && of.late.abs() <= resolved)
}

fn shifted(table: &TableLog, late: impl Fn(f64) -> f64) -> TableLog {
    let time = table.time.iter().map(|&time| time + late(time)).collect();
    let (attitude, axes) = (table.attitude.clone(), table.axes.clone());
    TableLog {
        time,
        attitude,
        axes,
    }
}

/// The delay of the gyros, to a step, for which the rates of both logs are most alike.
fn coarse(run: &Run, table: &TableLog) -> Option<f64> {
    let imu = &run.recording.imu;
    let start = imu.start();
    let turned: Vec<_> = turning::steps(imu, 0..imu.len(), nalgebra::Vector3::zeros()).collect();
    let rates: Vec<_> = turned
        .iter()
        .map(|(_, duration, angle)| angle / *duration)
        .collect();
    let rest = median_of_axes(&rates)?;
    let place = |time: f64| ((time - start) / STEP).floor() as i64;
    let mut gyros = vec![0.0; turned.len() + 1];
    for (time, duration, angle) in turned {
        if let Some(sum) = usize::try_from(place(time))
            .ok()
            .and_then(|k| gyros.get_mut(k))
        {
            *sum += (angle - rest * duration).norm();
        }
    }
    let readings = table.time.windows(2).zip(table.attitude.windows(2));
    let steps =
        readings.map(|(time, of)| (place(time[0].midpoint(time[1])), of[1].angle_to(&of[0])));
    let noise = 6f64.sqrt() * turning::SCALE_SIGMAS * run.table.reading_sigma;
    let steps: Vec<(i64, f64)> = steps.filter(|(_, angle)| *angle > noise).collect();
    let alike = |late: i64| {
        let at = |k: i64| usize::try_from(k + late).ok().and_then(|k| gyros.get(k));
        steps
            .iter()
            .map(|&(k, angle)| at(k).map_or(0.0, |of| of * angle))
            .sum::<f64>()
    };
    let reach = gyros.len() as i64 / 2;
    let weighed = (-reach..=reach).map(|late| (late, alike(late)));
    let best = weighed.max_by(|one, other| one.1.total_cmp(&other.1))?;
    Some(best.0 as f64 * STEP)
}

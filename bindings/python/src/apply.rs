//! Application of a calibration to columns.

use nalgebra::Vector3;
use numpy::{PyArray2, PyReadonlyArray1, PyReadwriteArray1};
use pyo3::prelude::*;
use rayon::prelude::*;
use turncal::calibration::Correction;
use turncal::imu::{PerSensor, Sensor};

use crate::calibration::Calibration;
use crate::errors::{Given, positive, raise, raised, wrong};
use crate::run::Run;

/// Rows that a thread takes at once.
const ROWS: usize = 1 << 14;

/// What rows are beside their columns.
struct Rows<'a> {
    columns: [&'a [f64]; 6],
    /// Outputs per row value: the rate for increments and pulses, otherwise one.
    per_row: f64,
    rate: f64,
}

impl Rows<'_> {
    fn output(&self, sensor: Sensor, row: usize) -> Vector3<f64> {
        let first = 3 * sensor as usize;
        Vector3::from_fn(|axis, _| self.columns[first + axis][row] * self.per_row)
    }

    fn calibrated(&self, by: &Correction, row: usize) -> PerSensor<Vector3<f64>> {
        let outputs = PerSensor::from_fn(|sensor| self.output(sensor, row));
        let acceleration = match by.terms().next() {
            Some(_) => self.angular_acceleration(by, row),
            None => Vector3::zeros(),
        };
        by.of_outputs(&outputs, &acceleration)
    }

    fn angular_acceleration(&self, by: &Correction, row: usize) -> Vector3<f64> {
        let (first, last) = (
            row.saturating_sub(1),
            (row + 1).min(self.columns[0].len() - 1),
        );
        let rate = |row| by.of_triad(Sensor::Gyro, &self.output(Sensor::Gyro, row));
        match last - first {
            0 => Vector3::zeros(),
            rows => (rate(last) - rate(first)) * self.rate / rows as f64,
        }
    }
}

/// Names of six columns, outputs per row value, and rows per second.
type Inputs = (Option<Vec<String>>, f64, f64);

/// How rows are read: as stated or, if nothing is stated, as in the calibrated run. A minus sign before a name reverses a
/// column. The columns are None if neither source gives them.
#[pyfunction]
pub fn inputs(
    calibration: &Calibration,
    gyro: Option<[String; 3]>,
    gyro_unit: Option<&str>,
    accel: Option<[String; 3]>,
    accel_unit: Option<&str>,
    rate: Given,
) -> PyResult<Inputs> {
    let record = &calibration.record;
    let units = record.unit.as_ref();
    for (sensor, unit) in [(Sensor::Gyro, gyro_unit), (Sensor::Accel, accel_unit)] {
        if let Some((unit, own)) = unit
            .zip(units.map(|of| of.get(sensor)))
            .filter(|(a, b)| a != b)
        {
            let (name, expected) = (
                sensor.name(),
                format!("{own:?}, the unit of this calibration. Convert the columns."),
            );
            return Err(wrong(name, format_args!("the unit {unit:?}"), &expected));
        }
    }
    let gyro = gyro.or_else(|| columns(calibration, Sensor::Gyro));
    let accel = accel.or_else(|| columns(calibration, Sensor::Accel));
    let columns = gyro.zip(accel);
    let columns = columns.map(|(gyro, accel)| gyro.into_iter().chain(accel).collect());
    let is_of_sums = calibration.is_of_sums().unwrap_or(rate.is_some());
    let of_record = record.provenance.as_ref().map(|of| of.rate_hz);
    let rate = positive("rate", rate)?.or(of_record).unwrap_or(1.0);
    Ok((columns, if is_of_sums { rate } else { 1.0 }, rate))
}

/// The columns of a triad in the log that was calibrated. A number is the place of a column in a file from one, in a
/// table from zero, so that those of a file have no meaning in a table.
fn columns(calibration: &Calibration, sensor: Sensor) -> Option<[String; 3]> {
    let names = calibration.record.columns.as_ref()?.get(sensor);
    let is_number = |name: &String| name.parse::<i64>().is_ok();
    let is_meaningful = calibration.is_of_table() || !names.iter().any(is_number);
    is_meaningful.then(|| names.clone())
}

/// Writes the calibrated values of some rows into six columns `out`. The first `before` rows and those beyond the
/// length of `out` are neighbours only.
#[pyfunction]
pub fn correct(
    py: Python,
    calibration: &Calibration,
    columns: [PyReadonlyArray1<f64>; 6],
    before: usize,
    mut out: [PyReadwriteArray1<f64>; 6],
    per_row: f64,
    rate: f64,
) -> PyResult<()> {
    let record = &calibration.record;
    let by = Correction::of_record(record).map_err(raise)?;
    if by.changes() {
        return Err(raised(
            "found a calibration that depends on temperature, expected data with temperature. Apply it to a run: \
             calibration.apply(turncal.run(data, temperature=…)).",
        ));
    }
    let [a, b, c, d, e, f] = columns.each_ref().map(|column| column.as_slice());
    let rows = Rows {
        columns: [a?, b?, c?, d?, e?, f?],
        per_row,
        rate,
    };
    let [a, b, c, d, e, f] = out.each_mut().map(|column| column.as_slice_mut());
    let out = [a?, b?, c?, d?, e?, f?];
    py.detach(|| write(&rows, &by, before, out));
    Ok(())
}

fn write(rows: &Rows, by: &Correction, before: usize, [a, b, c, d, e, f]: [&mut [f64]; 6]) {
    let pieces = (
        a.par_chunks_mut(ROWS),
        b.par_chunks_mut(ROWS),
        c.par_chunks_mut(ROWS),
    );
    let others = (
        d.par_chunks_mut(ROWS),
        e.par_chunks_mut(ROWS),
        f.par_chunks_mut(ROWS),
    );
    let pieces = pieces
        .into_par_iter()
        .zip(others.into_par_iter())
        .enumerate();
    pieces.for_each(|(piece, ((a, b, c), (d, e, f)))| {
        for k in 0..a.len() {
            let u = rows.calibrated(by, before + piece * ROWS + k);
            (a[k], b[k], c[k]) = (u.gyro.x, u.gyro.y, u.gyro.z);
            (d[k], e[k], f[k]) = (u.accel.x, u.accel.y, u.accel.z);
        }
    });
}

/// The calibrated samples of a run, of shape (rows, 8): start and end in s, rad/s, m/s².
#[pyfunction]
pub fn samples<'py>(
    py: Python<'py>,
    calibration: &Calibration,
    run: &Run,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let run = run.one()?;
    let correction = Correction::for_run(&calibration.record, run).map_err(raise)?;
    let rows: Vec<[f64; 8]> = py.detach(|| {
        let lost = run.recording.imu.lost();
        let is_kept = |k: &usize| !lost.iter().any(|lost| lost.contains(k));
        let samples = correction
            .samples(run, 0..run.recording.imu.len())
            .enumerate();
        let kept = samples.filter(|(k, _)| is_kept(k));
        kept.map(|(_, of)| {
            let ([p, q, r], [x, y, z]) = (of.rate.into(), of.force.into());
            [of.start, of.end, p, q, r, x, y, z]
        })
        .collect()
    });
    let flat = numpy::ndarray::Array2::from(rows);
    Ok(PyArray2::from_owned_array(py, flat))
}

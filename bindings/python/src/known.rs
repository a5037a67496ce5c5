//! What is known of a log without a run.toml.

use std::path::PathBuf;

use pyo3::prelude::*;
use turncal::earth::{GRAVITIES, HEIGHTS};
use turncal::imu::Sensor;
use turncal_files::draft::{Stated, StatedUnit};
use turncal_logs::DataFile;

use crate::errors::{Given, positive, raise, within, wrong};

/// What is known of a log without a run.toml.
#[pyclass(frozen, module = "turncal._turncal")]
pub struct Known {
    pub stated: Stated,
    pub stream: Option<String>,
}

#[pymethods]
impl Known {
    #[new]
    #[pyo3(signature = (
        *, rate=None, latitude=None, height=None, gravity=None, gyro_unit=None, accel_unit=None, sensor=None,
        noise_file=None, accel_file=None, stream=None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "each is a keyword")]
    fn new(
        rate: Given,
        latitude: Given,
        height: Given,
        gravity: Given,
        gyro_unit: Option<&str>,
        accel_unit: Option<&str>,
        sensor: Option<&str>,
        noise_file: Option<PathBuf>,
        accel_file: Option<PathBuf>,
        stream: Option<String>,
    ) -> PyResult<Self> {
        let stated = Stated {
            accel_file: accel_file.map(DataFile::from),
            rate_hz: positive("rate", rate)?,
            latitude_deg: within("latitude", latitude, -90.0..=90.0)?,
            height_m: within("height", height, HEIGHTS)?,
            gravity_m_s2: within("gravity", gravity, GRAVITIES)?,
            gyro_unit: unit(Sensor::Gyro, gyro_unit)?,
            accel_unit: unit(Sensor::Accel, accel_unit)?,
            ..Stated::default()
        };
        let stated = stated.with_data_sheets(sensor, noise_file.as_deref());
        Ok(Self {
            stated: stated.map_err(raise)?,
            stream,
        })
    }
}

impl Known {
    /// A sensor at a site.
    pub fn of_sensor(
        sensor: &str,
        latitude: Given,
        height: Given,
        gravity: Given,
    ) -> PyResult<Self> {
        let (none, name) = (None, Some(sensor));
        Self::new(
            none, latitude, height, gravity, None, None, name, None, None, None,
        )
    }
}

fn unit(sensor: Sensor, text: Option<&str>) -> PyResult<Option<StatedUnit>> {
    let parse = |text| {
        let refused = |expected: String| {
            let name = format!("{}_unit", sensor.name());
            wrong(
                &name,
                format_args!("{text:?}"),
                expected.trim_start_matches("expected "),
            )
        };
        StatedUnit::parse(sensor, text).map_err(refused)
    };
    text.map(parse).transpose()
}

//! Noise figures from Kalibr's `imu.yaml`.
//!
//! Source: Kalibr, *IMU Noise Model* (wiki): densities of white noise and of the random walk of the bias, in SI.

use std::collections::BTreeMap;
use std::path::Path;

use turncal::imu::{GaussMarkov, Noise, PerSensor, Sensor};
use turncal_input::{FileError, Place, nearest, small_file};

const RATE: &str = "update_rate";
/// Correlation time of the Gauss–Markov bias that represents a random walk, s; longer than most recordings.
const CORRELATION_TIME: f64 = 3600.0;

/// IMU noise from a Kalibr file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KalibrImu {
    /// Samples per second.
    pub rate_hz: Option<f64>,
    /// Noise in SI.
    pub noise: PerSensor<Noise>,
}

impl KalibrImu {
    /// Reads the lines `key: value` of one IMU; keys unrelated to noise are ignored.
    ///
    /// # Errors
    /// Returns [`FileError`] if the file cannot be read, lacks a noise density, or states a wrong number or a key
    /// twice.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let advice = "Correct the name, or create the file.";
        let text = small_file::text(path, "the noise figures", advice)?;
        Self::of_text(path, &text)
    }

    fn of_text(path: &Path, text: &str) -> Result<Self, FileError> {
        let (mut figures, mut others) = (BTreeMap::new(), Vec::new());
        for (line, text) in (1..).zip(text.lines()) {
            let text = text.split(" #").next().unwrap_or_default();
            let Some((key, value)) = text.split_once(':') else {
                continue;
            };
            let (key, value) = (key.trim(), value.trim());
            let mut known = Sensor::ALL.into_iter().flat_map(keys).chain([RATE]);
            let Some(key) = known.find(|known| *known == key) else {
                others.push(key);
                continue;
            };
            let wrong = |found: String, expected, advice| {
                let place = Place::Line(line);
                Err(FileError::new(path, place, found, expected, advice))
            };
            let number = value.parse().ok();
            let Some(number) = number.filter(|of: &f64| of.is_finite() && *of > 0.0) else {
                let found = format!("`{key}: {value}`");
                return wrong(found, "a number above zero", "Correct this value.");
            };
            if figures.insert(key, number).is_some() {
                let found = format!("a second `{key}`");
                return wrong(found, "one line per key", "Keep only the lines of one IMU.");
            }
        }
        let noise = |sensor| {
            let [white, walk] = keys(sensor);
            let missing = || missing(path, white, &others);
            Ok(Noise {
                random_walk: figures.get(white).copied().ok_or_else(missing)?,
                gauss_markov: figures.get(walk).copied().map(bias_of),
            })
        };
        let noise = PerSensor::try_from_fn(noise)?;
        let rate_hz = figures.get(RATE).copied();
        Ok(Self { rate_hz, noise })
    }
}

/// Keys of the white noise and the bias random walk of a triad.
fn keys(sensor: Sensor) -> [&'static str; 2] {
    sensor.pick(
        ["gyroscope_noise_density", "gyroscope_random_walk"],
        ["accelerometer_noise_density", "accelerometer_random_walk"],
    )
}

/// Gauss–Markov bias that grows like the random walk over times much shorter than its correlation time.
fn bias_of(walk: f64) -> GaussMarkov {
    GaussMarkov {
        sigma: walk * (CORRELATION_TIME / 2.0).sqrt(),
        correlation_time: CORRELATION_TIME,
    }
}

fn missing(path: &Path, key: &str, others: &[&str]) -> FileError {
    let found = format_args!("no `{key}`");
    let advice = match nearest(key, others.iter().copied()) {
        Some(other) => format!("Rename `{other}`, or add the line."),
        None => "Add the line.".to_owned(),
    };
    FileError::of(path, found, "a noise density for each triad", advice)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draft::StatedUnit;
    use crate::draft::{Draft, Stated};

    fn read(text: &str) -> Result<KalibrImu, String> {
        KalibrImu::of_text(Path::new("imu.yaml"), text).map_err(|error| error.to_string())
    }

    const FILE: &str = "\
#Accelerometers
accelerometer_noise_density: 1.86e-03   #Noise density (continuous-time)
accelerometer_random_walk:   4.33e-04   #Bias random walk

#Gyroscopes
gyroscope_noise_density:     1.87e-04   # not a key: of white noise
gyroscope_random_walk:       2.66e-05

rostopic:                    /imu0
update_rate:                 200.0      #Hz (for discretization of the values above)
";

    #[test]
    fn the_file_of_kalibrs_documentation_gives_its_figures_in_si() {
        let imu = read(FILE).unwrap();
        assert_eq!(imu.rate_hz, Some(200.0));
        assert_eq!(imu.noise.gyro.random_walk, 1.87e-4);
        assert_eq!(imu.noise.gyro.gauss_markov, Some(bias_of(2.66e-5)));
        assert_eq!(imu.noise.accel.random_walk, 1.86e-3);
        assert_eq!(imu.noise.accel.gauss_markov, Some(bias_of(4.33e-4)));
    }

    #[test]
    fn lines_below_the_name_of_an_imu_are_the_same() {
        let indented = FILE.replace('\n', "\r\n  ");
        let chain =
            format!("%YAML:1.0\r\nimu0:\r\n  T_i_b:\r\n  - [1.0, 0.0, 0.0, 0.0]\r\n  {indented}");
        assert_eq!(read(&chain), read(FILE));
    }

    #[test]
    fn a_bias_walks_as_kalibr_states_over_short_times() {
        let walk = 2.66e-5;
        let bias = bias_of(walk);
        let time = 10.0;
        let variance = 2.0 * bias.sigma.powi(2) * -(-time / bias.correlation_time).exp_m1();
        assert!((variance / (walk * walk * time) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (text, words) in [
            (
                "rostopic: /imu0\n",
                &[
                    "imu.yaml: found no `gyroscope_noise_density`",
                    "Add the line",
                ][..],
            ),
            (
                "x: 1\ngyroscope_noise_densty: 1e-4\n",
                &["Rename `gyroscope_noise_densty`"],
            ),
            (
                "gyroscope_noise_density: 1e-4\n",
                &["no `accelerometer_noise_density`"],
            ),
            (
                "\ngyroscope_noise_density: 1e-4 rad\n",
                &["line 2", "`gyroscope_noise_density: 1e-4 rad`"],
            ),
            ("gyroscope_random_walk: -1e-4\n", &["line 1", "above zero"]),
            ("gyroscope_random_walk:\n", &["line 1", "above zero"]),
            ("update_rate: inf\n", &["line 1", "above zero"]),
            (
                "update_rate: 200\nimu1:\n update_rate: 100\n",
                &["line 3", "a second", "one IMU"],
            ),
        ] {
            let error = read(text).unwrap_err();
            for word in words {
                assert!(error.contains(word), "{text:?}: {error}");
            }
        }
    }

    #[test]
    fn stated_noise_is_that_of_the_run() {
        let directory = tempfile::tempdir().unwrap();
        let log = directory.path().join("log.csv");
        let row = |k: usize| {
            format!(
                "{},{},0,0,0,0,9.8\n",
                k as f64 * 0.005,
                (k % 2) as f64 * 1e-3
            )
        };
        let rows: String = (0..400).map(row).collect();
        std::fs::write(&log, "t,gx,gy,gz,ax,ay,az\n".to_owned() + &rows).unwrap();
        let imu = read(FILE).unwrap();
        let stated = Stated {
            rate_hz: imu.rate_hz,
            gyro_unit: StatedUnit::parse(Sensor::Gyro, "rad/s").ok(),
            noise: Some(imu.noise),
            ..Stated::default()
        };
        let draft = Draft::of_stream(&log.as_path().into(), None, &stated)
            .unwrap()
            .to_toml("log.csv");
        let run = crate::run_of_text(&log, &draft, None, &[]).unwrap();
        for sensor in Sensor::ALL {
            let (found, expected) = (run.instrument.noise.get(sensor), imu.noise.get(sensor));
            let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
            near(found.random_walk, expected.random_walk);
            let (found, expected) = (found.gauss_markov.unwrap(), expected.gauss_markov.unwrap());
            near(found.sigma, expected.sigma);
            near(found.correlation_time, expected.correlation_time);
        }
    }
}

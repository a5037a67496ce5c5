//! Calibrates a recording in memory: increments of both triads at 100 Hz, without a table.
//!
//! Run it with `cargo run --release --example from_arrays`.

use nalgebra::Vector3;
use turncal::calibration::{Method, Options, Problem, UNWATCHED};
use turncal::earth::Site;
use turncal::imu::{Instrument, Noise, PerSensor, Prior};
use turncal::recording::Recording;
use turncal::run::{Aiding, Run};
use turncal::simulation::Scenario;
use turncal::units::{ARCSEC, DEGREE, MICRO_G_PER_SQRT_HZ, PPM};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Where a program of your own has arrays, this one takes them from a simulated hand-held MEMS.
    let simulated = Scenario::load("mems")?.simulate(7, 0)?.run;
    let samples = &simulated.recording.imu;
    let (gyro, accel) = (samples.gyro.clone(), samples.accel.clone());

    // rad and m/s in each period, along right-front-up.
    let recording = Recording::from_samples("my-imu", 0.0, samples.period, gyro, accel)?;
    let prior = |bias_sigma: f64| Prior {
        scale_sigma: Vector3::repeat(20_000.0 * PPM),
        installation_sigma: Vector3::repeat(2.0 * 3600.0 * ARCSEC),
        bias: Vector3::zeros(),
        bias_sigma: Vector3::repeat(bias_sigma),
    };
    let noise = |random_walk: f64| Noise {
        random_walk,
        gauss_markov: None,
    };
    let instrument = Instrument::new(
        PerSensor {
            gyro: prior(1.0 * DEGREE),
            accel: prior(0.3),
        },
        PerSensor {
            gyro: noise(simulated.instrument.noise.gyro.random_walk),
            accel: noise(200.0 * MICRO_G_PER_SQRT_HZ),
        },
    );
    let site = Site::with_normal_gravity(48.0 * DEGREE, 11.0 * DEGREE, 500.0);
    let run = Run::new(recording, instrument, site);

    let problem = Problem::new(&run, &Options::default().aiding(Aiding::Velocity));
    let solution = problem.solve(Method::Ekf, UNWATCHED)?;
    let assessment = solution.assess(&problem)?;
    let calibration = solution.calibration(&problem, &assessment);
    for name in ["gyro.bias.x", "accel.scale.z"] {
        let sigma = calibration.sigma_of(name).copied().unwrap_or(f64::NAN);
        println!("{name} = {:.6} ± {sigma:.6}", calibration[name]);
    }
    for finding in solution.findings() {
        println!("{finding}");
    }
    Ok(())
}

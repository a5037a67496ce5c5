//! A calibration in progress: samples are pushed as they arrive, and the session recommends the next move.
//!
//! Run it with `cargo run --release --example session`.

use nalgebra::Vector3;
use turncal::models::specification;
use turncal::simulation::Scenario;
use turncal::survey::Session;
use turncal_report::session::{data, words};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Your own program would read a sensor here; this one uses simulated samples.
    let run = Scenario::load("mems")?.simulate(7, 0)?.run;
    let imu = &run.recording.imu;
    let rates = |of: Vec<Vector3<f64>>| of.into_iter().map(|sample| sample / imu.period).collect();
    let gyro: Vec<Vector3<f64>> = rates(imu.gyro.iter().collect());
    let accel: Vec<Vector3<f64>> = rates(imu.accel.iter().collect());

    let session = Session::new(run.instrument.clone(), run.site, imu.period);
    let mut session = session.to_decide(specification("mems-by-hand".as_ref())?);
    for (gyro, accel) in gyro.chunks(1000).zip(accel.chunks(1000)) {
        let Some(status) = session.push(gyro, accel)? else {
            continue;
        };
        let Some(next) = status.next else {
            println!("{:.0} s: every limit can be decided", status.duration);
            println!("{:#}", data(&status)["sigma"]);
            break;
        };
        println!(
            "{:.0} s, {} dwells: {}",
            status.duration,
            status.survey.rests.len(),
            words(next)
        );
    }
    Ok(())
}

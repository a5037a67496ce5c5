//! A calibration under way: samples are pushed as they come, and each second tells what to do next.
//!
//! Run it with `cargo run --release --example session`.

use nalgebra::Vector3;
use turncal::models::specification;
use turncal::report::session::{data, words};
use turncal::simulation::Scenario;
use turncal::survey::Session;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Where a program of your own reads a sensor, this one takes the samples of a simulated one.
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

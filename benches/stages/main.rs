//! How long each stage of a calibration takes, in samples of the instrument a second.
//!
//! `cargo bench --bench stages` prints a table. `dense_filter` is the yardstick: a Kalman filter of the same
//! 39 states that multiplies whole matrices, over the same blocks of navigation; figures compare with it
//! on any machine.

mod dense_filter;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use dense_filter::DenseFilter;
use divan::Bencher;
use divan::counter::ItemsCount;
use turncal::calibration::{Method, NoisePolicy, Options, Problem, UNWATCHED, bound, estimate};
use turncal::imu::{InstallationForm, PerSensor, Triad};
use turncal::navigation::{Navigator, ProcessNoise, State};
use turncal::run::Run;
use turncal::simulation::{Scenario, Simulated};
use turncal::study;
use turncal::study::{AccuracyStudy, Study};
use turncal_files::write_run;

fn main() {
    divan::main();
}

/// A run on a three-axis turntable.
fn simulated() -> &'static Simulated {
    static RUN: OnceLock<Simulated> = OnceLock::new();
    RUN.get_or_init(|| {
        let scenario = Scenario::load("demo").expect("embedded");
        scenario.simulate(1, 0).expect("a sound scenario")
    })
}

fn run() -> &'static Run {
    &simulated().run
}

fn samples() -> ItemsCount {
    ItemsCount::new(run().recording.imu.len())
}

/// Samples in a block of the yardstick.
const BLOCK: usize = 10;

fn ideal() -> PerSensor<Triad> {
    PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General))
}

#[divan::bench]
fn read_files(bencher: Bencher) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let output = simulated().output;
    write_run(directory.path(), run(), output, None).expect("a run that was simulated");
    let path = directory.path().join("run.toml");
    bencher
        .counter(samples())
        .bench(|| turncal_files::read_run(&path));
}

#[divan::bench]
fn dwells_and_steps(bencher: Bencher) {
    let options = Options::default();
    bencher
        .counter(samples())
        .bench(|| Problem::new(run(), &options));
}

/// Strapdown navigation and its error model, as for a move.
#[divan::bench]
fn navigation(bencher: Bencher) {
    let imu = &run().recording.imu;
    let start = State::at_rest(nalgebra::Matrix3::identity());
    let navigator = Navigator::new(imu, &run().site, &ideal(), start).expect("ideal triads");
    bencher
        .counter(samples())
        .bench(|| navigator.clone().advance(0..imu.len()));
}

/// The yardstick: navigation by blocks of 10 samples and a filter of whole matrices.
#[divan::bench]
fn dense_filter(bencher: Bencher) {
    let imu = &run().recording.imu;
    let start = State::at_rest(nalgebra::Matrix3::identity());
    let navigator = Navigator::new(imu, &run().site, &ideal(), start).expect("ideal triads");
    let noise = PerSensor::from_fn(|_| ProcessNoise {
        random_walk: 1e-6,
        ..ProcessNoise::default()
    });
    bencher.counter(samples()).bench(|| {
        let mut navigator = navigator.clone();
        let mut filter = DenseFilter::new(noise);
        for begin in (0..imu.len() - BLOCK).step_by(BLOCK) {
            let block = navigator.advance(begin..begin + BLOCK);
            filter.propagate(&block);
            filter.observe(block.state.velocity, [1e-10, 1e-12]);
            navigator.state = start;
        }
        filter.trace()
    });
}

/// One pass of the filter, linearised at the truth.
#[divan::bench]
fn one_pass(bencher: Bencher) {
    let problem = Problem::new(run(), &Options::default());
    let Simulated { truth, terms, .. } = simulated();
    bencher
        .counter(samples())
        .bench(|| bound(&problem, truth, terms));
}

#[divan::bench(args = [NoisePolicy::Stated, NoisePolicy::Auto])]
fn estimator(bencher: Bencher, noise: NoisePolicy) {
    let problem = Problem::new(run(), &Options::default().noise(noise));
    bencher
        .counter(samples())
        .bench(|| estimate(&problem, UNWATCHED));
}

/// All that `calibrate` works out of a recorded run, if it is there.
#[divan::bench(sample_count = 5, args = ["three-axis-counts", "real-mems-lot-0", "nineteen-position-velocity"])]
fn calibrate(bencher: Bencher, name: &str) {
    let data = std::env::var_os("TURNCAL_DATA").map_or_else(
        || Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("../shared/data"),
        PathBuf::from,
    );
    let Ok(run) = turncal_files::read_run(&data.join(name).join("run.toml")) else {
        return;
    };
    let problem = Problem::new(&run, &Options::default());
    bencher
        .counter(ItemsCount::new(run.recording.imu.len()))
        .bench(|| {
            let solution = problem.solve(Method::Ekf, UNWATCHED)?;
            solution.assess(&problem)
        });
}

/// Simulation, both methods and the bound, a hundred times.
#[divan::bench(sample_count = 1)]
fn hundred_monte_carlo_runs(bencher: Bencher) {
    let study = study(100);
    bencher.bench(|| study.run(study::UNWATCHED).expect("a sound study"));
}

/// Simulation, both methods and the bound.
#[divan::bench(sample_count = 5)]
fn one_monte_carlo_run(bencher: Bencher) {
    let study = study(1);
    bencher.bench(|| study.run(study::UNWATCHED).expect("a sound study"));
}

fn study(runs: u64) -> AccuracyStudy {
    AccuracyStudy {
        scenario: Scenario::load("demo").expect("embedded"),
        form: InstallationForm::General,
        unmodelled: Vec::new(),
        auto_terms: true,
        noise: Default::default(),
        runs,
        seed: 1,
    }
}

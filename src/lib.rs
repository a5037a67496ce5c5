//! Calibration of an inertial measurement unit on a turntable: scale factors K, misalignment matrix E and biases D of
//! gyros and accelerometers, each with its σ.
//!
//! An error-state extended Kalman filter runs a strapdown navigation solution through a recording and estimates the
//! parameters from its errors at rest (velocity and table attitude). Passes over the whole recording, each linearised
//! at the previous estimate, are the iterations of a Gauss–Newton method. The closed form from static positions (Zhao,
//! Jiang, Li 2016) is the baseline.
//!
//! # Calibrate
//! ```
//! use turncal::calibration::{Method, Options, Problem, UNWATCHED};
//! use turncal::simulation::Scenario;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A simulated run; `turncal_files::read_run("run.toml".as_ref())` reads a recorded one.
//! let run = Scenario::load("single-axis")?.simulate(1, 0)?.run;
//! let problem = Problem::new(&run, &Options::default());
//! let solution = problem.solve(Method::Ekf, UNWATCHED)?;
//! let assessment = solution.assess(&problem)?;
//! let calibration = solution.calibration(&problem, &assessment);
//! assert!(solution.converged());
//! println!("{} ± {:?}", calibration["gyro.bias.x"], calibration.sigma_of("gyro.bias.x"));
//! for finding in solution.findings() {
//!     println!("{finding}");
//! }
//! # Ok(())
//! # }
//! ```
//! `examples/` contains more programs: samples from arrays, a comparison of both methods with a truth, a study of a
//! path, and calibration of rows as they arrive.
//!
//! # Frames, signs, units
//! | what | convention |
//! |---|---|
//! | navigation frame n | East-North-Up at the site |
//! | body frame b | right-front-up: the table's mounting face, or fixed by the accelerometers without a table ([`imu::BodyFrame`]) |
//! | attitude | `C_b_n` transforms body to navigation; heading is clockwise from North |
//! | instrument | `N = K C u + D`, u the angular rate in rad/s or the specific force in m/s² ([`imu`]) |
//! | navigation errors | computed − true, `C_computed = (I − [φ×]) C_true` |
//! | parameter errors | true − estimated |
//! | units | SI and radians everywhere; [`units`] are for input and output |
//!
//! # Modules A [`recording::Recording`] holds only data. A [`run::Run`] adds prior knowledge: instrument, site, table.
//! [`calibration::Options`] select the estimated quantities; a [`calibration::Problem`] preprocesses the runs once.
//! Data flow in one direction: [`calibration`] solves a problem, [`study`] evaluates the solution by navigation and
//! Monte Carlo, and [`lot`] compares units of one type. [`earth`], [`attitude`], [`imu`], [`turntable`] and
//! [`navigation`] do not depend on these; [`simulation`] generates runs from [`models`]; [`survey`] examines a run
//! before calibration, and [`noise`] analyses its noise.
//!
//! # Crates
//! This crate contains only the science: it reads no recordings, prints nothing and draws nothing.
//!
//! | crate | purpose | depends on |
//! |---|---|---|
//! | `turncal-input` | errors with line and field, TOML documents, checked numbers, units | |
//! | `turncal` | calibrates, simulates, studies | `turncal-input` |
//! | `turncal-logs` | turns logs into rows of numbers | `turncal-input` |
//! | `turncal-files` | reads and writes runs and calibrations, drafts a `run.toml`, exports | all above |
//! | `turncal-report` | presents results as text, page, JSON and certificate | `turncal`, `turncal-input` |
//! | `turncal-cli` | is the command `turncal` | all above |

pub mod attitude;
pub mod calibration;
pub mod earth;
pub mod imu;
pub mod laboratory;
pub mod lot;
pub mod magnetic;
pub mod models;
pub mod navigation;
pub mod noise;
pub mod number;
pub mod recording;
pub mod run;
pub mod simulation;
pub mod statistics;
pub mod study;
pub mod survey;
pub mod turntable;

pub use turncal_input::units;

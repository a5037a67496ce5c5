//! Calibration of an inertial measurement unit on a turntable.
//!
//! # Frames, signs, units
//! * Navigation frame `n`: East-North-Up. Body frame `b`: right-front-up. `C_b_n` takes body to
//!   navigation; heading is clockwise from North.
//! * Instrument: `N = K C u + D`, with `u` the angular rate in rad/s or the specific force in m/s².
//! * Navigation errors are computed − true, parameter errors true − estimated.
//! * SI and radians everywhere; [`units`] at the edges.
//!
//! # Rooms
//! Data flow one way: [`run`] → [`navigation`], [`calibration`] and [`noise`] → [`study`] → [`report`]. [`earth`],
//! [`attitude`], [`imu`] and [`turntable`] know nobody; [`simulation`] makes runs from [`models`], [`export`]
//! writes what other programs read. [`draft`] looks at a log of which nothing is known, [`survey`] at a run
//! before it is calibrated.
//!
//! # Features
//! `report` (pages, figures, tables: [`report`]) and `cli` (the command `turncal`, with `report`) are on by
//! default. Without them no crate of a user interface is compiled:
//! `turncal = { version = "…", default-features = false }`.

pub mod attitude;
pub mod calibration;
pub mod earth;
pub mod formats;
pub mod imu;
pub mod models;
pub mod navigation;
pub mod noise;
pub mod recording;
#[cfg(feature = "report")]
pub mod report;
pub mod run;
pub mod simulation;
pub(crate) mod statistics;
pub mod study;
pub mod survey;
pub mod turntable;
pub mod units;

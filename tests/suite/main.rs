//! What turncal promises, from the outside: one binary, so that it links once.

mod allan;
mod apply;
mod batch;
mod by_hand;
mod calibration_file;
mod check;
mod cli;
mod closed_form;
mod compare;
mod door;
mod error_terms;
mod export;
mod faults;
mod features;
mod fuzz;
mod help;
mod init;
#[cfg(unix)]
mod interrupted;
mod learnt_noise;
mod lot;
mod modules;
mod mounting;
mod navigate;
mod navigation;
mod observability;
mod outliers;
mod recorded;
mod shared;
mod simulated;
mod stretches;
mod study;
mod table1;
mod terms;
mod threads;
mod velocity;

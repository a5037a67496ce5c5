//! What turncal promises, from the outside: one binary, so that it links once.

mod cli;
mod door;
mod recorded;
mod shared;
mod simulated;

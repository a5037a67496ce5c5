//! What turncal promises, from the outside: one binary, so that it links once.

mod cli;
mod compare;
mod door;
mod navigation;
mod recorded;
mod shared;
mod simulated;

//! The instrument's samples.

mod held;
mod parts;
mod reading;
mod settings;

pub use settings::ImuLog;

#[cfg(test)]
mod tests;

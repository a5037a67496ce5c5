//! A [`Run`] as a run directory.

//! Reading of logs as rows of numbers.
//!
//! A [`Source`] opens a file by its content: text ([`csv_file`]), or one of the binary formats of [`streams`], each of
//! which provides streams of samples. Both kinds of file are read as [`LogRows`]; a [`clock`] turns their time stamps
//! into seconds. This crate does not interpret the numbers.

pub mod clock;
pub mod csv_file;
mod data_file;
pub mod rows;
mod source;
pub mod streams;
mod table;

pub use data_file::{Content, DataFile};
pub use rows::{LogRows, Rows};
pub use source::Source;
pub use table::{Table, TableRows};

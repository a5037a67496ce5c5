//! The sample rows of a file in order of time, all in memory or packed while reading.

use super::parts::{Parts, Sizes};
use super::{ImuLog, Layout};
use crate::formats::clock::{REACH, Stamp, Stamps, Wander};
use crate::formats::error::FileError;
use crate::formats::rows::LogRows;
use crate::formats::temperature::Temperatures;
use crate::imu::Output;

/// Minimum number of samples; with fewer, dwells and turns cannot be distinguished.
const FEWEST_SAMPLES: usize = 100;

/// Rows in memory, without duplicates.
#[derive(Default)]
pub struct Held {
    pub columns: [Vec<f64>; 6],
    /// Rows before each duplicate, and its line.
    pub duplicates: Vec<(usize, u64)>,
}

impl Held {
    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    fn row(&self, row: usize) -> [f64; 6] {
        self.columns.each_ref().map(|column| column[row])
    }

    fn insert(&mut self, place: usize, row: [f64; 6]) {
        // Rows that come late belong behind one of the last.
        let last = self.len().saturating_sub(REACH);
        let behind = self.duplicates.iter_mut().rev();
        for (row, _) in behind.take_while(|(row, _)| *row > last) {
            *row += usize::from(*row > place);
        }
        for (column, value) in self.columns.iter_mut().zip(row) {
            column.insert(place, value);
        }
    }

    /// Releases the first rows.
    pub fn let_go(&mut self, rows: usize) {
        for column in &mut self.columns {
            column.drain(..rows);
            column.shrink_to(2 * column.len());
        }
        self.duplicates.retain(|&(row, _)| row > rows);
        self.duplicates.iter_mut().for_each(|(row, _)| *row -= rows);
    }
}

/// A partly read file.
pub struct Reading<'a> {
    log: &'a ImuLog<'a>,
    /// Column indices of a sample in a row.
    places: [Option<usize>; 6],
    /// The column that distinguishes instruments, and its value for the selected one.
    instance: Option<(usize, f64)>,
    pub stamps: Stamps,
    pub temperature: Option<Temperatures>,
    held: Held,
    pub duplicates: usize,
    /// Rows without any value.
    blank: usize,
    /// Rows without some.
    lacking: usize,
}

impl<'a> Reading<'a> {
    pub fn begin(
        log: &'a ImuLog<'a>,
        csv: &mut LogRows,
        places: [Option<usize>; 6],
    ) -> Result<Self, FileError> {
        let temperature = log.temperature.as_ref();
        let temperature = temperature.map(|columns| columns.start(csv)).transpose()?;
        let instance = match log.instance {
            Some((name, number)) => Some((csv.column(name)?, number)),
            None => None,
        };
        Ok(Self {
            log,
            places,
            instance,
            stamps: log.clock_of_rows().start(csv)?,
            temperature,
            held: Held::default(),
            duplicates: 0,
            blank: 0,
            lacking: 0,
        })
    }

    /// Stores the row if it is a sample.
    fn take(&mut self, csv: &LogRows) -> Result<(), FileError> {
        if let Some((place, number)) = self.instance
            && csv.number(place)? != number
        {
            return Ok(());
        }
        // Rows that another sensor wrote, or in which a sensor said nothing; a time tells that they are missing.
        let places = || self.places.iter().flatten();
        match places().filter(|&&place| csv.is_blank(place)).count() {
            0 => {}
            _ if self.log.clock_of_rows().column.is_none() => {}
            all if all == places().count() => {
                self.blank += 1;
                return Ok(());
            }
            _ => {
                self.lacking += 1;
                return Ok(());
            }
        }
        let mut row = [0.0; 6];
        for (value, &place) in row.iter_mut().zip(&self.places) {
            if let Some(place) = place {
                *value = self.log.value(csv, place)?;
            }
        }
        let held = &mut self.held;
        let place = match self.stamps.take(csv, |other| held.row(other) == row)? {
            Stamp::New(place) => place,
            Stamp::Again(place) => {
                held.duplicates.push((place, csv.line()));
                self.duplicates += 1;
                return Ok(());
            }
        };
        held.insert(place, row);
        if let (Some(temperature), Some(&(time, _))) =
            (&mut self.temperature, self.stamps.of_rows.get(place))
        {
            temperature.take(csv, self.stamps.told(time));
        }
        Ok(())
    }

    /// Remarks on rows that are not samples, one sentence each.
    pub fn notes(&self) -> impl Iterator<Item = String> {
        let file = self.log.source.file.display();
        let blank = (self.blank > 0).then(|| {
            format!(
                "{} row(s) of {file} are empty in the columns of both triads. turncal skipped them.",
                self.blank
            )
        });
        let lacking = (self.lacking > 0).then(|| {
            format!(
                "{} row(s) of {file} lack a gyro or accelerometer value and count as missing.",
                self.lacking
            )
        });
        [blank, lacking].into_iter().flatten()
    }

    fn too_few(&self, csv: &LogRows) -> FileError {
        let (found, advice) = match self.lacking {
            0 => (String::new(), "Record a run with dwells and turns."),
            lacking => (
                format!(" and {lacking} rows that lack a gyro or accelerometer value"),
                "If gyros and accelerometers are in separate rows, `turncal init` drafts a run.toml for that layout.",
            ),
        };
        csv.error(
            format_args!("{} samples{found}", self.held.len()),
            format_args!("at least {FEWEST_SAMPLES}"),
            advice,
        )
    }
}

impl<'a> Reading<'a> {
    /// Reads all rows; the drift of the samples of a long log may be known.
    pub fn all(
        &mut self,
        csv: &mut LogRows,
        layout: &Layout,
        sizes: Sizes,
        known: Option<&Wander>,
    ) -> Result<Parts<'a>, FileError> {
        let begin = |reading: &Self, csv: &LogRows, size: Option<usize>| {
            let rows = (&reading.held, &reading.stamps);
            let parts = Parts::new(reading.log, layout.clone(), size, rows, known);
            parts.map_err(|error| csv.placed(error))
        };
        let mut parts: Option<Parts> = None;
        while csv.advance()? && !csv.may_be_cut() {
            self.take(csv)?;
            if parts.is_none() && self.held.len() == sizes.long {
                parts = Some(begin(self, csv, Some(sizes.part))?);
            }
            if let Some(parts) = parts.as_mut().filter(|parts| parts.is_full(&self.held)) {
                let taken = parts.take(&mut self.held, &mut self.stamps, false);
                taken.map_err(|error| csv.placed(error))?;
            }
        }
        let mut parts = match parts {
            Some(parts) => parts,
            None if self.held.len() < FEWEST_SAMPLES => return Err(self.too_few(csv)),
            None => begin(self, csv, None)?,
        };
        let taken = parts.take(&mut self.held, &mut self.stamps, true);
        self.held = Held::default();
        taken.map_err(|error| csv.placed(error))?;
        Ok(parts)
    }
}

impl ImuLog<'_> {
    /// A number in a row, unchanged.
    fn value(&self, csv: &LogRows, column: usize) -> Result<f64, FileError> {
        let value = csv.number(column)?;
        if self.output == Output::Pulse && value.fract() != 0.0 {
            return Err(csv.not(
                column,
                "a whole number of pulses, or output = \"increment\" in run.toml",
            ));
        }
        Ok(value)
    }
}

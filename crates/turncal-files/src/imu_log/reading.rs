//! The sample rows of a file in order of time, either all in memory or packed while they are read.

use super::held::{Held, Sizes};
use super::parts::Parts;
use super::settings::{ImuLog, Layout};
use crate::temperature::Temperatures;
use turncal::imu::Output;
use turncal::recording::{FEWEST_SAMPLES, ImuSamples};
use turncal_input::{FileError, counted};
use turncal_logs::clock::{Stamp, Stamps, Wander};
use turncal_logs::rows::LogRows;

/// A partly read file.
pub struct Reading<'a> {
    log: &'a ImuLog<'a>,
    /// Column indices of a sample in a row.
    places: [Option<usize>; 6],
    /// The column that distinguishes the instruments, and its value for the selected instrument.
    instance: Option<(usize, f64)>,
    pub stamps: Stamps,
    pub temperature: Option<Temperatures>,
    held: Held,
    pub duplicates: usize,
    /// Rows without any value.
    blank: usize,
    /// Rows without some values.
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
        // Rows from another sensor, or without a value from a sensor; with a time column, they count as missing.
        let places = || self.places.iter().flatten();
        let blank = places().filter(|&&place| csv.is_blank(place)).count();
        if blank > 0 && self.log.clock_of_rows().column.is_some() {
            let is_whole = blank == places().count();
            let rows = if is_whole {
                &mut self.blank
            } else {
                &mut self.lacking
            };
            *rows += 1;
            return Ok(());
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
            let rows = counted(self.blank, "row");
            format!(
                "turncal skipped {rows} of {file} in which the columns of both triads are empty."
            )
        });
        let lacking = (self.lacking > 0).then(|| {
            let rows = counted(self.lacking, "row");
            format!(
                "turncal counts {rows} of {file} with a missing gyro or accelerometer value as missing."
            )
        });
        [blank, lacking].into_iter().flatten()
    }

    /// Fewest samples of a recording, of a table of means, or of a log without both triads.
    fn fewest(&self) -> usize {
        if self.places.iter().all(Option::is_none) {
            return 1;
        }
        let may_be_means = !self.log.continuous && self.log.clock_of_rows().column.is_none();
        if may_be_means { 1 } else { FEWEST_SAMPLES }
    }

    fn too_few(&self, csv: &LogRows) -> FileError {
        let (found, advice) = match self.lacking {
            0 => (String::new(), "Record a run with dwells and turns."),
            lacking => (
                format!(
                    " and {} with a missing gyro or accelerometer value",
                    counted(lacking, "row")
                ),
                "If gyros and accelerometers are in separate rows, `turncal init` drafts a run.toml for that layout.",
            ),
        };
        let samples = counted(self.held.len(), "sample");
        csv.error(
            format_args!("{samples}{found}"),
            format_args!("at least {FEWEST_SAMPLES}"),
            advice,
        )
    }
}

impl<'a> Reading<'a> {
    /// Reads all rows; for a long log, the drift of the samples may already be known.
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
            None if self.held.len() < self.fewest() => return Err(self.too_few(csv)),
            None => begin(self, csv, None)?,
        };
        let taken = parts.take(&mut self.held, &mut self.stamps, true);
        self.held = Held::default();
        taken.map_err(|error| csv.placed(error))?;
        Ok(parts)
    }
}

impl ImuLog<'_> {
    /// Reads the samples, then finds and bridges faults; `notes` receives remarks about the file.
    pub fn read(&self, notes: &mut Vec<String>) -> Result<ImuSamples, FileError> {
        self.read_by(Sizes::default(), notes)
    }

    /// Does the same as [`Self::read`], with other limits for the rows in memory.
    pub fn read_by(&self, sizes: Sizes, notes: &mut Vec<String>) -> Result<ImuSamples, FileError> {
        let mut known = None;
        loop {
            let mut csv = self.open()?;
            let layout = self.layout(&mut csv)?;
            let mut reading = Reading::begin(self, &mut csv, layout.places)?;
            let parts = reading.all(&mut csv, &layout, sizes, known.as_ref())?;
            let clock = parts.clock().map_err(|error| csv.placed(error))?;
            if parts.are_packed() && known.is_none() && clock.wander.is_some() {
                // Too long to be kept in memory: the file is read again with the clock found in the first reading.
                known = clock.wander;
                continue;
            }
            notes.extend(clock.uneven());
            notes.extend(csv.left_out());
            notes.extend(csv.cut_off("turncal ignored it"));
            notes.extend_from_slice(csv.remarks());
            notes.extend(reading.notes());
            notes.extend(reading.stamps.notes(&self.source.file, parts.missing()));
            let mut imu = parts.finish(clock, reading.duplicates, csv.integral_error());
            for stretch in &mut imu.stretches {
                stretch.start = reading.stamps.told(stretch.start);
            }
            if let Some(temperature) = reading.temperature {
                let read = temperature.read(&self.source.file.display().to_string());
                notes.extend(read.notes);
                imu.temperature = read.temperature;
                if let Some(log) = &mut imu.log {
                    log.temperature = read.facts;
                }
            }
            return Ok(imu);
        }
    }

    /// A number in a row, unchanged.
    fn value(&self, csv: &LogRows, column: usize) -> Result<f64, FileError> {
        let value = csv.number(column)?;
        if self.output == Output::Pulse && value.fract() != 0.0 {
            let expected = "a whole number of pulses, or output = \"increment\" in run.toml";
            return Err(csv.not(column, expected));
        }
        Ok(value)
    }
}

//! Conversion of rows to samples: a short log at once, a long log packed part by part.

use std::ops::Range;

use nalgebra::Vector3;

use super::held::Held;
use super::settings::{ImuLog, Layout, sensor};
use crate::course::{Even, place, reached};
use turncal::imu::{Output, PerSensor, Sensor};
use turncal::recording::faults::{Repaired, Rows};
use turncal::recording::{
    Bridge, ColumnFacts, Fault, FaultKind, ImuSamples, LogFacts, Packer, SeriesWriter, finest_step,
    stretches_between,
};
use turncal_input::FileError;
use turncal_logs::clock::{Line, REACH, Stamps, Uniform, Wander};

/// Additional rows searched on either side of a part; more than the reach of a bridge and its evidence.
const BESIDE: usize = 1 << 13;

/// The samples of a log that have been read so far.
pub struct Parts<'a> {
    log: &'a ImuLog<'a>,
    layout: Layout,
    /// Rows per part; `None` for a single part.
    size: Option<usize>,
    clock: Line,
    /// Sample number of each row in memory.
    numbers: Vec<usize>,
    /// Number of rows in memory that were processed.
    taken: usize,
    /// The first unprocessed sample.
    next: usize,
    facts: Option<[ColumnFacts; 6]>,
    series: PerSensor<SeriesWriter>,
    /// Known drift of the samples.
    even: Option<(Wander, PerSensor<Even>)>,
    faults: Vec<Fault>,
    bridges: Vec<Bridge>,
    rows: usize,
}

impl<'a> Parts<'a> {
    /// Starts with the first rows of a log, or with all its rows. For a log that is read in parts, the drift of the
    /// samples may already be known.
    pub fn new(
        log: &'a ImuLog<'a>,
        layout: Layout,
        size: Option<usize>,
        (held, stamps): (&Held, &Stamps),
        known: Option<&Wander>,
    ) -> Result<Self, FileError> {
        // Later rows may belong before the last ones.
        let open = if size.is_some() { REACH } else { 0 };
        let settled = &stamps.of_rows[..stamps.of_rows.len().saturating_sub(open)];
        let (clock, numbers) = Line::new(&log.source.file, settled, log.clock.period)?;
        let wander = match size {
            Some(_) => known.cloned(),
            None => clock.clone().finish()?.wander,
        };
        let step = |column: usize| match log.output {
            Output::Pulse => 1.0,
            Output::Increment | Output::Rate => finest_step(&held.columns[column]),
        };
        let writer = |sensor| match size {
            None => SeriesWriter::default(),
            Some(_) => SeriesWriter::Packed(Packer::new(layout.columns(sensor).map(step))),
        };
        Ok(Self {
            series: PerSensor::from_fn(writer),
            even: wander.map(|wander| {
                let even = |_| Even::new(&wander, log.stamp.lag(), log.output);
                (wander.clone(), PerSensor::from_fn(even))
            }),
            log,
            layout,
            size,
            clock,
            numbers,
            taken: 0,
            next: 0,
            facts: None,
            faults: Vec::new(),
            bridges: Vec::new(),
            rows: 0,
        })
    }

    /// The rows needed for the next part.
    fn end(&self) -> Option<usize> {
        self.size.map(|size| self.taken + size + 2 * BESIDE)
    }

    /// Whether enough rows are in memory to process some of them.
    pub fn is_full(&self, held: &Held) -> bool {
        self.end().is_some_and(|end| held.len() >= end + REACH)
    }

    /// Processes rows in memory (at the end of the file, all rows), and releases the rows that are no longer needed.
    pub fn take(
        &mut self,
        held: &mut Held,
        stamps: &mut Stamps,
        at_end: bool,
    ) -> Result<(), FileError> {
        // Later rows show whether a row is late.
        let new = &stamps.of_rows[self.numbers.len()..];
        let count = new.len() - if at_end { 0 } else { REACH.min(new.len()) };
        self.numbers.extend(self.clock.numbers(new, count)?);
        while self.is_full(held)
            && let Some(end) = self.end()
        {
            self.part(held, stamps, end);
        }
        if at_end {
            self.part(held, stamps, held.len());
        }
        Ok(())
    }

    /// Processes rows up to about this one, the limit of the fault search.
    fn part(&mut self, held: &mut Held, stamps: &mut Stamps, end: usize) {
        let is_last = end == held.len();
        let first = self.numbers[0];
        let units = self.layout.units(self.log, self.clock.period());
        let names = &self.layout.names;
        let facts_of = |columns: &[Vec<f64>; 6], rows: Range<usize>| {
            let values = |k: usize| &columns[k][rows.clone()];
            std::array::from_fn(|k| ColumnFacts::of(&names[k].name, values(k), units[k]))
        };
        let facts = facts_of(&held.columns, 0..end);
        let of_rest = match self.taken {
            0 => facts.clone(),
            taken => facts_of(&held.columns, taken..end),
        };
        let columns = if is_last {
            std::mem::take(&mut held.columns)
        } else {
            held.columns.each_ref().map(|rows| rows[..end].to_vec())
        };
        let mut repaired = self.rows(held, stamps, columns, &facts).repair();
        for samples in repaired.samples_mut() {
            *samples = first + samples.start..first + samples.end;
        }
        if is_last {
            let until = self.numbers[end - 1] + 1;
            self.keep(repaired, first, self.next..until, true);
            self.add(of_rest, self.taken..end);
            self.next = until;
            return;
        }
        // A part ends before a sample without faults, so that no bridge crosses the boundary.
        let wanted = end.saturating_sub(BESIDE).max(self.taken);
        let sound = |row: &usize| repaired.is_sound(self.numbers[*row]);
        let end = (wanted..end).find(sound).unwrap_or(wanted);
        let until = self.numbers[end];
        let facts = facts_of(&held.columns, self.taken..end);
        self.keep(repaired, first, self.next..until, false);
        self.add(facts, self.taken..end);
        (self.next, self.taken) = (until, end);
        self.let_go(held, stamps);
    }

    /// Rows for the fault search.
    fn rows<'b>(
        &self,
        held: &Held,
        stamps: &Stamps,
        columns: [Vec<f64>; 6],
        facts: &'b [ColumnFacts; 6],
    ) -> Rows<'b> {
        let (end, first) = (columns[0].len(), self.numbers[0]);
        let lines = stamps.of_rows[..end].iter().map(|&(_, line)| line);
        let duplicates = held.duplicates.iter().copied();
        let period = self.clock.period();
        Rows {
            facts,
            full_scale: self.layout.full_scale(self.log),
            pulses: self.log.output == Output::Pulse,
            body_axes: self.layout.body_axes,
            units: self.layout.units(self.log, period),
            lines: lines.collect(),
            numbers: self.numbers[..end].iter().map(|n| n - first).collect(),
            period,
            duplicates: duplicates.filter(|&(row, _)| row <= end).collect(),
            columns,
        }
    }

    fn add(&mut self, facts: [ColumnFacts; 6], rows: Range<usize>) {
        self.rows += rows.len();
        self.facts = Some(match self.facts.take() {
            Some(before) => {
                let mut of = before.into_iter().zip(&facts).map(|(a, b)| a.and(b));
                std::array::from_fn(|_| of.next().unwrap_or_default())
            }
            None => facts,
        });
    }

    /// Stores the faults of these samples; repaired columns start at sample `first`.
    fn keep(&mut self, repaired: Repaired, first: usize, samples: Range<usize>, is_last: bool) {
        let Repaired {
            columns,
            faults,
            bridges,
        } = repaired;
        let within = |of: &Range<usize>| of.start.max(samples.start)..of.end.min(samples.end);
        let kept = faults.into_iter().map(|fault| Fault {
            samples: within(&fault.samples),
            ..fault
        });
        for fault in kept.filter(|fault| !fault.samples.is_empty()) {
            self.keep_fault(fault, samples.start);
        }
        let begin_within = |bridge: &Bridge| samples.contains(&bridge.samples.start);
        let begun = bridges.into_iter().filter(begin_within);
        self.bridges.extend(begun);
        for sensor in Sensor::ALL {
            let of_axes = self.layout.columns(sensor).map(|column| &columns[column]);
            let series = self.series.get_mut(sensor);
            let samples = samples.start - first..samples.end - first;
            let samples = samples.map(|k| of_axes.map(|column| column[k]));
            match &mut self.even {
                None => samples.for_each(|sample| series.push(sample)),
                Some((_, even)) => {
                    let even = even.get_mut(sensor);
                    samples.for_each(|sample| even.push(sample));
                    even.give(is_last, |sample| series.push(sample));
                }
            }
        }
    }

    /// Merges faults that continue from the previous part.
    fn keep_fault(&mut self, fault: Fault, begin: usize) {
        let is_whole = matches!(fault.kind, FaultKind::Duplicate | FaultKind::Missing);
        let is_rest = fault.samples.start == begin && !is_whole;
        let begun = |before: &&mut Fault| {
            (before.kind, before.axis) == (fault.kind, fault.axis) && before.samples.end == begin
        };
        let mut before = self.faults.iter_mut();
        match is_rest.then(|| before.find(begun)).flatten() {
            Some(before) => {
                before.samples.end = fault.samples.end;
                before.bridged &= fault.bridged;
            }
            None => self.faults.push(fault),
        }
    }

    fn let_go(&mut self, held: &mut Held, stamps: &mut Stamps) {
        let rows = self.taken.saturating_sub(BESIDE);
        held.let_go(rows);
        stamps.let_go(rows);
        self.numbers.drain(..rows);
        self.numbers.shrink_to(2 * self.numbers.len());
        self.taken -= rows;
    }

    /// Whether rows were packed while the log was read.
    pub fn are_packed(&self) -> bool {
        self.size.is_some()
    }

    /// The common clock of all rows.
    pub fn clock(&self) -> Result<Uniform, FileError> {
        self.clock.clone().finish()
    }

    /// Samples without a row.
    pub fn missing(&self) -> usize {
        self.next - self.rows
    }

    /// The samples of the complete log; `integral_error` is the error of the integrals of the accelerometers, in their
    /// quantity times s.
    pub fn finish(
        mut self,
        clock: Uniform,
        duplicates: usize,
        integral_error: [f64; 3],
    ) -> ImuSamples {
        let mut error = self.onto_the_even_clock();
        let (log, layout, period) = (self.log, &self.layout, clock.period);
        let units = layout.units(log, period);
        let seconds = log.seconds(period);
        for (error, of_both) in error.accel.iter_mut().zip(integral_error) {
            *error = error.hypot(of_both / seconds);
        }
        let PerSensor { gyro, accel } = self.series;
        let gyro = gyro.finish(seconds, layout.body_nominal(log, Sensor::Gyro));
        let accel = accel.finish(seconds, layout.body_nominal(log, Sensor::Accel));
        // Packed pulses are rounded a second time if they are interpolated; the fraction is carried over in the sum.
        let roundings: f64 = match log.output {
            Output::Pulse if gyro.is_packed() && !self.bridges.is_empty() => 2.0,
            _ => 1.0,
        };
        let pulse = PerSensor::from_fn(|sensor| {
            let step = match log.output {
                Output::Pulse => log.nominal.get(sensor).0.map(|n| n.abs().recip()).mean(),
                Output::Increment | Output::Rate => sensor.pick(&gyro, &accel).step(),
            };
            let of_column = |k: usize| error.get(sensor)[k] * units[3 * sensor as usize + k];
            (step * roundings.sqrt()).hypot(pulse_of([0, 1, 2].map(of_column)))
        });
        let mut columns = PerSensor::<[ColumnFacts; 3]>::default();
        let facts = self.facts.unwrap_or_default().into_iter().zip(units);
        for (k, (facts, unit)) in facts.enumerate() {
            columns.get_mut(sensor(k))[layout.body_axes[k]] = ColumnFacts { unit, ..facts };
        }
        let lag = log.stamp.lag();
        let ahead = clock.wander.as_ref();
        let ahead = ahead.map_or(0.0, |wander| place(wander, lag, 0).ceil());
        let begin = clock.first + (ahead - lag) * period;
        ImuSamples {
            period_sigma: 0.0,
            stretches: stretches_between(gyro.len(), begin, period, &self.faults),
            period,
            continuous: log.continuous,
            gyro,
            accel,
            pulse,
            faults: self.faults,
            bridges: self.bridges,
            temperature: None,
            log: Some(LogFacts {
                rows: self.rows + duplicates,
                output: log.output,
                jitter_rms: clock.jitter_rms,
                jitter_max: clock.jitter_max,
                off_stated_period: clock.off_given,
                columns,
                named: log.named_columns(layout),
                temperature: None,
            }),
        }
    }

    /// Moves faults and bridges, in order, to the positions of samples resampled to a uniform clock; with RMS errors of
    /// the integrals, in the quantity of the columns times samples.
    fn onto_the_even_clock(&mut self) -> PerSensor<[f64; 3]> {
        let mut error = PerSensor::default();
        if let Some((wander, even)) = &self.even {
            error = PerSensor::from_fn(|sensor| even.get(sensor).error());
            let of_faults = self.faults.iter_mut().map(|fault| &mut fault.samples);
            let of_bridges = self.bridges.iter_mut().map(|bridge| &mut bridge.samples);
            let count = self.series.gyro.len();
            for samples in of_faults.chain(of_bridges) {
                let of = reached(wander, self.log.stamp.lag(), samples);
                *samples = of.start.min(count)..of.end.min(count);
            }
        }
        self.faults.sort_by_key(Fault::order);
        self.faults.shrink_to_fit();
        Bridge::sort(&mut self.bridges);
        self.bridges.shrink_to_fit();
        error
    }
}

/// Pulse whose rounding has this RMS error on each axis: like rounding, the error of integrals between edges is bounded
/// and does not grow with time.
fn pulse_of(error: [f64; 3]) -> f64 {
    12f64.sqrt() * Vector3::from(error).norm() / 3f64.sqrt()
}

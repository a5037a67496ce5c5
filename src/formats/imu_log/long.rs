//! A log of so many rows that they are packed part by part as they are read.

use std::ops::Range;

use super::content::Held;
use super::even::{Even, reached};
use super::{ImuLog, Layout, Read};
use crate::formats::clock::Stamps;
use crate::formats::error::FileError;
use crate::formats::uniform::{Following, REACH, Uniform};
use crate::imu::{Output, PerSensor, Sensor};
use crate::recording::faults::{Repaired, Rows};
use crate::recording::{Bridge, ColumnFacts, Fault, FaultKind, Packed, Packer, finest_step};

/// How many rows are held.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sizes {
    /// From so many on a log is packed: until then they take 50 MB at most.
    pub long: usize,
    /// So many are looked at for faults at once, as though they were a record.
    pub part: usize,
}

impl Default for Sizes {
    fn default() -> Self {
        Self {
            long: 1 << 20,
            part: 1 << 18,
        }
    }
}

/// Rows on either side of a part that are looked at with it: more than what is bridged, and what tells of it, reach
/// over.
const BESIDE: usize = 1 << 13;

/// What a long log has come to so far.
pub(super) struct LongLog<'a> {
    log: &'a ImuLog<'a>,
    layout: Layout,
    sizes: Sizes,
    clock: Following,
    /// The sample of each row that is held.
    numbers: Vec<usize>,
    /// Rows held that were taken.
    taken: usize,
    /// The first sample that was not.
    next: usize,
    facts: Option<[ColumnFacts; 6]>,
    packers: PerSensor<Packer>,
    /// Where it is known that samples wander.
    even: Option<PerSensor<Even<'a>>>,
    faults: Vec<Fault>,
    bridges: Vec<Bridge>,
    rows: usize,
}

/// What a long log has come to.
pub(super) struct Whole {
    pub read: Read,
    pub packed: PerSensor<Packed>,
    pub samples: usize,
    /// Samples without a row.
    pub missing: usize,
}

impl<'a> LongLog<'a> {
    /// Begins with the first rows of a log, whose clock may be known.
    pub fn new(
        log: &'a ImuLog<'a>,
        (layout, sizes): (Layout, Sizes),
        held: &Held,
        stamps: &Stamps,
        known: Option<&'a Uniform>,
    ) -> Result<Self, FileError> {
        // Rows further on may belong before the last ones.
        let settled = &stamps.of_rows[..stamps.of_rows.len().saturating_sub(REACH)];
        let (clock, numbers) = Following::new(&log.source.file, settled, log.clock.period)?;
        let step = |column: usize| match log.output {
            Output::Pulse => 1.0,
            Output::Increment | Output::Rate => finest_step(&held.columns[column]),
        };
        Ok(Self {
            packers: PerSensor::from_fn(|sensor| Packer::new(layout.columns(sensor).map(step))),
            even: known.and_then(|clock| clock.wander.as_ref()).map(|wander| {
                PerSensor::from_fn(|_| Even::new(wander, log.stamp.lag(), log.output))
            }),
            log,
            layout,
            sizes,
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

    /// Whether so many rows are held that some can be taken.
    pub fn is_full(&self, held: &Held) -> bool {
        held.len() >= self.taken + self.sizes.part + 2 * BESIDE + REACH
    }

    /// Takes rows that are held, all of them at the end of the file, and lets go of what no later row asks for.
    pub fn take(
        &mut self,
        held: &mut Held,
        stamps: &mut Stamps,
        at_end: bool,
    ) -> Result<(), FileError> {
        // Rows further on tell whether one is late.
        let new = &stamps.of_rows[self.numbers.len()..];
        let count = new.len() - if at_end { 0 } else { REACH.min(new.len()) };
        self.numbers.extend(self.clock.numbers(new, count)?);
        while self.is_full(held) {
            self.part(held, stamps, self.taken + self.sizes.part + 2 * BESIDE);
        }
        if at_end {
            self.part(held, stamps, held.len());
        }
        Ok(())
    }

    /// Takes rows up to about this one, to which faults are looked for.
    fn part(&mut self, held: &mut Held, stamps: &mut Stamps, end: usize) {
        let is_last = end == held.len();
        let first = self.numbers[0];
        let columns = held.columns.each_ref().map(|rows| rows[..end].to_vec());
        let lines = stamps.of_rows[..end].iter().map(|&(_, line)| line);
        let duplicates = held.duplicates.iter().copied();
        let layout = &self.layout;
        let period = self.clock.period();
        let units = layout.units(self.log, period);
        let facts =
            std::array::from_fn(|k| ColumnFacts::of(&layout.names[k].name, &columns[k], units[k]));
        let rows = Rows {
            facts: &facts,
            full_scale: layout.full_scale(self.log),
            pulses: self.log.output == Output::Pulse,
            body_axes: layout.body_axes,
            units,
            lines: lines.collect(),
            numbers: self.numbers[..end].iter().map(|n| n - first).collect(),
            period,
            duplicates: duplicates.filter(|&(row, _)| row <= end).collect(),
            columns,
        };
        let mut repaired = rows.repair();
        for samples in repaired.samples_mut() {
            *samples = first + samples.start..first + samples.end;
        }
        // A part ends before a sound sample, so that nothing is bridged across.
        let wanted = end.saturating_sub(BESIDE).max(self.taken);
        let end = match is_last {
            true => end,
            false => {
                let sound = |row: &usize| repaired.is_sound(self.numbers[*row]);
                (wanted..end).find(sound).unwrap_or(wanted)
            }
        };
        let until = match is_last {
            true => self.numbers[end - 1] + 1,
            false => self.numbers[end],
        };
        self.keep(repaired, first, self.next..until);
        let new = self.taken..end;
        let facts = std::array::from_fn(|k| {
            ColumnFacts::of(&facts[k].name, &held.columns[k][new.clone()], units[k])
        });
        self.facts = Some(match self.facts.take() {
            Some(before) => {
                let mut of = before.into_iter().zip(&facts).map(|(a, b)| a.and(b));
                std::array::from_fn(|_| of.next().unwrap_or_default())
            }
            None => facts,
        });
        self.rows += new.len();
        self.next = until;
        self.taken = end;
        self.let_go(held, stamps);
    }

    /// Keeps what was found of these samples; repaired columns begin with sample `first`.
    fn keep(&mut self, repaired: Repaired, first: usize, samples: Range<usize>) {
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
        self.faults
            .extend(kept.filter(|fault| !fault.samples.is_empty()));
        let begin_within = |bridge: &Bridge| samples.contains(&bridge.samples.start);
        self.bridges
            .extend(bridges.into_iter().filter(begin_within));
        for sensor in Sensor::ALL {
            let of_axes = self.layout.columns(sensor).map(|column| &columns[column]);
            let packer = self.packers.get_mut(sensor);
            let samples = samples.start - first..samples.end - first;
            let samples = samples.map(|k| of_axes.map(|column| column[k]));
            match &mut self.even {
                None => samples.for_each(|sample| packer.push(sample)),
                Some(even) => {
                    let even = even.get_mut(sensor);
                    samples.for_each(|sample| even.push(sample));
                    even.give(false, |sample| packer.push(sample));
                }
            }
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

    /// What the log is, all of its rows being taken.
    pub fn finish(mut self, duplicates: usize) -> Result<Whole, FileError> {
        let clock = self.clock.finish()?;
        let units = self.layout.units(self.log, clock.period);
        let mut facts = self.facts.unwrap_or_default();
        for (facts, unit) in facts.iter_mut().zip(units) {
            facts.unit = unit;
        }
        let mut error = PerSensor::default();
        if let (Some(wander), Some(even)) = (&clock.wander, &mut self.even) {
            for sensor in Sensor::ALL {
                let packer = self.packers.get_mut(sensor);
                let even = even.get_mut(sensor);
                even.give(true, |sample| packer.push(sample));
                *error.get_mut(sensor) = even.error();
            }
            let of_faults = self.faults.iter_mut().map(|fault| &mut fault.samples);
            let of_bridges = self.bridges.iter_mut().map(|bridge| &mut bridge.samples);
            for samples in of_faults.chain(of_bridges) {
                *samples = reached(wander, self.log.stamp.lag(), samples);
            }
        }
        let PerSensor { gyro, accel } = self.packers;
        let units = |sensor| self.layout.body_units(self.log, sensor, clock.period);
        let packed = PerSensor {
            gyro: gyro.finish(units(Sensor::Gyro)),
            accel: accel.finish(units(Sensor::Accel)),
        };
        let mut faults = self.faults;
        let order = |fault: &Fault| {
            let axis = fault.axis.map(|(sensor, axis)| (sensor as usize, axis));
            (fault.kind as usize, axis, fault.samples.start)
        };
        faults.sort_unstable_by_key(order);
        faults.shrink_to_fit();
        // What goes on in the next part is one.
        faults.dedup_by(|next, fault| {
            let goes_on = next.kind == fault.kind
                && next.axis == fault.axis
                && next.kind != FaultKind::Duplicate
                && next.kind != FaultKind::Missing
                && next.samples.start == fault.samples.end;
            if goes_on {
                fault.samples.end = next.samples.end;
                fault.bridged &= next.bridged;
            }
            goes_on
        });
        let mut bridges = self.bridges;
        Bridge::sort(&mut bridges);
        bridges.shrink_to_fit();
        let samples = match self.even {
            Some(_) => packed.gyro.len(),
            None => self.next,
        };
        Ok(Whole {
            read: Read {
                clock,
                facts,
                rows: self.rows + duplicates,
                faults,
                bridges,
                error,
            },
            packed,
            samples,
            missing: self.next - self.rows,
        })
    }
}

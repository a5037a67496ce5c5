//! Descriptions of faults.

use super::{Fault, FaultKind, Slower};
use crate::recording::ImuSamples;

/// One sentence per part that was recorded at a lower rate, and one per kind of fault elsewhere.
pub fn notes(imu: &ImuSamples) -> Vec<String> {
    let slower = imu.slower();
    let is_beside = |fault: &&Fault| !slower.iter().any(|part| part.holds(fault));
    let note = |kind| {
        let faults: Vec<&Fault> = imu
            .faults
            .iter()
            .filter(|fault| fault.kind == kind)
            .filter(is_beside)
            .collect();
        let first = faults.iter().min_by_key(|fault| fault.samples.start)?;
        let count: usize = faults.iter().map(|fault| fault.samples.len()).sum();
        let what = imu.what(kind, faults.iter().copied(), count);
        let unbridged = faults.iter().filter(|fault| !fault.bridged).count();
        let done = if kind == FaultKind::Duplicate {
            "turncal dropped the duplicates.".to_owned()
        } else if unbridged == 0 {
            "turncal interpolated these samples, and the σ include the interpolation error."
                .to_owned()
        } else {
            format!(
                "{unbridged} of {} faults are too long to bridge, so attitude and velocity restart after them.",
                faults.len()
            )
        };
        let place = if kind == FaultKind::Missing {
            "after"
        } else {
            "in"
        };
        let centiseconds = (100.0 * imu.time(first.samples.start)).round();
        // Without the sign of a rounded negative time.
        let time = centiseconds / 100.0 + 0.0;
        Some(format!(
            "{what} (first {place} line {}, {time:.2} s): {done}",
            first.line
        ))
    };
    let of_parts = slower.iter().map(|part| imu.of_rate(part));
    of_parts
        .chain(FaultKind::ALL.into_iter().filter_map(note))
        .collect()
}

impl ImuSamples {
    /// A sentence on a part with a lower rate: its rate and its treatment.
    fn of_rate(&self, part: &Slower) -> String {
        let [from, to] = [part.samples.start, part.samples.end].map(|k| self.time(k));
        let [usual, step] = [1, part.step].map(|samples| 1e3 * self.period * samples as f64);
        let done = match part.places - part.bridged {
            0 => "turncal interpolated the missing samples, and the σ include the interpolation error."
                .to_owned(),
            unbridged => format!(
                "turncal interpolated the missing samples, but attitude and velocity restart in {unbridged} of {} \
                 places, so dwells and moves are lost. Split the log where its rate changes, and calibrate the parts \
                 together as a campaign.",
                part.places
            ),
        };
        format!(
            "From line {} ({from:.2} s) to {to:.2} s, the interval between rows is {step:.3} ms instead of {usual:.3} \
             ms: {done}",
            part.line
        )
    }

    /// The number of rows or samples, the columns of samples, and their fault.
    fn what<'a>(
        &self,
        kind: FaultKind,
        faults: impl IntoIterator<Item = &'a Fault>,
        count: usize,
    ) -> String {
        let are = if count == 1 { "is" } else { "are" };
        let plural = if count == 1 { "" } else { "s" };
        let said = match kind {
            FaultKind::Duplicate => "duplicated",
            FaultKind::Spike if count == 1 => "a spike",
            FaultKind::Spike => "spikes",
            FaultKind::Zero => {
                "zero in all columns, which is impossible for accelerometers in a gravity field"
            }
            FaultKind::Beyond => "beyond the range of any instrument at the nominal scale",
            FaultKind::Missing | FaultKind::Saturated | FaultKind::Stuck => kind.name(),
        };
        let mut columns: Vec<&str> = Vec::new();
        for (sensor, axis) in faults.into_iter().filter_map(|fault| fault.axis) {
            let column = self.log.as_ref().map(|log| &log.columns.get(sensor)[axis]);
            columns.extend(column.map(|column| column.name.as_str()));
        }
        columns.dedup();
        if columns.is_empty() {
            format!("{count} row{plural} {are} {said}")
        } else {
            let columns = columns.join("`, `");
            format!("{count} sample{plural} of `{columns}` {are} {said}")
        }
    }
}

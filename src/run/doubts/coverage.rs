//! A table log that does not cover the IMU's log.

use crate::recording::nanoseconds;
use crate::run::Run;

/// Reports a table log that starts after the IMU's, or ends before it, by more than its longest pause. Outside it,
/// the table may have moved unobserved.
pub fn coverage(run: &Run) -> Option<String> {
    let table = run.recording.table.as_ref()?;
    let (first, last) = (*table.time.first()?, *table.time.last()?);
    let pauses = table.time.windows(2).map(|pair| pair[1] - pair[0]);
    let longest = pauses.fold(0.0, f64::max) + run.recording.imu.period;
    let (start, end) = (run.recording.imu.start(), run.recording.imu.end());
    let late = (first - start > longest).then(|| format!("begins {:.1} s after", first - start));
    let early = (end - last > longest).then(|| format!("ends {:.1} s before", end - last));
    let off: Vec<String> = [late, early].into_iter().flatten().collect();
    let [first, last, start, end] = [first, last, start, end].map(nanoseconds);
    (!off.is_empty()).then(|| {
        format!(
            "The table log ({first}–{last} s) {} the IMU log ({start}–{end} s). The rest of the IMU log cannot be \
             used. Check that both are of one run and one clock.",
            off.join(" and ")
        )
    })
}

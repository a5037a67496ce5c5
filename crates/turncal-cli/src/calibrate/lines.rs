//! Lines that arrive from a pipe or a device, without those that are not rows of the log.

use std::mem;

use super::continued::Continued;
use turncal_logs::csv_file::{RowKind, is_remark};

/// Maximum number of bytes kept without a line end, for example from a device at the wrong baud rate.
const LONGEST_LINE: usize = 4096;
/// Number of consecutive rows of one kind that define the kind of all rows.
const ALIKE: usize = 8;
/// Maximum number of lines held back until the kind of the rows is known.
const MOST_HELD: usize = 64;
/// Maximum number of omitted lines that are described.
const MOST_NAMED: usize = 5;

/// Reason for omitting the first line of a device.
const CUT: &str = "the first line may be only the end of a row";

/// Holds back the first lines until several rows have the same layout; from then on, keeps only rows with this layout.
#[derive(Default)]
pub struct Lines {
    begin_anywhere: bool,
    /// Whether the next line may be only the end of a row.
    is_cut: bool,
    continued: Option<Continued>,
    kind: Option<RowKind>,
    pending: Vec<u8>,
    /// First lines.
    held: Vec<Vec<u8>>,
    /// Number of lines received.
    number: usize,
    pub left_out: LeftOut,
}

/// Lines that are left out.
#[derive(Default)]
pub struct LeftOut {
    pub count: usize,
    /// The first lines that are left out, each with its number in the order of arrival and the reason.
    pub named: Vec<String>,
}

impl LeftOut {
    /// Number of lines that are left out, with the reasons for the first ones; `None` if no line is left out.
    pub fn text(&self) -> Option<String> {
        let mut named = self.named.join("; ");
        if self.count > self.named.len() {
            named += "; …";
        }
        (self.count > 0).then(|| format!("incomplete lines left out: {} ({named})", self.count))
    }

    fn add(&mut self, number: usize, why: &str) {
        self.count += 1;
        if self.named.len() < MOST_NAMED {
            self.named.push(format!("line {number}: {why}"));
        }
    }
}

impl Lines {
    /// The first line from a device that does not wait for a reader may be incomplete.
    pub fn new(begin_anywhere: bool, continued: Option<Continued>) -> Self {
        Self {
            begin_anywhere,
            is_cut: begin_anywhere,
            continued,
            ..Self::default()
        }
    }

    /// Adds bytes; returns the bytes to keep.
    ///
    /// # Errors
    /// Returns an error if the rows do not continue those of the file.
    pub fn push(&mut self, bytes: &[u8]) -> anyhow::Result<Vec<u8>> {
        let mut kept = Vec::new();
        for part in bytes.split_inclusive(|byte| *byte == b'\n') {
            self.pending.extend(part);
            if part.ends_with(b"\n") || self.pending.len() > LONGEST_LINE {
                let line = mem::take(&mut self.pending);
                self.take(line, &mut kept)?;
            }
        }
        Ok(kept)
    }

    /// Must be called when the device has disappeared, because its last row is then incomplete.
    pub fn interrupt(&mut self) {
        self.is_cut = self.begin_anywhere;
        if !self.pending.is_empty() {
            self.pending.clear();
            self.number += 1;
            self.left_out.add(self.number, "incomplete");
        }
    }

    /// The remaining bytes to keep.
    ///
    /// # Errors
    /// Returns an error if the rows do not continue those of the file.
    pub fn end(&mut self) -> anyhow::Result<Vec<u8>> {
        let mut rest = Vec::new();
        if !self.pending.is_empty() {
            let line = mem::take(&mut self.pending);
            self.take(line, &mut rest)?;
        }
        self.release(None, &mut rest)?;
        Ok(rest)
    }

    fn take(&mut self, line: Vec<u8>, kept: &mut Vec<u8>) -> anyhow::Result<()> {
        self.number += 1;
        if let Some(kind) = &self.kind {
            match kind.check(&line) {
                _ if mem::take(&mut self.is_cut) => self.left_out.add(self.number, CUT),
                Err(why) if !is_remark(&line) => self.left_out.add(self.number, &why),
                _ => kept.extend(line),
            }
            return Ok(());
        }
        let is_endless = !line.ends_with(b"\n");
        self.held.push(line);
        let mut last = self.held.iter().rev().filter(|line| !is_remark(line));
        let kind = last.next().and_then(|line| RowKind::of(line));
        let is_alike = |kind: &RowKind| {
            let others: Vec<_> = last.take(ALIKE - 1).collect();
            others.len() == ALIKE - 1 && others.iter().all(|line| kind.check(line).is_ok())
        };
        match kind.filter(is_alike) {
            Some(kind) => self.release(Some(kind), kept),
            None if is_endless || self.held.len() >= MOST_HELD => self.release(None, kept),
            None => Ok(()),
        }
    }

    /// Keeps the lines held so far: all of them if their kind is not known, otherwise the names with the rows below
    /// them and, of a pipe or file, the preamble.
    fn release(&mut self, kind: Option<RowKind>, kept: &mut Vec<u8>) -> anyhow::Result<()> {
        let held = mem::take(&mut self.held);
        let kind = match &self.continued {
            Some(continued) => {
                continued.check(&held)?;
                Some(continued.kind.clone())
            }
            None => kind,
        };
        let Some(kind) = kind else {
            kept.extend(held.concat());
            return Ok(());
        };
        let is_first = self.continued.is_none();
        let names = held
            .iter()
            .rposition(|line| is_first && kind.is_names(line));
        let below = names.map_or(0, |names| names + 1);
        let first = (below..held.len()).find(|&k| kind.check(&held[k]).is_ok());
        let before = self.number - held.len();
        let is_cut = mem::take(&mut self.is_cut);
        for (k, line) in held.into_iter().enumerate() {
            let is_above = is_first && first.is_none_or(|first| k < first);
            let wrong = match kind.check(&line) {
                _ if is_remark(&line) || is_above && kind.is_names(&line) => None,
                _ if is_cut && k == 0 => Some(CUT.to_owned()),
                Ok(()) => is_above.then(|| "a row above the column names".to_owned()),
                Err(why) => (!is_above || self.begin_anywhere).then_some(why),
            };
            match wrong {
                Some(why) => self.left_out.add(before + k + 1, &why),
                None => kept.extend(line),
            }
        }
        self.kind = Some(kind);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines kept of these bytes if they arrive one by one, and the first reasons for omitting the others.
    fn kept(begin_anywhere: bool, bytes: &str) -> (String, Vec<String>) {
        let mut lines = Lines::new(begin_anywhere, None);
        let bytes = bytes.as_bytes().chunks(1);
        let mut kept: Vec<u8> = bytes.flat_map(|byte| lines.push(byte).unwrap()).collect();
        kept.extend(lines.end().unwrap());
        (String::from_utf8(kept).unwrap(), lines.left_out.named)
    }

    /// Rows from one number to another.
    fn rows(numbers: std::ops::Range<u32>) -> String {
        numbers.map(|k| format!("{k},0.5,-1e-3\n")).collect()
    }

    #[test]
    fn every_byte_of_complete_lines_is_kept() {
        for text in [
            "t,a,b\n1,2,3\n2,3,4\n3,4",
            "1 2\r\n3 4\r\n",
            "no end of line",
            "",
            "# made\nt a\n1 2\n",
            &format!(
                "rate,100\nt,a,b\ns,,\n{}# note\n\n{}",
                rows(0..20),
                rows(20..30)
            ),
            &"1;10:00:00.5;nan;2,5;\n2;10:00:01.0;;2,5;ok\n".repeat(20),
        ] {
            assert_eq!(kept(false, text), (text.to_owned(), vec![]));
        }
        let noise = "x".repeat(2 * LONGEST_LINE);
        assert_eq!(kept(true, &noise).0, noise);
    }

    #[test]
    fn lines_that_are_no_rows_are_left_out_and_named_with_what_is_wrong() {
        for (line, why) in [
            ("9,0.5,-1p-3", "found `-1p-3` in field 3, expected a number"),
            ("9,inf,-1e-3", "found `inf` in field 2, expected a number"),
            ("9,0.5", "found 2 as the number of fields, expected 3"),
            (
                "9,0.59,0.5,-1e-3",
                "found 4 as the number of fields, expected 3",
            ),
            ("MPU ready", "found 1 as the number of fields, expected 3"),
            (
                "9,0.5,-1e\0-3",
                "found `-1e\0-3` in field 3, expected a number",
            ),
        ] {
            for (before, after) in [(0, 20), (2, 20), (20, 40)] {
                let text = format!("t,a,b\n{}{line}\n{}", rows(0..before), rows(before..after));
                let (kept, named) = kept(before == 0, &text);
                assert_eq!(kept, format!("t,a,b\n{}", rows(0..after)), "{line}");
                assert_eq!(named, [format!("line {}: {why}", before + 2)]);
            }
        }
    }

    #[test]
    fn names_are_kept_once() {
        let text = format!("t,a,b\n{}t,a,b\n{}", rows(0..20), rows(20..40));
        let (kept, named) = kept(false, &text);
        assert_eq!(kept, format!("t,a,b\n{}", rows(0..40)));
        assert_eq!(named, ["line 22: found `t` in field 1, expected a number"]);
    }

    #[test]
    fn rows_from_before_a_reset_do_not_stand_above_the_names() {
        let text = format!("7,0.5\n{}boot\nt,a,b\n{}", rows(4..6), rows(0..20));
        let (kept, named) = kept(true, &text);
        assert_eq!(kept, format!("t,a,b\n{}", rows(0..20)));
        assert_eq!(named.len(), 4, "{named:?}");
    }

    #[test]
    fn a_device_that_goes_within_a_row_and_comes_within_another_loses_both() {
        let mut lines = Lines::new(true, None);
        let mut kept = lines
            .push(format!("t,a,b\n{}20,0.", rows(0..20)).as_bytes())
            .unwrap();
        lines.interrupt();
        // The end of 22,0.5,-1e-3.
        kept.extend(lines.push(b"2,0.5,-1e-3\n").unwrap());
        kept.extend(lines.push(rows(23..30).as_bytes()).unwrap());
        let rows = format!("t,a,b\n{}{}", rows(0..20), rows(23..30));
        assert_eq!(String::from_utf8(kept).unwrap(), rows);
        assert_eq!(lines.left_out.count, 2);
    }
}

//! Lines of a pipe or a device as they arrive, without incomplete ones.

/// Bytes without the end of a line that are kept nevertheless, such as those of a device at the wrong baud rate.
const LONGEST_LINE: usize = 4096;

/// Holds each line until the next one shows that it is complete: one that has another number of fields than both its
/// neighbours is not.
#[derive(Default)]
pub struct Lines {
    begin_anywhere: bool,
    pending: Vec<u8>,
    held: Option<Vec<u8>>,
    /// Number of fields of the line before the held one.
    before: Option<usize>,
    /// Number of incomplete lines so far.
    pub incomplete: usize,
}

impl Lines {
    /// The first line may be the end of a row if the device does not wait for a reader.
    pub fn new(begin_anywhere: bool) -> Self {
        Self {
            begin_anywhere,
            ..Self::default()
        }
    }

    /// Adds bytes; returns those of complete lines.
    pub fn push(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut complete = Vec::new();
        for part in bytes.split_inclusive(|byte| *byte == b'\n') {
            self.pending.extend(part);
            if part.ends_with(b"\n") {
                let line = std::mem::take(&mut self.pending);
                self.take(line, &mut complete);
            } else if self.pending.len() > LONGEST_LINE {
                complete.extend(self.end());
            }
        }
        complete
    }

    /// The device is gone: its last row is incomplete.
    pub fn interrupt(&mut self) {
        self.incomplete += usize::from(!self.pending.is_empty());
        self.pending.clear();
    }

    /// The rest.
    pub fn end(&mut self) -> Vec<u8> {
        let mut rest = self.held.take().unwrap_or_default();
        rest.append(&mut self.pending);
        rest
    }

    fn take(&mut self, line: Vec<u8>, complete: &mut Vec<u8>) {
        let next = fields(&line);
        if let Some(held) = self.held.replace(line) {
            let own = fields(&held);
            let is_odd = own != next && self.before.map_or(self.begin_anywhere, |of| of == next);
            if is_odd {
                self.incomplete += 1;
            } else {
                self.before = Some(own);
                complete.extend(held);
            }
        }
    }
}

fn fields(line: &[u8]) -> usize {
    let parts = line.split(|byte| b",;\t \r\n".contains(byte));
    parts.filter(|part| !part.is_empty()).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines kept of these bytes, which arrive one by one, and the number of incomplete ones.
    fn kept(begin_anywhere: bool, bytes: &str) -> (String, usize) {
        let mut lines = Lines::new(begin_anywhere);
        let bytes = bytes.as_bytes();
        let mut kept: Vec<u8> = bytes.chunks(1).flat_map(|byte| lines.push(byte)).collect();
        kept.extend(lines.end());
        (String::from_utf8(kept).unwrap(), lines.incomplete)
    }

    #[test]
    fn every_byte_of_complete_lines_is_kept() {
        for text in [
            "t,a,b\n1,2,3\n2,3,4\n3,4",
            "1 2\r\n3 4\r\n",
            "no end of line",
            "",
            "# made\nt a\n1 2\n",
        ] {
            assert_eq!(kept(false, text), (text.to_owned(), 0));
        }
        let noise = "x".repeat(2 * LONGEST_LINE);
        assert_eq!(kept(true, &noise).0, noise);
    }

    #[test]
    fn a_line_unlike_both_its_neighbours_is_left_out() {
        let lost_byte = kept(false, "1,2,3\n1,2,3\n1,23\n1,2,3\n");
        assert_eq!(lost_byte, ("1,2,3\n1,2,3\n1,2,3\n".to_owned(), 1));
        let begun_within = kept(true, "3\n1,2,3\n1,2,3\n");
        assert_eq!(begun_within, ("1,2,3\n1,2,3\n".to_owned(), 1));
        // Another format from some line on.
        assert_eq!(kept(false, "1,2\n1,2\n1,2,3\n1,2,3\n").1, 0);
    }

    #[test]
    fn a_device_that_goes_within_a_row_and_comes_within_another_loses_both() {
        let mut lines = Lines::default();
        let mut kept = lines.push(b"1,2,3\n4,5,6\n7,8");
        lines.interrupt();
        kept.extend(lines.push(b"2\n1,2,3\n4,5,6\n"));
        kept.extend(lines.end());
        assert_eq!(kept, b"1,2,3\n4,5,6\n1,2,3\n4,5,6\n");
        assert_eq!(lines.incomplete, 2);
    }
}

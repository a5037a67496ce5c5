//! Rows in memory.

use turncal_logs::clock::REACH;

/// Limits for the number of rows kept in memory.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    /// Longer logs are packed; a log of up to this length takes at most 50 MB.
    pub long: usize,
    /// Number of rows that are searched for faults at once.
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

/// The rows in memory, without duplicates.
#[derive(Default)]
pub struct Held {
    pub columns: [Vec<f64>; 6],
    /// For each duplicate row, the number of rows before it and its line in the file.
    pub duplicates: Vec<(usize, u64)>,
}

impl Held {
    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    pub fn row(&self, row: usize) -> [f64; 6] {
        self.columns.each_ref().map(|column| column[row])
    }

    pub fn insert(&mut self, place: usize, row: [f64; 6]) {
        // Late rows belong after one of the last rows.
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

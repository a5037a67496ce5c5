//! Arrays of a file, combined into streams and read row by row.
//!
//! Arrays with the same number of rows form one stream; an array of several columns gives `name[0]`, `name[1]`, …

use std::io::{self, Read};
use std::rc::Rc;

use super::bytes::{Broken, Kind};
use super::{Column, Log, Stream};

/// Limits per row; arrays with more columns or bytes are pictures or matrices rather than samples.
const MOST_COLUMNS: usize = 256;
const LONGEST_ROW: usize = 1 << 16;

/// The bytes of an array, starting at an offset.
pub type Open = Box<dyn Fn(u64) -> io::Result<Box<dyn Read>>>;

/// An array of items of the same size.
pub struct Array {
    pub shape: Vec<usize>,
    /// Whether the first or the last dimension varies fastest.
    pub first_is_fastest: bool,
    /// Bytes of an item, and the numbers in it.
    pub size: usize,
    pub fields: Vec<Field>,
    pub open: Open,
    /// Offset in the file.
    pub offset: u64,
}

/// A number in each item of an array.
#[derive(Clone)]
pub struct Field {
    pub name: String,
    pub kind: Kind,
    pub big_endian: bool,
    /// Number of bytes in the item before the number.
    pub place: usize,
}

impl Array {
    /// Number of items; `None` if it is too large.
    fn items(&self) -> Option<usize> {
        let mut sizes = self.shape.iter();
        sizes.try_fold(1usize, |all, &size| all.checked_mul(size))
    }

    /// The field, if the items of the array fit into this many bytes.
    pub fn within(self, bytes: u64, name: &str) -> Result<Self, Broken> {
        let needed = self.items().and_then(|all| all.checked_mul(self.size));
        if needed.is_some_and(|needed| needed as u64 <= bytes) {
            return Ok(self);
        }
        Err(Broken::new(
            self.offset,
            format_args!("{bytes} bytes in the array `{name}`"),
            format_args!("items of {} bytes in the shape {:?}", self.size, self.shape),
        ))
    }

    /// Columns with their layout: the longest dimension (the first of equal ones) gives the rows.
    fn cursors(self) -> Vec<Cursor> {
        let rows = self.shape.iter().copied().max().unwrap_or(1);
        let columns = self
            .items()
            .filter(|_| rows > 1)
            .map_or(0, |all| all / rows);
        let numbers = columns.saturating_mul(self.fields.len());
        let length = columns.saturating_mul(self.size);
        if numbers == 0 || numbers > MOST_COLUMNS || length > LONGEST_ROW {
            return Vec::new();
        }
        let strides = self.strides();
        let along = self
            .shape
            .iter()
            .position(|&size| size == rows)
            .unwrap_or(0);
        let step = strides.get(along).copied().unwrap_or(1);
        let across: Vec<usize> = (0..self.shape.len()).filter(|&k| k != along).collect();
        let first = |mut index: usize| {
            let mut item = 0;
            for &dimension in across.iter().rev() {
                item += (index % self.shape[dimension]) * strides[dimension];
                index /= self.shape[dimension];
            }
            item
        };
        let cell = |field: &Field, index: usize, item: usize| Field {
            name: match columns {
                1 => field.name.clone(),
                _ => format!("{}[{index}]", field.name),
            },
            place: field.place + item * self.size,
            ..field.clone()
        };
        let open = Rc::new(self.open);
        let cursor = |skip: usize, items: usize, cells: Vec<Field>| Cursor {
            open: open.clone(),
            source: None,
            begin: (skip * self.size) as u64,
            row: vec![0; items * self.size],
            stride: (step * self.size) as u64,
            rows,
            next: 0,
            cells,
            offset: self.offset,
        };
        if step == columns {
            // The numbers of a row are adjacent.
            let of_field = |field| (0..columns).map(move |index| (field, index));
            let cells = self.fields.iter().flat_map(of_field);
            let cells = cells.map(|(field, index)| cell(field, index, first(index)));
            return vec![cursor(0, columns, cells.collect())];
        }
        let each = (0..columns).map(|index| {
            let cells = self.fields.iter().map(|field| cell(field, index, 0));
            cursor(first(index), 1, cells.collect())
        });
        each.collect()
    }

    /// Distance, in items, between neighbours along each dimension.
    fn strides(&self) -> Vec<usize> {
        let mut strides = vec![1; self.shape.len()];
        let mut stride = 1;
        for k in 0..self.shape.len() {
            let dimension = if self.first_is_fastest {
                k
            } else {
                self.shape.len() - 1 - k
            };
            strides[dimension] = stride;
            stride *= self.shape[dimension];
        }
        strides
    }
}

/// Columns read together, row by row.
struct Cursor {
    open: Rc<Open>,
    source: Option<Box<dyn Read>>,
    /// Bytes before the first row.
    begin: u64,
    /// The bytes of the last row read.
    row: Vec<u8>,
    /// Bytes between rows.
    stride: u64,
    rows: usize,
    /// Number of the row after the last row read.
    next: usize,
    cells: Vec<Field>,
    offset: u64,
}

impl Cursor {
    fn read(&mut self, row: usize) -> io::Result<()> {
        if row < self.next {
            return Ok(());
        }
        if self.source.is_none() {
            self.source = Some((self.open)(self.begin)?);
        }
        let Some(source) = &mut self.source else {
            return Ok(());
        };
        let gap = match self.next {
            0 => 0,
            _ => self.stride - self.row.len() as u64,
        };
        let passed = (row - self.next) as u64 * self.stride + gap;
        if io::copy(&mut source.take(passed), &mut io::sink())? < passed {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        source.read_exact(&mut self.row)?;
        self.next = row + 1;
        Ok(())
    }

    /// Bytes from the start of a number of the last row.
    fn bytes(&self, cell: &Field) -> &[u8] {
        self.row.get(cell.place..).unwrap_or_default()
    }

    /// Reads the remaining rows, so that damage in them is found.
    fn finish(&mut self) -> io::Result<()> {
        if self.next < self.rows {
            self.read(self.rows - 1)?;
        }
        match self.source.take() {
            Some(mut source) => io::copy(&mut source, &mut io::sink()).map(|_| ()),
            None => Ok(()),
        }
    }

    fn broken(&self, error: io::Error) -> Broken {
        let name = &self.cells[0].name;
        Broken::new(
            self.offset,
            format_args!("`{name}`: {error}"),
            format_args!("an array of {} rows", self.rows),
        )
    }
}

/// Columns of a file; columns of the same length form one stream, row by row.
pub struct Arrays {
    streams: Vec<Stream>,
    groups: Vec<Vec<Cursor>>,
    at: Option<(usize, usize)>,
}

impl Arrays {
    pub fn new(arrays: Vec<Array>) -> Self {
        let mut groups: Vec<Vec<Cursor>> = Vec::new();
        for cursor in arrays.into_iter().flat_map(Array::cursors) {
            match groups.iter_mut().find(|group| group[0].rows == cursor.rows) {
                Some(group) => group.push(cursor),
                None => groups.push(vec![cursor]),
            }
        }
        let stream = |group: &Vec<Cursor>| {
            let cells = || group.iter().flat_map(|cursor| &cursor.cells);
            let first = &group[0].cells[0].name;
            let end = first.rfind('[').filter(|_| first.ends_with(']'));
            Stream {
                name: first[..end.unwrap_or(first.len())].to_owned(),
                columns: cells().map(|cell| Column::new(&cell.name, "")).collect(),
                is_inertial: true,
                ..Stream::default()
            }
        };
        Self {
            streams: groups.iter().map(stream).collect(),
            groups,
            at: None,
        }
    }

    /// Adds remarks to all streams.
    pub fn with_remarks(mut self, remarks: &[String]) -> Self {
        for stream in &mut self.streams {
            stream.remarks.extend_from_slice(remarks);
        }
        self
    }
}

impl Log for Arrays {
    fn streams(&self) -> &[Stream] {
        &self.streams
    }

    fn advance(&mut self) -> Result<Option<usize>, Broken> {
        let (stream, row) = self.at.map_or((0, 0), |(stream, row)| (stream, row + 1));
        self.at = Some((stream, row));
        let Some(group) = self.groups.get_mut(stream) else {
            return Ok(None);
        };
        if row < group[0].rows {
            return Ok(Some(stream));
        }
        for cursor in group {
            cursor.finish().map_err(|error| cursor.broken(error))?;
        }
        self.at = Some((stream + 1, 0));
        Ok((stream + 1 < self.groups.len()).then_some(stream + 1))
    }

    fn values(&mut self, values: &mut Vec<f64>) -> Result<(), Broken> {
        values.clear();
        let Some((stream, row)) = self.at else {
            return Ok(());
        };
        for cursor in self.groups.get_mut(stream).into_iter().flatten() {
            cursor.read(row).map_err(|error| cursor.broken(error))?;
            let number = |cell: &Field| cell.kind.number(cursor.bytes(cell), cell.big_endian);
            values.extend(
                cursor
                    .cells
                    .iter()
                    .map(|cell| number(cell).unwrap_or(f64::NAN)),
            );
        }
        Ok(())
    }

    fn whole(&self, column: usize) -> Option<i128> {
        let group = self.groups.get(self.at?.0)?;
        let mut cells =
            (group.iter()).flat_map(|cursor| cursor.cells.iter().map(move |cell| (cursor, cell)));
        let (cursor, cell) = cells.nth(column)?;
        cell.kind.whole(cursor.bytes(cell), cell.big_endian)
    }

    fn offset(&self) -> u64 {
        let group = self.at.and_then(|(stream, _)| self.groups.get(stream));
        group.map_or(0, |group| group[0].offset)
    }
}

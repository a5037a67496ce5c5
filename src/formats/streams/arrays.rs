//! Arrays of a file, put together to streams.

use super::bytes::Broken;
use super::{Column, Log, Stream};

/// As many columns as a sheet has.
const MOST_COLUMNS: usize = 16_384;

/// One column of numbers.
pub(super) struct Array {
    pub name: String,
    pub values: Vec<f64>,
    /// Where it begins in the file, and bytes from row to row.
    pub offset: u64,
}

/// The columns of an array of several dimensions; the longest one, of equal ones the first, counts rows.
///
/// `number` gives the value at an index into the array, whose first dimension varies fastest if `first_is_fastest`.
pub(super) fn columns(
    name: &str,
    shape: &[usize],
    first_is_fastest: bool,
    offset: u64,
    number: impl Fn(usize) -> Option<f64>,
) -> Result<Vec<Array>, Broken> {
    let rows = shape.iter().copied().max().unwrap_or(1);
    let along = shape.iter().position(|&size| size == rows).unwrap_or(0);
    let all = shape
        .iter()
        .try_fold(1usize, |all, &size| all.checked_mul(size));
    let count = match (all, rows) {
        (Some(all), 1..) => all / rows,
        _ => 0,
    };
    if count > MOST_COLUMNS {
        return Err(Broken::new(
            offset,
            format_args!("an array `{name}` of {count} columns"),
            format_args!("at most {MOST_COLUMNS}"),
        ));
    }
    // Strides in items.
    let mut strides = vec![1; shape.len()];
    let order: Vec<usize> = match first_is_fastest {
        true => (0..shape.len()).collect(),
        false => (0..shape.len()).rev().collect(),
    };
    let mut stride = 1usize;
    for &dimension in &order {
        strides[dimension] = stride;
        stride = stride.saturating_mul(shape[dimension]);
    }
    let across: Vec<usize> = (0..shape.len()).filter(|&k| k != along).collect();
    let step = strides.get(along).copied().unwrap_or(1);
    let column = |index: usize| {
        let (mut rest, mut first) = (index, 0);
        for &dimension in across.iter().rev() {
            first += (rest % shape[dimension]) * strides[dimension];
            rest /= shape[dimension];
        }
        let values = (0..rows).map(|row| number(first + row * step));
        let values: Option<Vec<f64>> = values.collect();
        values.map(|values| Array {
            name: match count {
                1 => name.to_owned(),
                _ => format!("{name}[{index}]"),
            },
            values,
            offset,
        })
    };
    let columns: Option<Vec<Array>> = (0..count).map(column).collect();
    columns.ok_or_else(|| {
        Broken::new(
            offset,
            format_args!("fewer numbers in the array `{name}` than its shape {shape:?} has"),
            "all of them",
        )
    })
}

/// Columns of a file; those of the same length are one stream, row by row.
pub(super) struct Arrays {
    streams: Vec<Stream>,
    arrays: Vec<Vec<Array>>,
    at: Option<(usize, usize)>,
}

impl Arrays {
    pub fn new(arrays: Vec<Array>) -> Self {
        let mut groups: Vec<Vec<Array>> = Vec::new();
        // A single number is no row.
        for array in arrays.into_iter().filter(|array| array.values.len() > 1) {
            match groups
                .iter_mut()
                .find(|group| group[0].values.len() == array.values.len())
            {
                Some(group) => group.push(array),
                None => groups.push(vec![array]),
            }
        }
        let stream = |group: &Vec<Array>| {
            let first = &group[0].name;
            let end = first.rfind('[').filter(|_| first.ends_with(']'));
            Stream {
                name: first[..end.unwrap_or(first.len())].to_owned(),
                columns: group
                    .iter()
                    .map(|array| Column::new(&array.name, ""))
                    .collect(),
                remarks: Vec::new(),
                is_inertial: true,
                axes: None,
            }
        };
        Self {
            streams: groups.iter().map(stream).collect(),
            arrays: groups,
            at: None,
        }
    }
}

impl Log for Arrays {
    fn streams(&self) -> &[Stream] {
        &self.streams
    }

    fn advance(&mut self) -> Result<Option<usize>, Broken> {
        let (mut stream, mut row) = match self.at {
            None => (0, 0),
            Some((stream, row)) => (stream, row + 1),
        };
        if self
            .arrays
            .get(stream)
            .is_some_and(|group| row >= group[0].values.len())
        {
            (stream, row) = (stream + 1, 0);
        }
        self.at = Some((stream, row));
        Ok((stream < self.arrays.len()).then_some(stream))
    }

    fn values(&mut self, row: &mut Vec<f64>) -> Result<(), Broken> {
        row.clear();
        if let Some((stream, at)) = self.at
            && let Some(group) = self.arrays.get(stream)
        {
            row.extend(group.iter().map(|array| array.values[at]));
        }
        Ok(())
    }

    fn offset(&self) -> u64 {
        let group = self.at.and_then(|(stream, _)| self.arrays.get(stream));
        group.map_or(0, |group| group[0].offset)
    }
}

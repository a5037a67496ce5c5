//! Tables of an SQLite file, row by row: table b-trees with overflow pages.
//!
//! Source: sqlite.org, "Database File Format".

use super::bytes::{Broken, Input, Slice};

const HEADER: usize = 100;
const INTERIOR: u64 = 5;
const LEAF: u64 = 13;
/// Maximum depth of pages; a tree of 2³² pages is less deep.
const DEEPEST: usize = 32;

pub enum Value {
    /// Null, or a real number (which does not occur in the columns read).
    Null,
    Whole(i64),
    Bytes(Vec<u8>),
}

impl Value {
    pub fn whole(&self) -> Option<i64> {
        match self {
            Self::Whole(value) => Some(*value),
            _ => None,
        }
    }

    pub fn text(&self) -> String {
        String::from_utf8_lossy(self.bytes()).into_owned()
    }

    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            _ => &[],
        }
    }
}

/// Reads values by column name.
#[derive(Default)]
pub struct Row {
    columns: Vec<String>,
    values: Vec<Value>,
    /// Offset in the file.
    pub offset: u64,
}

impl Row {
    /// The value in a column; [`Value::Null`] if the table lacks it.
    pub fn get(&self, column: &str) -> &Value {
        let place = self.columns.iter().position(|known| known == column);
        let value = place.and_then(|place| self.values.get(place));
        value.unwrap_or(&Value::Null)
    }
}

/// A position in a table.
pub struct Table {
    columns: Vec<String>,
    /// Pages from the root, each with its next cell.
    pages: Vec<(Page, usize)>,
    /// Remaining number of pages to read, because a damaged tree may contain a loop.
    left: u64,
}

struct Page {
    bytes: Vec<u8>,
    /// Offset in the file, and the offset of its header.
    offset: u64,
    begin: usize,
    is_leaf: bool,
    cells: usize,
}

pub struct Database {
    input: Input,
    page: usize,
    /// Usable bytes of a page.
    usable: usize,
    length: u64,
}

impl Database {
    pub fn open(mut input: Input) -> Result<Self, Broken> {
        let length = input.left();
        let mut bytes = Vec::new();
        input.take(HEADER as u64, &mut bytes, "the header")?;
        let mut header = big_endian(&bytes[16..], 16);
        let page = match header.whole(2, "the page size")? {
            1 => 1 << 16,
            size => size as usize,
        };
        header.take(2, "versions")?;
        let usable = page.saturating_sub(header.whole(1, "reserved bytes")? as usize);
        if !page.is_power_of_two() || usable < 480 {
            let found = format_args!("pages of {page} bytes with {usable} usable bytes");
            return Err(Broken::new(16, found, "pages of 512 to 65536 bytes"));
        }
        Ok(Self {
            input,
            page,
            usable,
            length,
        })
    }

    /// The start of a table; `None` if no table has this name.
    pub fn table(&mut self, name: &str) -> Result<Option<Table>, Broken> {
        let columns = ["type", "name", "tbl_name", "rootpage", "sql"];
        let mut schema = self.begin(1, columns.map(str::to_owned).to_vec())?;
        while let Some(row) = self.next(&mut schema)? {
            if row.get("type").bytes() == b"table" && row.get("name").text() == name {
                let root = row.get("rootpage").whole().unwrap_or(0);
                let columns = columns_of(&row.get("sql").text());
                return self.begin(root as u64, columns).map(Some);
            }
        }
        Ok(None)
    }

    fn begin(&mut self, root: u64, columns: Vec<String>) -> Result<Table, Broken> {
        Ok(Table {
            columns,
            pages: vec![(self.read(root)?, 0)],
            left: self.length / self.page as u64 + 1,
        })
    }

    fn read(&mut self, number: u64) -> Result<Page, Broken> {
        let place = number.checked_sub(1);
        let offset = place.and_then(|place| place.checked_mul(self.page as u64));
        let wrong = |found| Broken::new(self.input.offset(), found, "a table page");
        let offset = offset.filter(|&offset| offset < self.length);
        let offset = offset.ok_or_else(|| wrong(format!("page {number}")))?;
        let mut bytes = Vec::new();
        self.input.go_to(offset)?;
        self.input.take(self.page as u64, &mut bytes, "a page")?;
        let begin = if number == 1 { HEADER } else { 0 };
        let mut header = big_endian(&bytes[begin..], offset);
        let kind = header.whole(1, "the page type")?;
        header.take(2, "a free-block pointer")?;
        let cells = header.whole(2, "the number of cells")? as usize;
        if kind != LEAF && kind != INTERIOR {
            return Err(Broken::new(
                offset,
                format!("a page of type {kind}"),
                "a table page",
            ));
        }
        Ok(Page {
            bytes,
            offset,
            begin,
            is_leaf: kind == LEAF,
            cells,
        })
    }

    /// The next row of a table; `None` at its end.
    pub fn next(&mut self, table: &mut Table) -> Result<Option<Row>, Broken> {
        loop {
            let Some((page, at)) = table.pages.last_mut() else {
                return Ok(None);
            };
            let cell = *at;
            *at += 1;
            if cell < page.cells && page.is_leaf {
                let (offset, mut cell) = (page.offset, page.cell(cell)?);
                let (id, payload) = self.payload(&mut cell)?;
                let values = record(&payload, id, offset)?;
                let columns = table.columns.clone();
                return Ok(Some(Row {
                    columns,
                    values,
                    offset,
                }));
            }
            if page.is_leaf || cell > page.cells {
                table.pages.pop();
                continue;
            }
            let child = if cell < page.cells {
                page.cell(cell)?.whole(4, "a page number")?
            } else {
                // Position after all cells.
                let mut header = big_endian(&page.bytes[page.begin + 8..], page.offset);
                header.whole(4, "a page number")?
            };
            if table.pages.len() > DEEPEST || table.left == 0 {
                let offset = self.input.offset();
                return Err(Broken::new(offset, "a loop of pages", "a tree of pages"));
            }
            table.left -= 1;
            let page = self.read(child)?;
            table.pages.push((page, 0));
        }
    }

    /// Number and content of a row; the content may continue on overflow pages.
    fn payload(&mut self, cell: &mut Slice) -> Result<(i64, Vec<u8>), Broken> {
        let offset = cell.offset();
        let size = varint(cell)?;
        let id = varint(cell)? as i64;
        if size > self.length {
            return Err(Broken::new(
                offset,
                format!("a row of {size} bytes"),
                "a row within the file",
            ));
        }
        let (size, usable) = (size as usize, self.usable);
        let (most, least) = (usable - 35, (usable - 12) * 32 / 255 - 23);
        let fits = least + size.saturating_sub(least) % (usable - 4);
        let local = match size <= most {
            true => size,
            false if fits <= most => fits,
            false => least,
        };
        let mut payload = cell.take(local, "a row")?.to_vec();
        if local == size {
            return Ok((id, payload));
        }
        let mut next = cell.whole(4, "an overflow page number")?;
        let mut bytes = Vec::new();
        while payload.len() < size {
            let place = next.checked_sub(1).map(|place| place * self.page as u64);
            let place =
                place.ok_or_else(|| Broken::new(offset, "a truncated row", "a complete row"))?;
            self.input.go_to(place)?;
            self.input
                .take(usable as u64, &mut bytes, "an overflow page")?;
            let mut page = big_endian(&bytes, place);
            next = page.whole(4, "an overflow page number")?;
            let part = (size - payload.len()).min(page.left());
            payload.extend(page.take(part, "an overflow page")?);
        }
        Ok((id, payload))
    }
}

impl Page {
    fn cell(&self, number: usize) -> Result<Slice<'_>, Broken> {
        let pointers = self.begin + if self.is_leaf { 8 } else { 12 };
        let pointer = self.bytes.get(pointers + 2 * number..).unwrap_or_default();
        let place = big_endian(pointer, self.offset).whole(2, "a cell pointer")? as usize;
        let cell = self.bytes.get(place..).ok_or_else(|| {
            let found = format!("a cell at byte {place} of a page");
            Broken::new(self.offset, found, "a position within the page")
        })?;
        Ok(big_endian(cell, self.offset + place as u64))
    }
}

fn big_endian(bytes: &[u8], offset: u64) -> Slice<'_> {
    Slice::new(bytes, offset).in_order(true)
}

/// A variable-length integer: seven bits per byte, most significant first; the ninth byte has eight.
fn varint(slice: &mut Slice) -> Result<u64, Broken> {
    let mut value = 0;
    for byte in 0..9 {
        let next = slice.whole(1, "a number")?;
        if byte == 8 {
            return Ok(value << 8 | next);
        }
        value = value << 7 | next & 0x7f;
        if next < 0x80 {
            break;
        }
    }
    Ok(value)
}

/// The values of a row; its number replaces an omitted one.
fn record(payload: &[u8], id: i64, offset: u64) -> Result<Vec<Value>, Broken> {
    let mut values = Slice::packed(payload, offset).in_order(true);
    let head = varint(&mut values)? as usize;
    let begin = values.position();
    let types = values.take(head.saturating_sub(begin), "the column types of a row")?;
    let mut types = Slice::packed(types, offset);
    let mut row = Vec::new();
    while types.left() > 0 {
        row.push(match varint(&mut types)? {
            0 => Value::Whole(id),
            kind @ 1..=6 => {
                let size = [1, 2, 3, 4, 6, 8][kind as usize - 1];
                let unused = 64 - 8 * size as u32;
                let whole = values.whole(size, "a number")?;
                Value::Whole((whole << unused) as i64 >> unused)
            }
            7 => {
                values.take(8, "a number")?;
                Value::Null
            }
            kind @ 8..=9 => Value::Whole(kind as i64 - 8),
            kind => {
                let size = usize::try_from(kind.saturating_sub(12) / 2).unwrap_or(usize::MAX);
                Value::Bytes(values.take(size, "a value")?.to_vec())
            }
        });
    }
    Ok(row)
}

/// Column names of a table, from its CREATE statement.
fn columns_of(sql: &str) -> Vec<String> {
    let (_, columns) = sql.split_once('(').unwrap_or_default();
    let names = columns
        .split(',')
        .filter_map(|column| column.split_whitespace().next());
    names
        .map(|name| name.trim_matches(['"', '`', '[', ']']).to_owned())
        .collect()
}

//! A structure for MATLAB, as a MAT file of version 5: every value with its σ, ready to use.
//!
//! Source: MathWorks, "MAT-File Format", 2023.

use nalgebra::Matrix3;

use super::remarks::{Exported, Remarks, equation, title};
use super::values::Values;
use turncal::calibration::result::{EQUATION, TriadRecord};
use turncal::imu::Sensor;

const INT8: u32 = 1;
const INT32: u32 = 5;
const UINT16: u32 = 4;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;
/// Classes of arrays.
const STRUCT: u32 = 2;
const CHAR: u32 = 4;
const NUMBERS: u32 = 6;
/// Longest field name, with its terminator.
const NAME: usize = 32;

pub fn write(values: &Values) -> Exported {
    let mut fields = vec![
        ("equation", text(EQUATION)),
        ("axes", text("right, front, up")),
        (
            "about",
            text(&(title(values.record) + "; " + &equation(values).join("; "))),
        ),
    ];
    let word = values.record.word().map(|word| word.to_string());
    fields.extend(word.map(|word| ("verdict", text(&word))));
    let triads = Sensor::ALL.into_iter();
    for sensor in triads.filter(|_| !values.record.is_of_magnetometer()) {
        let mut of_triad = triad(values.record.triad(sensor));
        let matrix = values.correction.matrix.get(sensor);
        of_triad.push(("correction", numbers(3, matrix.as_slice())));
        of_triad.push(("unit", text(&values.unit(sensor))));
        if let Some(sigma) = values.sigma(sensor) {
            of_triad.push(("sigma", structure("", &triad(sigma))));
        }
        fields.push((sensor.name(), structure("", &of_triad)));
    }
    if let Some(mag) = &values.record.mag {
        let mut of_mag = magnetometer(&mag.matrix, &mag.bias);
        of_mag.push(("correction", by_columns(&mag.correction)));
        of_mag.push(("unit", text(&mag.unit)));
        of_mag.push(("field_unit", text(&mag.field.unit)));
        if let Some(sigma) = &mag.sigma {
            of_mag.push((
                "sigma",
                structure("", &magnetometer(&sigma.matrix, &sigma.bias)),
            ));
        }
        fields.push(("mag", structure("", &of_mag)));
    }
    // The matrix is symmetric, so rows equal columns.
    let covariance = values.record.covariance.concat();
    let size = values.record.covariance.len();
    fields.push(("covariance", numbers(size, &covariance)));
    fields.push(("parameters", text(&values.record.parameters.join(" "))));
    let mut file = vec![b' '; 124];
    let head = b"MATLAB 5.0 MAT-file, a calibration by turncal";
    file[..head.len()].copy_from_slice(head);
    // No subsystem data.
    file[116..124].fill(0);
    file.extend([0x00, 0x01, b'I', b'M']);
    file.extend(structure("turncal", &fields));
    Remarks::new(values, "", &[]).of_file(file)
}

fn magnetometer(matrix: &[[f64; 3]; 3], bias: &[f64; 3]) -> Vec<(&'static str, Vec<u8>)> {
    vec![("matrix", by_columns(matrix)), ("bias", numbers(3, bias))]
}

/// A matrix that is stored row by row.
fn by_columns(rows: &[[f64; 3]; 3]) -> Vec<u8> {
    numbers(3, Matrix3::from_fn(|i, j| rows[i][j]).as_slice())
}

fn triad(record: &TriadRecord) -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("scale", numbers(3, &record.scale)),
        ("installation", by_columns(&record.installation)),
        ("bias", numbers(3, &record.bias)),
    ]
}

fn bytes<const N: usize>(parts: impl IntoIterator<Item = [u8; N]>) -> Vec<u8> {
    parts.into_iter().flatten().collect()
}

fn element(kind: u32, content: &[u8]) -> Vec<u8> {
    let mut bytes = bytes([kind, content.len() as u32].map(u32::to_le_bytes));
    bytes.extend(content);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// Start of an array: class, size and name.
fn array(class: u32, name: &str, rows: usize, columns: usize, rest: &[u8]) -> Vec<u8> {
    let size = [rows as u32, columns as u32];
    let parts = [
        element(UINT32, &bytes([class, 0].map(u32::to_le_bytes))),
        element(INT32, &bytes(size.map(u32::to_le_bytes))),
        element(INT8, name.as_bytes()),
        rest.to_vec(),
    ];
    element(MATRIX, &parts.concat())
}

/// A matrix with this number of rows, column by column.
fn numbers(rows: usize, values: &[f64]) -> Vec<u8> {
    let bytes = bytes(values.iter().map(|value| value.to_le_bytes()));
    let columns = values.len().checked_div(rows).unwrap_or(0);
    array(NUMBERS, "", rows, columns, &element(DOUBLE, &bytes))
}

fn text(text: &str) -> Vec<u8> {
    let letters = bytes(text.encode_utf16().map(u16::to_le_bytes));
    array(CHAR, "", 1, letters.len() / 2, &element(UINT16, &letters))
}

fn structure(name: &str, fields: &[(&str, Vec<u8>)]) -> Vec<u8> {
    // A short element: its size in the upper half of its type.
    let mut rest = bytes([INT32 | 4 << 16, NAME as u32].map(u32::to_le_bytes));
    let mut names = Vec::new();
    for (field, _) in fields {
        let end = names.len() + NAME;
        names.extend(field.bytes().take(NAME - 1));
        names.resize(end, 0);
    }
    rest.extend(element(INT8, &names));
    fields.iter().for_each(|(_, content)| rest.extend(content));
    array(STRUCT, name, 1, 1, &rest)
}

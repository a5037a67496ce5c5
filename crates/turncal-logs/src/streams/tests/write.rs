//! Small files of every format, by their descriptions.

use std::io::Write;

use flate2::Compression;
use flate2::write::{DeflateEncoder, ZlibEncoder};
use hdf5_pure::FileBuilder;
use hdf5_pure::mat::{MatBuilder, MatClass, Options, StructWriter};

/// Samples of each fixture.
pub const SAMPLES: usize = 40;

/// Time in s, gyros, accelerometers of a sample, all of which 32 bits hold.
pub fn sample(k: usize) -> [f64; 7] {
    let k = k as f64;
    [k / 128.0, k / 8.0, -k / 4.0, 0.5, k / 2.0, -1.5, 9.75]
}

fn text(length: usize, text: &str) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(length, 0);
    bytes
}

/// A length of four bytes, and what it counts.
fn counted(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

pub fn floats(values: &[f64]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|&value| (value as f32).to_le_bytes())
        .collect()
}

fn doubles(values: &[f64]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

pub fn dataflash() -> Vec<u8> {
    let format = |kind: u8, length: u8, name: &str, types: &str, labels: &str| {
        let head = vec![0xa3, 0x95, 0x80, kind, length];
        [head, text(4, name), text(16, types), text(64, labels)].concat()
    };
    let mut file = format(0x80, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
    file.extend(format(0x40, 31, "PARM", "QNf", "TimeUS,Name,Value"));
    let labels = "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ";
    file.extend(format(0x81, 36, "IMU", "QBffffff", labels));
    for (name, value) in [
        ("INS_ACCOFFS", [0.5, 0.0, 0.0]),
        ("INS_ACCSCAL", [1.0, 2.0, 1.0]),
        ("INS_GYROFFS", [0.5, 0.0, 0.0]),
    ] {
        for (axis, value) in ["X", "Y", "Z"].iter().zip(value) {
            file.extend([0xa3, 0x95, 0x40]);
            file.extend([0; 8]);
            file.extend(text(16, &format!("{name}_{axis}")));
            file.extend(f32::to_le_bytes(value));
        }
    }
    for k in 0..SAMPLES {
        let [t, ref values @ ..] = sample(k);
        file.extend([0xa3, 0x95, 0x81]);
        file.extend(((t * 1e6) as u64).to_le_bytes());
        file.push(0);
        file.extend(floats(values));
    }
    file
}

fn npy(shape: &str, fortran: &str, descr: &str, data: &[u8]) -> Vec<u8> {
    let head = format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((head.len() as u16).to_le_bytes());
    file.extend(head.bytes());
    file.extend(data);
    file
}

pub fn npy_of_fields() -> Vec<u8> {
    let descr = "[('t', '<f8'), ('gyro', '<f4', (3,)), ('acc', '>f8', (3,)), ('name', '<U2')]";
    let row = |k| {
        let all = sample(k);
        let big: Vec<u8> = all[4..]
            .iter()
            .flat_map(|value| value.to_be_bytes())
            .collect();
        [doubles(&all[..1]), floats(&all[1..4]), big, vec![0; 8]].concat()
    };
    npy(
        &format!("({SAMPLES},)"),
        "False",
        descr,
        &(0..SAMPLES).flat_map(row).collect::<Vec<u8>>(),
    )
}

/// Gyros a row a sample, accelerometers a row an axis in big-endian order, both in chunks.
pub fn hdf5() -> Vec<u8> {
    let rows = SAMPLES as u64;
    let column = |k: usize| (0..SAMPLES).map(move |row| sample(row)[k]);
    let time: Vec<f64> = column(0).collect();
    let gyro: Vec<f64> = (0..SAMPLES)
        .flat_map(|k| sample(k)[1..4].to_vec())
        .collect();
    let accel: Vec<f32> = (4..7).flat_map(column).map(|value| value as f32).collect();
    let mut file = FileBuilder::new();
    let mut imu = file.create_group("imu");
    imu.create_dataset("t").with_f64_data(&time);
    imu.create_dataset("gyro")
        .with_f64_data(&gyro)
        .with_shape(&[rows, 3])
        .with_chunks(&[16, 3])
        .with_shuffle()
        .with_deflate(6)
        .with_fletcher32();
    imu.create_dataset("acc")
        .with_f32_data(&accel)
        .with_shape(&[3, rows])
        .with_chunks(&[2, 16])
        .with_deflate(6);
    file.add_group(imu.finish());
    file.finish().unwrap()
}

/// A structure, text, a number and an empty array.
pub fn mat_of_hdf5() -> Vec<u8> {
    let column = |k: usize| (0..SAMPLES).map(move |row| sample(row)[k]);
    let values = |from: usize| (from..from + 3).flat_map(column).collect::<Vec<f64>>();
    let mut file = MatBuilder::new(Options::default());
    let imu = |of: &mut StructWriter| {
        of.write_f64("t", &[SAMPLES, 1], &column(0).collect::<Vec<f64>>())?;
        of.write_f64("gyro", &[SAMPLES, 3], &values(1))?;
        of.write_f64("acc", &[SAMPLES, 3], &values(4))?;
        Ok(())
    };
    file.struct_("imu", imu).unwrap();
    file.write_char("label", "forty letters forty letters forty letter")
        .unwrap();
    file.write_scalar_f64("count", 40.0).unwrap();
    file.write_empty("none", MatClass::Double, &[0, 0]).unwrap();
    file.finish().unwrap()
}

/// Of one array of a row a sample, and one of a column.
pub fn npz(deflated: bool) -> Vec<u8> {
    let time: Vec<f64> = (0..SAMPLES).map(|k| sample(k)[0]).collect();
    let gyro: Vec<f64> = (0..SAMPLES)
        .flat_map(|k| sample(k)[1..4].to_vec())
        .collect();
    let accel: Vec<f64> = (0..SAMPLES).flat_map(|k| sample(k)[4..].to_vec()).collect();
    let members = [
        (
            "t.npy",
            npy(&format!("({SAMPLES},)"), "False", "'<f8'", &doubles(&time)),
        ),
        (
            "gyro.npy",
            npy(
                &format!("({SAMPLES}, 3)"),
                "False",
                "'<f8'",
                &doubles(&gyro),
            ),
        ),
        // The same bytes are the columns of the transposed array.
        (
            "acc.npy",
            npy(
                &format!("(3, {SAMPLES})"),
                "True",
                "'<f8'",
                &doubles(&accel),
            ),
        ),
    ];
    let (mut file, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in &members {
        let packed = if deflated {
            let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(content).unwrap();
            encoder.finish().unwrap()
        } else {
            content.clone()
        };
        let mut sum = flate2::Crc::new();
        sum.update(content);
        let head = [
            &[20, 0, 0, 0, if deflated { 8 } else { 0 }, 0][..],
            &[0; 4],
            &sum.sum().to_le_bytes(),
            &(packed.len() as u32).to_le_bytes(),
            &(content.len() as u32).to_le_bytes(),
            &(name.len() as u16).to_le_bytes(),
            &[0; 2],
        ];
        let offset = file.len() as u32;
        file.extend(b"PK\x03\x04");
        file.extend(head.concat());
        file.extend(name.bytes());
        file.extend(packed);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(head.concat());
        directory.extend([0; 10]);
        directory.extend(offset.to_le_bytes());
        directory.extend(name.bytes());
    }
    let begin = file.len() as u32;
    file.extend(&directory);
    file.extend(b"PK\x05\x06\0\0\0\0\x03\0\x03\0");
    file.extend((directory.len() as u32).to_le_bytes());
    file.extend(begin.to_le_bytes());
    file.extend([0; 2]);
    file
}

pub fn mat(compressed: bool) -> Vec<u8> {
    let element = |kind: u32, content: &[u8]| {
        let mut bytes = [
            &kind.to_le_bytes()[..],
            &(content.len() as u32).to_le_bytes(),
            content,
        ]
        .concat();
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    let array = |class: u8, name: &str, shape: [i32; 2], rest: &[u8]| {
        let shape = shape.map(i32::to_le_bytes).concat();
        let flags = [class, 0, 0, 0, 0, 0, 0, 0];
        element(
            14,
            &[
                element(6, &flags),
                element(5, &shape),
                element(1, name.as_bytes()),
                rest.to_vec(),
            ]
            .concat(),
        )
    };
    let of = |columns: std::ops::Range<usize>| -> Vec<f64> {
        columns
            .flat_map(|column| (0..SAMPLES).map(move |k| sample(k)[column]))
            .collect()
    };
    let rows = SAMPLES as i32;
    let fields = [
        (
            "t",
            array(6, "", [rows, 1], &element(9, &doubles(&of(0..1)))),
        ),
        (
            "gyro",
            array(7, "", [rows, 3], &element(7, &floats(&of(1..4)))),
        ),
        (
            "acc",
            array(6, "", [rows, 3], &element(9, &doubles(&of(4..7)))),
        ),
    ];
    let mut rest = vec![5, 0, 4, 0, 8, 0, 0, 0];
    let names: Vec<u8> = fields.iter().flat_map(|(name, _)| text(8, name)).collect();
    rest.extend(element(1, &names));
    fields.iter().for_each(|(_, field)| rest.extend(field));
    let whole = array(2, "imu", [1, 1], &rest);
    let mut file = text(124, "MATLAB 5.0 MAT-file");
    file.extend([0, 1, b'I', b'M']);
    if compressed {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&whole).unwrap();
        let packed = encoder.finish().unwrap();
        file.extend(
            [
                &15u32.to_le_bytes()[..],
                &(packed.len() as u32).to_le_bytes(),
                &packed,
            ]
            .concat(),
        );
    } else {
        file.extend(whole)
    }
    file
}

/// The message of ROS 1 and 2 of these fixtures.
const DEFINITION: &str = "std_msgs/Header header\n# remark\nuint8 KIND=3\ngeometry_msgs/Vector3 angular_velocity\n\
                          float64[] more\ngeometry_msgs/Vector3 linear_acceleration\n\
                          ====\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n\
                          ====\nMSG: std_msgs/Header\n";
const HEADER_1: &str = "uint32 seq\ntime stamp\nstring frame_id\n";
const HEADER_2: &str = "builtin_interfaces/Time stamp\nstring frame_id\n";

fn nanoseconds(k: usize) -> u64 {
    (sample(k)[0] * 1e9) as u64
}

fn ros1(k: usize) -> Vec<u8> {
    let all = sample(k);
    let stamp = [0, nanoseconds(k) as u32].map(u32::to_le_bytes).concat();
    [
        (k as u32).to_le_bytes().to_vec(),
        stamp,
        counted(b"imu"),
        doubles(&all[1..4]),
        counted(&[]).to_vec(),
        doubles(&all[4..]),
    ]
    .concat()
}

fn cdr(k: usize) -> Vec<u8> {
    let all = sample(k);
    let stamp = [0, nanoseconds(k) as u32].map(u32::to_le_bytes).concat();
    // The text ends at 16 bytes, the empty list at 44: doubles begin at 16 and 48.
    [
        vec![0, 1, 0, 0],
        stamp,
        counted(b"im\0"),
        vec![0],
        doubles(&all[1..4]),
        vec![0; 4],
        vec![0; 4],
        doubles(&all[4..]),
    ]
    .concat()
}

pub fn bag(lz4: bool) -> Vec<u8> {
    let head = |fields: &[(&str, &[u8])]| -> Vec<u8> {
        let field =
            |(name, value): &(&str, &[u8])| counted(&[name.as_bytes(), b"=", value].concat());
        counted(&fields.iter().flat_map(field).collect::<Vec<u8>>())
    };
    let number = 0u32.to_le_bytes();
    let definition = [DEFINITION, HEADER_1].concat();
    let connection = &head(&[
        ("type", b"lab/Imu"),
        ("message_definition", definition.as_bytes()),
    ])[4..];
    let mut chunk = head(&[("op", &[7]), ("conn", &number), ("topic", b"/imu")]);
    chunk.extend(counted(connection));
    for k in 0..SAMPLES {
        let time = [0, nanoseconds(k) as u32].map(u32::to_le_bytes).concat();
        chunk.extend(head(&[("op", &[2]), ("conn", &number), ("time", &time)]));
        chunk.extend(counted(&ros1(k)));
    }
    let size = (chunk.len() as u32).to_le_bytes();
    let packed = if lz4 { packed(&chunk) } else { chunk };
    let method: &[u8] = if lz4 { b"lz4" } else { b"none" };
    let mut file = b"#ROSBAG V2.0\n".to_vec();
    file.extend(head(&[("op", &[3])]));
    file.extend(counted(&[b' '; 8]));
    file.extend(head(&[
        ("op", &[5]),
        ("compression", method),
        ("size", &size),
    ]));
    file.extend(counted(&packed));
    file
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// What messages of MCAP are.
#[derive(Clone, Copy, PartialEq)]
pub enum Messages {
    Ros1,
    Cdr,
    Json,
    Protobuf,
}

/// A field of Protocol Buffers with a length.
fn field(number: u8, content: &[u8]) -> Vec<u8> {
    // The fixtures' fields are short, or have lengths of two bytes.
    let length = content.len();
    let length = match length {
        0..128 => vec![length as u8],
        _ => vec![length as u8 | 0x80, (length >> 7) as u8],
    };
    [vec![number << 3 | 2], length, content.to_vec()].concat()
}

fn descriptors() -> Vec<u8> {
    let of = |name: &str, number: u8, kind: u8, type_name: &str| {
        let mut all = [
            field(1, name.as_bytes()),
            vec![3 << 3, number, 4 << 3, 1, 5 << 3, kind],
        ]
        .concat();
        if !type_name.is_empty() {
            all.extend(field(6, type_name.as_bytes()));
        }
        field(2, &all)
    };
    let vector = [
        field(1, b"V"),
        of("x", 1, 1, ""),
        of("y", 2, 1, ""),
        of("z", 3, 1, ""),
    ]
    .concat();
    let imu = [
        field(1, b"Imu"),
        of("time", 1, 11, ".google.protobuf.Timestamp"),
        of("angular_velocity", 2, 11, ".lab.V"),
        of("linear_acceleration", 3, 11, ".lab.V"),
        of("count", 4, 17, ""),
    ]
    .concat();
    let timestamp = [
        field(1, b"Timestamp"),
        of("seconds", 1, 3, ""),
        of("nanos", 2, 5, ""),
    ]
    .concat();
    let name = b"google/protobuf/timestamp.proto";
    let of_time = [
        field(1, name),
        field(2, b"google.protobuf"),
        field(4, &timestamp),
        field(12, b"proto3"),
    ]
    .concat();
    let of_imu = [
        field(1, b"imu.proto"),
        field(2, b"lab"),
        field(3, name),
        field(4, &vector),
        field(4, &imu),
        field(12, b"proto3"),
    ]
    .concat();
    [field(1, &of_time), field(1, &of_imu)].concat()
}

fn protobuf(k: usize) -> Vec<u8> {
    let all = sample(k);
    let vector = |values: &[f64]| {
        let number = |(number, value): (usize, &f64)| {
            let mut bytes = vec![(number as u8 + 1) << 3 | 1];
            bytes.extend(value.to_le_bytes());
            // Zero is left out.
            if *value == 0.0 { Vec::new() } else { bytes }
        };
        values
            .iter()
            .enumerate()
            .flat_map(number)
            .collect::<Vec<u8>>()
    };
    let mut nanos = vec![2 << 3];
    let mut left = nanoseconds(k);
    while left >= 128 {
        nanos.push(left as u8 | 0x80);
        left >>= 7;
    }
    nanos.push(left as u8);
    [
        field(1, &nanos),
        field(2, &vector(&all[1..4])),
        field(3, &vector(&all[4..])),
        // −1 with its sign in the last bit.
        vec![4 << 3, 1],
    ]
    .concat()
}

fn json(k: usize) -> Vec<u8> {
    let [_, gx, gy, gz, ax, ay, az] = sample(k);
    format!(
        r#"{{"stamp": {{"sec": 0, "nanosec": {}}}, "angular_velocity": {{"x": {gx}, "y": {gy}, "z": {gz}}}, "linear_acceleration": [{ax}, {ay}, {az}], "frame": "imu"}}"#,
        nanoseconds(k)
    )
    .into_bytes()
}

pub fn mcap(messages: Messages, lz4: bool) -> Vec<u8> {
    let record = |kind: u8, content: &[u8]| {
        [&[kind][..], &(content.len() as u64).to_le_bytes(), content].concat()
    };
    let (encoding, of_schema, name, data) = match messages {
        Messages::Ros1 => (
            "ros1",
            "ros1msg",
            "lab/Imu",
            [DEFINITION, HEADER_1].concat().into_bytes(),
        ),
        Messages::Cdr => (
            "cdr",
            "ros2msg",
            "lab/msg/Imu",
            [DEFINITION, HEADER_2].concat().into_bytes(),
        ),
        Messages::Json => ("json", "jsonschema", "Imu", b"{}".to_vec()),
        Messages::Protobuf => ("protobuf", "protobuf", "lab.Imu", descriptors()),
    };
    let schema = [
        &[1, 0][..],
        &counted(name.as_bytes()),
        &counted(of_schema.as_bytes()),
        &counted(&data),
    ]
    .concat();
    let channel = [
        &[0, 0, 1, 0][..],
        &counted(b"/imu"),
        &counted(encoding.as_bytes()),
        &[0; 4],
    ]
    .concat();
    let mut chunk = [record(3, &schema), record(4, &channel)].concat();
    for k in 0..SAMPLES {
        let content = match messages {
            Messages::Ros1 => ros1(k),
            Messages::Cdr => cdr(k),
            Messages::Json => json(k),
            Messages::Protobuf => protobuf(k),
        };
        let time = nanoseconds(k).to_le_bytes();
        chunk.extend(record(5, &[&[0; 6][..], &time, &time, &content].concat()));
    }
    let mut sum = flate2::Crc::new();
    sum.update(&chunk);
    let (method, packed) = if lz4 {
        ("lz4", packed(&chunk))
    } else {
        ("", chunk.clone())
    };
    let content = [
        &[0; 16][..],
        &(chunk.len() as u64).to_le_bytes(),
        &sum.sum().to_le_bytes(),
        &counted(method.as_bytes()),
        &(packed.len() as u64).to_le_bytes(),
        &packed,
    ];
    let mut file = b"\x89MCAP0\r\n".to_vec();
    file.extend(record(1, &[0; 8]));
    file.extend(record(6, &content.concat()));
    file.extend(record(15, &[0; 4]));
    file
}

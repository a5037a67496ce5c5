//! Small ULog files, and whose corrections are taken out of them.

use super::open;
use super::write::{SAMPLES, floats, sample};

fn message(kind: u8, content: &[u8]) -> Vec<u8> {
    [&(content.len() as u16).to_le_bytes()[..], &[kind], content].concat()
}

fn parameter(name: &str, value: [u8; 4]) -> Vec<u8> {
    let content = [&[name.len() as u8], name.as_bytes(), &value].concat();
    message(b'P', &content)
}

/// Begins a file.
fn header() -> Vec<u8> {
    let mut file = [&b"ULog\x01\x12\x35\x01"[..], &[0; 8]].concat();
    file.extend(message(b'B', &[0; 40]));
    file
}

fn subscription(topic: u8, name: &str) -> Vec<u8> {
    message(b'A', &[&[0, topic, 0], name.as_bytes()].concat())
}

pub fn ulog() -> Vec<u8> {
    let mut file = header();
    let fields = "uint64_t timestamp;uint32_t accel_device_id;uint32_t gyro_device_id;float[3] delta_angle;\
                  float[3] delta_velocity;uint32_t delta_angle_dt;uint32_t delta_velocity_dt;uint8_t[4] _padding0;";
    file.extend(message(b'F', format!("vehicle_imu:{fields}").as_bytes()));
    for (triad, id) in [("ACC", 11), ("GYRO", 12)] {
        let name = format!("int32_t CAL_{triad}0_ID");
        file.extend(parameter(&name, i32::to_le_bytes(id)));
        let name = format!("float CAL_{triad}0_XOFF");
        file.extend(parameter(&name, f32::to_le_bytes(0.5)));
    }
    file.extend(parameter("float CAL_ACC0_YSCALE", f32::to_le_bytes(2.0)));
    file.extend(subscription(5, "vehicle_imu"));
    for k in 0..SAMPLES {
        let [t, ref values @ ..] = sample(k);
        let data = [
            &[5, 0][..],
            &((t * 1e6) as u64).to_le_bytes(),
            &11u32.to_le_bytes(),
            &12u32.to_le_bytes(),
            &floats(values),
            &7812u32.to_le_bytes(),
            &7812u32.to_le_bytes(),
        ];
        file.extend(message(b'D', &data.concat()));
    }
    file
}

/// A sample of the selected device, or a selection.
#[derive(Clone, Copy)]
enum Event {
    Sample,
    Selected(u32),
    Offset(f32),
}

/// Zero rates and forces of devices 1 and 2, whose offsets along x are 1 and 2 until one is changed.
fn of_selected(events: &[Event]) -> Vec<u8> {
    let mut file = header();
    for format in [
        "sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;",
        "sensor_selection:uint64_t timestamp;uint32_t accel_device_id;uint32_t gyro_device_id;",
    ] {
        file.extend(message(b'F', format.as_bytes()));
    }
    for (number, triad) in [(0, "ACC"), (1, "ACC"), (0, "GYRO"), (1, "GYRO")] {
        let name = format!("int32_t CAL_{triad}{number}_ID");
        file.extend(parameter(&name, i32::to_le_bytes(number + 1)));
        let name = format!("float CAL_{triad}{number}_XOFF");
        file.extend(parameter(&name, f32::to_le_bytes(number as f32 + 1.0)));
    }
    file.extend(subscription(5, "sensor_combined"));
    file.extend(subscription(6, "sensor_selection"));
    for (k, &event) in events.iter().enumerate() {
        let time = (k as u64).to_le_bytes();
        file.extend(match event {
            Event::Sample => message(b'D', &[&[5, 0], &time[..], &floats(&[0.0; 6])].concat()),
            Event::Selected(device) => {
                let device = device.to_le_bytes();
                message(b'D', &[&[6, 0], &time[..], &device, &device].concat())
            }
            Event::Offset(offset) => parameter("float CAL_GYRO0_XOFF", offset.to_le_bytes()),
        });
    }
    file
}

/// What the gyros gave along x at each sample, and what is said of both triads.
fn undone(events: &[Event]) -> (Vec<f64>, Vec<String>) {
    let mut log = open(of_selected(events)).unwrap().unwrap();
    let (mut row, mut offsets) = (Vec::new(), Vec::new());
    while let Some(stream) = log.advance().unwrap() {
        log.values(&mut row).unwrap();
        if stream == 0 {
            offsets.push(row[1]);
        }
    }
    (offsets, log.streams()[0].remarks.clone())
}

#[test]
fn samples_before_the_first_selection_are_those_of_the_device_that_it_names() {
    use Event::{Sample, Selected};
    let (offsets, remarks) = undone(&[Sample, Sample, Selected(2), Sample]);
    assert_eq!(offsets, [2.0; 3]);
    let [gyros, accelerometers] = &remarks[..] else {
        panic!("{remarks:?}");
    };
    assert!(gyros.contains("CAL_GYRO1_XOFF") && accelerometers.contains("CAL_ACC1_XOFF"));
    assert!(
        remarks
            .iter()
            .all(|remark| remark.ends_with(". turncal undid this correction."))
    );
}

#[test]
fn where_device_or_parameters_change_each_sample_is_undone_by_its_own_and_all_are_said() {
    use Event::{Offset, Sample, Selected};
    let devices = [
        Sample,
        Selected(1),
        Selected(2),
        Sample,
        Selected(7),
        Sample,
    ];
    let (offsets, remarks) = undone(&devices);
    assert_eq!(offsets, [1.0, 2.0, 0.0]);
    for (n, words) in ["GYRO0", "GYRO1", "used the values unchanged"]
        .iter()
        .enumerate()
    {
        let is_of_part = remarks[n].starts_with("For part of the samples: ");
        assert!(is_of_part && remarks[n].contains(words), "{remarks:?}");
    }
    let (offsets, remarks) = undone(&[Selected(1), Sample, Offset(3.0), Sample]);
    assert_eq!(offsets, [1.0, 3.0]);
    assert_eq!(remarks.len(), 2, "{remarks:?}");
}

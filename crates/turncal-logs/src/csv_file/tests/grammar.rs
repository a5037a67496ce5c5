//! Logs of random shapes: labels, prefixes, check sums, interleaved streams and noise.

use std::fmt::Write;

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::csv_file::CsvFile;
use crate::rows::LogRows;

const ROWS: usize = 120;

/// A log, and the values of each row of each of its streams.
struct Log {
    form: String,
    text: String,
    streams: Vec<Vec<Vec<f64>>>,
}

fn pick<T: Copy>(of: &[T], rng: &mut ChaCha8Rng) -> T {
    *of.choose(rng).unwrap()
}

/// A number as some program prints it, and its value.
fn number(rng: &mut ChaCha8Rng, format: usize) -> (String, f64) {
    let value = rng.random_range(-20.0..20.0);
    let text = match format {
        0 => format!("{value:.3}"),
        1 => format!("{value:+.6}"),
        2 => format!("{value:.4e}"),
        3 => format!("{:.0}", value * 1000.0),
        _ => format!("{value:>9.4}"),
    };
    let read = text.trim().parse().unwrap();
    (text, read)
}

fn clock(second: f64, rng: &mut ChaCha8Rng) -> Option<(String, f64)> {
    let (whole, milli) = (second.floor(), (second.fract() * 1000.0).round());
    Some(match rng.random_range(0..4) {
        0 => return None,
        1 => (format!("{second:.3}"), second),
        2 => (format!("{:.0}", second * 1000.0), second * 1000.0),
        _ => (
            format!("13:59:{whole:02.0}.{milli:03.0}"),
            13.0 * 3600.0 + 59.0 * 60.0 + second,
        ),
    })
}

/// How the rows of a stream are printed.
#[derive(Debug, Clone, Copy)]
enum Form {
    /// `aX=0.1, aY=…`
    Each(&'static str, &'static str),
    /// `Acc: 0.1, 0.2, 0.3; Gyr: …`
    Groups(&'static str, &'static str),
    /// `$IMU,0.1,…*5A`
    Sentence(&'static str, bool),
    /// `13:59:20.010 -> 0.1 0.2 …`
    Prefix(&'static str, &'static str),
    /// A line for each value.
    Lines(&'static str),
    /// `{"ax": 0.1, …}`
    Json,
    Plain(&'static str),
}

const NAMES: [&str; 6] = ["aX", "aY", "aZ", "gX", "gY", "gZ"];

fn row(form: Form, tag: &str, time: Option<&str>, values: &[String]) -> String {
    let with_time = |separator: &str| {
        let time = time.into_iter().map(str::to_owned);
        let all: Vec<String> = time.chain(values.iter().cloned()).collect();
        all.join(separator)
    };
    let before = |separator: &str| time.map_or(String::new(), |time| format!("{time}{separator}"));
    match form {
        Form::Each(sign, separator) => {
            let each = NAMES.iter().zip(values);
            let each: Vec<String> = each
                .map(|(name, value)| format!("{tag}{name}{sign}{value}"))
                .collect();
            before(separator) + &each.join(separator)
        }
        Form::Groups(between, separator) => {
            let groups = values.chunks(3).zip(["Acc", "Gyr"]);
            let groups: Vec<String> = groups
                .map(|(values, name)| format!("{tag}{name}: {}", values.join(separator)))
                .collect();
            before(between) + &groups.join(between)
        }
        Form::Sentence(mark, has_sum) => {
            let sum = if has_sum { "*5A" } else { "" };
            format!("{mark}{tag}IMU,{}{sum}", with_time(","))
        }
        Form::Prefix(arrow, separator) => format!("13:59:20.010{arrow}{}", values.join(separator)),
        Form::Lines(sign) => {
            let each = NAMES.iter().zip(values);
            let each: Vec<String> = each
                .map(|(name, value)| format!("{tag}{name}{sign}{value}"))
                .collect();
            each.join("\n")
        }
        Form::Json => {
            let each = NAMES.iter().zip(values);
            let each: Vec<String> = each
                .map(|(name, value)| format!("\"{name}\": {}", value.trim()))
                .collect();
            format!("{{{}}}", each.join(", "))
        }
        Form::Plain(separator) => with_time(separator),
    }
}

fn log(seed: u64) -> Log {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let separators = [", ", " ", "; ", " | ", "\t"];
    let form = match rng.random_range(0..8) {
        0 | 1 => Form::Each(
            pick(&["=", ": ", " = ", ":"], &mut rng),
            pick(&separators, &mut rng),
        ),
        2 => Form::Groups(
            pick(&["; ", " | ", "  ", "\t"], &mut rng),
            pick(&[", ", " "], &mut rng),
        ),
        3 => Form::Sentence(pick(&["$", "%", "#", ""], &mut rng), rng.random()),
        4 => Form::Prefix(
            pick(&[" -> ", "] ", " > "], &mut rng),
            pick(&[",", "\t", " "], &mut rng),
        ),
        5 => Form::Lines(pick(&["=", ": "], &mut rng)),
        6 => Form::Json,
        _ => Form::Plain(pick(&[",", "\t", " ", ";"], &mut rng)),
    };
    let format = rng.random_range(0..5);
    let is_noisy: bool = rng.random();
    let two = matches!(form, Form::Sentence(..) | Form::Groups(..)) && rng.random_bool(0.3);
    let tags: &[&str] = if two { &["A", "B"] } else { &[""] };
    let mut text = String::new();
    if is_noisy {
        text += "Booting v1.2.3\nInit IMU ... ok\n";
    }
    let mut streams = vec![Vec::new(); tags.len()];
    let has_time = clock(0.0, &mut rng.clone()).is_some();
    let kind = rng.clone();
    for k in 0..ROWS {
        for (stream, tag) in streams.iter_mut().zip(tags) {
            // Streams of their own have other rates.
            if two && *tag == "B" && k % 3 != 0 {
                continue;
            }
            let time = clock(0.02 * k as f64, &mut kind.clone());
            let numbers: Vec<(String, f64)> = (0..6).map(|_| number(&mut rng, format)).collect();
            let values: Vec<String> = numbers.iter().map(|(text, _)| text.clone()).collect();
            let shown = time.as_ref().map(|(text, _)| text.as_str());
            writeln!(text, "{}", row(form, tag, shown, &values)).unwrap();
            stream.push(numbers.iter().map(|(_, value)| *value).collect());
        }
        if is_noisy && k == 60 {
            text += "ets Jul 29 2019 12:21:46\n\nrst:0x1 (POWERON_RESET)\n";
        }
    }
    Log {
        form: format!("{form:?} format {format} noise {is_noisy} two {two} time {has_time}"),
        text,
        streams,
    }
}

/// The last six values of each row of each stream.
fn read(path: &std::path::Path) -> Result<Vec<Vec<Vec<f64>>>, String> {
    let tags = CsvFile::tags(&path.into()).map_err(|error| error.to_string())?;
    let all: Vec<Option<&str>> = match &tags[..] {
        [] => vec![None],
        tags => tags.iter().map(|tag| Some(tag.as_str())).collect(),
    };
    let streams = all.into_iter().map(|tag| {
        let csv = CsvFile::open(&path.into(), tag).map_err(|error| error.to_string())?;
        let mut rows = LogRows::new(csv);
        let columns = rows.header().len();
        let mut found = Vec::new();
        while rows.advance().map_err(|error| error.to_string())? {
            let first = columns.saturating_sub(6);
            found.push((first..columns).map(|k| rows.value(k)).collect());
        }
        Ok(found)
    });
    streams.collect()
}

#[test]
fn logs_of_seven_hundred_random_shapes_have_the_values_that_were_written() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.txt");
    let (mut refused, mut wrong) = (Vec::new(), Vec::new());
    for seed in 0..700 {
        let log = log(seed);
        std::fs::write(&path, &log.text).unwrap();
        match read(&path) {
            Err(error) => refused.push(format!("{seed} {}: {error}", log.form)),
            Ok(streams) if streams == log.streams => {}
            Ok(streams) => wrong.push(format!(
                "{seed} {}: {} streams, first {:?} in place of {:?}\n{}",
                log.form,
                streams.len(),
                streams.first().and_then(|rows| rows.first()),
                log.streams[0][0],
                &log.text[..200]
            )),
        }
    }
    println!(
        "refused: {}\nwrong: {}",
        refused.join("\n"),
        wrong.join("\n")
    );
    assert!(
        wrong.is_empty() && refused.len() <= 10,
        "{} refused, {} wrong",
        refused.len(),
        wrong.len()
    );
}

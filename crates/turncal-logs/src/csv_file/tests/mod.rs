mod grammar;

use std::fs;

use super::*;
use crate::rows::LogRows;
use crate::source::Source;

fn rows(name: &str, content: &[u8]) -> Result<Vec<(u64, Vec<f64>)>, FileError> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    fs::write(&path, content).unwrap();
    let mut csv = Source::of_file(path.as_path()).open()?;
    let columns = ["t", "gx", "ax"].map(|name| csv.column(name));
    let columns: Vec<usize> = columns.into_iter().collect::<Result<_, _>>()?;
    let mut rows = Vec::new();
    while csv.advance()? {
        let numbers: Result<_, _> = columns.iter().map(|&column| csv.number(column)).collect();
        rows.push((csv.line(), numbers?));
    }
    Ok(rows)
}

#[test]
fn the_same_rows_are_read_however_a_program_wrote_them() {
    let expected = [vec![0.0, -1.5, 9.8], vec![0.01, 2.5e-3, -9.8]];
    for (name, content, lines) in [
        ("a.csv", "t,gx,ax\n0,-1.5,9.8\n0.01,2.5e-3,-9.8\n", [2, 3]),
        ("a.TXT", "t;gx;ax\r\n0;-1,5;9,8\r\n0,01;2,5e-3;-9,8", [2, 3]),
        (
            "a.tsv",
            "t\tgx\tax\n0\t-1,5\t9,8\n\n0.01\t2.5e-3\t-9.8\n\n",
            [2, 4],
        ),
        (
            "a.dat",
            "  t  gx   ax\n  0  -1.5 \t 9.8 \n 0.01   2.5e-3 -9.8\n",
            [2, 3],
        ),
        (
            "a.log",
            "\u{feff}\"t\", \"gx\", \"ax\"\n0, -1.5, 9.8\n0.01, 2.5e-3, -9.8\n,,\n",
            [2, 3],
        ),
        (
            "a.csv",
            "// of a device\n# day 1\nt,gx,ax,\n% on\n0,-1.5,9.8,\n#\n0.01,2.5e-3,-9.8,\n",
            [5, 7],
        ),
        ("a.csv", "t,gx,ax\n0,-1.5,9.8,\n0.01,2.5e-3,-9.8,\n", [2, 3]),
        (
            "a.csv",
            "t,gx,ax\ns,deg/s,m/s^2\n\n0,-1.5,9.8\n0.01,2.5e-3,-9.8\n",
            [4, 5],
        ),
        ("a.csv", "#t,gx,ax\n0,-1.5,9.8\n0.01,2.5e-3,-9.8\n", [2, 3]),
        (
            "a.csv",
            "t,\tgx,\tax\n0,\t-1.5,\t9.8\n0.01,\t2.5e-3,\t-9.8\n",
            [2, 3],
        ),
    ] {
        let rows = rows(name, content.as_bytes()).unwrap_or_else(|error| panic!("{error}"));
        let numbers: Vec<_> = rows.iter().map(|(_, row)| row.clone()).collect();
        assert_eq!(numbers, expected, "{content}");
        let found: Vec<_> = rows.iter().map(|(line, _)| *line).collect();
        assert_eq!(found, lines, "{content}");
    }
}

#[test]
fn columns_without_names_are_numbered() {
    let directory = tempfile::tempdir().unwrap();
    for content in [
        "0 -1,5 9,8\n1 2 3\n",
        "0,-1.5,9.8\n1,2,3\n",
        "0\t-1.5\t9.8\n1\t2\t3\n",
    ] {
        let path = directory.path().join("a.txt");
        fs::write(&path, content).unwrap();
        let mut csv = Source::of_file(path.as_path()).open().unwrap();
        assert_eq!(csv.header(), ["1", "2", "3"]);
        let column = csv.column("2").unwrap();
        assert!(csv.advance().unwrap());
        assert_eq!((csv.line(), csv.number(column).unwrap()), (1, -1.5));
    }
}

#[test]
fn an_error_names_its_line_behind_comments_and_empty_lines() {
    let short = "# a\n\nt,gx,ax\n0,1,2\n\n# b\n1,2\n";
    let error = rows("a.csv", short.as_bytes()).unwrap_err().to_string();
    assert!(
        error.contains("line 7: found 2 fields, expected 3"),
        "{error}"
    );
    let word = "t,gx,ax\n0,1,2\n\n% b\n1,x,3\n";
    let error = rows("a.csv", word.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("line 5, column `gx`: found `x`"), "{error}");
}

#[test]
fn files_without_a_row_are_empty_or_have_none() {
    for content in ["", "\n\n", "# only a remark\n", "\u{feff}"] {
        let error = rows("a.csv", content.as_bytes()).unwrap_err().to_string();
        assert!(error.contains("an empty file"), "{error}");
    }
    assert!(rows("a.csv", b"t,gx,ax\n").unwrap().is_empty());
    assert!(rows("a.csv", b"t,gx,ax\ns,deg,m\n").unwrap().is_empty());
}

#[test]
fn a_quote_that_is_not_closed_is_named_where_it_is() {
    let good = "0,\"1\",2\n".repeat(500);
    let names = "\"t\", \"gx\", ax\n";
    let all = rows("a.csv", format!("{names}{good}").as_bytes()).unwrap();
    assert!(all.len() == 500 && all[499].1 == [0.0, 1.0, 2.0]);
    for stray in ["0,\"1,2\n", "0,1,\"2\n", "\"0,1,2\n"] {
        let text = format!("{names}{good}{stray}{good}");
        let read = rows("a.csv", text.as_bytes()).unwrap();
        assert!(read.len() == 1000 && read.iter().all(|(line, _)| *line != 502));
    }
    let error = rows("a.csv", b"t,\"gx,ax\n0,1,2\n").unwrap_err();
    assert!(
        error
            .to_string()
            .contains("line 1: found an unclosed quote"),
        "{error}"
    );
    // A quote within a field is a letter of it: an inch.
    let inch = rows("a.csv", b"t,gx,ax,long 5\"\n0,1,2,3\"\n").unwrap();
    assert_eq!(inch, [(2, vec![0.0, 1.0, 2.0])]);
}

#[test]
fn a_file_that_ends_within_a_row_is_told_from_one_that_is_whole() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.csv");
    for (content, rows, doubtful, note) in [
        ("t,gx\n0,10\n1,20\n", 2, false, None),
        ("t,gx\n0,10,\n1,20,", 2, false, None),
        ("t,gx\n0,10\n1,2", 2, true, Some("may lack digits")),
        ("t,gx\n0,10\n1", 1, false, Some("has too few fields")),
        ("t,gx\n0,10\n1,\"2", 1, false, Some("has too few fields")),
    ] {
        fs::write(&path, content).unwrap();
        let mut csv = Source::of_file(path.as_path()).open().unwrap();
        csv.column("gx").unwrap();
        let mut found = 0;
        while csv.advance().unwrap() {
            found += 1;
        }
        assert_eq!((found, csv.may_be_cut()), (rows, doubtful), "{content}");
        let said = csv.cut_off("");
        let fits = |note: &str| said.as_ref().is_some_and(|said| said.contains(note));
        assert!(note.map_or(said.is_none(), fits), "{content}: {said:?}");
    }
}

#[test]
fn columns_that_share_a_name_have_that_of_the_row_below_too() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.csv");
    let grouped = "sensor,left,left,right,right\naxis,gx,ax,gx,ax\n";
    for (head, names, units) in [
        (
            format!("{grouped}s,dps,g,dps,g\n"),
            "sensor axis|left gx|left ax|right gx|right ax",
            true,
        ),
        (
            grouped.to_owned(),
            "sensor axis|left gx|left ax|right gx|right ax",
            false,
        ),
        ("t,gx,,,gy\ns,dps,,,dps\n".to_owned(), "t|gx|||gy", true),
    ] {
        fs::write(&path, format!("{head}0,1,2,3,4\n1,1,2,3,4\n")).unwrap();
        let mut csv = Source::of_file(path.as_path()).open().unwrap();
        assert_eq!(csv.header().join("|"), names);
        assert_eq!(!csv.units().is_empty(), units);
        assert!(csv.advance().unwrap() && csv.number(0).unwrap() == 0.0);
    }
}

#[test]
fn a_preamble_is_told_from_names_and_rows() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.csv");
    let rows = "0,1,2\n1,2,3\n2,3,4\n";
    for (above, names, units) in [
        ("sep=,\nt,gx,ax\n", "t|gx|ax", ""),
        ("SD online\nNo device there\n", "1|2|3", ""),
        (
            "A LOG\nversion,1.3\ntscale,0.001\ngscale,0.02\nt,gx,ax\n",
            "t|gx|ax",
            "0.001 s|0.02 rad/s|",
        ),
        (
            "One,One,One\nTime,Gyro,Gyro\nRAW,RAW,CAL\nms,,dps\n",
            "Time RAW|Gyro RAW|Gyro CAL",
            "ms||dps",
        ),
    ] {
        for (end, is_wide) in [("\n", false), ("\r", false), ("\r\n", true)] {
            let text = format!("{above}{rows}").replace('\n', end);
            let wide = || {
                format!("\u{feff}{text}")
                    .encode_utf16()
                    .collect::<Vec<u16>>()
            };
            let bytes = if is_wide {
                wide().iter().flat_map(|unit| unit.to_be_bytes()).collect()
            } else {
                text.clone().into_bytes()
            };
            fs::write(&path, bytes).unwrap();
            let mut csv = Source::of_file(path.as_path()).open().unwrap();
            assert_eq!(csv.header().join("|"), names, "{text}");
            assert_eq!(csv.units().join("|"), units, "{text}");
            assert!(csv.advance().unwrap() && csv.number(2).unwrap() == 2.0);
        }
    }
}

#[test]
fn rows_with_a_tag_are_streams_and_fields_without_a_value_stay_in_place() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.txt");
    let rows = |k: usize| format!("Raw:{k},-2\nUni:{k}.5,-2.5,9\n");
    fs::write(&path, (0..20).map(rows).collect::<String>()).unwrap();
    assert_eq!(
        CsvFile::tags(&path.as_path().into()).unwrap(),
        ["Raw", "Uni"]
    );
    let mut csv = LogRows::new(CsvFile::open(&path.as_path().into(), Some("Uni")).unwrap());
    assert_eq!(csv.header(), ["1", "2", "3"]);
    assert!(csv.advance().unwrap() && csv.advance().unwrap());
    assert_eq!((csv.line(), csv.number(0).unwrap()), (4, 1.5));

    fs::write(&path, "a\tb\tc\n\t1\t\n\t2\t3\n\t3\t\n").unwrap();
    assert!(CsvFile::tags(&path.as_path().into()).unwrap().is_empty());
    let mut csv = Source::of_file(path.as_path()).open().unwrap();
    assert!(csv.advance().unwrap() && csv.advance().unwrap());
    assert!(csv.is_blank(0) && csv.number(2).unwrap() == 3.0);
}

#[test]
fn a_separator_is_what_rows_share_and_not_what_a_note_contains() {
    let rows_with = |note: &str| {
        let row = |k: usize| format!("{k},{k}.5,1,{note}\n");
        let text = (0..9).map(row).collect::<String>();
        rows("a.csv", format!("t,gx,ax,note\n{text}").as_bytes())
    };
    for note in ["separate file; label from the sheet", "a\tb", "x up"] {
        let read = rows_with(note).unwrap();
        assert!(read.len() == 9 && read[8].1 == [8.0, 8.5, 1.0], "{note}");
    }
}

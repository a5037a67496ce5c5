//! The tutorial and the README: their commands run in order, and print what the pages show.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

const PAGES: [&str; 2] = [
    include_str!("../../docs/tutorial.md"),
    include_str!("../../README.md"),
];
/// Lines around an output and around what a page shows of it.
const ENDS: [&str; 2] = ["(the beginning)", "(the end)"];

/// A fenced block between `<!-- run -->` and `<!-- /run -->`, and the line directly above it.
struct Block {
    above: &'static str,
    language: &'static str,
    lines: Vec<&'static str>,
}

fn blocks(page: &'static str) -> Vec<Block> {
    let (mut blocks, mut open, mut above, mut run) = (Vec::new(), None::<Block>, "", false);
    for line in page.lines() {
        match (&mut open, line.strip_prefix("```")) {
            (Some(_), Some(_)) => blocks.extend(open.take().filter(|_| run)),
            (Some(block), None) => block.lines.push(line),
            (None, Some(language)) => {
                open = Some(Block {
                    above,
                    language,
                    lines: Vec::new(),
                });
            }
            (None, None) if line == "<!-- run -->" => run = true,
            (None, None) if line == "<!-- /run -->" => run = false,
            (None, None) => above = line,
        }
    }
    blocks
}

/// What a shell prints in `place`: standard output and standard error in one pipe, in the order of a terminal, with
/// the narrow spaces of numbers as plain ones.
fn output(script: &str, place: &Path) -> String {
    let binary = Path::new(env!("CARGO_BIN_EXE_turncal")).parent().unwrap();
    let path = std::env::var("PATH").unwrap();
    let output = Command::new("sh")
        .args(["-ec", &format!("exec 2>&1\n{script}")])
        .current_dir(place)
        .env("PATH", format!("{}:{path}", binary.display()))
        .env("COLUMNS", "80")
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "$ {script}\n{text}");
    text.replace('\u{202f}', " ")
}

/// The first shown line that the output does not have in its place; `…` stands for any lines.
fn missing<'a>(shown: &[&'a str], text: &'a str) -> Option<&'a str> {
    let between_ends = |lines: &[&'a str]| [&ENDS[..1], lines, &ENDS[1..]].concat();
    let lines = between_ends(&text.lines().map(str::trim_end).collect::<Vec<_>>());
    let mut rest = &lines[..];
    for run in between_ends(shown).split(|line| *line == "…") {
        let (mut best, mut place) = (0, 0);
        for from in 0..rest.len() {
            let pairs = run.iter().zip(&rest[from..]);
            let agree = pairs.take_while(|(shown, line)| shown == line).count();
            if agree > best {
                (best, place) = (agree, from);
            }
        }
        if best < run.len() {
            return Some(run[best]);
        }
        rest = &rest[place + best..];
    }
    None
}

#[test]
fn the_pages_show_what_their_commands_print() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    let mut outputs = BTreeMap::new();
    for block in PAGES.into_iter().flat_map(blocks) {
        let append = block.above.strip_prefix("<!-- append ");
        let file = append.and_then(|rest| rest.strip_suffix(" -->"));
        match (block.language, file) {
            ("sh", _) => drop(output(&block.lines.join("\n"), place)),
            ("toml", Some(file)) => {
                let path = place.join(file);
                let text = fs::read_to_string(&path).unwrap();
                fs::write(&path, format!("{text}\n{}\n", block.lines.join("\n"))).unwrap();
            }
            ("text", _) => {
                for shown in block.lines.chunk_by(|_, next| !next.starts_with("$ ")) {
                    let command = shown[0].strip_prefix("$ ").expect("a command first");
                    // The README shows an output of the tutorial, whose command is not repeated.
                    let run = || output(command, place);
                    let text = outputs.entry(command).or_insert_with(run);
                    if let Some(line) = missing(&shown[1..], text) {
                        panic!("$ {command}\nexpected: {line}\nprinted:\n{text}");
                    }
                }
            }
            _ => {}
        }
    }
    assert!(outputs.len() > 5);
}

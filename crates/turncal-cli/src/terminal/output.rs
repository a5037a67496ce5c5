//! Standard output.

use std::io::{self, BufWriter, IsTerminal, Write};

use turncal::calibration::Word;
use turncal_report as report;
use turncal_report::{Document, terminal};

/// Prints a document as text in the width of the terminal, or as JSON.
pub fn show(document: &Document, json: bool) -> anyhow::Result<()> {
    let text = if json {
        report::json(document)
    } else {
        terminal::text(document, columns().map(usize::from))
    };
    print(text.as_bytes())
}

/// Prints the short form of a document, which fits on one screen.
pub fn show_brief(document: &Document) -> anyhow::Result<()> {
    let text = terminal::brief(document, columns().map(usize::from));
    let is_plain = !io::stdout().is_terminal() || std::env::var_os("NO_COLOR").is_some();
    let coloured = document.verdict.as_ref().filter(|_| !is_plain);
    let text = match coloured {
        Some((word, _)) => text.replacen(&word.to_string(), &in_colour(*word), 1),
        None => text,
    };
    print(text.as_bytes())
}

/// A verdict in its terminal colour.
fn in_colour(word: Word) -> String {
    let colour = match word {
        Word::Good | Word::Pass => 32,
        Word::UseWithCare | Word::Partial | Word::Undecided => 33,
        Word::Failed | Word::Fail => 31,
    };
    format!("\u{1b}[1;{colour}m{word}\u{1b}[0m")
}

/// Width of standard output: the width of its terminal, otherwise COLUMNS, otherwise unlimited.
pub fn columns() -> Option<u16> {
    let terminal = terminal_size::terminal_size_of(io::stdout()).map(|(width, _)| width.0);
    terminal.or_else(|| std::env::var("COLUMNS").ok()?.parse().ok())
}

/// Writes to standard output. A closed pipe, as with `head`, is not an error.
pub fn print(bytes: &[u8]) -> anyhow::Result<()> {
    stream(|stdout| stdout.write_all(bytes))
}

/// Writes output that is too large for memory to standard output.
pub fn stream(write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> anyhow::Result<()> {
    let mut stdout = BufWriter::new(io::stdout().lock());
    match write(&mut stdout).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(anyhow::Error::new(error).context("cannot write to standard output"))
        }
        _ => Ok(()),
    }
}

//! The display shown while a log is followed.

use std::collections::BTreeSet;
use std::io::{self, IsTerminal};

use crate::terminal::{columns, print};
use turncal::lot::Specification;
use turncal::number::count;
use turncal::run::Run;
use turncal::survey::Status;
use turncal_report::session;
use turncal_report::terminal::{printable, wrapped};

/// Form of the output: on a terminal, a screen that is redrawn; in a file or a pipe, one line for each dwell.
pub struct Screen {
    is_terminal: bool,
    silent: bool,
    /// Lines on the terminal that the next screen replaces.
    drawn: usize,
    /// Number of dwells already reported.
    told: usize,
    trouble: String,
    /// Notes already reported, without their figures.
    noted: BTreeSet<String>,
    /// Number of lines left out, and the first reasons.
    left_out: Option<String>,
    /// Content of the screen below the number of lines received.
    content: Vec<String>,
    received: usize,
}

impl Screen {
    pub fn new(silent: bool) -> Self {
        Self {
            is_terminal: io::stdout().is_terminal(),
            silent,
            drawn: 0,
            told: 0,
            trouble: String::new(),
            noted: BTreeSet::new(),
            left_out: None,
            content: Vec::new(),
            received: 0,
        }
    }

    pub fn show(
        &mut self,
        run: &Run,
        status: &Status,
        specification: Option<&Specification>,
    ) -> anyhow::Result<()> {
        self.trouble.clear();
        if self.is_terminal && !self.silent {
            return self.draw(session::screen(run, status, specification));
        }
        for note in session::notes(run, status) {
            let is_new = self
                .noted
                .insert(note.replace(|c: char| c.is_ascii_digit(), ""));
            if is_new {
                self.tell(&note)?;
            }
        }
        // The last dwell is not complete while the instrument is at rest.
        let whole = status.survey.rests.len() - usize::from(status.still > 0.0);
        while self.told < whole {
            if let Some(line) = session::line(status, self.told) {
                self.tell(&line)?;
            }
            self.told += 1;
            if self.told == whole
                && let Some(next) = status.next
            {
                let (words, reason) = (session::words(next), session::reason(status));
                self.tell(&format!("next: {words}{reason}"))?;
            }
        }
        Ok(())
    }

    /// Reports, only once, why the rows cannot be evaluated.
    pub fn trouble(&mut self, text: &str) -> anyhow::Result<()> {
        if self.is_terminal && !self.silent {
            return self.draw(vec![
                "waiting for readable rows".to_owned(),
                text.to_owned(),
            ]);
        }
        if self.trouble != text {
            text.clone_into(&mut self.trouble);
            self.tell(&format!("not yet: {text}"))?;
        }
        Ok(())
    }

    fn tell(&self, line: &str) -> anyhow::Result<()> {
        if self.silent {
            tell!("{}", printable(line));
            Ok(())
        } else {
            print(format!("{}\n", printable(line)).as_bytes())
        }
    }

    /// Shows immediately that lines arrive, even before they are evaluated.
    pub fn count(&mut self, received: usize, left_out: Option<String>) -> anyhow::Result<()> {
        if received == self.received && left_out == self.left_out {
            return Ok(());
        }
        (self.received, self.left_out) = (received, left_out);
        if self.is_terminal && !self.silent {
            self.redraw()
        } else {
            Ok(())
        }
    }

    fn draw(&mut self, content: Vec<String>) -> anyhow::Result<()> {
        self.content = content;
        self.redraw()
    }

    fn redraw(&mut self) -> anyhow::Result<()> {
        let width = usize::from(columns().unwrap_or(80)).max(20);
        let mut text = String::new();
        if self.drawn > 0 {
            text += &format!("\u{1b}[{}A", self.drawn);
        }
        text += "\u{1b}[J";
        self.drawn = 0;
        let received = format!("{} lines received", count(self.received));
        let counts = std::iter::once(&received).chain(&self.left_out);
        for line in counts.chain(&self.content) {
            for part in wrapped(&printable(line), "  ", Some(width)) {
                text += &part;
                text.push('\n');
                self.drawn += 1;
            }
        }
        print(text.as_bytes())
    }
}

//! Names of columns, each of which means one quantity.

use super::error::{list, nearest};
use crate::shown::excerpt;

/// The names of a file's columns, and which of them are taken.
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    all: Vec<String>,
    taken: Vec<usize>,
}

/// Why a name is none, in the words of an error.
pub(super) struct Wrong {
    pub found: String,
    pub expected: String,
    pub advice: String,
}

impl Names {
    pub fn new(all: &[String]) -> Self {
        Self {
            all: all.to_vec(),
            taken: Vec::new(),
        }
    }

    pub fn all(&self) -> &[String] {
        &self.all
    }

    /// The columns that were found.
    pub fn taken(&self) -> &[usize] {
        &self.taken
    }

    /// The index of a named column, which nothing else may be.
    pub fn find(&mut self, name: &str) -> Result<usize, Wrong> {
        let mut places = (0..self.all.len()).filter(|&i| self.all[i] == name);
        let header = || self.all.iter().map(String::as_str);
        match (places.next(), places.next()) {
            (Some(index), None) if self.taken.contains(&index) => Err(Wrong {
                found: format!("`{name}` named for two quantities"),
                expected: "a column of its own for each".to_owned(),
                advice: "Correct `columns` in run.toml.".to_owned(),
            }),
            (Some(index), None) => {
                self.taken.push(index);
                Ok(index)
            }
            (Some(_), Some(_)) => Err(Wrong {
                found: format!("two columns named `{name}`"),
                expected: "one".to_owned(),
                advice: "Rename one of them.".to_owned(),
            }),
            (None, _) => Err(Wrong {
                found: format!("the columns {}", list(header())),
                expected: format!("a column named `{}`", excerpt(name)),
                advice: match nearest(name, header()) {
                    Some(like) => {
                        format!(
                            "Did you mean `{like}`? Correct `columns` in run.toml or this header."
                        )
                    }
                    None => "Correct `columns` in run.toml or this header.".to_owned(),
                },
            }),
        }
    }
}

//! Names of columns, each of which means one quantity.

use super::error::{choice, nearest};
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

    /// The columns that were found.
    pub fn taken(&self) -> &[usize] {
        &self.taken
    }

    /// The index of a column by its name, or by its number where none is called so; nothing else may be that column.
    pub fn find(&mut self, name: &str) -> Result<usize, Wrong> {
        let mut places: Vec<usize> = (0..self.all.len())
            .filter(|&i| self.all[i] == name)
            .collect();
        if let Ok(number) = name.parse::<usize>()
            && places.is_empty()
        {
            places.extend(
                number
                    .checked_sub(1)
                    .filter(|&place| place < self.all.len()),
            );
        }
        let mut places = places.into_iter();
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
                advice: "Name it by its number, the first being `1`, or rename one of them."
                    .to_owned(),
            }),
            (None, _) => Err(Wrong {
                found: format!("no column named `{}`", excerpt(name)),
                expected: format!("one of {}", choice(name, header())),
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

#[cfg(test)]
mod tests {
    use super::*;

    fn expected(names: &[String], wanted: &str) -> String {
        let wrong = Names::new(names).find(wanted).unwrap_err();
        assert_eq!(wrong.found, format!("no column named `{wanted}`"));
        wrong.expected
    }

    #[test]
    fn a_name_that_is_none_is_answered_by_all_or_by_those_like_it_first() {
        let six = ["t", "gx", "gy", "gz", "ax", "ay", "az"].map(str::to_owned);
        assert_eq!(
            expected(&six, "gyro_x"),
            "one of `t`, `gx`, `gy`, `gz`, `ax`, `ay`, `az`"
        );
        let flags = (0..60).map(|k| format!("status_flag_{k}"));
        let many: Vec<String> = flags.chain(["gyro_x".to_owned()]).collect();
        let shown = expected(&many, "gyr_x");
        assert!(shown.starts_with("one of `gyro_x`, `"), "{shown}");
        let count = shown.matches("status_flag").count();
        assert!(
            count > 10 && shown.ends_with(&format!("` and {} more", 60 - count)),
            "{shown}"
        );
    }
}

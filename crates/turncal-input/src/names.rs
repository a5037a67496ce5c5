//! Column names, each of which may be used for one quantity only.

use super::error::{choice, excerpt, nearest};

/// A column as given in `run.toml`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FileColumn {
    /// Name in the file; empty if the triad was not recorded.
    pub name: String,
    /// Whether the values of the column are read with the sign reversed.
    pub reversed: bool,
}

/// Index of an unused column by name or, if no column has this name, by number. The error contains the content found,
/// the content expected and the remedy.
pub fn find(all: &[String], taken: &[usize], name: &str) -> Result<usize, [String; 3]> {
    let mut places: Vec<usize> = (0..all.len()).filter(|&place| all[place] == name).collect();
    if let Ok(number) = name.parse::<usize>()
        && (1..=all.len()).contains(&number)
        && places.is_empty()
    {
        places.push(number - 1);
    }
    let header = || all.iter().map(String::as_str);
    match places[..] {
        [place] if !taken.contains(&place) => Ok(place),
        [_] => Err([
            format!("the column `{name}` used for two quantities"),
            "a separate column for each".to_owned(),
            "Name another column.".to_owned(),
        ]),
        [_, ..] => Err([
            format!("two columns named `{name}`"),
            "a unique name".to_owned(),
            "Refer to the column by its number (the first is `1`), or rename one of the columns."
                .to_owned(),
        ]),
        [] => {
            let advice = "Correct `columns` in run.toml, or the names in this header.";
            Err([
                format!("no column named `{}`", excerpt(name)),
                format!("one of {}", choice(name, header())),
                match nearest(name, header()) {
                    Some(like) => format!("Did you mean `{like}`? {advice}"),
                    None => advice.to_owned(),
                },
            ])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn expected(names: &[String], wanted: &str) -> String {
        let [found, expected, _] = find(names, &[], wanted).unwrap_err();
        assert_eq!(found, format!("no column named `{wanted}`"));
        expected
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

//! Catalogue of the embedded models.

use super::Room;

/// An embedded model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Embedded {
    /// Folder.
    pub room: Room,
    /// Name on the command line and in other models.
    pub name: &'static str,
    text: &'static str,
}

impl Embedded {
    /// All embedded models, folder by folder.
    pub fn all() -> impl Iterator<Item = Self> {
        Room::ALL.into_iter().flat_map(|room| {
            let models = room.embedded();
            models.map(move |(name, text)| Self { room, name, text })
        })
    }

    /// Description: the first sentence of the initial comment of its file.
    pub fn description(&self) -> String {
        let comment = self.text.lines().map_while(|line| line.strip_prefix('#'));
        let words: Vec<&str> = comment
            .map(str::trim)
            .take_while(|line| !line.is_empty())
            .flat_map(str::split_whitespace)
            .collect();
        // A full stop before a lower-case letter or a number belongs to an abbreviation.
        let begins = |word: &&str| word.starts_with(char::is_uppercase);
        let end = (1..=words.len())
            .find(|&k| words[k - 1].ends_with('.') && words.get(k).is_none_or(begins));
        words[..end.unwrap_or(words.len())].join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_embedded_model_says_in_one_sentence_what_it_is() {
        for model in Embedded::all() {
            let description = model.description();
            let told = format!("{} {}: {description}", model.room.name(), model.name);
            assert!(description.ends_with('.'), "{told}");
            assert!((20..200).contains(&description.chars().count()), "{told}");
        }
    }

    #[test]
    fn a_description_ends_with_its_first_sentence() {
        let described = |text| {
            let (room, name) = (Room::Imu, "x");
            Embedded { room, name, text }.description()
        };
        assert_eq!(
            described("# One axis (Eqs. 4 and 7),\n# e.g. this. Another.\n"),
            "One axis (Eqs. 4 and 7), e.g. this."
        );
        assert_eq!(described("# A title\n#\n# More.\n"), "A title");
        assert_eq!(described("form = 1\n# no comment in front"), "");
    }
}

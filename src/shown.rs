//! Text of others as it is shown.

/// A message shows so many characters of one input, no more.
pub(crate) const LONGEST: usize = 200;

/// An input short enough for a message.
pub(crate) fn excerpt(text: &str) -> String {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_excerpt_ends_between_two_characters() {
        assert_eq!(excerpt("µg"), "µg");
        let long = excerpt(&"µ".repeat(1_000_000));
        assert_eq!(long.chars().filter(|&c| c == 'µ').count(), LONGEST);
    }
}

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

/// Text without what a terminal would obey instead of show: controls other than line ends, and marks that turn
/// the direction of writing, are escaped.
pub fn printable(text: &str) -> String {
    let obeyed = |c: char| {
        let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        (c.is_control() && c != '\n') || turns
    };
    if !text.contains(obeyed) {
        return text.to_owned();
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        match obeyed(c) {
            true => shown.extend(c.escape_default()),
            false => shown.push(c),
        }
    }
    shown
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

    #[test]
    fn what_a_terminal_would_obey_is_shown_escaped() {
        assert_eq!(printable("a\u{1b}[31mb\nc"), "a\\u{1b}[31mb\nc");
        assert_eq!(printable("\u{9b}2J\u{202e}\r"), "\\u{9b}2J\\u{202e}\\r");
        assert_eq!(printable("µg °/√h ″"), "µg °/√h ″");
    }
}

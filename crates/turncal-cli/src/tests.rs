use clap::error::ErrorKind;
use clap::{Command, CommandFactory};

use super::Cli;

/// What stands below the options of a command and of all below it, with the command's name.
fn closing_words(command: &Command) -> Vec<(String, String)> {
    let words = command.get_after_help().map(ToString::to_string);
    let own = (command.get_name().to_owned(), words.unwrap_or_default());
    let below = command.get_subcommands().flat_map(closing_words);
    std::iter::once(own).chain(below).collect()
}

/// The words of each command line in a text, up to a pipe or a redirection.
fn command_lines(text: &str) -> Vec<Vec<String>> {
    let joined = text.replace("\\\n", " ");
    let begins = |line: &&str| line.starts_with("turncal ");
    let lines = joined.lines().map(|line| line.trim_start());
    let lines = lines.map(|line| line.trim_start_matches("Example:").trim());
    lines
        .filter(begins)
        .map(|line| {
            let words = line.split_whitespace();
            let words = words.take_while(|word| !["|", ">"].contains(word));
            words.map(|word| word.trim_matches('\'').into()).collect()
        })
        .collect()
}

#[test]
fn the_arguments_fit_together() {
    Cli::command().debug_assert();
}

#[test]
fn every_command_has_examples_and_each_of_them_parses() {
    for (command, words) in closing_words(&Cli::command()) {
        let lines = command_lines(&words);
        assert!(!lines.is_empty(), "{command} has no example");
        // A manual page indents them by seven columns and has a margin of two.
        let examples = words.split("\n\n").next().unwrap_or_default();
        let widest = examples.lines().map(|line| line.chars().count()).max();
        assert!(widest <= Some(70), "{examples}");
        for line in lines {
            if let Err(error) = Cli::command().try_get_matches_from(&line) {
                assert_eq!(error.kind(), ErrorKind::DisplayHelp, "{line:?}: {error}");
            }
        }
    }
}

#[test]
fn what_begins_a_sentence_of_help_ends_without_a_full_stop() {
    fn check(command: &Command) {
        let about = command.get_about().map(ToString::to_string);
        let about = about.unwrap_or_default();
        assert!(!about.is_empty() && !about.ends_with('.'), "{about:?}");
        command.get_subcommands().for_each(check);
    }
    check(&Cli::command());
}

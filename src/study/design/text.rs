//! A designed path as the text of a path file.

use super::machine::Machine;
use super::turn::Turn;

/// Widest line of a comment.
const WIDTH: usize = 110;

/// The text of a path file with dwells of this duration in s, below a comment.
pub fn text(machine: &Machine, turns: &[Turn], dwell: f64, comment: &str) -> String {
    let list = |values: &[i32]| {
        let values = values.iter().map(i32::to_string);
        format!("[{}]", values.collect::<Vec<_>>().join(", "))
    };
    // A table has rates, a hand has durations.
    let pace = |turn: &Turn| match machine {
        Machine::Table(_) => turn.rate.to_string(),
        Machine::Hand => machine.duration(turn).to_string(),
    };
    let (kind, start, unit) = match machine {
        Machine::Table(table) => {
            let angles = list(&vec![0; table.axes.len()]);
            ("axes", format!("start_deg = {angles}"), "rate_deg_per_s")
        }
        Machine::Hand => {
            let start = "start_pitch_roll_heading_deg = [0, 0, 0]";
            ("body", start.to_owned(), "move_s")
        }
    };
    let usual = turns.first().map_or("1".to_owned(), pace);
    let step = |turn: &Turn| {
        let own = pace(turn);
        let own = (own != usual).then(|| format!(", {unit} = {own}"));
        let (angles, own) = (list(&turn.degrees), own.unwrap_or_default());
        format!("    {{ turn_deg = {angles}{own} }},\n")
    };
    let steps: String = turns.iter().map(step).collect();
    let acceleration = machine.acceleration();
    format!(
        "{}\nfirst_dwell_s = {dwell}\n\n[{kind}]\n{start}\n{unit} = {usual}\n\
         acceleration_deg_per_s2 = {acceleration}\ndwell_s = {dwell}\nsteps = [\n{steps}]\n",
        commented(comment)
    )
}

/// Lines of a comment.
fn commented(comment: &str) -> String {
    let (mut lines, mut line) = (String::new(), String::from("#"));
    for word in comment.split_whitespace() {
        if line.chars().count() + word.chars().count() >= WIDTH {
            lines += &format!("{line}\n");
            line = String::from("#");
        }
        line += &format!(" {word}");
    }
    lines + &line + "\n"
}

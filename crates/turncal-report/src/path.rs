//! Report on a path: expected σ and table time, the value of each move, the errors that the path does not show, and
//! whether a specification can be decided.

mod shipped;

use serde::Serialize;

use super::navigation;
use super::prelude::*;
use turncal::calibration::{
    Direction, ParameterVector, TermLeftOff, Word, auxiliary_name, parameter_name,
};
use turncal::imu::{AXES, InstallationForm};
use turncal::lot::{Check, Verdict};
use turncal::simulation::Scenario;
use turncal::study::design::Design;
use turncal::study::navigation::MethodOutlook;
use turncal::study::path::{Evaluation, PathStudy, Without};
use turncal::turntable::{Moves, Rotation};

/// A term is not observed if more than this fraction of its prior σ remains.
const NOT_SHOWN: f64 = 0.5;
/// Number of combinations of parameters in the data.
const LISTED: usize = 5;

/// A path with its evaluation.
pub struct Report<'a> {
    /// Name of the path.
    pub name: &'a str,
    /// Instrument, table and site in words.
    pub with: &'a str,
    /// All moves in words.
    pub moves: &'a [String],
    /// Expected results.
    pub evaluation: &'a Evaluation,
    /// Limits of the specification that the calibration must decide, if any.
    pub checks: Option<&'a [Check]>,
    /// The design of the path, if it was designed.
    pub design: Option<&'a Design>,
}

/// A combination of parameters or an error term that the path does not show.
#[derive(Serialize)]
struct NotShown {
    what: String,
    /// Remaining part of the prior σ.
    remaining: f64,
    /// Change caused by an error term of typical magnitude, relative to the σ of the group; the largest over all
    /// groups.
    change_in_sigma: Option<f64>,
    shown_by: String,
}

impl Report<'_> {
    /// The report.
    pub fn document(&self) -> Document {
        let navigated = [MethodOutlook {
            method: "EKF",
            outlook: self.evaluation.navigation.clone(),
        }];
        let not_shown = self.not_shown();
        let (word, reason) = self.verdict();
        let mut document = Document::new(format!(
            "Predicted calibration accuracy of the path {}",
            self.name
        ));
        document.lead = vec![format!(
            "{}. The σ are Cramér–Rao bounds for a recording of this path with the stated noise; they are not based on \
             measured data.",
            self.with
        )];
        document.both(self.groups());
        if let Some(design) = self.design {
            for table in shipped::tables(design) {
                document.both(table);
            }
        }
        document.both(self.facts(&navigated));
        document.both(self.moves());
        document.both(table(&not_shown));
        navigation::add(&mut document, Ok(&navigated));
        document.data = self.data(json!({ "word": word, "reasons": [reason] }), &not_shown);
        document.verdict = Some((word, reason));
        document
    }

    fn verdict(&self) -> (Word, String) {
        let time = duration(self.evaluation.duration);
        let unobserved = self.evaluation.bound.observability.unobserved().count();
        let (word, text) = match (self.checks, self.not_decided().len(), unobserved) {
            (Some(_), 0, _) => (
                Word::Pass,
                "a unit whose values are nominal passes every limit".to_owned(),
            ),
            (Some(checks), open, _) => (
                Word::Undecided,
                format!(
                    "the σ are too large to decide {open} of {} limits",
                    checks.len()
                ),
            ),
            (None, _, 0) => (Word::Good, "the path determines every parameter".to_owned()),
            (None, _, unobserved) => (
                Word::UseWithCare,
                format!(
                    "the σ of {} of parameters is still more than half of the prior σ",
                    several(unobserved, "combination")
                ),
            ),
        };
        (word, format!("after {time}, {text}"))
    }

    /// Parameters with a limit for which σ is too large.
    fn not_decided(&self) -> Vec<String> {
        let checks = self.checks.into_iter().flatten();
        let open = checks.filter(|check| check.verdict != Verdict::Pass);
        let name = |check: &Check| parameter_name(InstallationForm::General, check.limit.parameter);
        open.filter_map(name).collect()
    }

    /// Expected σ and prior σ of each group, and the number of limits that are decided.
    fn groups(&self) -> Table {
        let bound = &self.evaluation.bound;
        let sigma = bound.estimate.sigma();
        let row = |group: Group| {
            let with_unit = |value: f64| format!("{} {}", three_digits(value), group.unit());
            let (largest, rms) = group
                .spread(&sigma, &group.estimated(&bound.estimate))
                .unzip();
            let prior = group.rms(&bound.prior_sigma, &bound.estimate);
            let mut row = vec![group.title()];
            row.extend([rms, largest, prior].map(|of| or_dash(of, with_unit)));
            row.extend(self.checks.map(|checks| decided(group, checks)));
            row
        };
        let columns = ["", "expected 1σ", "largest 1σ", "prior 1σ"].into_iter();
        Table::new("Accuracy", columns.chain(self.checks.map(|_| "decided")))
            .section(Group::all().map(row))
            .note("Expected 1σ: RMS over the parameters of the group.")
    }

    fn facts(&self, navigated: &[MethodOutlook]) -> Facts {
        let [time, standing] = [self.evaluation.duration, self.evaluation.standing].map(duration);
        let mut facts = Facts::default();
        facts.push("time", format!("{time}, including {standing} at rest"));
        let not_decided = self.not_decided();
        if !not_decided.is_empty() {
            facts.push("not decided", not_decided.join(", "));
        }
        facts.push("navigation", navigation::line(navigated));
        facts
    }

    /// σ of each group without the information from each move, divided by σ with all moves.
    fn moves(&self) -> Table {
        let (estimate, all) = (
            &self.evaluation.bound.estimate,
            self.evaluation.bound.estimate.sigma(),
        );
        let row = |(number, without): (usize, &Without)| {
            let name = self.moves.get(number).map_or("", String::as_str);
            let mut row = cells![(number + 1).to_string(), name, value(without.time, 1.0)];
            row.extend(Group::all().map(|group| {
                let [without, all] = [&without.sigma, &all].map(|v| group.rms(v, estimate));
                let ratio = without.zip(all).map(|(without, all)| without / all);
                or_dash(ratio, |ratio| format!("{ratio:.2}"))
            }));
            row
        };
        let columns = cells!["", "move", "s"].into_iter();
        let columns = columns.chain(Group::all().map(Group::short));
        let mut table = Table::new("σ without each move, divided by the σ with all moves", columns)
            .section(self.evaluation.without.iter().enumerate().map(row))
            .note("If the move is left out of a path, the dwell after it is missing too. Evaluate a shortened path before you use \
            it.");
        table.optional = vec![2];
        table
    }

    /// Combinations of parameters, then error terms with the largest effect first.
    fn not_shown(&self) -> Vec<NotShown> {
        let combinations = self.evaluation.bound.observability.unobserved();
        let combinations = combinations.map(|of| NotShown {
            what: of.words.clone(),
            remaining: of.remaining,
            change_in_sigma: None,
            shown_by: shown_by(of),
        });
        let terms = self.evaluation.left_off.iter();
        let terms = terms.filter(|of| of.remaining > NOT_SHOWN);
        let terms = terms.map(|of| NotShown {
            what: of.term.name().to_owned(),
            remaining: of.remaining,
            change_in_sigma: self.change_in_sigma(of),
            shown_by: of.term.shown_by().to_owned(),
        });
        let mut terms: Vec<NotShown> = terms.collect();
        let change = |of: &NotShown| of.change_in_sigma.unwrap_or_default();
        terms.sort_by(|a, b| change(b).total_cmp(&change(a)));
        combinations.chain(terms).collect()
    }

    fn change_in_sigma(&self, of: &TermLeftOff) -> Option<f64> {
        let estimate = &self.evaluation.bound.estimate;
        let sigma = estimate.sigma();
        let rms = |v: &ParameterVector, group: Group| group.rms(v, estimate);
        let changes =
            Group::all().filter_map(|group| Some(rms(&of.change, group)? / rms(&sigma, group)?));
        changes.reduce(f64::max)
    }

    /// Name, unit, expected σ and prior σ of every estimated parameter.
    fn parameters(&self) -> Map<String, Value> {
        let bound = &self.evaluation.bound;
        let (form, sigma) = (bound.estimate.form(), bound.estimate.sigma());
        let figures = |name: Option<String>, unit: &str, sigma: f64, prior: f64| {
            let figures = json!({ "sigma": sigma, "prior_sigma": prior, "unit": unit });
            Some((name?, figures))
        };
        let parameters = bound.estimate.estimated().filter_map(|k| {
            let (name, group) = (parameter_name(form, k), Group::of(k));
            let [sigma, prior] = [sigma[k], bound.prior_sigma[k]].map(|of| of / group.unit_value());
            figures(name, group.unit(), sigma, prior)
        });
        let of_terms = bound.auxiliary.sigma();
        let terms = bound.auxiliary.estimated().filter_map(|k| {
            let prior = bound.auxiliary.prior_sigma[k];
            figures(auxiliary_name(k), "SI", of_terms[k], prior)
        });
        parameters.chain(terms).collect()
    }

    fn by_group(&self, v: &ParameterVector) -> Map<String, Value> {
        let estimate = &self.evaluation.bound.estimate;
        let rms = Group::all().map(|group| (group.key(), group.rms(v, estimate).into()));
        rms.collect()
    }

    fn data(&self, verdict: Value, not_shown: &[NotShown]) -> Value {
        let evaluation = self.evaluation;
        let directions = evaluation.bound.observability.directions.iter();
        let without = evaluation.without.iter().enumerate().map(|(k, of)| {
            json!({ "move": self.moves.get(k), "time_s": of.time, "sigma": self.by_group(&of.sigma) })
        });
        json!({
            "path": self.name,
            "verdict": verdict,
            "aiding": evaluation.aiding,
            "duration_s": evaluation.duration,
            "standing_s": evaluation.standing,
            "sigma": self.by_group(&evaluation.bound.estimate.sigma()),
            "parameters": self.parameters(),
            "weakest": directions.take(LISTED).collect::<Vec<_>>(),
            "without": without.collect::<Value>(),
            "not_shown": not_shown,
            "not_decided": self.checks.map(|_| self.not_decided()),
            "same_time": self.design.map(shipped::data),
        })
    }
}

fn table(all: &[NotShown]) -> Table {
    let row = |of: &NotShown| {
        cells![
            of.what.as_str(),
            three_digits(100.0 * of.remaining),
            or_dash(of.change_in_sigma, three_digits),
            of.shown_by.as_str(),
        ]
    };
    Table::new(
        "Not shown by this path",
        columns("| prior σ left, % | could change, σ | shown by"),
    )
    .section(all.iter().map(row))
    .note(
        "Combinations of parameters, and error terms that are not estimated, whose σ stays above half of the prior σ. \
         Could change: RMS change, in units of σ, of the group that a term of typical magnitude affects most.",
    )
}

/// Moves that show a combination of parameters, by its largest part.
fn shown_by(direction: &Direction) -> String {
    let parts = direction.parts.iter();
    let largest = parts.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let name = largest.map_or("", |(name, _)| name.as_str());
    // If there are two axes, the second is the axis of rotation or the upward axis.
    let axis = name.chars().last().unwrap_or_default();
    match (name.starts_with("gyro"), name.contains("bias")) {
        (true, true) => format!("longer dwells with {axis} in several directions"),
        (true, false) => format!("turns about {axis}"),
        (false, _) => format!("dwells with {axis} up and down"),
    }
}

/// Number of decided limits of a group.
fn decided(group: Group, checks: &[Check]) -> String {
    let of_group = checks.iter();
    let of_group = of_group.filter(|check| Group::of(check.limit.parameter) == group);
    let passed = |check: &&Check| check.verdict == Verdict::Pass;
    match of_group.clone().count() {
        0 => NONE.to_owned(),
        all => format!("{} of {all}", of_group.filter(passed).count()),
    }
}

/// Instrument, table and site in words.
pub fn in_words(study: &PathStudy) -> String {
    let scenario = &study.scenario;
    let table = if study.by_hand {
        "turned by hand"
    } else {
        &scenario.table_name
    };
    format!(
        "Instrument {}, {table}, {:.0} Hz, latitude {:.1}°",
        scenario.instrument.name,
        1.0 / scenario.integrator.period,
        scenario.site.latitude / DEGREE
    )
}

/// All moves of a scenario in words.
pub fn moves_in_words(scenario: &Scenario) -> Vec<String> {
    let degrees = |angle: f64| format!("{:+.0}°", angle / DEGREE).replace('-', "−");
    match &scenario.path.moves {
        Moves::Axes { steps, .. } => {
            let step = |angles: &[f64]| {
                let axes = scenario.table.axes.iter().zip(angles);
                let turned = axes.filter(|(_, angle)| **angle != 0.0);
                let words =
                    turned.map(|(axis, angle)| format!("{} {}", axis.name, degrees(*angle)));
                words.collect::<Vec<_>>().join(", ")
            };
            steps.iter().map(|of| step(&of.angles)).collect()
        }
        Moves::Body { steps, .. } => steps.iter().map(|of| rotation(&of.rotation)).collect(),
    }
}

fn rotation(rotation: &Rotation) -> String {
    let vector = match rotation {
        Rotation::By(vector) => vector / DEGREE,
        Rotation::Point { axis, .. } => *axis,
    };
    let axes = AXES.into_iter().zip(&vector);
    let along = axes.filter(|(_, part)| **part != 0.0);
    match rotation {
        Rotation::By(_) => {
            let words = along.map(|(axis, angle)| format!("{axis} {angle:+.0}°").replace('-', "−"));
            format!("turn {}", words.collect::<Vec<_>>().join(", "))
        }
        Rotation::Point { along: to, .. } => {
            let words = along.map(|(axis, part)| signed_axis(axis, *part));
            let words = words.collect::<String>();
            if to.z > 0.999 {
                format!("{words} up")
            } else {
                format!("{words} along ({:.2}, {:.2}, {:.2})", to.x, to.y, to.z)
            }
        }
    }
}

//! Report on a path: expected σ and table time, the value of each move, what the path does not show, and whether it
//! decides a specification.

use serde::Serialize;

use super::navigation;
use super::prelude::*;
use turncal::calibration::{
    Direction, ParameterVector, TermLeftOff, Word, auxiliary_name, parameter_name,
};
use turncal::imu::{AXES, InstallationForm};
use turncal::lot::{Check, Verdict};
use turncal::run::Aiding;
use turncal::simulation::Scenario;
use turncal::study::navigation::MethodOutlook;
use turncal::study::path::{Evaluation, PathStudy};
use turncal::turntable::{Moves, Rotation};

/// A term is not observed if more than this part of its prior σ remains.
const NOT_SHOWN: f64 = 0.5;
/// Number of combinations of parameters in the data.
const LISTED: usize = 5;

/// A path with its evaluation.
pub struct Report<'a> {
    /// Name of the path.
    pub name: &'a str,
    /// Instrument, table and site in words.
    pub with: &'a str,
    /// Each move in words.
    pub moves: &'a [String],
    /// Its expected results.
    pub evaluation: &'a Evaluation,
    /// Limits of the specification that the calibration is to decide, if any.
    pub checks: Option<&'a [Check]>,
}

/// The figures of the report; those of groups are the RMS over the parameters, in the unit of the group.
#[derive(Serialize)]
struct Figures<'a> {
    path: &'a str,
    verdict: VerdictFigures,
    aiding: Aiding,
    duration_s: f64,
    standing_s: f64,
    sigma: ByName<Option<f64>>,
    parameters: ByName<ParameterFigures>,
    weakest: &'a [Direction],
    without: Vec<WithoutFigures<'a>>,
    not_shown: Vec<NotShown>,
    terms_left_off: Vec<TermFigures>,
    #[serde(skip_serializing_if = "Option::is_none")]
    limits: Option<Vec<LimitFigures>>,
}

#[derive(Serialize)]
struct VerdictFigures {
    word: Word,
    reasons: [String; 1],
}

#[derive(Serialize)]
struct ParameterFigures {
    sigma: f64,
    prior_sigma: f64,
    unit: &'static str,
}

#[derive(Serialize)]
struct WithoutFigures<'a> {
    r#move: Option<&'a String>,
    time_s: f64,
    sigma: ByName<Option<f64>>,
}

/// A combination of parameters or an error term that the path does not determine.
#[derive(Serialize)]
struct NotShown {
    what: String,
    /// Remaining part of the prior σ.
    remaining: f64,
    /// Largest change of a group, relative to σ, by an error term of usual size.
    could_change: Option<String>,
    shown_by: String,
}

#[derive(Serialize)]
struct TermFigures {
    term: &'static str,
    remaining: f64,
    change: ByName<Option<f64>>,
}

#[derive(Serialize)]
struct LimitFigures {
    parameter: Option<String>,
    decided: bool,
}

impl Report<'_> {
    /// The report.
    pub fn document(&self) -> Document {
        let (word, reason) = self.verdict();
        let figures = self.figures((word, reason.clone()));
        let navigated = [MethodOutlook {
            method: "EKF",
            outlook: self.evaluation.navigation.clone(),
        }];
        let mut document = Document::new(format!(
            "Predicted calibration accuracy of the path {}",
            self.name
        ));
        document.verdict = Some((word, reason));
        document.lead = vec![format!(
            "{}. σ are the Cramér–Rao bound for a recording of this path with the stated noise; no data were measured.",
            self.with
        )];
        document.both(self.groups());
        document.both(self.facts(&navigated));
        document.both(moves(&figures));
        document.both(not_shown(&figures.not_shown));
        navigation::add(&mut document, Ok(&navigated));
        document.data = json!(figures);
        document
    }

    fn verdict(&self) -> (Word, String) {
        let time = minutes(self.evaluation.duration);
        let unobserved = self.evaluation.bound.observability.unobserved().count();
        match (self.checks, self.undecided().count(), unobserved) {
            (Some(_), 0, _) => (
                Word::Pass,
                format!("after {time}, a unit at its nominal values passes every limit"),
            ),
            (Some(checks), open, _) => (
                Word::Undecided,
                format!(
                    "after {time}, σ are too large to decide {open} of {} limits",
                    checks.len()
                ),
            ),
            (None, _, 0) => (
                Word::Good,
                format!("the path determines every parameter in {time}"),
            ),
            (None, _, unobserved) => (
                Word::UseWithCare,
                format!(
                    "after {time}, {unobserved} combination(s) of parameters keep more than half of their prior σ"
                ),
            ),
        }
    }

    /// Limits for which σ are too large.
    fn undecided(&self) -> impl Iterator<Item = &Check> {
        let checks = self.checks.into_iter().flatten();
        checks.filter(|check| check.verdict != Verdict::Pass)
    }

    /// Expected σ and prior σ of each group, and the number of limits that are decided.
    fn groups(&self) -> Table {
        let bound = &self.evaluation.bound;
        let sigma = bound.estimate.sigma();
        let row = |group: Group| {
            let indices = group.estimated(&bound.estimate);
            let with_unit = |value: f64| format!("{} {}", three_digits(value), group.unit());
            let (largest, rms) = group.spread(&sigma, &indices).unzip();
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
        let [duration, standing] =
            [self.evaluation.duration, self.evaluation.standing].map(minutes);
        let mut facts = Facts::default();
        facts.push("time", format!("{duration}, including {standing} at rest"));
        let open = self.undecided().map(|check| {
            let parameter = check.limit.parameter;
            let group = Group::of(parameter);
            let name = parameter_name(InstallationForm::General, parameter).unwrap_or_default();
            let in_unit = |value: f64| three_digits(value / group.unit_value());
            let sigma = or_dash(check.off.map(|(_, sigma)| sigma), in_unit);
            let (within, unit) = (in_unit(check.limit.within), group.unit());
            format!("{name} (limit ±{within} {unit}, expected 1σ {sigma} {unit})")
        });
        let open: Vec<String> = open.collect();
        if !open.is_empty() {
            facts.push("not decided", open.join("; "));
        }
        facts.push("navigation", navigation::line(navigated));
        facts
    }

    /// Combinations of parameters, then error terms with the largest effect first.
    fn not_shown(&self) -> Vec<NotShown> {
        let evaluation = self.evaluation;
        let combinations = evaluation.bound.observability.unobserved();
        let combinations = combinations.map(|of| NotShown {
            what: of.words.clone(),
            remaining: of.remaining,
            could_change: None,
            shown_by: shown_by(of),
        });
        let terms = evaluation.left_off.iter();
        let mut terms: Vec<(f64, NotShown)> = terms
            .filter(|of| of.remaining > NOT_SHOWN)
            .filter_map(|of| {
                let (ratio, could_change) = self.effect(of)?;
                let not_shown = NotShown {
                    what: of.term.name().to_owned(),
                    remaining: of.remaining,
                    could_change: Some(could_change),
                    shown_by: of.term.shown_by().to_owned(),
                };
                Some((ratio, not_shown))
            })
            .collect();
        terms.sort_by(|a, b| b.0.total_cmp(&a.0));
        combinations
            .chain(terms.into_iter().map(|(_, term)| term))
            .collect()
    }

    /// Largest effect of a term that is not estimated: relative to the expected σ, and in words.
    fn effect(&self, of: &TermLeftOff) -> Option<(f64, String)> {
        let estimate = &self.evaluation.bound.estimate;
        let sigma = estimate.sigma();
        let effects = Group::all().filter_map(|group| {
            let change = group.rms(&of.change, estimate)?;
            Some((change / group.rms(&sigma, estimate)?, group, change))
        });
        let (ratio, group, change) = effects.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let (name, change, unit) = (group.short(), three_digits(change), group.unit());
        Some((ratio, format!("{name} by {change} {unit}")))
    }

    fn by_group(&self, v: &ParameterVector) -> ByName<Option<f64>> {
        let estimate = &self.evaluation.bound.estimate;
        ByName::of_groups(|group| group.rms(v, estimate))
    }

    /// Expected σ and prior σ of every estimated parameter by name.
    fn parameters(&self) -> ByName<ParameterFigures> {
        let bound = &self.evaluation.bound;
        let (form, sigma) = (bound.estimate.form(), bound.estimate.sigma());
        let parameters = bound.estimate.estimated().filter_map(|k| {
            let group = Group::of(k);
            let figures = ParameterFigures {
                sigma: sigma[k] / group.unit_value(),
                prior_sigma: bound.prior_sigma[k] / group.unit_value(),
                unit: group.unit(),
            };
            Some((parameter_name(form, k)?, figures))
        });
        let of_terms = bound.auxiliary.sigma();
        let terms = bound.auxiliary.estimated().filter_map(|k| {
            let figures = ParameterFigures {
                sigma: of_terms[k],
                prior_sigma: bound.auxiliary.prior_sigma[k],
                unit: "SI",
            };
            Some((auxiliary_name(k)?, figures))
        });
        ByName(parameters.chain(terms).collect())
    }

    fn figures(&self, (word, reason): (Word, String)) -> Figures<'_> {
        let evaluation = self.evaluation;
        let directions = &evaluation.bound.observability.directions;
        let without = evaluation.without.iter().enumerate();
        let terms = evaluation.left_off.iter().map(|of| TermFigures {
            term: of.term.name(),
            remaining: of.remaining,
            change: self.by_group(&of.change),
        });
        let limit = |check: &Check| LimitFigures {
            parameter: parameter_name(InstallationForm::General, check.limit.parameter),
            decided: check.verdict == Verdict::Pass,
        };
        Figures {
            path: self.name,
            verdict: VerdictFigures {
                word,
                reasons: [reason],
            },
            aiding: evaluation.aiding,
            duration_s: evaluation.duration,
            standing_s: evaluation.standing,
            sigma: self.by_group(&evaluation.bound.estimate.sigma()),
            parameters: self.parameters(),
            weakest: directions.get(..LISTED).unwrap_or(directions),
            without: without
                .map(|(k, without)| WithoutFigures {
                    r#move: self.moves.get(k),
                    time_s: without.time,
                    sigma: self.by_group(&without.sigma),
                })
                .collect(),
            not_shown: self.not_shown(),
            terms_left_off: terms.collect(),
            limits: self.checks.map(|checks| checks.iter().map(limit).collect()),
        }
    }
}

/// σ of each group without each move, divided by σ with all moves.
fn moves(figures: &Figures) -> Table {
    let row = |(number, of): (usize, &WithoutFigures)| {
        let name = of.r#move.map_or("", String::as_str);
        let mut row = cells![(number + 1).to_string(), name, value(of.time_s, 1.0)];
        let pairs = of.sigma.0.iter().zip(&figures.sigma.0);
        row.extend(pairs.map(|((_, without), (_, all))| {
            let ratio = without.zip(*all).map(|(without, all)| without / all);
            or_dash(ratio, |ratio| format!("{ratio:.2}"))
        }));
        row
    };
    let columns = cells!["", "move", "s"].into_iter();
    let columns = columns.chain(Group::all().map(Group::short));
    let mut table = Table::new("σ without each move, divided by σ with all moves", columns)
        .section(figures.without.iter().enumerate().map(row))
        .note(
            "Without a move, the dwell after it says nothing about the parameters, and all other moves stay as they \
             are. 1.00: the move and the dwell after it can be left out. Of two equal moves, one can.",
        );
    table.optional = vec![2];
    table
}

fn not_shown(all: &[NotShown]) -> Table {
    let row = |of: &NotShown| {
        cells![
            of.what.as_str(),
            three_digits(100.0 * of.remaining),
            of.could_change.as_deref().unwrap_or(NONE),
            of.shown_by.as_str(),
        ]
    };
    Table::new(
        "Not shown by this path",
        columns("| prior σ left, % | could change | shown by"),
    )
    .section(all.iter().map(row))
    .note(
        "Combinations of parameters, and error terms that are not estimated, that keep more than half of their prior \
         σ. Could change: RMS over the group that changes most relative to its σ, for a term of usual size.",
    )
}

/// Moves that show a combination of parameters, by its largest part.
fn shown_by(direction: &Direction) -> String {
    let parts = direction.parts.iter();
    let largest = parts.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let name = largest.map_or("", |(name, _)| name.as_str());
    // Of two axes, the second is the one that is turned about or points up.
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

/// A time with its unit: seconds below two minutes.
pub fn minutes(seconds: f64) -> String {
    if seconds < 120.0 {
        format!("{} s", value(seconds, 1.0))
    } else {
        format!("{} min", value(seconds / 60.0, 0.1))
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

/// Each move of a scenario in words.
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
            let words = along.map(|(axis, sign)| {
                let minus = if *sign < 0.0 { "−" } else { "" };
                format!("{minus}{axis}")
            });
            let words = words.collect::<String>();
            if to.z > 0.999 {
                format!("{words} up")
            } else {
                format!("{words} along ({:.2}, {:.2}, {:.2})", to.x, to.y, to.z)
            }
        }
    }
}

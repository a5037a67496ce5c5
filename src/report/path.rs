//! Report on a path: expected σ, the value of each move, and errors that the path cannot reveal.

use super::navigation::{self, Navigated};
use super::prelude::*;
use crate::calibration::{ParameterVector, TermLeftOff, Word, auxiliary_name, parameter_name};
use crate::imu::{AXES, InstallationForm};
use crate::lot::{Check, Specification, Verdict};
use crate::simulation::Scenario;
use crate::study::path::{Evaluation, PathStudy, Without};
use crate::survey::decided;
use crate::turntable::{Moves, Rotation};

/// A term is not observed if more than this part of its prior σ remains.
const NOT_SHOWN: f64 = 0.5;
/// Number of combinations of parameters on the page.
const LISTED: usize = 5;
/// Number of error terms and combinations on the terminal.
const NAMED: usize = 2;

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
    /// The specification that the calibration is to decide, if any.
    pub specification: Option<&'a Specification>,
}

impl Report<'_> {
    /// The report.
    pub fn document(&self) -> Document {
        let evaluation = self.evaluation;
        let checks = self
            .specification
            .map(|of| decided(of, &evaluation.bound.estimate));
        let mut document = Document::new(format!(
            "Predicted calibration accuracy of the path {}",
            self.name
        ));
        document.verdict = Some(self.verdict(checks.as_deref()));
        document.lead = vec![format!(
            "{}. σ are the Cramér–Rao bound for a recording of this path with the stated noise; no data were measured.",
            self.with
        )];
        document.both(self.groups(checks.as_deref()));
        document.both(self.facts());
        document.both(self.moves());
        document.page(self.figure());
        document.page(self.terms());
        document.page(self.parameters());
        if let Some(checks) = &checks {
            document.page(limits(checks));
        }
        navigation::add(&mut document, Ok(&self.navigated()));
        document.data = self.data(checks.as_deref());
        document
    }

    fn verdict(&self, checks: Option<&[Check]>) -> (Word, String) {
        let time = minutes(self.evaluation.duration);
        let unobserved = self.evaluation.bound.observability.unobserved().count();
        match checks {
            Some(checks) => {
                let open = checks
                    .iter()
                    .filter(|check| check.verdict != Verdict::Pass)
                    .count();
                let text = match open {
                    0 => format!("after {time}, a unit at its nominal values passes every limit"),
                    open => format!(
                        "after {time}, σ are too large to decide {open} of {} limits",
                        checks.len()
                    ),
                };
                let word = if open == 0 {
                    Word::Pass
                } else {
                    Word::Undecided
                };
                (word, text)
            }
            None if unobserved == 0 => (
                Word::Good,
                format!("the path determines every parameter in {time}"),
            ),
            None => (
                Word::UseWithCare,
                format!(
                    "after {time}, {unobserved} combination(s) of parameters keep more than half of their prior σ"
                ),
            ),
        }
    }

    /// Expected σ and prior σ of each group, and the number of limits that are decided.
    fn groups(&self, checks: Option<&[Check]>) -> Table {
        let bound = &self.evaluation.bound;
        let sigma = bound.estimate.sigma();
        let mut columns = cells!["", "expected 1σ", "largest 1σ", "prior 1σ"];
        columns.extend(checks.map(|_| "decided".to_owned()));
        let row = |group: Group| {
            let indices = group.estimated(&bound.estimate);
            let with_unit = |value: Option<f64>| {
                or_dash(value, |value| {
                    format!("{} {}", three_digits(value), group.unit())
                })
            };
            let spread = group.spread(&sigma, &indices);
            let mut row = vec![
                group.title(),
                with_unit(spread.map(|(_, rms)| rms)),
                with_unit(spread.map(|(largest, _)| largest)),
                with_unit(
                    group
                        .spread(&bound.prior_sigma, &indices)
                        .map(|(_, rms)| rms),
                ),
            ];
            row.extend(checks.map(|checks| how_many(group, checks)));
            row
        };
        Table::new("Expected accuracy", columns)
            .section(Group::all().map(row))
            .note("Expected: RMS of the group's parameters.")
    }

    fn facts(&self) -> Facts {
        let evaluation = self.evaluation;
        let mut facts = Facts::default();
        facts.push(
            "time",
            format!(
                "{}, including {} at rest",
                minutes(evaluation.duration),
                minutes(evaluation.standing)
            ),
        );
        let directions = &evaluation.bound.observability.directions;
        let weakest = directions.iter().take(NAMED);
        let weakest =
            weakest.map(|of| format!("{} ({} % of prior σ)", of.words, percent(of.remaining)));
        facts.push("weakest", weakest.collect::<Vec<_>>().join("; "));
        facts.push("navigation", navigation::line(&self.navigated()));
        let hidden = evaluation.left_off.iter();
        let hidden = hidden.filter(|of| of.remaining > NOT_SHOWN);
        let mut hidden: Vec<_> = hidden.filter_map(|of| self.effect(of)).collect();
        hidden.sort_by(|a, b| b.0.total_cmp(&a.0));
        if !hidden.is_empty() {
            let named = hidden.iter().take(NAMED).map(|(_, text)| text.as_str());
            let mut text = named.collect::<Vec<_>>().join("; ");
            if let more @ 1.. = hidden.len().saturating_sub(NAMED) {
                text += &format!("; {more} more");
            }
            facts.push("unobserved terms", text);
        }
        facts
    }

    /// Largest effect of a term that is not estimated: relative to the expected σ, and in words.
    fn effect(&self, of: &TermLeftOff) -> Option<(f64, String)> {
        let sigma = self.rms(&self.evaluation.bound.estimate.sigma());
        let change = self.rms(&of.change);
        let groups = Group::all().zip(sigma).zip(change);
        let ratio =
            groups.filter_map(|((group, sigma), change)| Some((change? / sigma?, group, change?)));
        let (ratio, group, change) = ratio.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let (change, unit, name) = (three_digits(change), group.unit(), of.term.name());
        Some((
            ratio,
            format!("{name} (could change {} by {change} {unit})", group.short()),
        ))
    }

    /// σ of each group without each move, divided by σ with all moves.
    fn moves(&self) -> Table {
        let all = self.rms(&self.evaluation.bound.estimate.sigma());
        let row = |(number, without): (usize, &Without)| {
            let mut row = cells![
                (number + 1).to_string(),
                self.moves.get(number).map_or("", String::as_str),
                value(without.time, 1.0),
            ];
            let ratios = without.sigma.map(|sigma| self.rms(&sigma));
            row.extend((0..all.len()).map(|k| {
                let ratio = ratios.as_ref().and_then(|of| Some(of[k]? / all[k]?));
                or_dash(ratio, |ratio| format!("{ratio:.2}"))
            }));
            row
        };
        let groups = Group::all().map(Group::short);
        let columns = cells!["", "move", "s"].into_iter().chain(groups);
        let mut table = Table::new("σ without each move, divided by σ with all moves", columns)
            .section(self.evaluation.without.iter().enumerate().map(row))
            .note("1.00: the move and the dwell after it can be left out. Turns are relative, so omitting one changes \
                   all later positions; if the figure is below 1, the path is better without it.");
        table.optional = vec![2];
        table
    }

    /// Error terms that are not estimated: whether the path would reveal them, and their effect on the groups.
    fn terms(&self) -> Table {
        let mut terms: Vec<_> = self.evaluation.left_off.iter().collect();
        terms.sort_by(|a, b| b.remaining.total_cmp(&a.remaining));
        let row = |of: &&TermLeftOff| {
            let mut row = cells![
                of.term.name(),
                if of.remaining > NOT_SHOWN {
                    "no"
                } else {
                    "yes"
                },
            ];
            row.extend(Group::all().map(|group| {
                let indices = group.estimated(&self.evaluation.bound.estimate);
                or_dash(
                    group.spread(&of.change, &indices).map(|(_, rms)| rms),
                    three_digits,
                )
            }));
            row
        };
        let groups = Group::all().map(|group| format!("{}, {}", group.short(), group.unit()));
        let columns = cells!["error term", "observed"].into_iter().chain(groups);
        Table::new("Error terms of usual size that are not estimated, and their effect (RMS, 1σ)", columns)
            .section(terms.iter().map(row))
            .note("Observed: data from this path would halve, at least, the usual σ of every parameter of the term.")
    }

    /// σ of each group against time.
    fn figure(&self) -> Plot {
        let bound = &self.evaluation.bound;
        let form = bound.estimate.form();
        let panel = |group: Group| {
            let indices = group.estimated(&bound.estimate);
            if indices.is_empty() {
                return Panel::blank(format!("{}: all fixed", group.title()));
            }
            let line = |(n, &i): (usize, &usize)| {
                let points = bound.history.iter();
                let points = points.map(|m| (m.time, m.sigma[i] / group.unit_value()));
                Series::line(points).nth(n).label(axis_name(form, i))
            };
            let x = Axis::linear("time, s").between(0.0, self.evaluation.duration);
            Panel::new(group.titled(), x, Axis::log(""))
                .with_all(indices.iter().enumerate().map(line))
        };
        let panels = Group::all().map(panel);
        Plot::new("sigma.svg", "Expected 1σ against time", (3, 330), panels).caption(
            "1σ of every parameter along the path. Where a line stays level, that part of the path does not \
             determine the parameter.",
        )
    }

    /// Expected σ of every parameter.
    fn parameters(&self) -> Table {
        let rows = self.each().map(|(name, unit, sigma, prior)| {
            cells![name, three_digits(sigma), three_digits(prior), unit]
        });
        Table::new(
            "Parameters",
            columns("parameter | expected 1σ | prior 1σ | unit"),
        )
        .section(rows)
        .note("Parameters of estimated error terms are in SI units.")
    }

    /// Name, unit, expected σ and prior σ of every estimated parameter.
    fn each(&self) -> impl Iterator<Item = (String, &'static str, f64, f64)> {
        let bound = &self.evaluation.bound;
        let (form, sigma) = (bound.estimate.form(), bound.estimate.sigma());
        let parameters = bound.estimate.estimated().filter_map(move |k| {
            let group = Group::of(k);
            let unit = group.unit_value();
            let prior = bound.prior_sigma[k] / unit;
            Some((
                parameter_name(form, k)?,
                group.unit(),
                sigma[k] / unit,
                prior,
            ))
        });
        let of_terms = bound.auxiliary.sigma();
        let terms = bound.auxiliary.estimated().filter_map(move |k| {
            Some((
                auxiliary_name(k)?,
                "SI",
                of_terms[k],
                bound.auxiliary.prior_sigma[k],
            ))
        });
        parameters.chain(terms)
    }

    fn navigated(&self) -> [Navigated; 1] {
        [Navigated {
            method: "EKF",
            outlook: self.evaluation.navigation.clone(),
        }]
    }

    /// RMS of each group of σ, in the group's unit.
    fn rms(&self, sigma: &ParameterVector) -> Vec<Option<f64>> {
        let estimate = &self.evaluation.bound.estimate;
        let rms = |group: Group| Some(group.spread(sigma, &group.estimated(estimate))?.1);
        Group::all().map(rms).collect()
    }

    fn by_group(&self, v: &ParameterVector) -> Value {
        let rms = Group::all().map(Group::key).zip(self.rms(v));
        rms.map(|(key, rms)| (key, rms.into()))
            .collect::<Map<_, Value>>()
            .into()
    }

    fn data(&self, checks: Option<&[Check]>) -> Value {
        let evaluation = self.evaluation;
        let bound = &evaluation.bound;
        let (word, reason) = self.verdict(checks);
        let parameters = self.each().map(|(name, unit, sigma, prior)| {
            (
                name,
                json!({ "sigma": sigma, "prior_sigma": prior, "unit": unit }),
            )
        });
        let without = evaluation.without.iter().enumerate().map(|(k, without)| {
            json!({
                "move": self.moves.get(k), "time_s": without.time,
                "sigma": without.sigma.map(|sigma| self.by_group(&sigma)),
            })
        });
        let terms = evaluation.left_off.iter().map(|of| {
            json!({ "term": of.term.name(), "remaining": of.remaining, "change": self.by_group(&of.change) })
        });
        let mut data = json!({
            "path": self.name,
            "verdict": { "word": word, "reasons": [reason] },
            "aiding": evaluation.aiding,
            "duration_s": evaluation.duration,
            "standing_s": evaluation.standing,
            "sigma": self.by_group(&bound.estimate.sigma()),
            "parameters": parameters.collect::<Map<_, _>>(),
            "weakest": bound.observability.directions.iter().take(LISTED).collect::<Vec<_>>(),
            "without": without.collect::<Value>(),
            "terms_left_off": terms.collect::<Value>(),
        });
        if let Some(checks) = checks {
            let limit = |check: &Check| {
                let name = parameter_name(InstallationForm::General, check.limit.parameter);
                json!({ "parameter": name, "decided": check.verdict == Verdict::Pass })
            };
            data["limits"] = checks.iter().map(limit).collect();
        }
        data
    }
}

/// Number of decided limits of a group.
fn how_many(group: Group, checks: &[Check]) -> String {
    let of_group = || {
        checks
            .iter()
            .filter(|check| Group::of(check.limit.parameter) == group)
    };
    let decided = of_group()
        .filter(|check| check.verdict == Verdict::Pass)
        .count();
    match of_group().count() {
        0 => NONE.to_owned(),
        all => format!("{decided} of {all}"),
    }
}

/// Every limit with the expected σ, and whether that is small enough to decide it.
fn limits(checks: &[Check]) -> Table {
    let form = InstallationForm::General;
    let row = |check: &Check| {
        let group = Group::of(check.limit.parameter);
        let unit = group.unit_value();
        cells![
            parameter_name(form, check.limit.parameter).unwrap_or_default(),
            three_digits(check.limit.within / unit),
            or_dash(check.off.map(|(_, sigma)| sigma / unit), three_digits),
            group.unit(),
            if check.verdict == Verdict::Pass {
                "yes"
            } else {
                "no"
            },
        ]
    };
    Table::new("Limits", columns("parameter | within ± | expected 1σ | unit | decided"))
        .section(checks.iter().map(row))
        .note("Decided: a unit at its nominal value would pass with the confidence that the specification requires.")
}

fn percent(part: f64) -> String {
    three_digits(100.0 * part)
}

/// A time with its unit: seconds below two minutes.
pub fn minutes(seconds: f64) -> String {
    match seconds < 120.0 {
        true => format!("{} s", value(seconds, 1.0)),
        false => format!("{} min", value(seconds / 60.0, 0.1)),
    }
}

/// Instrument, table and site in words.
pub fn in_words(study: &PathStudy) -> String {
    let scenario = &study.scenario;
    let table = match study.by_hand {
        true => "turned by hand",
        false => &scenario.table_name,
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
            match to.z > 0.999 {
                true => format!("{words} up"),
                false => format!("{words} along ({:.2}, {:.2}, {:.2})", to.x, to.y, to.z),
            }
        }
    }
}

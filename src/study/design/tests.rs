//! Designed paths against random paths of the same machine in the same time.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::search::Search;
use super::turn::Turn;
use super::*;
use crate::study::path::Named;

/// The σ of one random path in this many are computed exactly: of the best by the σ of joined legs.
const FOR_EACH_EXACT: usize = 25;

/// A path of random turns, with equal dwells that use the whole time.
fn random(search: &Search, random: &mut ChaCha8Rng) -> Vec<Turn> {
    let all = search.legs.machine.turns();
    loop {
        let count = random.random_range(6..=32);
        let turns = (0..count).map(|_| all[random.random_range(0..all.len())].clone());
        let turns: Vec<Turn> = turns.collect();
        if search.dwell(&turns) >= SHORTEST_DWELL && search.legs.machine.are_seen(&turns) {
            return turns;
        }
    }
}

/// Cost of the design, and those of random paths in order.
fn costs(study: &DesignStudy, count: usize) -> (f64, Vec<f64>) {
    let time = study.time.unwrap();
    let setting = &study.setting;
    let table = setting.scenario.table.clone();
    let machine = if setting.by_hand {
        Machine::Hand
    } else {
        Machine::Table(&table)
    };
    let tour = along(
        setting,
        machine.path(&machine.start(), &machine.tour(), 20.0),
    );
    let tour = tour.unwrap();
    let mut legs = Legs::new(machine, &tour).unwrap();
    let goals = study.goals(setting, &tour, time).unwrap();
    let best = study.best(&mut legs, &goals, time).unwrap();
    let compared = legs.compared(&best).unwrap().unwrap();
    let search = Search::new(&mut legs, goals.corrected(&compared), time);
    let mut chacha = ChaCha8Rng::seed_from_u64(7);
    let paths: Vec<Vec<Turn>> = (0..count).map(|_| random(&search, &mut chacha)).collect();
    search.legs.make(paths.iter().map(Vec::as_slice)).unwrap();
    let joined = paths.par_iter().map(|turns| search.cost(turns));
    let mut joined: Vec<(f64, &Vec<Turn>)> = joined
        .map(|cost| cost.unwrap_or(f64::INFINITY))
        .zip(&paths)
        .collect();
    joined.sort_by(|a, b| a.0.total_cmp(&b.0));
    let exact = joined[..count / FOR_EACH_EXACT]
        .par_iter()
        .map(|(_, turns)| {
            let candidate = search.legs.candidate((*turns).clone(), search.dwell(turns));
            candidate.map(|of| goals.cost(&of.expected.sigma(), of.dwell))
        });
    let mut exact: Vec<f64> = exact.collect::<Result<_, _>>().unwrap();
    exact.sort_by(f64::total_cmp);
    let median = joined[count / 2].0;
    exact.push(median);
    (goals.cost(&best.expected.sigma(), best.dwell), exact)
}

/// The design is compared by its own cost, the mean of σ relative to the best of all embedded paths. `RANDOM_PATHS`
/// paths for each machine, 100 by default.
#[test]
#[ignore = "minutes"]
fn a_designed_path_is_better_than_the_best_of_many_random_ones() {
    let count = std::env::var("RANDOM_PATHS").map_or(100, |count| count.parse().unwrap());
    for (scenario, by_hand, time) in [
        ("demo", false, 524.6),
        ("mems", false, 524.6),
        ("two-axis", false, 520.0),
        ("mems", true, 600.0),
    ] {
        for auto_terms in [false, true] {
            let mut setting = PathStudy::setting(&Named {
                scenario: Some(scenario),
                by_hand,
                ..Named::default()
            })
            .unwrap();
            setting.options.auto_terms = auto_terms;
            let study = DesignStudy {
                setting,
                specification: None,
                time: Some(time),
            };
            let (designed, random) = costs(&study, count);
            let [best, .., median] = random[..] else {
                unreachable!()
            };
            println!(
                "{scenario} by hand {by_hand} auto {auto_terms}: design {designed:.3}, random best {best:.3} ({:.3} \
                 of the design), median {median:.3}",
                best / designed
            );
            assert!(designed < best, "{scenario} {by_hand} {auto_terms}");
        }
    }
}

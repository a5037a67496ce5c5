//! The dwells in which causes are searched.

use std::collections::BTreeSet;

use crate::calibration::Innovation;

/// At most this many dwells are tested: half selected by innovation, half evenly spaced. Every tested constant is a
/// column of every row, so memory would grow with the square of the number of dwells.
const HALF: usize = 20;

/// The dwells in which causes are searched: all, or in long recordings those with the largest innovations and, as a
/// reference for chance, some evenly spaced ones.
pub struct Tried {
    dwells: BTreeSet<usize>,
    evenly: BTreeSet<usize>,
}

impl Tried {
    /// Selects dwells out of `count` by the innovations of a pass.
    pub fn of(count: usize, innovations: &[Innovation]) -> Self {
        if count <= 2 * HALF {
            let all: BTreeSet<usize> = (0..count).collect();
            return Self {
                dwells: all.clone(),
                evenly: all,
            };
        }
        let evenly: BTreeSet<usize> = (0..HALF).map(|k| k * count / HALF).collect();
        let each = innovations.chunk_by(|one, other| one.dwell == other.dwell);
        let mut each: Vec<(f64, usize)> = each.map(|of| (size(of), of[0].dwell)).collect();
        each.sort_by(|a, b| b.0.total_cmp(&a.0));
        let largest = each.iter().map(|of| of.1).take(HALF);
        Self {
            dwells: evenly.iter().copied().chain(largest).collect(),
            evenly,
        }
    }

    /// Whether causes are searched in a dwell.
    pub fn contains(&self, dwell: usize) -> bool {
        self.dwells.contains(&dwell)
    }

    /// Whether it belongs to the reference for chance.
    pub fn evenly(&self, dwell: usize) -> bool {
        self.evenly.contains(&dwell)
    }
}

/// Size of the innovations of a dwell, as χ²: of the first, which shows the previous move, or of their sum, which shows
/// lasting errors.
fn size(of_dwell: &[Innovation]) -> f64 {
    let first = of_dwell.first().map_or(0.0, Innovation::distance);
    let sum = |axis: usize| of_dwell.iter().map(|of| of.whitened[axis]).sum::<f64>();
    let lasting = (0..3).map(|axis| sum(axis).powi(2)).sum::<f64>() / of_dwell.len() as f64;
    first.max(lasting)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Observation;

    /// Four innovations of a dwell, of these sizes along East.
    fn of_dwell(dwell: usize, sizes: [f64; 4]) -> impl Iterator<Item = Innovation> {
        sizes.into_iter().map(move |size| Innovation {
            time: dwell as f64,
            observation: Observation::Velocity,
            whitened: [size, 0.0, 0.0],
            sigma: [1.0; 3],
            accepted: true,
            dwell,
            after_move: true,
        })
    }

    fn tried(count: usize) -> Tried {
        let innovations = (0..count).flat_map(|dwell| {
            let chance = 1e-3 * dwell as f64;
            let sizes = match dwell {
                // What a move left, and what lasts though no innovation is large.
                73 => [5.0, 0.1, -0.1, 0.0],
                91 => [0.0, 1.5, 1.5, 1.5],
                // A single one in the middle says nothing of the move, and next to nothing of what lasts.
                31 => [0.0, 1.0, -1.0, 0.0],
                _ => [chance, -chance, chance, -chance],
            };
            of_dwell(dwell, sizes)
        });
        Tried::of(count, &innovations.collect::<Vec<_>>())
    }

    #[test]
    fn of_many_dwells_some_evenly_and_those_of_the_largest_innovations_are_tried() {
        let tried = tried(101);
        let all: Vec<usize> = (0..101).filter(|&dwell| tried.contains(dwell)).collect();
        let evenly: Vec<usize> = (0..101).filter(|&dwell| tried.evenly(dwell)).collect();
        assert_eq!(evenly.len(), HALF);
        assert!(
            evenly
                .windows(2)
                .all(|pair| (5..=6).contains(&(pair[1] - pair[0])))
        );
        assert!(evenly.iter().all(|dwell| all.contains(dwell)));
        assert!(all.len() > HALF && all.len() <= 2 * HALF);
        for dwell in [73, 91] {
            assert!(tried.contains(dwell) && !tried.evenly(dwell), "{dwell}");
        }
        // Of the others, those with the largest first innovation.
        let others: Vec<usize> = (0..101).filter(|dwell| !all.contains(dwell)).collect();
        assert!(others.contains(&31));
        assert!(
            others.iter().all(|&dwell| dwell < 101 - HALF + 1),
            "{others:?}"
        );
    }

    #[test]
    fn of_few_dwells_all_are_tried_and_show_chance() {
        let tried = tried(2 * HALF);
        assert!((0..2 * HALF).all(|dwell| tried.contains(dwell) && tried.evenly(dwell)));
    }
}

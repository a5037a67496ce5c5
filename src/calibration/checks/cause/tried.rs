//! The dwells in which causes are looked for.

use std::collections::BTreeSet;

use crate::calibration::{Innovation, Problem};

/// Half as many dwells at most are tried because of their innovations, and as many evenly: every constant that is tried
/// is a column of every row, so that a day of dwells would take its square in memory.
const HALF: usize = 20;

/// The dwells in which causes are looked for: all, or in long records those of the largest innovations and, as a sample of
/// chance, some evenly over the record.
pub struct Tried {
    dwells: BTreeSet<usize>,
    evenly: BTreeSet<usize>,
}

impl Tried {
    /// By the innovations of a pass.
    pub fn of(problem: &Problem, innovations: &[Innovation]) -> Self {
        let count = problem.dwells().count();
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

    /// Whether causes are looked for in a dwell.
    pub fn contains(&self, dwell: usize) -> bool {
        self.dwells.contains(&dwell)
    }

    /// Whether it is one of those that show chance.
    pub fn evenly(&self, dwell: usize) -> bool {
        self.evenly.contains(&dwell)
    }
}

/// How large the innovations of a dwell are: the first, which shows the move before it, or their sum, which shows what
/// lasts, each as χ².
fn size(of_dwell: &[Innovation]) -> f64 {
    let first = of_dwell.first().map_or(0.0, Innovation::distance);
    let sum = |axis: usize| of_dwell.iter().map(|of| of.whitened[axis]).sum::<f64>();
    let lasting = (0..3).map(|axis| sum(axis).powi(2)).sum::<f64>() / of_dwell.len() as f64;
    first.max(lasting)
}

//! Averaging over the absence and the sizes of constants that may be absent.

use nalgebra::{DMatrix, DVector};

use super::averages::{ABSENT, Average};
use crate::calibration::constants::{Information, Sites};
use crate::calibration::{Candidate, Constant, Known, Model, Prior};

/// Initial size of a term over its usual size.
const NEXT_TO_ABSENT: f64 = 0.01;

/// Constants that may be absent, in groups, with the average over their cases.
#[derive(Debug, Clone)]
pub struct Candidates {
    all: Vec<Candidate>,
    /// Positions of the constants of each candidate among the constants that may be absent.
    places: Vec<Vec<usize>>,
    average: Average,
}

impl Candidates {
    /// The candidates among constants, before averaging.
    pub fn new(constants: &[Constant], model: &Model) -> Self {
        let mut all = Vec::new();
        let mut places = Vec::<Vec<usize>>::new();
        let candidates = constants.iter().filter_map(|&of| Candidate::of(of, model));
        for (place, candidate) in candidates.enumerate() {
            match all.iter().position(|&of| of == candidate) {
                Some(k) => places[k].push(place),
                None => {
                    all.push(candidate);
                    places.push(vec![place]);
                }
            }
        }
        Self {
            average: begun(&all, &places),
            all,
            places,
        }
    }

    /// The candidates with the probability that each is absent.
    pub fn absent(&self) -> impl Iterator<Item = (Candidate, f64)> + '_ {
        let absent = self.average.absent.iter().copied();
        self.all.iter().copied().zip(absent)
    }

    /// The candidates with the positions of their constants among those that may be absent.
    pub fn places(&self) -> impl Iterator<Item = (Candidate, &[usize])> {
        self.all
            .iter()
            .copied()
            .zip(self.places.iter().map(Vec::as_slice))
    }

    /// Normal priors that represent the average, for errors of the linearisation point of this prior.
    pub fn sites(&self, prior: &Prior) -> Sites {
        let (usual, at) = usual_and_values(prior);
        let inverse = DMatrix::from_diagonal(&usual.map(f64::recip));
        let matrix = &inverse * &self.average.precision * &inverse;
        Sites {
            between: &inverse * &self.average.between * &inverse,
            information: Information {
                vector: -(&matrix * at),
                matrix,
            },
        }
    }

    /// Restarts the average.
    pub fn begin(&mut self) {
        self.average = begun(&self.all, &self.places);
    }

    /// Averages over all cases, given the information on the constants; returns the largest change of a probability,
    /// which is infinite if there is no average.
    pub fn weigh(&mut self, known: &Known, prior: &Prior) -> f64 {
        if self.all.is_empty() {
            return 0.0;
        }
        let (usual, at) = usual_and_values(prior);
        let of_data = known.of_candidates();
        let scale = DMatrix::from_diagonal(&usual);
        let data = Information {
            vector: &scale * (of_data.vector + &of_data.matrix * at),
            matrix: &scale * of_data.matrix * &scale,
        };
        let found = begun(&self.all, &self.places).given(&data, &self.places);
        let Some(found) = found else {
            return f64::INFINITY;
        };
        let pairs = found.absent.iter().zip(&self.average.absent);
        let change = pairs.map(|(now, before)| (now - before).abs());
        let change = change.fold(0.0, f64::max);
        self.average = found;
        change
    }
}

/// Starts terms almost absent, because all of them together could explain everything else, and orders of temperature
/// with their usual sizes, because nothing else explains the effect of warming.
fn begun(all: &[Candidate], places: &[Vec<usize>]) -> Average {
    let size = |of: &Candidate| match of {
        Candidate::Order(..) => 1.0,
        Candidate::Term(_) | Candidate::EarthRate => NEXT_TO_ABSENT,
    };
    // Every parameter changes with temperature; if it is warmed only once, its rate of change has the same effect.
    let absent = |of: &Candidate| match of {
        Candidate::Order(_, _, 0) => 0.0,
        _ => ABSENT,
    };
    let sizes: Vec<f64> = all.iter().map(size).collect();
    Average::begun(places, &sizes, all.iter().map(absent).collect())
}

/// Usual size of each constant that may be absent, and its value at the linearisation point.
fn usual_and_values(prior: &Prior) -> (DVector<f64>, DVector<f64>) {
    let (n, m) = (prior.sigma.len(), prior.candidates);
    (
        prior.sigma.rows(n - m, m).into_owned(),
        -prior.mean.rows(n - m, m),
    )
}

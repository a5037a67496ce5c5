use nalgebra::{DVector, RowSVector, Vector1};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::equations::{Event, Partials};
use super::*;
use crate::calibration::{PARAMETERS, ParameterVector};
use crate::imu::{GaussMarkov, Noise};

/// Equations of some unknowns over these events, with errors of every kind.
fn equations(events: usize, correlated: bool) -> Equations {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut sigma = ParameterVector::zeros();
    for k in [0, 4, 9, 13, 21] {
        sigma[k] = 10.0f64.powi(k as i32 % 3);
    }
    let mean = ParameterVector::from_fn(|_, _| rng.random_range(-1.0..1.0));
    let mut equations = Equations::new(&mean, &sigma);
    equations.correlated = correlated;
    let noise = PerSensor {
        gyro: Noise {
            random_walk: 0.0,
            gauss_markov: Some(GaussMarkov {
                sigma: 0.7,
                correlation_time: 12.0,
            }),
        },
        accel: Noise::default(),
    };
    for event in 0..events {
        let begin = 3.0 * event as f64;
        let times = [begin, begin + 2.0 + (event % 2) as f64];
        let recording = 2 * event / events;
        let white = [0.3, 0.5];
        equations.events.push(Event {
            recording,
            times,
            variance: PerSensor {
                gyro: white[0] + noise.gyro.covariance_of_means(times, times),
                accel: white[1],
            },
            noise,
        });
        let mut errors = vec![Common::Table(0), Common::Table(4)];
        errors.extend([Common::Unit(event / 3), Common::Unit(1000 + event)]);
        errors
            .extend([event, (event + 1).min(events - 1)].map(|k| Common::Noise(Sensor::Accel, k)));
        errors.push(Common::Noise(Sensor::Gyro, event));
        errors.dedup();
        for _ in 0..4 {
            let mut by = |size: f64| RowVector3::from_fn(|_, _| rng.random_range(-size..size));
            let common = errors.iter().map(|of| (*of, by(0.8))).collect();
            let partials: Partials<1> =
                RowSVector::<f64, PARAMETERS>::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let residual = Vector1::new(rng.random_range(-3.0..3.0));
            equations.add(&Rows {
                event,
                weighted: Vector1::new(rng.random_range(0.5..2.0)),
                own: Vector1::new(rng.random_range(0.1..0.4)),
                common,
                ..Rows::new(partials, residual, 0.0)
            });
        }
    }
    equations
}

/// Design, residuals and covariance of the errors of all rows.
fn dense(equations: &Equations) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
    let rows = &equations.rows;
    let weights = DVector::from_fn(rows.len(), |k, _| rows[k].weighted.x.sqrt());
    let errors = equations
        .errors()
        .component_mul(&(&weights * weights.transpose()));
    let unknown = equations.unknown.len();
    let rows_of = rows.iter().flat_map(|row| equations.partials(row));
    let design = DMatrix::from_row_iterator(rows.len(), unknown, rows_of);
    (
        design,
        DVector::from_fn(rows.len(), |k, _| rows[k].residual.x),
        errors,
    )
}

fn assert_near(found: &DMatrix<f64>, expected: &DMatrix<f64>) {
    let off = (found - expected).amax() / expected.amax();
    assert!(off < 1e-9, "{off:e}: {found} {expected}");
}

/// The rows of the unknowns.
fn of_unknowns<const N: usize>(
    equations: &Equations,
    whole: &nalgebra::SMatrix<f64, PARAMETERS, N>,
) -> DMatrix<f64> {
    DMatrix::from_fn(equations.unknown.len(), N, |i, j| {
        whole[(equations.unknown[i], j)]
    })
}

#[test]
fn elimination_event_by_event_gives_the_same_as_the_whole_covariance() {
    let equations = equations(9, true);
    let (design, residual, errors) = dense(&equations);
    let inverse = errors.cholesky().unwrap().inverse();
    let information = design.tr_mul(&inverse) * &design;
    let vector = design.tr_mul(&inverse) * &residual;
    let solution = equations.solved().unwrap();
    let by_rows = information.clone().cholesky().unwrap().solve(&vector);
    let chi_square = residual.dot(&(&inverse * &residual)) - vector.dot(&by_rows);
    approx::assert_relative_eq!(
        solution.residuals.chi_square,
        chi_square,
        max_relative = 1e-9
    );
    assert_eq!(solution.residuals.degrees, 36 - 5);
    let growth = solution.residuals.growth();
    assert!(growth > 1.0);
    let prior = DMatrix::from_diagonal(&equations.sigma.map(|sigma| sigma.powi(-2)));
    let of_prior = equations.mean.component_div(&equations.sigma);
    let covariance = |growth: f64| {
        let sum = &information / growth.powi(2) + &prior;
        sum.cholesky().unwrap().inverse()
    };
    let step = covariance(growth) * (&vector / growth.powi(2) + of_prior);
    let found = of_unknowns(&equations, &solution.step);
    assert_near(&found, &DMatrix::from_column_slice(5, 1, step.as_slice()));
    assert_near(
        &of_unknowns(&equations, &solution.covariance).select_columns(&equations.unknown),
        &covariance(growth),
    );
    for number in [0, 4] {
        let of_table = |row: &Rows<1>| {
            let mut common = row.common.iter();
            common
                .find(|(of, _)| *of == Common::Table(number))
                .unwrap()
                .1
        };
        let columns: Vec<_> = equations.rows.iter().map(of_table).collect();
        let columns = DMatrix::from_fn(36, 3, |i, j| columns[i][j]);
        let expected = covariance(1.0) * design.tr_mul(&inverse) * columns;
        assert_near(
            &of_unknowns(&equations, &solution.by_table[&number]),
            &expected,
        );
    }
}

#[test]
fn errors_of_rows_that_are_weighted_otherwise_reach_the_unknowns_as_by_the_whole_covariance() {
    let equations = equations(9, false);
    let (design, residual, errors) = dense(&equations);
    let weights = DVector::from_fn(36, |k, _| equations.rows[k].weighted.x.recip());
    let weighted = design.transpose() * DMatrix::from_diagonal(&weights);
    let prior = DMatrix::from_diagonal(&equations.sigma.map(|sigma| sigma.powi(-2)));
    let covariance = (&weighted * &design + &prior).cholesky().unwrap().inverse();
    let by_errors = &covariance * &weighted * &errors * weighted.transpose() * &covariance;
    let whole = |found: &crate::calibration::ParameterMatrix| {
        of_unknowns(&equations, found).select_columns(&equations.unknown)
    };
    assert_near(&whole(&equations.by_errors().unwrap()), &by_errors);
    let solution = equations.solved().unwrap();
    let of_prior = &covariance * &prior * &covariance;
    let growth = solution.residuals.growth();
    assert_near(
        &whole(&solution.covariance),
        &(by_errors * growth.powi(2) + of_prior),
    );
    let step = covariance * (weighted * residual + equations.mean.component_div(&equations.sigma));
    let found = of_unknowns(&equations, &solution.step);
    assert_near(&found, &DMatrix::from_column_slice(5, 1, step.as_slice()));
}

#[test]
fn errors_that_are_over_take_no_room() {
    let eliminated = equations(200, true).eliminated();
    let left = [
        Common::Drift(Sensor::Gyro, 199),
        Common::Table(0),
        Common::Table(4),
    ];
    assert_eq!(eliminated.errors, left);
}

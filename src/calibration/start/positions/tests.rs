use approx::assert_relative_eq;

use super::*;

fn triad(form: InstallationForm) -> Triad {
    let mut v = TriadVector::zeros();
    let values = [
        1.0025, 0.9981, 1.0007, 1.7e-3, -0.9e-3, 1.2e-3, 0.4e-3, -1.5e-3, 0.8e-3, 1.2e-4, -0.4e-4,
        0.9e-4,
    ];
    for (parameter, value) in values.into_iter().enumerate() {
        if Triad::has_parameter(form, parameter) {
            v[parameter] = value;
        }
    }
    Triad::from_vector(form, &v)
}

fn six(truth: &Triad, size: f64) -> Vec<Position> {
    (0..6)
        .map(|k| {
            let mut input = Vector3::zeros();
            input[k / 2] = if k % 2 == 0 { size } else { -size };
            Position {
                input,
                output: truth.output(&input),
                variance: Vector3::repeat(1e-12),
                weighted: Vector3::repeat(1e-12),
            }
        })
        .collect()
}

#[test]
fn general_and_six_angle_reproduce_the_sensitivity_exactly() {
    for truth_form in InstallationForm::ALL {
        let truth = triad(truth_form);
        for form in [InstallationForm::General, InstallationForm::SixAngle] {
            for size in [7.292115e-5, 9.8] {
                let (found, _) = six_position_triad(&six(&truth, size), form).unwrap();
                assert_relative_eq!(
                    found.sensitivity(),
                    truth.sensitivity(),
                    max_relative = 1e-12,
                    epsilon = 1e-15
                );
                assert_relative_eq!(found.bias, truth.bias, epsilon = 1e-12 * size);
            }
        }
    }
}

#[test]
fn three_angle_leaves_the_half_sum_of_each_pair() {
    let truth = triad(InstallationForm::General);
    let c = truth.installation();
    let (found, _) = six_position_triad(&six(&truth, 9.8), InstallationForm::ThreeAngle).unwrap();
    let error = found.installation() - c;
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        // Entries relative to the diagonal: A_ij / A_ii.
        let half_sum = 0.5 * (c[(i, j)] / c[(i, i)] + c[(j, i)] / c[(j, j)]);
        let relative = |i: usize, j: usize| error[(i, j)] + c[(i, j)] - c[(i, j)] / c[(i, i)];
        assert_relative_eq!(relative(i, j), -half_sum, epsilon = 1e-12);
        assert_relative_eq!(relative(j, i), -half_sum, epsilon = 1e-12);
    }
    assert_relative_eq!(found.bias, truth.bias, epsilon = 1e-12);
}

#[test]
fn least_squares_over_six_positions_is_half_sums_and_half_differences() {
    let truth = triad(InstallationForm::General);
    let mut positions = six(&truth, 9.8);
    for (k, position) in positions.iter_mut().enumerate() {
        position.output += Vector3::new(1.0, -2.0, 0.5) * (1e-3 * (k as f64).cos());
    }
    let (found, _) = six_position_triad(&positions, InstallationForm::General).unwrap();
    let mut bias = Vector3::zeros();
    let mut a = Matrix3::zeros();
    for axis in 0..3 {
        let (up, down) = (positions[2 * axis].output, positions[2 * axis + 1].output);
        bias += (up + down) * 0.5 / 3.0;
        a.set_column(axis, &((up - down) / (2.0 * 9.8)));
    }
    assert_relative_eq!(
        found.sensitivity(),
        a,
        max_relative = 1e-12,
        epsilon = 1e-15
    );
    assert_relative_eq!(found.bias, bias, epsilon = 1e-13);
}

#[test]
fn positions_in_a_plane_are_refused() {
    let truth = triad(InstallationForm::General);
    assert!(six_position_triad(&six(&truth, 9.8)[..4], InstallationForm::General).is_none());
}

#[test]
fn an_axis_that_senses_against_its_body_axis_keeps_its_sign() {
    for form in InstallationForm::ALL {
        let mut truth = triad(form);
        truth.scale.y = -truth.scale.y;
        let (found, covariance) = six_position_triad(&six(&truth, 9.8), form).unwrap();
        assert_relative_eq!(found.scale, truth.scale, epsilon = 1e-9);
        assert!(covariance[(1, 1)] > 0.0);
        assert_relative_eq!(found.bias, truth.bias, epsilon = 1e-9);
    }
}

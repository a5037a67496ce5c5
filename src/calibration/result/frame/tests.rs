use nalgebra::SMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::attitude;
use crate::calibration::result::{MagRecord, TriadRecord};
use crate::calibration::{parameter_name, sensor_and_parameter};
use crate::imu::{Instrument, Prior};

/// Scale factors in counts, installation of hundredths, biases; no σ.
pub fn record() -> Calibration {
    let rows = |v: [f64; 6]| {
        let c = InstallationForm::General.matrix(&v.into());
        [0, 1, 2].map(|i| [c[(i, 0)], c[(i, 1)], c[(i, 2)]])
    };
    let mut record = Calibration::new(
        TriadRecord {
            scale: [2.067e6, 2.059e6, 2.066e6],
            installation: rows([0.011, -0.004, 0.007, 0.014, -0.005, 0.017]),
            bias: [260.0, -236.0, 234.0],
        },
        TriadRecord {
            scale: [1.006e5, 0.998e5, 0.999e5],
            installation: rows([-0.003, 0.014, 0.016, 0.006, -0.011, 0.006]),
            bias: [3083.0, -2775.0, 2146.0],
        },
    );
    record.unit = Some(PerSensor::from_fn(|_| "count".to_owned()));
    record
}

/// σ of a good calibration, with correlations.
pub fn with_covariance(mut record: Calibration, form: InstallationForm) -> Calibration {
    let indices: Vec<usize> = (0..PARAMETERS)
        .filter(|&i| parameter_name(form, i).is_some())
        .collect();
    let n = indices.len();
    let nominal = own_nominal(&record);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut root = nalgebra::DMatrix::from_fn(n, n, |_, _| 0.2 * draw());
    for (row, &index) in indices.iter().enumerate() {
        root[(row, row)] += 1.0;
        let (sensor, of_triad) = sensor_and_parameter(index);
        let sigma = match Triad::kind(of_triad) {
            crate::imu::ParameterKind::Bias => 2e-6,
            _ => 1e-6,
        };
        root.row_mut(row)
            .scale_mut(sigma * nominal.get(sensor).factor(of_triad));
    }
    let covariance = &root * root.transpose();
    record.installation_form = Some(form);
    record.parameters = indices
        .iter()
        .filter_map(|&i| parameter_name(form, i))
        .collect();
    record.covariance = (0..n)
        .map(|i| covariance.row(i).iter().copied().collect())
        .collect();
    record
}

/// The same instrument in a body frame that is rotated.
fn seen_from(record: &Calibration, rotation: &Matrix3<f64>) -> Calibration {
    let mut record = record.clone();
    for triad in [&mut record.gyro, &mut record.accel] {
        let c = Matrix3::from_fn(|i, j| triad.installation[i][j]) * rotation.transpose();
        triad.installation = [0, 1, 2].map(|i| [c[(i, 0)], c[(i, 1)], c[(i, 2)]]);
    }
    record
}

fn canonical(record: &Calibration, body_frame: BodyFrame) -> Canonical {
    Canonical::new("a", record, &own_nominal(record), body_frame).unwrap()
}

#[test]
fn an_instrument_is_the_same_from_two_frames() {
    let on_table = record();
    let rotation = attitude::exp(Vector3::new(0.02, -0.03, 0.05));
    let mut turned = seen_from(&on_table, &rotation);
    turned.body_frame = BodyFrame::Accelerometer;
    let compared = |b: &Calibration| {
        let [a, b] = [("a", &on_table), ("b", b)].map(|(name, record)| Named { name, record });
        in_common_form(a, b, &own_nominal(&on_table)).unwrap()
    };
    let [a, b] = compared(&turned);
    assert_eq!(b.body_frame, BodyFrame::Accelerometer);
    assert!((a.vector() - b.vector()).amax() < 1e-12);
    assert_eq!(free_parameters(b.body_frame).len(), 21);
    turned.body_frame = BodyFrame::Table;
    let [a, b] = compared(&turned);
    assert!((a.vector() - b.vector()).amax() > 1e-3);
}

#[test]
fn the_accelerometer_frame_makes_the_accelerometers_lower_triangular_by_a_rotation() {
    let record = record();
    let a = record.accel.normalised(&own_nominal(&record).accel);
    let r = accelerometer_frame(&a);
    assert!((r * r.transpose() - Matrix3::identity()).amax() < 1e-15);
    assert!((r.determinant() - 1.0).abs() < 1e-15);
    let l = a * r.transpose();
    assert!(l[(0, 1)].abs().max(l[(0, 2)].abs()).max(l[(1, 2)].abs()) < 1e-15);
    assert!(l.diagonal().min() > 0.0);
    let canonical = canonical(&record, BodyFrame::Accelerometer);
    assert_eq!(canonical.triads.accel.angles[0], 0.0);
    assert!((canonical.triads.accel.scale.add_scalar(-1.0)).amax() < 1e-15);
}

#[test]
fn forms_of_one_matrix_are_one_calibration() {
    let mut three = record();
    let e = [0.003, -0.002, 0.004, 0.0, 0.0, 0.0].into();
    let c = InstallationForm::ThreeAngle.matrix(&e);
    three.gyro.installation = [0, 1, 2].map(|i| [c[(i, 0)], c[(i, 1)], c[(i, 2)]]);
    three.installation_form = Some(InstallationForm::ThreeAngle);
    let mut general = three.clone();
    general.installation_form = Some(InstallationForm::General);
    for (i, row) in general.gyro.installation.iter_mut().enumerate() {
        let norm = Vector3::from(*row).norm();
        row.iter_mut().for_each(|c| *c /= norm);
        general.gyro.scale[i] *= norm;
    }
    let nominal = own_nominal(&general);
    let frame = BodyFrame::Table;
    let a = Canonical::new("a", &three, &nominal, frame).unwrap();
    let b = Canonical::new("b", &general, &nominal, frame).unwrap();
    assert!((a.vector() - b.vector()).amax() < 1e-15);
}

#[test]
fn the_general_form_in_its_own_frame_keeps_its_covariance() {
    let record = with_covariance(record(), InstallationForm::General);
    let nominal = own_nominal(&record);
    let own = record.covariance_by(&nominal).unwrap();
    let there = canonical(&record, BodyFrame::Table).covariance.unwrap();
    assert!((there - own).amax() < 1e-12 * own.amax());
}

/// Moves each own parameter and looks where the canonical ones go.
fn numeric_jacobian(record: &Calibration, body_frame: BodyFrame) -> ParameterMatrix {
    let nominal = own_nominal(record);
    let form = record.installation_form.unwrap();
    let own = to_vector(&triads_of(record, &nominal, form));
    let step = 1e-6;
    let columns: Vec<ParameterVector> = (0..PARAMETERS)
        .map(|index| {
            let [plus, minus] = [step, -step].map(|by| {
                let mut moved = own;
                if parameter_name(form, index).is_some() {
                    moved[index] += by;
                }
                let triads = crate::calibration::from_vector(form, &moved);
                let mut record = record.clone();
                for (sensor, slot) in Sensor::ALL
                    .into_iter()
                    .zip([&mut record.gyro, &mut record.accel])
                {
                    let (triad, nominal) = (triads.get(sensor), nominal.get(sensor).0);
                    let c = triad.installation();
                    *slot = TriadRecord {
                        scale: triad.scale.component_mul(&nominal).into(),
                        installation: [0, 1, 2].map(|i| [c[(i, 0)], c[(i, 1)], c[(i, 2)]]),
                        bias: triad.bias.component_mul(&nominal).into(),
                    };
                }
                Canonical::new("a", &record, &nominal, body_frame)
                    .unwrap()
                    .vector()
            });
            (plus - minus) / (2.0 * step)
        })
        .collect();
    SMatrix::from_columns(&columns)
}

#[test]
fn covariance_follows_the_finite_differences_of_every_form_into_every_frame() {
    for form in InstallationForm::ALL {
        let mut record = record();
        let angles = [0.011, -0.004, 0.007, 0.014, -0.005, 0.017].into();
        let c = form.matrix(&angles);
        record.accel.installation = [0, 1, 2].map(|i| [c[(i, 0)], c[(i, 1)], c[(i, 2)]]);
        record.gyro.installation = [0, 1, 2].map(|i| [c[(i, 0)], c[(i, 1)], c[(i, 2)]]);
        let record = with_covariance(record, form);
        for frame in [BodyFrame::Table, BodyFrame::Accelerometer] {
            let nominal = own_nominal(&record);
            let own = record.covariance_by(&nominal).unwrap();
            let j = numeric_jacobian(&record, frame);
            let expected = j * own * j.transpose();
            let found = canonical(&record, frame).covariance.unwrap();
            let error = (found - expected).amax() / expected.amax();
            assert!(error < 1e-8, "{} {frame:?}: {error:e}", form.name());
        }
    }
}

#[test]
fn sigma_alone_stands_for_independent_parameters() {
    let mut record = record();
    let mut sigma = record.gyro;
    sigma.installation = [[1e-6; 3]; 3];
    record.sigma = Some(PerSensor::from_fn(|_| sigma));
    let there = canonical(&record, BodyFrame::Table);
    assert!(!there.correlated);
    let there = there.sigma().unwrap();
    assert!((there[0] - 1.0).abs() < 1e-12 && (there[3] - 1e-6).abs() < 1e-15);
    let none = sigma_of_zero(record);
    assert_eq!(canonical(&none, BodyFrame::Table).covariance, None);
}

fn sigma_of_zero(mut record: Calibration) -> Calibration {
    record.sigma = Some(PerSensor::from_fn(|_| TriadRecord {
        scale: [0.0; 3],
        installation: [[0.0; 3]; 3],
        bias: [0.0; 3],
    }));
    record
}

#[test]
fn a_negative_scale_factor_is_the_reference_and_a_turned_axis_an_error() {
    let mut record = with_covariance(record(), InstallationForm::General);
    record.accel.scale[2] *= -1.0;
    let there = canonical(&record, BodyFrame::Accelerometer);
    assert!((there.triads.accel.scale.z - 1.0).abs() < 1e-15);
    let nominal = own_nominal(&record);
    record.accel.scale[2] *= -1.0;
    let error = Canonical::new("b", &record, &nominal, BodyFrame::Table).unwrap_err();
    assert!(
        error.to_string().starts_with("b: the accel z axis"),
        "{error}"
    );
}

/// Instruments drawn from the prior, which speaks of the mounting face, scatter along the accelerometers as the prior
/// in that frame says: root mean squares of 4,000 draws, whose own 1σ is 1.1 %.
#[test]
fn the_prior_along_the_accelerometers_is_that_of_the_mounting_face_turned() {
    const DRAWS: usize = 4000;
    let prior = |installation: [f64; 3]| Prior {
        scale_sigma: Vector3::repeat(1e-4),
        installation_sigma: installation.into(),
        bias: Vector3::zeros(),
        bias_sigma: Vector3::repeat(1e-5),
    };
    let prior = PerSensor {
        gyro: prior([2e-4, 1e-4, 3e-4]),
        accel: prior([1e-4, 3e-4, 2e-4]),
    };
    let instrument = Instrument::new(prior, PerSensor::default());
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for form in InstallationForm::ALL {
        let mut squares = ParameterVector::zeros();
        for _ in 0..DRAWS {
            let drawn = PerSensor::from_fn(|sensor| {
                let sigma = prior.get(sensor).sigma(form);
                let error =
                    sigma.map(|s| s * Distribution::<f64>::sample(&StandardNormal, &mut rng));
                let mean = prior.get(sensor).mean(form).to_vector();
                Triad::from_vector(form, &(mean + error))
            });
            let turned = in_body_frame(&drawn, BodyFrame::Accelerometer);
            let error = PerSensor::from_fn(|sensor| {
                let mean = prior.get(sensor).mean(form);
                let turned = turned.get(sensor).in_form(form);
                Triad::from_vector(form, &(turned.to_vector() - mean.to_vector()))
            });
            squares += to_vector(&error).map(|e| e * e);
        }
        let of = instrument.prior_sigma(form, BodyFrame::Accelerometer);
        for (i, sum) in squares.iter().enumerate() {
            let (sensor, of_triad) = sensor_and_parameter(i);
            let (sigma, found) = (of.get(sensor)[of_triad], (sum / DRAWS as f64).sqrt());
            let off = (found - sigma).abs();
            // Four σ of the draws, and squares of the angles.
            assert!(
                off <= 0.045 * sigma + 1e-7,
                "{form:?} {i}: {found} for {sigma}"
            );
        }
    }
}

#[test]
fn other_units_are_an_error_that_names_both_and_units_not_stated_are_none() {
    let (a, mut b) = (record(), record());
    let compared = |b: &Calibration| {
        let [a, b] = [("one", &a), ("two", b)].map(|(name, record)| Named { name, record });
        in_common_form(a, b, &own_nominal(&record()))
    };
    if let Some(unit) = &mut b.unit {
        unit.accel = "m/s".to_owned();
    }
    let text = compared(&b).unwrap_err().to_string();
    for part in ["one", "two", "accel", "`count`", "`m/s`"] {
        assert!(text.contains(part), "{text}");
    }
    b.unit = None;
    assert!(compared(&b).is_ok());
}

/// A magnetometer with these rows along the body axes; no σ.
fn magnetometer(matrix: Matrix3<f64>) -> MagRecord {
    let triad = crate::magnetic::MagneticTriad {
        matrix,
        bias: Vector3::new(3.0, -2.0, 1.0),
        angles: nalgebra::Vector2::zeros(),
    };
    let log = crate::recording::Magnetometer::new("uT", 1.0);
    MagRecord::new(&triad, None, &log).unwrap()
}

#[test]
fn a_magnetometer_has_the_same_matrix_from_every_body_frame_and_the_sigma_of_the_frame() {
    let record = with_covariance(record(), InstallationForm::General);
    let matrix = Matrix3::new(0.2, 1.1, -0.1, -0.9, 0.1, 0.05, 0.03, -0.2, 1.3);
    let rotation = attitude::exp(Vector3::new(0.02, -0.03, 0.05));
    let nominal = own_nominal(&record);
    let of = |mag: &MagRecord, record: &Calibration| {
        magnetic_in(BodyFrame::Accelerometer, (mag, record), &nominal)
    };
    let here = of(&magnetometer(matrix), &record);
    let turned = magnetometer(matrix * rotation.transpose());
    let there = of(&turned, &seen_from(&record, &rotation));
    assert!((here[0] - there[0]).amax() < 1e-12);
    assert_eq!(here[1].amax(), 0.0);
    // A magnetometer without errors has those of the accelerometers that define the frame.
    let mut exact = magnetometer(matrix);
    exact.sigma = Some(crate::calibration::result::MagSigma {
        matrix: [[0.0; 3]; 3],
        bias: [0.0; 3],
    });
    let [_, sigma] = of(&exact, &record);
    let covariance = record.covariance_by(&nominal).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let root = covariance.cholesky().unwrap().l();
    let draws = (0..4000).map(|_| {
        let white = ParameterVector::from_fn(|_, _| StandardNormal.sample(&mut rng));
        let at = to_vector(&triads_of(&record, &nominal, InstallationForm::General));
        let triads = from_vector(InstallationForm::General, &(at + root * white));
        let frame = accelerometer_frame(&triads.accel.sensitivity());
        (matrix * frame.transpose())[(0, 0)] - here[0][0]
    });
    let rms = (draws.map(|off| off * off).sum::<f64>() / 4000.0).sqrt();
    assert!(
        (rms / sigma[0] - 1.0).abs() < 0.05,
        "{rms:e} {:e}",
        sigma[0]
    );
    assert_eq!(sigma[9], 0.0);
}

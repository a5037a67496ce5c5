//! A calibration with correlated errors.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use turncal::calibration::result::frame::own_nominal;
use turncal::calibration::result::{Calibration, TriadRecord};
use turncal::calibration::{PARAMETERS, parameter_name, sensor_and_parameter};
use turncal::imu::{InstallationForm, ParameterKind, PerSensor, Triad};

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
            ParameterKind::Bias => 2e-6,
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

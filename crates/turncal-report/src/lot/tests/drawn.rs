//! Units drawn from a type.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use turncal::calibration::result::{Calibration, GravityRecord, Provenance, TriadRecord};
use turncal::imu::PerSensor;
use turncal::lot::{Calibrated, Unit};

/// How units are drawn: 1σ of scale factors from unit to unit, and of each calibration.
#[derive(Clone, Copy)]
pub struct Draw {
    pub spread: f64,
    pub sigma: f64,
    /// 1σ of an error of gravity that all share, in that of each calibration.
    pub shared: f64,
}

const SCALE: f64 = 2e6;

fn provenance() -> Provenance {
    Provenance {
        program: "turncal".to_owned(),
        inputs: Vec::new(),
        nominal: PerSensor::from_fn(|_| [SCALE; 3]),
        latitude_deg: None,
        height_m: 0.0,
        duration_s: 600.0,
        rate_hz: 100.0,
        dwells: 20,
    }
}

pub fn drawn(count: usize, draw: Draw, seed: u64) -> Vec<Unit> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |sigma: f64| {
        let white: f64 = StandardNormal.sample(&mut rng);
        sigma * white
    };
    let gravity = normal(draw.shared);
    let units = (0..count).map(|k| {
        let own = (draw.spread.powi(2) + draw.sigma.powi(2) - draw.shared.powi(2)).sqrt();
        let mut triad = |shared: f64| TriadRecord {
            scale: [0, 1, 2].map(|_| SCALE * (1.0 + normal(own) + shared)),
            installation: [0, 1, 2].map(|i| [0, 1, 2].map(|j| f64::from(u8::from(i == j)))),
            bias: [0.0; 3],
        };
        let (gyro, accel) = (triad(0.0), triad(gravity));
        let mut calibration = Calibration::new(gyro, accel);
        calibration.provenance = Some(provenance());
        calibration.converged = Some(true);
        calibration.gravity = (draw.shared > 0.0).then_some(GravityRecord {
            m_s2: 9.8,
            sigma_m_s2: 9.8 * draw.shared,
        });
        let of_sigma = TriadRecord {
            scale: [SCALE * draw.sigma; 3],
            installation: [[0.0; 3]; 3],
            bias: [0.0; 3],
        };
        calibration.sigma = Some(PerSensor {
            gyro: of_sigma,
            accel: of_sigma,
        });
        let meta = [
            ("serial", format!("A{k}")),
            ("date", format!("2026-01-{:02}", k % 28 + 1)),
        ];
        Unit {
            name: format!("unit-{k}"),
            meta: meta.map(|(key, value)| (key.to_owned(), value)).into(),
            calibrated: Ok(Calibrated {
                calibration,
                noise: None,
            }),
        }
    });
    units.collect()
}

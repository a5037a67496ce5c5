//! What is identified in simulated noise, counted over many seeds.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::allan::{Curve, cluster_sizes, overlapping};
use super::identify::MANY;
use super::triad::within;
use super::*;

const PERIOD: f64 = 0.01;

/// Strengths of a simulated rate.
#[derive(Clone, Copy, Default)]
struct Made {
    quantisation: f64,
    random_walk: f64,
    rate_random_walk: f64,
    ramp: f64,
    /// 1σ and correlation time.
    markov: Option<(f64, f64)>,
}

impl Made {
    fn increments(self, samples: usize, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (sigma, keep) = self
            .markov
            .map_or((0.0, 0.0), |(sigma, time)| (sigma, (-PERIOD / time).exp()));
        let (mut wander, mut walk) = (sigma * normal(), 0.0);
        let mut before = self.quantisation * normal();
        let one = |k: usize| {
            let after = self.quantisation * normal();
            let quantised = after - before;
            before = after;
            let white = self.random_walk * PERIOD.sqrt() * normal();
            // The integral of a random walk over a sample, exactly.
            let step = self.rate_random_walk * PERIOD.sqrt() * normal();
            let bridge = self.rate_random_walk * PERIOD.powf(1.5) * normal() / 12f64.sqrt();
            let rate = walk + 0.5 * step + wander + self.ramp * (k as f64 + 0.5) * PERIOD;
            walk += step;
            wander = wander * keep + sigma * (1.0 - keep * keep).sqrt() * normal();
            white + rate * PERIOD + bridge + quantised
        };
        (0..samples).map(one).collect()
    }

    fn identified(self, clusters: &Clusters, samples: usize, seed: u64) -> Identified {
        let increments = self.increments(samples, seed).into_iter();
        let curve = overlapping(increments, PERIOD, clusters.sizes());
        clusters.identify(&[&curve]).unwrap()
    }
}

fn clusters(samples: usize) -> Clusters {
    Clusters::new(samples, PERIOD)
}

/// Mean square of (found − true)/σ of one process over seeds, with how often it was found; and how often
/// something else was.
fn count(
    made: Made,
    samples: usize,
    seeds: u64,
    process: Process,
    strength: f64,
    others: &[Process],
) -> (u64, f64, u64) {
    let clusters = clusters(samples);
    let (mut times, mut squares, mut wrong) = (0, 0.0, 0);
    for seed in 0..seeds {
        let identified = made.identified(&clusters, samples, seed);
        if let Some(found) = of_kind(&identified.found, process) {
            times += 1;
            squares += ((found.strength - strength) / found.sigma).powi(2);
        }
        let right = |f: &Found| {
            f.process.same_kind(process) || others.iter().any(|o| f.process.same_kind(*o))
        };
        wrong += u64::from(!identified.found.iter().all(right));
    }
    (times, squares / times as f64, wrong)
}

#[test]
fn white_noise_shows_its_random_walk_and_nothing_else_in_97_of_100_records() {
    let made = Made {
        random_walk: 2.0,
        ..Made::default()
    };
    let (times, square, wrong) = count(made, 20_000, 150, Process::RandomWalk, 2.0, &[]);
    assert_eq!(times, 150);
    assert!(wrong <= 4, "{wrong}");
    // The mean of 150 squares scatters by 0.12.
    assert!((square - 1.0).abs() < 0.35, "{square}");
}

#[test]
fn quantisation_is_told_from_random_walk_and_both_within_their_sigma() {
    let made = Made {
        quantisation: 0.1,
        random_walk: 1.0,
        ..Made::default()
    };
    let walk = [Process::RandomWalk];
    let (times, square, wrong) = count(made, 20_000, 60, Process::Quantisation, 0.1, &walk);
    assert_eq!(times, 60);
    assert!(
        (square - 1.0).abs() < 0.55 && wrong <= 3,
        "{square} {wrong}"
    );
    let quantised = [Process::Quantisation];
    let (times, square, _) = count(made, 20_000, 60, Process::RandomWalk, 1.0, &quantised);
    assert_eq!(times, 60);
    assert!((square - 1.0).abs() < 0.55, "{square}");
}

#[test]
fn a_rate_random_walk_is_found_within_its_sigma() {
    let made = Made {
        random_walk: 1.0,
        rate_random_walk: 0.5,
        ..Made::default()
    };
    let walk = [Process::RandomWalk];
    let (times, square, wrong) = count(made, 40_000, 60, Process::RateRandomWalk, 0.5, &walk);
    assert!(times >= 54, "{times}");
    // Some are taken for a Gauss–Markov process that does not come to its end.
    assert!(wrong <= 6, "{wrong}");
    assert!((square - 1.0).abs() < 0.55, "{square}");
}

#[test]
fn a_gauss_markov_process_is_found_within_its_sigma_and_its_correlation_time() {
    let (sigma, time) = (3.0, 2.0);
    let made = Made {
        random_walk: 1.0,
        markov: Some((sigma, time)),
        ..Made::default()
    };
    let samples = 50_000;
    let clusters = clusters(samples);
    let (mut strengths, mut times) = (0.0, 0.0);
    let seeds = 25;
    for seed in 0..seeds {
        let identified = made.identified(&clusters, samples, seed);
        let markov = Process::GaussMarkov {
            correlation_time: time,
        };
        let found = of_kind(&identified.found, markov).expect("a Gauss–Markov process");
        let Process::GaussMarkov { correlation_time } = found.process else {
            unreachable!()
        };
        strengths += ((found.strength - sigma) / found.sigma).powi(2);
        let of_time = found.sigma_log_time.unwrap();
        times += ((correlation_time / time).ln() / of_time).powi(2);
        assert!(identified.for_filter == identified.found);
    }
    for square in [strengths, times].map(|sum| sum / seeds as f64) {
        assert!((0.35..1.9).contains(&square), "{square}");
    }
}

#[test]
fn a_ramp_is_found_where_it_is_clear() {
    let made = Made {
        random_walk: 1.0,
        ramp: 0.03,
        ..Made::default()
    };
    let walk = [Process::RandomWalk];
    let (times, square, _) = count(made, 20_000, 30, Process::RateRamp, 0.03, &walk);
    assert!(times >= 28 && square < 2.0, "{times} {square}");
}

#[test]
fn what_was_not_found_is_below_its_limit_in_95_of_100_records() {
    // A rate random walk that most records cannot show.
    let made = Made {
        random_walk: 1.0,
        rate_random_walk: 0.03,
        ..Made::default()
    };
    let samples = 20_000;
    let clusters = clusters(samples);
    let (mut hidden, mut below) = (0, 0);
    for seed in 0..100 {
        let identified = made.identified(&clusters, samples, seed);
        let limit = identified.hidden.iter();
        if let Some(found) = limit.clone().find(|h| h.process == Process::RateRandomWalk) {
            hidden += 1;
            below += u32::from(found.limit > 0.03);
        }
    }
    assert!(hidden > 80, "{hidden}");
    assert!(below * 100 >= hidden * 90, "{below} of {hidden}");
}

#[test]
fn the_degrees_of_freedom_of_white_noise_are_those_of_the_nist_handbook() {
    let samples = 4096;
    let made = Made {
        random_walk: 1.0,
        ..Made::default()
    };
    let identified = made.identified(&clusters(samples), samples, 5);
    assert_eq!(identified.found.len(), 1);
    // NIST SP 1065, table 5, white FM; N is the number of integrals.
    let n = samples as f64 + 1.0;
    for (size, freedom) in cluster_sizes(samples).iter().zip(&identified.freedom) {
        let m = *size as f64;
        let published =
            (3.0 * (n - 1.0) / (2.0 * m) - 2.0 * (n - 2.0) / n) * 4.0 * m * m / (4.0 * m * m + 5.0);
        assert!(
            (freedom / published - 1.0).abs() < 0.04,
            "{size}: {freedom} {published}"
        );
    }
}

#[test]
fn three_axes_together_see_more_than_one() {
    let made = Made {
        random_walk: 1.0,
        ..Made::default()
    };
    let samples = 20_000;
    let clusters = clusters(samples);
    let curves = [1, 2, 3].map(|seed| {
        let increments = made.increments(samples, seed).into_iter();
        overlapping(increments, PERIOD, clusters.sizes())
    });
    let one = clusters.identify(&[&curves[0]]).unwrap();
    let all = clusters.identify(&curves.each_ref()).unwrap();
    let ratio = one.found[0].sigma / all.found[0].sigma;
    assert!((ratio - 3f64.sqrt()).abs() < 0.1, "{ratio}");
}

#[test]
fn an_interval_is_there_where_a_ramp_leaves_nothing_random() {
    let curve = Curve {
        tau: vec![1.0],
        variance: vec![2.0],
    };
    let mut identified = Identified {
        found: Vec::new(),
        hidden: Vec::new(),
        misfit: 0.0,
        first: 0,
        freedom: vec![f64::INFINITY],
        for_filter: Vec::new(),
    };
    assert_eq!(identified.interval(&curve, 0, 0.95), Some((2.0, 2.0)));
    // On both sides of the change to the normal distribution.
    let width = |identified: &Identified| {
        let (low, high) = identified.interval(&curve, 0, 0.95).unwrap();
        high - low
    };
    identified.freedom = vec![0.999 * MANY];
    let exact = width(&identified);
    identified.freedom = vec![1.001 * MANY];
    assert!((width(&identified) / exact - 1.0).abs() < 0.01);
}

/// Whole pulses of a rate with white noise.
fn pulses(random_walk: f64, pulse: f64, rate: f64, samples: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (mut angle, mut before) = (0.37 * seed as f64, 0.0);
    let mut one = || {
        angle += (rate * PERIOD + random_walk * PERIOD.sqrt() * normal()) / pulse;
        let counts = angle.floor() - before;
        before = angle.floor();
        counts * pulse
    };
    one();
    (0..samples).map(|_| one()).collect()
}

/// In how many of 100 records white noise is found and is within its 95 % interval, and by how much of itself
/// it is off at most.
fn accuracy(samples: usize, random_walk: f64, record: impl Fn(u64) -> Vec<f64>) -> (u64, f64) {
    let clusters = clusters(samples);
    let (mut times, mut most) = (0, 0.0);
    for seed in 0..100 {
        let curve = overlapping(record(seed).into_iter(), PERIOD, clusters.sizes());
        let identified = clusters.identify(&[&curve]).unwrap();
        let found = of_kind(&identified.found, Process::RandomWalk).expect("white noise");
        let off = (found.strength - random_walk).abs();
        times += u64::from(off < 1.96 * found.sigma);
        most = f64::max(most, off / random_walk);
    }
    (times, most)
}

/// 0.001 °/√h under pulses of 0.1″, at rest, and turning with and much slower than the Earth.
#[test]
#[ignore = "300 records of 20 minutes"]
fn white_noise_under_pulses_coarser_than_it_is_found_within_its_interval_in_95_of_100_records() {
    let (random_walk, pulse) = (2.909e-7, 4.848e-7);
    for rate in [0.0, 5.3e-5, 7.3e-7] {
        let record = |seed| pulses(random_walk, pulse, rate, 120_000, seed);
        let (times, most) = accuracy(120_000, random_walk, record);
        assert!(times >= 95, "{times} at {rate} rad/s");
        assert!(most < 0.2, "{most} at {rate} rad/s");
    }
}

#[test]
fn white_noise_under_pulses_coarser_than_it_is_found_and_no_gauss_markov_process_in_its_place() {
    let (random_walk, samples) = (2.909e-7, 120_000);
    let clusters = clusters(samples);
    for seed in 0..4 {
        let record = pulses(random_walk, 4.848e-7, 5.3e-5, samples, seed);
        let curve = overlapping(record.into_iter(), PERIOD, clusters.sizes());
        let identified = clusters.identify(&[&curve]).unwrap();
        let found = of_kind(&identified.found, Process::RandomWalk).expect("white noise");
        assert!(
            (found.strength / random_walk - 1.0).abs() < 0.1,
            "{found:?}"
        );
        assert!(identified.first > 0);
        let others = [Process::RandomWalk, Process::Quantisation];
        for found in identified.found.iter().chain(&identified.for_filter) {
            assert!(others.contains(&found.process), "{found:?}");
        }
    }
}

/// White noise of strength one through two poles of this bandwidth in Hz at 0.707 of critical damping.
fn filtered(bandwidth: f64, samples: usize, seed: u64) -> Vec<f64> {
    const FINE: usize = 32;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let step = PERIOD / FINE as f64;
    let omega = 2.0 * std::f64::consts::PI * bandwidth;
    let (mut rate, mut slope) = (0.0, 0.0);
    let mut one = || {
        let mut angle = 0.0;
        for _ in 0..FINE {
            let white = normal() / step.sqrt();
            slope += step * (omega * omega * (white - rate) - 2f64.sqrt() * omega * slope);
            rate += step * slope;
            angle += step * rate;
        }
        angle
    };
    (0..samples).map(|_| one()).collect()
}

#[test]
#[ignore = "200 records of 20 minutes"]
fn a_bandwidth_of_two_poles_leaves_the_white_noise_within_its_interval() {
    for (bandwidth, largest) in [(40.0, 0.03), (10.0, 0.1)] {
        let record = |seed| filtered(bandwidth, 120_000, seed);
        let (times, most) = accuracy(120_000, 1.0, record);
        assert!(
            times >= 93 && most < largest,
            "{times} {most} at {bandwidth} Hz"
        );
    }
}

#[test]
fn a_bandwidth_of_two_poles_is_no_bias() {
    let samples = 120_000;
    let clusters = clusters(samples);
    for seed in 0..4 {
        let record = filtered(40.0, samples, seed);
        let curve = overlapping(record.into_iter(), PERIOD, clusters.sizes());
        let identified = clusters.identify(&[&curve]).unwrap();
        for found in identified.found.iter().chain(&identified.for_filter) {
            assert_eq!(found.process, Process::RandomWalk);
            assert!((found.strength - 1.0).abs() < 0.03, "{found:?}");
        }
    }
}

#[test]
fn where_no_process_describes_the_curve_its_own_scatter_makes_the_intervals() {
    let samples = 20_000;
    let clusters = clusters(samples);
    let mut curve = overlapping(
        Made {
            random_walk: 1.0,
            ..Made::default()
        }
        .increments(samples, 1)
        .into_iter(),
        PERIOD,
        clusters.sizes(),
    );
    // Deviations that differ threefold from one point to the next, as dither makes them.
    for (k, variance) in curve.variance.iter_mut().enumerate() {
        *variance *= if k % 2 == 0 { 1.0 } else { 9.0 };
    }
    let identified = clusters.identify(&[&curve]).unwrap();
    assert!(identified.misfit > 0.5, "{}", identified.misfit);
    for point in 0..curve.tau.len() {
        let (low, high) = identified.interval(&curve, point, 0.95).unwrap();
        let factor = (high / low).sqrt();
        assert!(factor > 3.0, "{point}: {factor}");
    }
}

#[test]
fn a_triads_figure_lies_within_those_of_its_axes() {
    let shows = |strength: Option<f64>| Identified {
        found: Vec::from_iter(strength.map(|strength| Found {
            process: Process::RandomWalk,
            strength,
            sigma: 0.03,
            sigma_log_time: None,
        })),
        hidden: Vec::from_iter(strength.is_none().then_some(Hidden {
            process: Process::RandomWalk,
            limit: 0.5,
        })),
        misfit: 0.0,
        first: 0,
        freedom: Vec::new(),
        for_filter: Vec::new(),
    };
    let axes = [1.0, 1.2, 1.4].map(|strength| shows(Some(strength)));
    let mean_square = ((1.0 + 1.44 + 1.96f64) / 3.0).sqrt();
    for (own, expected) in [
        (Some(1.1), 1.1),
        (Some(0.8), mean_square),
        (Some(1.5), mean_square),
        (None, mean_square),
    ] {
        let held = within(shows(own), &axes.each_ref());
        assert!((held.found[0].strength - expected).abs() < 1e-12, "{own:?}");
        assert!(held.found.len() == 1 && held.hidden.is_empty());
    }
    // One axis that does not show it says nothing of the others.
    let held = within(shows(Some(0.8)), &[&axes[0], &axes[1], &shows(None)]);
    assert_eq!(held.found[0].strength, 0.8);
}

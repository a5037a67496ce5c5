//! Maximum-likelihood variance components, added one by one while the gain is significant.

/// Longest step of the log of a variance.
const LONGEST: f64 = 3.0;
/// A step of the log of a variance below this fraction of its σ counts as converged.
const SETTLED: f64 = 0.01;
/// Maximum number of steps.
const STEPS: usize = 40;

/// One component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// Number of the component among all candidates.
    pub place: usize,
    pub variance: f64,
    /// 1σ of the logarithm of the variance.
    pub spread: f64,
}

/// The likelihood of errors with some components, and its slope with respect to one of them.
#[derive(Debug, Clone, Copy)]
pub struct Slope {
    /// −2 ln of the likelihood, up to a constant.
    pub deviance: f64,
    /// Gradient of the log-likelihood with respect to the variance of the component.
    pub score: f64,
    /// Expected information.
    pub information: f64,
}

/// Adds components (out of this number) one by one while −2 ln of the likelihood decreases by more than a limit; also
/// returns the total decrease. `slope` evaluates the likelihood for some components, and its slope with respect to one
/// of them.
pub fn likeliest(
    count: usize,
    limit: f64,
    slope: impl Fn(&[Component], usize) -> Option<Slope>,
) -> Option<(Vec<Component>, f64)> {
    let none = slope(&[], 0)?.deviance;
    let (mut found, mut here) = (Vec::<Component>::new(), none);
    loop {
        let left = (0..count).filter(|&place| found.iter().all(|one| one.place != place));
        let more = left.filter_map(|place| {
            let mut with = found.clone();
            with.push(Component {
                place,
                variance: 0.0,
                spread: 0.0,
            });
            let deviance = fitted(&mut with, &slope)?;
            Some((with, deviance))
        });
        match more.min_by(|(_, one), (_, other)| one.total_cmp(other)) {
            Some((with, deviance)) if here - deviance > limit => (found, here) = (with, deviance),
            _ => return Some((found, none - here)),
        }
    }
}

/// Sets the variances to their maximum-likelihood values, and returns −2 ln of the likelihood; `None` if one is zero.
/// The last variance starts from zero.
///
/// Source: Fisher scoring of the likelihood of components of variance, Patterson and Thompson 1971, Biometrika 58(3);
/// applied to one after the other.
fn fitted(
    found: &mut [Component],
    slope: &impl Fn(&[Component], usize) -> Option<Slope>,
) -> Option<f64> {
    for step in 0..STEPS {
        let mut settled = step > 0;
        for number in (0..found.len()).rev() {
            let Slope {
                deviance,
                score,
                information,
            } = slope(found, found[number].place)?;
            let one = &mut found[number];
            if one.variance == 0.0 {
                if score <= 0.0 || information <= 0.0 {
                    return None;
                }
                one.variance = score / information;
                continue;
            }
            one.spread = 1.0 / (one.variance * information.sqrt());
            let step = score * one.variance * one.spread.powi(2);
            settled &= step.abs() < SETTLED * one.spread;
            if settled && number == 0 {
                return Some(deviance);
            }
            one.variance *= step.clamp(-LONGEST, LONGEST).exp();
        }
    }
    None
}

//! Errors of values that are rounded to steps.

use std::f64::consts::PI;

/// Number of summed waves; the others add a thousandth.
const WAVES: u32 = 600;

/// Variance of the rounding error that remains in a mean of many values rounded to this step, if the values have white
/// noise of this variance.
///
/// If noise does not carry the value over the edge of a step, the rounding error is the same in every row, and averaging
/// does not reduce the error. With noise of σ, the remaining error is a sum of sine waves of the value, the k-th of
/// amplitude step/πk · exp(−2π²k²σ²/step²) (Widrow and Kollár, *Quantization Noise*, 2008, on dither). The position of the
/// value within a step is unknown, so the mean square of the error is half the sum of the squared amplitudes. With σ of
/// half a step, the remaining error is negligible.
pub fn rounding_error(step: f64, noise: f64) -> f64 {
    if step == 0.0 {
        return 0.0;
    }
    let square = step * step;
    let wave = |k: u32| {
        let k = f64::from(k);
        (-4.0 * PI * PI * k * k * noise / square).exp() / (2.0 * PI * PI * k * k)
    };
    square * (1..=WAVES).map(wave).sum::<f64>()
}

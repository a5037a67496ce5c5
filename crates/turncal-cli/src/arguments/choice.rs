//! Options that accept one of a few names.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use turncal::calibration::{Method, NoisePolicy};
use turncal::imu::InstallationForm;
use turncal::run::Aiding;
use turncal_files::export::{FORMATS, Format};

/// A name on the command line, its description and its value.
type Choice<T> = (&'static str, &'static str, T);

/// Methods of estimation.
pub const METHODS: [Choice<Method>; 2] = [
    (
        "ekf",
        "Extended Kalman filter that uses the whole run",
        Method::Ekf,
    ),
    (
        "six-position",
        "Closed form from table positions, otherwise from labelled sections, otherwise from gravity",
        Method::SixPosition,
    ),
];

/// Parameters that --require accepts: all, or those whose names begin with this prefix.
pub const REQUIRED: [Choice<&str>; 9] = [
    ("all", "Every parameter that is estimated", ""),
    ("gyro", "All of the gyros", "gyro."),
    ("accel", "All of the accelerometers", "accel."),
    ("gyro.scale", "K of the gyros", "gyro.scale."),
    ("gyro.installation", "E of the gyros", "gyro.installation."),
    ("gyro.bias", "D of the gyros", "gyro.bias."),
    ("accel.scale", "K of the accelerometers", "accel.scale."),
    (
        "accel.installation",
        "E of the accelerometers",
        "accel.installation.",
    ),
    ("accel.bias", "D of the accelerometers", "accel.bias."),
];

/// Forms of the misalignment matrix.
pub const FORMS: [Choice<InstallationForm>; 3] = [
    (
        "general",
        "Six direction cosines, rows with unit norm: `C_ii = √(1 − C_ij² − C_ik²)` (Eqs. 4 and 7)",
        InstallationForm::General,
    ),
    (
        "six-angle",
        "Six off-diagonal entries, unit diagonal (Eq. 8)",
        InstallationForm::SixAngle,
    ),
    (
        "three-angle",
        "Identity plus a cross-product matrix of three angles `E_yz`, `E_xz`, `E_xy` (Eq. 10)",
        InstallationForm::ThreeAngle,
    ),
];

/// Kinds of observation that the filter can use.
pub const AIDINGS: [Choice<Aiding>; 2] = [
    (
        "table",
        "Zero velocity in every dwell, and the attitude of the table",
        Aiding::Table,
    ),
    (
        "velocity",
        "Zero velocity only; the accelerometers define the body axes",
        Aiding::Velocity,
    ),
];

/// Policies for choosing the noise that the filter uses. The help does not list names without a description.
pub const NOISE: [Choice<NoisePolicy>; 4] = [
    (
        "stated",
        "Use the noise stated in run.toml and models",
        NoisePolicy::Stated,
    ),
    (
        "auto",
        "Use the stated noise, unless the recording contradicts it (p < 0.001); then estimate the noise from the \
         recording",
        NoisePolicy::Auto,
    ),
    ("estimate", "", NoisePolicy::Auto),
    (
        "learnt",
        "Estimate the noise from the recording, and use the stated noise as the prior",
        NoisePolicy::Learnt,
    ),
];

/// Parses the name of an option value.
pub fn one_of<T: Copy + Send + Sync>(
    choices: &'static [Choice<T>],
) -> impl TypedValueParser<Value = T> {
    let listed = |&(name, help, _): &Choice<T>| {
        let name = PossibleValue::new(name).hide(help.is_empty());
        if help.is_empty() {
            name
        } else {
            name.help(help)
        }
    };
    PossibleValuesParser::new(choices.iter().map(listed)).try_map(|name| {
        let chosen = choices.iter().find(|(of, ..)| *of == name);
        chosen.map(|&(.., value)| value).ok_or("an unknown name")
    })
}

/// Parses the name of an export format.
pub fn export_format() -> impl TypedValueParser<Value = Format> {
    let listed = |format: &Format| PossibleValue::new(format.name).help(format.about);
    PossibleValuesParser::new(FORMATS.iter().map(listed)).try_map(|name| {
        let chosen = FORMATS.iter().find(|format| format.name == name);
        chosen.copied().ok_or("an unknown format")
    })
}

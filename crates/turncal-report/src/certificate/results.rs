//! Parameters with their expanded uncertainties.

use turncal::calibration::Group;
use turncal::calibration::result::{Calibration, Provenance};
use turncal::calibration::{PARAMETERS, ThermalRecord, parameter_name, sensor_and_parameter};
use turncal::imu::{Nominal, ParameterKind, PerSensor, Sensor, TERM_PARAMETERS, Term};

/// Coverage factor for 95.45 % if the degrees of freedom were not evaluated.
const COVERAGE_FACTOR: f64 = 2.0;

/// Coverage factor and degrees of freedom of a parameter, which are the same in every table. Coverage factor and
/// degrees of freedom come from the budget of the calibration or, without a budget, from a normal distribution.
pub fn coverage(calibration: &Calibration, name: &str) -> (f64, Option<f64>) {
    let place = calibration.parameters.iter().position(|of| of == name);
    let of_budget = calibration
        .budget
        .as_ref()
        .zip(place)
        .and_then(|(budget, n)| {
            Some((
                *budget.coverage_factor.get(n)?,
                *budget.degrees_of_freedom.get(n)?,
            ))
        });
    of_budget.unwrap_or((COVERAGE_FACTOR, None))
}

/// A quantity of a certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Parameters of a triad.
    Parameters(Group),
    /// Parameters of an error term.
    Term(Term),
}

impl Quantity {
    /// Symbol of the displayed unit, and the value of this unit in SI units.
    pub fn unit(self) -> (&'static str, f64) {
        match self {
            Self::Term(term) => term.entry().unit,
            Self::Parameters(group) => (group.unit(), group.unit_value()),
        }
    }

    /// The SI unit of the parameter in D-SI notation.
    pub fn si_unit(self) -> &'static str {
        match self {
            Self::Term(term) => term.entry().d_si_unit,
            Self::Parameters(group) => match (group.kind(), group.sensor()) {
                (ParameterKind::Scale, _) => "\\one",
                (ParameterKind::Installation, _) => "\\radian",
                (ParameterKind::Bias, Sensor::Gyro) => "\\radian\\second\\tothe{-1}",
                (ParameterKind::Bias, Sensor::Accel) => "\\metre\\second\\tothe{-2}",
            },
        }
    }
}

/// A parameter with its expanded uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Name of the parameter, such as `gyro.scale.x`.
    pub name: String,
    /// Its quantity.
    pub quantity: Quantity,
    /// Value in SI units: scale factors divided by their nominal value, minus one; angles in rad; biases in rad/s or
    /// m/s²; parameters of error terms as in the calibration file.
    pub value: f64,
    /// Expanded uncertainty.
    pub expanded: f64,
    /// Coverage factor.
    pub coverage_factor: f64,
    /// Degrees of freedom; `None` if infinite.
    pub degrees_of_freedom: Option<f64>,
}

/// The nominal scales of a calibration.
pub fn nominal(provenance: &Provenance) -> PerSensor<Nominal> {
    PerSensor::from_fn(|sensor| Nominal((*provenance.nominal.get(sensor)).into()))
}

/// All estimated parameters and their covariance in SI units; `None` if the record has no covariance.
pub fn results(
    calibration: &Calibration,
    provenance: &Provenance,
) -> Option<(Vec<Measured>, Vec<Vec<f64>>)> {
    let nominal = nominal(provenance);
    let form = calibration.installation_form.unwrap_or_default();
    let index =
        |name: &String| (0..PARAMETERS).find(|&i| parameter_name(form, i).as_ref() == Some(name));
    let indices: Vec<usize> = calibration
        .parameters
        .iter()
        .map(index)
        .collect::<Option<_>>()?;
    let factor = |i: usize| {
        let (sensor, of_triad) = sensor_and_parameter(i);
        nominal.get(sensor).factor(of_triad)
    };
    let size = indices.len();
    let sized = |row: &Vec<f64>| row.len() == size;
    if size == 0
        || calibration.covariance.len() != size
        || !calibration.covariance.iter().all(sized)
    {
        return None;
    }
    let covariance: Vec<Vec<f64>> = (0..size)
        .map(|m| {
            let element =
                |n: usize| calibration.covariance[m][n] / (factor(indices[m]) * factor(indices[n]));
            (0..size).map(element).collect()
        })
        .collect();
    let results = indices.iter().zip(&calibration.parameters).enumerate();
    let results = results.map(|(n, (&i, name))| {
        let group = Group::of(i);
        let value = *calibration.get(name)? / factor(i);
        let (coverage_factor, degrees_of_freedom) = coverage(calibration, name);
        Some(Measured {
            name: name.clone(),
            quantity: Quantity::Parameters(group),
            value: match group.kind() {
                ParameterKind::Scale => value - 1.0,
                ParameterKind::Installation | ParameterKind::Bias => value,
            },
            expanded: coverage_factor * covariance[n][n].max(0.0).sqrt(),
            coverage_factor,
            degrees_of_freedom,
        })
    });
    Some((results.collect::<Option<_>>()?, covariance))
}

/// Every estimated parameter of the instrument's error terms; the errors of the table are not included, because they
/// are not results for the instrument.
pub fn terms(calibration: &Calibration) -> Vec<Measured> {
    let measured = |k: usize| {
        let name = Term::parameter_name(k)?;
        let record = calibration.terms.get(&name)?;
        let (coverage_factor, degrees_of_freedom) = coverage(calibration, &name);
        Some(Measured {
            name,
            quantity: Quantity::Term(Term::of(k)?),
            value: record.value,
            expanded: coverage_factor * record.sigma?,
            coverage_factor,
            degrees_of_freedom,
        })
    };
    (0..TERM_PARAMETERS).filter_map(measured).collect()
}

/// States the temperatures at which the results are valid, and where the temperature coefficients can be found.
pub fn temperature_words(of: &ThermalRecord, number: impl Fn(f64) -> String) -> String {
    let triad = |(name, sensor): (&str, Sensor)| {
        let range = of.range.get(sensor);
        format!(
            "{name} at {} °C, valid from {} to {} °C",
            number(range.reference),
            number(range.lowest),
            number(range.highest)
        )
    };
    let triads = [("gyros", Sensor::Gyro), ("accelerometers", Sensor::Accel)].map(triad);
    format!(
        "The results apply at the reference temperature: {}. The results change with temperature; the attached \
         calibration.json contains the coefficients with their equation and covariance.",
        triads.join("; ")
    )
}

/// The name of a parameter in words, such as `gyroscope scale factor x`.
pub fn in_words(measured: &str) -> String {
    let words = [
        ("gyro.", "gyroscope "),
        ("accel.", "accelerometer "),
        ("scale.", "scale factor "),
        ("installation.", "misalignment "),
    ];
    let named = |name: String, (key, word): (&str, &str)| name.replace(key, word);
    let name = words.into_iter().fold(measured.to_owned(), named);
    name.replace(['.', '_'], " ")
}

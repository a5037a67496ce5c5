//! Statements of a calibration laboratory about itself, its customer and the item. These statements are not derived
//! from data; they appear in the certificate.

use serde::Deserialize;

/// Address of a laboratory or a customer.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Name.
    pub name: String,
    /// Street with number.
    pub street: String,
    /// Postal code, if there is one.
    pub post_code: Option<String>,
    /// City.
    pub city: String,
    /// Country code of ISO 3166-1, two capital letters.
    pub country: String,
    /// Electronic mail.
    pub email: Option<String>,
    /// Telephone.
    pub phone: Option<String>,
}

/// A day.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(try_from = "String")]
pub struct Day {
    /// Year.
    pub year: u16,
    /// Month, from one.
    pub month: u8,
    /// Day of the month, from one.
    pub day: u8,
}

impl Day {
    /// Parses a date such as `2026-03-31`; `None` if it is invalid.
    pub fn parse(text: &str) -> Option<Self> {
        let mut parts = text.split('-');
        let mut next = |digits: usize| {
            let part = parts.next().filter(|part| part.len() == digits)?;
            part.bytes().all(|b| b.is_ascii_digit()).then_some(part)
        };
        let day = Self {
            year: next(4)?.parse().ok()?,
            month: next(2)?.parse().ok()?,
            day: next(2)?.parse().ok()?,
        };
        let every = |years: u16| day.year.is_multiple_of(years);
        let leap = every(4) && (!every(100) || every(400));
        let length = match day.month {
            4 | 6 | 9 | 11 => 30,
            2 => 28 + u8::from(leap),
            1..=12 => 31,
            _ => return None,
        };
        let within = (1..=length).contains(&day.day) && parts.next().is_none();
        within.then_some(day)
    }
}

impl TryFrom<String> for Day {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        Self::parse(&text).ok_or("a date such as 2026-03-31")
    }
}

impl std::fmt::Display for Day {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:04}-{:02}-{:02}", self.year, self.month, self.day)
    }
}

/// Place of a calibration, in the terms of the Digital Calibration Certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// In the laboratory.
    Laboratory,
    /// At the customer's site.
    Customer,
    /// In a branch of the laboratory.
    LaboratoryBranch,
    /// Elsewhere.
    Other,
}

impl Place {
    /// The spelling used in the Digital Calibration Certificate.
    pub fn code(self) -> &'static str {
        match self {
            Self::Laboratory => "laboratory",
            Self::Customer => "customer",
            Self::LaboratoryBranch => "laboratoryBranch",
            Self::Other => "other",
        }
    }

    /// A description of the place in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Laboratory => "in the laboratory",
            Self::Customer => "at the customer's site",
            Self::LaboratoryBranch => "in a branch of the laboratory",
            Self::Other => "elsewhere, see remarks",
        }
    }
}

/// A condition with its expanded uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// Value, in the unit of the field.
    pub value: f64,
    /// Expanded uncertainty, k = 2.
    pub uncertainty: f64,
}

/// Equipment used for traceability.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(expecting = "name, serial number and certificate as three strings in quotes")]
pub struct Equipment {
    /// Name.
    pub name: String,
    /// Serial number.
    pub serial: String,
    /// Certificate.
    pub certificate: String,
}

/// Decision rule for conformity (ISO/IEC 17025, 7.8.6; ILAC-G8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DecisionRule {
    /// A limit is met if the value is inside the limit by at least the expanded uncertainty (guard band w = U).
    GuardBand,
    /// A limit is met if the value is inside the limit.
    SimpleAcceptance,
}

impl DecisionRule {
    /// A description of the rule in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::GuardBand => {
                "guard band w = U (ILAC-G8): pass if the value is inside its limit by at least the expanded \
                 uncertainty, fail if it is outside its limit by at least the expanded uncertainty; otherwise the \
                 pass or fail is conditional"
            }
            Self::SimpleAcceptance => {
                "simple acceptance (ILAC-G8): pass if the value is within its limit, regardless of its uncertainty"
            }
        }
    }
}

/// Statements of a laboratory.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Laboratory {
    /// The laboratory.
    #[serde(rename = "laboratory")]
    pub contact: Contact,
    /// The customer of the calibration.
    pub customer: Contact,
    /// Identification of the certificate.
    pub certificate: Issue,
    /// The calibrated item.
    pub item: Item,
    /// Method of the laboratory.
    pub method: Method,
    /// The conditions of the calibration.
    pub conditions: Conditions,
    /// Traceability of results to the SI.
    pub traceability: Traceability,
    /// Person who authorises the certificate.
    pub authorised: Authorised,
    /// Decision rule for conformity.
    #[serde(default)]
    pub decision: DecisionStated,
    /// Other remarks.
    pub remarks: Option<String>,
}

/// Number, days and place of a calibration.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Issue {
    /// Unique number of the certificate.
    pub number: String,
    /// Day of issue.
    pub issued: Day,
    /// Day on which the item was received.
    pub received: Option<Day>,
    /// First day of the calibration.
    pub begin: Day,
    /// Last day.
    pub end: Day,
    /// Place of the calibration.
    pub place: Place,
}

/// The calibrated item.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// Description, such as `inertial measurement unit`.
    pub name: String,
    /// Manufacturer.
    pub manufacturer: Option<String>,
    /// Model.
    #[serde(default)]
    pub model: String,
    /// Serial number.
    #[serde(default)]
    pub serial: String,
    /// State when received.
    pub state: String,
}

/// Calibration method.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Method {
    /// Procedure of the laboratory.
    pub procedure: String,
    /// Additions to the procedure, and deviations or exclusions from it.
    pub deviations: Option<String>,
}

/// Conditions of a calibration.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditions {
    /// Air temperature.
    pub temperature_degc: Condition,
    /// Relative humidity.
    pub humidity_percent: Option<Condition>,
}

/// Traceability to the SI.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Traceability {
    /// Statement in the laboratory's own words.
    pub statement: String,
    /// Equipment that provides the traceability.
    #[serde(default)]
    pub equipment: Vec<Equipment>,
}

/// The person who authorises a certificate.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Authorised {
    /// Name.
    pub name: String,
    /// The function.
    pub function: String,
}

/// Statement of conformity.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DecisionStated {
    /// Decision rule.
    pub rule: Option<DecisionRule>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_is_one_of_the_calendar() {
        assert_eq!(Day::parse("2024-02-29").unwrap().to_string(), "2024-02-29");
        for none in [
            "2023-02-29",
            "2024-13-01",
            "2024-1-1",
            "24-01-01",
            "2024-04-31",
            "2024-01-01-1",
            "+024-01-01",
        ] {
            assert_eq!(Day::parse(none), None, "{none}");
        }
    }
}

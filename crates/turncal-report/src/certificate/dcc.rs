//! The certificate as a Digital Calibration Certificate: PTB's DCC 3.3.0 with D-SI 2.2.1 quantities.
//!
//! Values are in SI units: scale factors relative to nominal, angles in rad, biases in rad/s and m/s², each as a
//! separate quantity with its expanded uncertainty, followed by the covariance of all.

use maud::{Markup, html};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{AsFound, Certificate, Decided, Measured, in_words, temperature_words};
use turncal::laboratory::{Condition, Contact};
use turncal::number::to_twelve_digits;

/// Coverage probability of every uncertainty.
const PROBABILITY: f64 = 0.9545;

/// The certificate as an XML document.
pub fn write(certificate: &Certificate) -> String {
    let xml = html! {
        dcc:digitalCalibrationCertificate xmlns:dcc="https://ptb.de/dcc" xmlns:si="https://ptb.de/si"
            xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
            xsi:schemaLocation="https://ptb.de/dcc https://ptb.de/dcc/v3.3.0/dcc.xsd" schemaVersion="3.3.0" {
            dcc:administrativeData { (administrative(certificate)) }
            dcc:measurementResults { dcc:measurementResult { (measured(certificate)) } }
        }
    };
    indented(&xml.into_string())
}

/// XML with a line for each element; an element without child elements is on one line.
fn indented(xml: &str) -> String {
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>".to_owned();
    let (mut depth, mut is_open) = (0usize, false);
    for tag in xml.split('<').skip(1) {
        let is_end = tag.starts_with('/');
        depth = depth.saturating_sub(usize::from(is_end));
        if !(is_end && is_open) {
            text.push('\n');
            text.extend(std::iter::repeat_n("  ", depth));
        }
        text.push('<');
        // XML 1.0 has no place for control characters, not even escaped.
        text.extend(tag.chars().map(|c| if c.is_control() { ' ' } else { c }));
        is_open = !is_end;
        depth += usize::from(is_open);
    }
    text + "\n"
}

/// A number with all its digits.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-4..1e6).contains(&value.abs()) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

fn contact(contact: &Contact) -> Markup {
    html! {
        dcc:name { dcc:content { (contact.name) } }
        @if let Some(text) = &contact.email { dcc:eMail { (text) } }
        @if let Some(text) = &contact.phone { dcc:phone { (text) } }
        dcc:location {
            dcc:city { (contact.city) }
            dcc:countryCode { (contact.country) }
            @if let Some(code) = &contact.post_code { dcc:postCode { (code) } }
            dcc:street { (contact.street) }
        }
    }
}

/// Identifications that consist of the manufacturer's serial number.
fn serial_number(serial: &str) -> Markup {
    html! {
        dcc:identifications {
            dcc:identification {
                dcc:issuer { "manufacturer" }
                dcc:value { (serial) }
                dcc:name { dcc:content { "serial number" } }
            }
        }
    }
}

fn condition(name: &str, unit: &str, condition: Condition) -> Markup {
    let expanded = (condition.uncertainty > 0.0).then_some(Expanded {
        uncertainty: condition.uncertainty,
        coverage_factor: 2.0,
        distribution: "normal",
    });
    html! {
        dcc:influenceCondition {
            dcc:name { dcc:content { (name) } }
            dcc:data { dcc:quantity { (real(condition.value, unit, expanded)) } }
        }
    }
}

/// An expanded uncertainty.
struct Expanded {
    uncertainty: f64,
    coverage_factor: f64,
    distribution: &'static str,
}

/// A value with its unit and, if available, its uncertainty.
fn real(value: f64, unit: &str, expanded: Option<Expanded>) -> Markup {
    html! {
        si:real {
            si:value { (number(value)) }
            si:unit { (unit) }
            @if let Some(expanded) = expanded {
                si:measurementUncertaintyUnivariate {
                    si:expandedMU {
                        si:valueExpandedMU { (number(expanded.uncertainty)) }
                        si:coverageFactor { (number(expanded.coverage_factor)) }
                        si:coverageProbability { (number(PROBABILITY)) }
                        si:distribution { (expanded.distribution) }
                    }
                }
            }
        }
    }
}

/// Name and release of the calibration program; PTB rules require a letter before the release number.
fn program(certificate: &Certificate) -> Markup {
    let program = &certificate.provenance.program;
    let (name, release) = program.split_once(' ').unwrap_or((program, "0"));
    html! {
        dcc:name { dcc:content { (name) } }
        dcc:release { "v" (release) }
    }
}

fn administrative(certificate: &Certificate) -> Markup {
    let laboratory = &certificate.laboratory;
    let (issue, item) = (&laboratory.certificate, &laboratory.item);
    html! {
        dcc:dccSoftware { dcc:software { (program(certificate)) dcc:type { "application" } } }
        dcc:coreData {
            dcc:countryCodeISO3166_1 { (laboratory.contact.country) }
            dcc:usedLangCodeISO639_1 { "en" }
            dcc:mandatoryLangCodeISO639_1 { "en" }
            dcc:uniqueIdentifier { (issue.number) }
            @if let Some(day) = issue.received { dcc:receiptDate { (day) } }
            dcc:beginPerformanceDate { (issue.begin) }
            dcc:endPerformanceDate { (issue.end) }
            dcc:performanceLocation { (issue.place.code()) }
            dcc:issueDate { (issue.issued) }
        }
        dcc:items {
            dcc:item {
                dcc:name { dcc:content { (item.name) } }
                dcc:description { dcc:content { "State when received: " (item.state) } }
                @if let Some(manufacturer) = &item.manufacturer {
                    dcc:manufacturer { dcc:name { dcc:content { (manufacturer) } } }
                }
                dcc:model { (item.model) }
                (serial_number(&item.serial))
            }
        }
        dcc:calibrationLaboratory { dcc:contact { (contact(&laboratory.contact)) } }
        dcc:respPersons {
            dcc:respPerson {
                dcc:person { dcc:name { dcc:content { (laboratory.authorised.name) } } }
                dcc:role { (laboratory.authorised.function) }
                dcc:mainSigner { "true" }
            }
        }
        dcc:customer { (contact(&laboratory.customer)) }
        dcc:statements {
            dcc:statement {
                dcc:name { dcc:content { "metrological traceability" } }
                dcc:declaration { dcc:content { (laboratory.traceability.statement) } }
            }
            @if let Some(word) = certificate.calibration.word() {
                dcc:statement {
                    dcc:name { dcc:content { "verdict of the evaluation" } }
                    dcc:declaration { dcc:content { (word) } }
                }
            }
            @for text in certificate.remarks() {
                dcc:statement {
                    dcc:name { dcc:content { "remark" } }
                    dcc:declaration { dcc:content { (text) } }
                }
            }
            @if let Some(conformity) = &certificate.conformity {
                @for limit in &conformity.limits { (statement(limit, conformity.rule.words())) }
            }
        }
    }
}

fn statement(limit: &Decided, rule: &str) -> Markup {
    let text = format!(
        "{} from nominal in SI units, limit ±{}; decision rule: {rule}; probability of a wrong decision: {:.1e}",
        number(limit.off),
        number(limit.limit.within),
        limit.risk,
    );
    html! {
        dcc:statement {
            dcc:name { dcc:content { (in_words(&limit.name)) } }
            dcc:declaration { dcc:content { (text) } }
            dcc:conformity { (limit.decision.code()) }
        }
    }
}

fn measured(certificate: &Certificate) -> Markup {
    let laboratory = &certificate.laboratory;
    let equipment = &laboratory.traceability.equipment;
    let conditions = &laboratory.conditions;
    html! {
        dcc:name { dcc:content { "Calibration of both triads" } }
        dcc:usedMethods {
            dcc:usedMethod {
                dcc:name { dcc:content { (laboratory.method.procedure) } }
                dcc:description {
                    dcc:content { (certificate.calibration.equation.as_deref().unwrap_or_default()) }
                }
                dcc:norm { "JCGM 100:2008" }
            }
        }
        dcc:usedSoftware {
            dcc:software {
                (program(certificate))
                dcc:description {
                    dcc:content {
                        "calibration.json: SHA-256 " (certificate.sha256)
                        @for input in &certificate.provenance.inputs {
                            "; " (input.name) ": SHA-256 " (input.sha256)
                        }
                    }
                }
            }
        }
        @if !equipment.is_empty() {
            dcc:measuringEquipments {
                @for of in equipment {
                    dcc:measuringEquipment {
                        dcc:name { dcc:content { (of.name) } }
                        dcc:description { dcc:content { "Certificate " (of.certificate) } }
                        (serial_number(&of.serial))
                    }
                }
            }
        }
        dcc:influenceConditions {
            (condition("air temperature", "\\degreecelsius", conditions.temperature_degc))
            @if let Some(humidity) = conditions.humidity_percent {
                (condition("relative humidity", "\\percent", humidity))
            }
        }
        dcc:results {
            dcc:result {
                dcc:name { dcc:content { "Parameters" } }
                dcc:description { dcc:content { (description(certificate)) } }
                dcc:data {
                    @for of in certificate.results.iter().chain(&certificate.terms) {
                        (quantity(of, Some(&of.name), Some("basic_measuredValue")))
                    }
                    (together(&certificate.results, &certificate.covariance))
                }
            }
            @if let Some(as_found) = &certificate.as_found { (found(as_found)) }
        }
    }
}

/// Description of the values.
fn description(certificate: &Certificate) -> String {
    let nominal = &certificate.provenance.nominal;
    let [for_gyros, for_accels] = [nominal.gyro, nominal.accel]
        .map(|of| of.map(|scale| number(to_twelve_digits(scale))).join(", "));
    let unit = certificate.calibration.unit.as_ref();
    let unit = unit.map(|unit| (unit.gyro.as_str(), unit.accel.as_str()));
    let (gyro, accel) = unit.unwrap_or_default();
    let mut text = format!(
        "Scale factors divided by their nominal value, minus one; entries of the installation matrix in rad; biases \
         in rad/s and m/s². Nominal scale: gyros {for_gyros} {gyro} per second for 1 rad/s, accelerometers \
         {for_accels} {accel} per second for 1 m/s². Body frame: {}.",
        certificate.calibration.body_frame.words(),
    );
    if let Some(temperature) = &certificate.calibration.temperature {
        text.push(' ');
        text += &temperature_words(temperature, |t| format!("{t:.1}"));
    }
    text
}

/// Parameters as found, with their own uncertainties; parameters as left are the results in the same body frame.
fn found(as_found: &AsFound) -> Markup {
    let about = format!(
        "Valid when the item was received; from {}; general installation form, body frame: {}.",
        as_found.earlier,
        as_found.body_frame.words()
    );
    html! {
        dcc:result {
            dcc:name { dcc:content { "Parameters as found" } }
            dcc:description { dcc:content { (about) } }
            dcc:data {
                @for change in &as_found.changes { (quantity(&change.found, None, None)) }
            }
        }
    }
}

/// One parameter as expected by certificate readers. Its name in calibration.json is a valid xs:ID, for one result.
fn quantity(of: &Measured, id: Option<&str>, kind: Option<&str>) -> Markup {
    let expanded = (of.expanded > 0.0).then_some(Expanded {
        uncertainty: of.expanded,
        coverage_factor: of.coverage_factor,
        distribution: of.degrees_of_freedom.map_or("normal", |_| "t"),
    });
    html! {
        dcc:quantity id=[id] refType=[kind] {
            dcc:name { dcc:content { (in_words(&of.name)) } }
            (real(of.value, of.quantity.si_unit(), expanded))
        }
    }
}

/// All parameters in the order of the preceding quantities, with their covariance and joint coverage region.
fn together(results: &[Measured], covariance: &[Vec<f64>]) -> Markup {
    let units: Vec<&str> = results.iter().map(|of| of.quantity.si_unit()).collect();
    let values: Vec<String> = results.iter().map(|of| number(of.value)).collect();
    html! {
        dcc:quantity {
            dcc:name { dcc:content { "K, E and D, in the order above, with their covariance" } }
            si:realListXMLList {
                si:valueXMLList { (values.join(" ")) }
                si:unitXMLList { (units.join(" ")) }
                si:ellipsoidalRegionXMLList {
                    si:covarianceMatrix {
                        @for (column, of_column) in units.iter().enumerate() {
                            si:column {
                                @for (row, of_row) in units.iter().enumerate() {
                                    si:covariance {
                                        si:value { (number(covariance[row][column])) }
                                        si:unit { (format!("{of_row}{of_column}").replace("\\one\\one", "\\one")) }
                                    }
                                }
                            }
                        }
                    }
                    si:coverageFactor { (number(of_ellipsoid(units.len()))) }
                    si:coverageProbability { (number(PROBABILITY)) }
                    si:distribution { "normal" }
                }
            }
        }
    }
}

/// Radius, in σ, of the ellipsoid of this dimension that contains the coverage probability.
fn of_ellipsoid(dimensions: usize) -> f64 {
    let square = ChiSquared::new(dimensions as f64).map(|chi2| chi2.inverse_cdf(PROBABILITY));
    square.map_or(1.0, f64::sqrt)
}

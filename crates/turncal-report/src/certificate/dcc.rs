//! The certificate as a Digital Calibration Certificate: PTB's DCC 3.3.0 with D-SI 2.2.1 quantities.
//!
//! Values are in SI: scale factors relative to nominal, angles in rad, biases in rad/s and m/s², each as a separate
//! quantity with its expanded uncertainty, followed by the covariance of all.

use std::fmt::Write;

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{Certificate, Decided, Measured, in_words, temperature_words};
use turncal::laboratory::{Condition, Contact, Equipment, Item};
use turncal::number::to_twelve_digits;

/// Coverage probability of every uncertainty.
const PROBABILITY: f64 = 0.9545;

/// XML under construction: elements open and close in order, and texts are escaped.
struct Xml {
    text: String,
    open: Vec<&'static str>,
}

impl Xml {
    fn indent(&mut self) {
        self.text.push('\n');
        self.text.extend(std::iter::repeat_n("  ", self.open.len()));
    }

    /// An element with its content; `tag` may have attributes that need no escaping.
    fn element(&mut self, name: &'static str, content: impl FnOnce(&mut Self)) {
        self.with(name, "", content);
    }

    fn with(&mut self, name: &'static str, attributes: &str, content: impl FnOnce(&mut Self)) {
        self.indent();
        self.text.push('<');
        self.text.push_str(name);
        self.text.push_str(attributes);
        self.text.push('>');
        self.open.push(name);
        content(self);
        self.open.pop();
        self.indent();
        self.end(name);
    }

    fn end(&mut self, name: &str) {
        self.text.push_str("</");
        self.text.push_str(name);
        self.text.push('>');
    }

    /// An element with a text.
    fn leaf(&mut self, name: &str, text: &str) {
        self.indent();
        self.text.push('<');
        self.text.push_str(name);
        self.text.push('>');
        for character in text.chars() {
            match character {
                '&' => self.text.push_str("&amp;"),
                '<' => self.text.push_str("&lt;"),
                '>' => self.text.push_str("&gt;"),
                // XML 1.0 has no place for these, not even escaped.
                c if c.is_control() => self.text.push(' '),
                c => self.text.push(c),
            }
        }
        self.end(name);
    }

    /// `dcc:textType` or `dcc:richContentType`.
    fn words(&mut self, name: &'static str, text: &str) {
        self.element(name, |xml| xml.leaf("dcc:content", text));
    }

    fn contact(&mut self, name: &'static str, contact: &Contact) {
        self.element(name, |xml| {
            xml.words("dcc:name", &contact.name);
            for (tag, text) in [("dcc:eMail", &contact.email), ("dcc:phone", &contact.phone)] {
                if let Some(text) = text {
                    xml.leaf(tag, text);
                }
            }
            xml.element("dcc:location", |xml| {
                xml.leaf("dcc:city", &contact.city);
                xml.leaf("dcc:countryCode", &contact.country);
                if let Some(code) = &contact.post_code {
                    xml.leaf("dcc:postCode", code);
                }
                xml.leaf("dcc:street", &contact.street);
            });
        });
    }

    fn identification(&mut self, issuer: &str, value: &str, name: &str) {
        self.element("dcc:identification", |xml| {
            xml.leaf("dcc:issuer", issuer);
            xml.leaf("dcc:value", value);
            xml.words("dcc:name", name);
        });
    }

    fn condition(&mut self, name: &str, unit: &str, condition: Condition) {
        self.element("dcc:influenceCondition", |xml| {
            xml.words("dcc:name", name);
            xml.element("dcc:data", |xml| {
                let expanded = (condition.uncertainty > 0.0).then_some(Expanded {
                    uncertainty: condition.uncertainty,
                    coverage_factor: 2.0,
                    distribution: "normal",
                });
                xml.element("dcc:quantity", |xml| {
                    xml.real(condition.value, unit, expanded)
                });
            });
        });
    }

    /// A value with its unit and, if available, its uncertainty.
    fn real(&mut self, value: f64, unit: &str, expanded: Option<Expanded>) {
        self.element("si:real", |xml| {
            xml.leaf("si:value", &number(value));
            xml.leaf("si:unit", unit);
            let Some(expanded) = expanded else { return };
            xml.element("si:measurementUncertaintyUnivariate", |xml| {
                xml.element("si:expandedMU", |xml| {
                    xml.leaf("si:valueExpandedMU", &number(expanded.uncertainty));
                    xml.leaf("si:coverageFactor", &number(expanded.coverage_factor));
                    xml.leaf("si:coverageProbability", &number(PROBABILITY));
                    xml.leaf("si:distribution", expanded.distribution);
                });
            });
        });
    }
}

/// An expanded uncertainty.
struct Expanded {
    uncertainty: f64,
    coverage_factor: f64,
    distribution: &'static str,
}

/// A number with all its digits.
fn number(value: f64) -> String {
    match value == 0.0 || (1e-4..1e6).contains(&value.abs()) {
        true => format!("{value}"),
        false => format!("{value:e}"),
    }
}

/// The certificate as an XML document.
pub fn write(certificate: &Certificate) -> String {
    let mut xml = Xml {
        text: "<?xml version=\"1.0\" encoding=\"UTF-8\"?>".to_owned(),
        open: Vec::new(),
    };
    let attributes = " xmlns:dcc=\"https://ptb.de/dcc\" xmlns:si=\"https://ptb.de/si\" \
                      xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
                      xsi:schemaLocation=\"https://ptb.de/dcc https://ptb.de/dcc/v3.3.0/dcc.xsd\" \
                      schemaVersion=\"3.3.0\"";
    xml.with("dcc:digitalCalibrationCertificate", attributes, |xml| {
        xml.element("dcc:administrativeData", |xml| {
            administrative(xml, certificate);
        });
        xml.element("dcc:measurementResults", |xml| {
            xml.element("dcc:measurementResult", |xml| measured(xml, certificate));
        });
    });
    xml.text.push('\n');
    xml.text
}

fn administrative(xml: &mut Xml, certificate: &Certificate) {
    let laboratory = &certificate.laboratory;
    let (program, release) = program(certificate);
    xml.element("dcc:dccSoftware", |xml| {
        xml.element("dcc:software", |xml| {
            xml.words("dcc:name", &program);
            xml.leaf("dcc:release", &release);
            xml.leaf("dcc:type", "application");
        });
    });
    let issue = &laboratory.certificate;
    xml.element("dcc:coreData", |xml| {
        xml.leaf("dcc:countryCodeISO3166_1", &laboratory.contact.country);
        xml.leaf("dcc:usedLangCodeISO639_1", "en");
        xml.leaf("dcc:mandatoryLangCodeISO639_1", "en");
        xml.leaf("dcc:uniqueIdentifier", &issue.number);
        if let Some(day) = issue.received {
            xml.leaf("dcc:receiptDate", &day.to_string());
        }
        xml.leaf("dcc:beginPerformanceDate", &issue.begin.to_string());
        xml.leaf("dcc:endPerformanceDate", &issue.end.to_string());
        xml.leaf("dcc:performanceLocation", issue.place.code());
        xml.leaf("dcc:issueDate", &issue.issued.to_string());
    });
    item(xml, &laboratory.item);
    xml.element("dcc:calibrationLaboratory", |xml| {
        xml.contact("dcc:contact", &laboratory.contact);
    });
    xml.element("dcc:respPersons", |xml| {
        xml.element("dcc:respPerson", |xml| {
            let of = &laboratory.authorised;
            xml.element("dcc:person", |xml| xml.words("dcc:name", &of.name));
            xml.leaf("dcc:role", &of.function);
            xml.leaf("dcc:mainSigner", "true");
        });
    });
    xml.contact("dcc:customer", &laboratory.customer);
    xml.element("dcc:statements", |xml| {
        xml.element("dcc:statement", |xml| {
            xml.words("dcc:name", "metrological traceability");
            xml.words("dcc:declaration", &laboratory.traceability.statement);
        });
        if let Some(conformity) = &certificate.conformity {
            for limit in &conformity.limits {
                statement(xml, limit, conformity.rule.words());
            }
        }
    });
}

/// The calibrated item.
fn item(xml: &mut Xml, item: &Item) {
    xml.element("dcc:items", |xml| {
        xml.element("dcc:item", |xml| {
            xml.words("dcc:name", &item.name);
            xml.words(
                "dcc:description",
                &format!("State when received: {}", item.state),
            );
            if let Some(manufacturer) = &item.manufacturer {
                xml.element("dcc:manufacturer", |xml| {
                    xml.words("dcc:name", manufacturer)
                });
            }
            xml.leaf("dcc:model", &item.model);
            xml.element("dcc:identifications", |xml| {
                xml.identification("manufacturer", &item.serial, "serial number");
            });
        });
    });
}

fn statement(xml: &mut Xml, limit: &Decided, rule: &str) {
    xml.element("dcc:statement", |xml| {
        xml.words("dcc:name", &in_words(&limit.name));
        let text = format!(
            "{} from nominal in SI units, limit ±{}; decision rule: {rule}; probability that the decision is \
             wrong: {:.1e}",
            number(limit.off),
            number(limit.limit.within),
            limit.risk,
        );
        xml.words("dcc:declaration", &text);
        xml.leaf("dcc:conformity", limit.decision.code());
    });
}

fn measured(xml: &mut Xml, certificate: &Certificate) {
    let laboratory = &certificate.laboratory;
    let (program, release) = program(certificate);
    xml.words("dcc:name", "Calibration of both triads");
    xml.element("dcc:usedMethods", |xml| {
        xml.element("dcc:usedMethod", |xml| {
            xml.words("dcc:name", &laboratory.method.procedure);
            let equation = certificate.calibration.equation.as_deref();
            xml.words("dcc:description", equation.unwrap_or_default());
            xml.leaf("dcc:norm", "JCGM 100:2008");
        });
    });
    xml.element("dcc:usedSoftware", |xml| {
        xml.element("dcc:software", |xml| {
            xml.words("dcc:name", &program);
            xml.leaf("dcc:release", &release);
            let inputs = certificate.provenance.inputs.iter();
            let mut text = format!("calibration.json: SHA-256 {}", certificate.sha256);
            for input in inputs {
                // Writing into a text does not fail.
                let _ = write!(text, "; {}: SHA-256 {}", input.name, input.sha256);
            }
            xml.words("dcc:description", &text);
        });
    });
    let equipment = &laboratory.traceability.equipment;
    if !equipment.is_empty() {
        equipments(xml, equipment);
    }
    xml.element("dcc:influenceConditions", |xml| {
        xml.condition(
            "air temperature",
            "\\degreecelsius",
            laboratory.conditions.temperature_degc,
        );
        if let Some(humidity) = laboratory.conditions.humidity_percent {
            xml.condition("relative humidity", "\\percent", humidity);
        }
    });
    xml.element("dcc:results", |xml| {
        xml.element("dcc:result", |xml| {
            xml.words("dcc:name", "Parameters");
            xml.words("dcc:description", &description(certificate));
            xml.element("dcc:data", |xml| {
                for of in certificate.results.iter().chain(&certificate.terms) {
                    quantity(xml, of);
                }
                together(xml, &certificate.results, &certificate.covariance);
            });
        });
    });
}

fn equipments(xml: &mut Xml, equipments: &[Equipment]) {
    xml.element("dcc:measuringEquipments", |xml| {
        for equipment in equipments {
            xml.element("dcc:measuringEquipment", |xml| {
                xml.words("dcc:name", &equipment.name);
                let text = format!("Certificate {}", equipment.certificate);
                xml.words("dcc:description", &text);
                xml.element("dcc:identifications", |xml| {
                    xml.identification("manufacturer", &equipment.serial, "serial number");
                });
            });
        }
    });
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
        certificate.body_frame().words(),
    );
    if let Some(temperature) = &certificate.calibration.temperature {
        text.push(' ');
        text += &temperature_words(temperature, |t| format!("{t:.1}"));
    }
    text
}

/// One parameter as expected by certificate readers.
fn quantity(xml: &mut Xml, of: &Measured) {
    // The name that calibration.json has is a valid xs:ID.
    let attributes = format!(" id=\"{}\" refType=\"basic_measuredValue\"", of.name);
    xml.with("dcc:quantity", &attributes, |xml| {
        xml.words("dcc:name", &in_words(&of.name));
        let expanded = Expanded {
            uncertainty: of.expanded,
            coverage_factor: of.coverage_factor,
            distribution: of.degrees_of_freedom.map_or("normal", |_| "t"),
        };
        xml.real(of.value, of.quantity.si_unit(), Some(expanded));
    });
}

/// All parameters in the order of the quantities before, with their covariance.
fn together(xml: &mut Xml, results: &[Measured], covariance: &[Vec<f64>]) {
    let list =
        |of: &dyn Fn(&Measured) -> String| results.iter().map(of).collect::<Vec<_>>().join(" ");
    xml.element("dcc:quantity", |xml| {
        xml.words(
            "dcc:name",
            "K, E and D, in the order above, with their covariance",
        );
        xml.element("si:realListXMLList", |xml| {
            xml.leaf("si:valueXMLList", &list(&|of| number(of.value)));
            xml.leaf(
                "si:unitXMLList",
                &list(&|of| of.quantity.si_unit().to_owned()),
            );
            ellipsoid(xml, results, covariance);
        });
    });
}

/// The joint coverage region.
fn ellipsoid(xml: &mut Xml, results: &[Measured], covariance: &[Vec<f64>]) {
    xml.element("si:ellipsoidalRegionXMLList", |xml| {
        xml.element("si:covarianceMatrix", |xml| {
            for (column, of_column) in results.iter().enumerate() {
                xml.element("si:column", |xml| {
                    for (row, of_row) in results.iter().enumerate() {
                        let unit = format!(
                            "{}{}",
                            of_row.quantity.si_unit(),
                            of_column.quantity.si_unit()
                        );
                        xml.element("si:covariance", |xml| {
                            xml.leaf("si:value", &number(covariance[row][column]));
                            xml.leaf("si:unit", &unit.replace("\\one\\one", "\\one"));
                        });
                    }
                });
            }
        });
        xml.leaf("si:coverageFactor", &number(of_ellipsoid(results.len())));
        xml.leaf("si:coverageProbability", &number(PROBABILITY));
        xml.leaf("si:distribution", "normal");
    });
}

/// Radius, in σ, of the ellipsoid of this dimension that contains the coverage probability.
fn of_ellipsoid(dimensions: usize) -> f64 {
    let square = ChiSquared::new(dimensions as f64).map(|chi2| chi2.inverse_cdf(PROBABILITY));
    square.map_or(1.0, f64::sqrt)
}

/// Name and release of the calibration program; PTB rules require a letter before the release number.
fn program(certificate: &Certificate) -> (String, String) {
    let program = &certificate.provenance.program;
    let (name, release) = program.split_once(' ').unwrap_or((program, "0"));
    (name.to_owned(), format!("v{release}"))
}

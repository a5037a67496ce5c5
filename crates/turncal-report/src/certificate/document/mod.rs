//! A calibration certificate: the document and the content of the page margins.

mod results;

use results::{results, two_digits};

use crate::certificate::{
    AsFound, Certificate, Conformity, Decision, Measured, Quantity, dcc, in_words,
    temperature_words,
};
use crate::document::Block;
use crate::pdf;
use crate::pdf::{Attached, Frame, PdfError};
use crate::prelude::*;
use turncal::calibration::Group;
use turncal::calibration::result::{EQUATION, GravityRecord};
use turncal::imu::ParameterKind;
use turncal::laboratory::{Authorised, Condition, Contact};
use turncal::run::Aiding;

/// Files of a certificate: PDF, XML and the calibration; the XML file and the calibration are also embedded in the PDF.
///
/// # Errors [`PdfError`] if a text cannot be shown.
pub fn files(
    certificate: &Certificate,
    calibration: Vec<u8>,
) -> Result<Vec<(String, Vec<u8>)>, PdfError> {
    let xml = dcc::write(certificate).into_bytes();
    let attached = vec![
        Attached {
            name: "dcc.xml".to_owned(),
            mime: "application/xml",
            description: "Digital Calibration Certificate, PTB DCC 3.3.0".to_owned(),
            alternative: true,
            bytes: xml.clone(),
        },
        Attached {
            name: "calibration.json".to_owned(),
            mime: "application/json",
            description: match certificate.calibration.budget {
                Some(_) => "Calibration with covariance and uncertainty budget".to_owned(),
                None => "Calibration with covariance".to_owned(),
            },
            alternative: false,
            bytes: calibration.clone(),
        },
    ];
    let pdf = pdf::write(&document(certificate), &frame(certificate), attached)?;
    Ok(vec![
        ("certificate.pdf".to_owned(), pdf),
        ("dcc.xml".to_owned(), xml),
        ("calibration.json".to_owned(), calibration),
    ])
}

/// Length of the line for a signature.
const SIGNATURE: usize = 40;

fn frame(certificate: &Certificate) -> Frame {
    let laboratory = &certificate.laboratory;
    let number = &laboratory.certificate.number;
    let day = laboratory.certificate.issued;
    Frame {
        left: laboratory.contact.name.clone(),
        right: format!("Calibration certificate {number}"),
        foot: format!("Certificate {number}, issued {day}"),
        end: format!("End of calibration certificate {number}"),
        day: (day.year, day.month, day.day),
    }
}

/// The complete content, in the order of ISO/IEC 17025, 7.8.2 and 7.8.4.
pub fn document(certificate: &Certificate) -> Document {
    let laboratory = &certificate.laboratory;
    let (issue, item) = (&laboratory.certificate, &laboratory.item);
    let mut document = Document::new("Calibration certificate");
    let mut general = Facts::new("", [("certificate number", issue.number.clone())]);
    general.push("laboratory", contact(&laboratory.contact));
    general.push("customer", contact(&laboratory.customer));
    let manufacturer = item.manufacturer.iter();
    let made = manufacturer.map(|name| format!(", {name}"));
    let words = format!(
        "{}{}, model {}, serial number {}",
        item.name,
        made.collect::<String>(),
        item.model,
        item.serial
    );
    general.push("item", words);
    general.push("state when received", item.state.clone());
    if let Some(day) = issue.received {
        general.push("received", day.to_string());
    }
    let (first, last) = (issue.begin, issue.end);
    let performed = if first == last {
        first.to_string()
    } else {
        format!("{first} to {last}")
    };
    general.push(
        "calibrated",
        format!("{performed}, {}", issue.place.words()),
    );
    general.push("issued", issue.issued.to_string());
    document.page(general);
    if let Some(conformity) = &certificate.conformity {
        document.page(Block::Text("Conformity".to_owned(), verdict(conformity)));
    }
    document.page(method(certificate));
    document.page(conditions(certificate));
    document.page(results(certificate));
    if let Some(conformity) = &certificate.conformity {
        document.page(limits(conformity));
    }
    if let Some(as_found) = &certificate.as_found {
        document.page(found(as_found));
    }
    document.page(traceability(certificate));
    document.page(signature(certificate));
    document.page(remarks(certificate));
    document
}

fn contact(contact: &Contact) -> String {
    let city = match &contact.post_code {
        Some(code) => format!("{code} {}", contact.city),
        None => contact.city.clone(),
    };
    let mut text = format!(
        "{}, {}, {city}, {}",
        contact.name, contact.street, contact.country
    );
    for way in [&contact.email, &contact.phone].into_iter().flatten() {
        text = format!("{text}, {way}");
    }
    text
}

fn method(certificate: &Certificate) -> Facts {
    let (calibration, provenance) = (&certificate.calibration, &certificate.provenance);
    let laboratory = &certificate.laboratory;
    let mut facts = Facts::new(
        "Method",
        [("procedure", laboratory.method.procedure.clone())],
    );
    facts.push(
        "deviations",
        laboratory.method.deviations.as_deref().unwrap_or("none"),
    );
    let how = evaluation(calibration.aiding);
    facts.push("evaluation", format!("{}: {how}", provenance.program));
    if let Some(word) = calibration.word() {
        facts.push("verdict", word.to_string());
    }
    let latitude = provenance.latitude_deg;
    facts.push(
        "data",
        format!(
            "{} s at {} Hz, {} dwells; latitude {}, height {} m",
            value(provenance.duration_s, 10.0),
            value(provenance.rate_hz, 10.0),
            count(provenance.dwells),
            latitude.map_or("not stated".to_owned(), |of| format!("{}°", value(of, 0.1))),
            value(provenance.height_m, 10.0),
        ),
    );
    facts.push(
        "model",
        format!(
            "{}; N: output per second; u: angular rate or specific force along the body axes",
            calibration.equation.as_deref().unwrap_or(EQUATION)
        ),
    );
    if let Some(temperature) = &calibration.temperature {
        let words = temperature_words(temperature, |t| value(t, 1.0));
        facts.push("temperature", words);
    }
    facts.push("body frame", calibration.body_frame.words());
    if let Some(gravity) = calibration.gravity {
        facts.push("gravity", of_gravity(gravity));
    }
    for input in &provenance.inputs {
        facts.push(
            "input file",
            format!("{}, SHA-256 {}", input.name, input.sha256),
        );
    }
    let attached = format!("attached, SHA-256 {}", certificate.sha256);
    facts.push("calibration.json", attached);
    facts
}

fn evaluation(aiding: Option<Aiding>) -> &'static str {
    match aiding {
        Some(Aiding::Table) => {
            "error-state Kalman filter with Gauss–Newton iterations, which observes standstill and the attitude of \
             the turntable"
        }
        Some(Aiding::Velocity) => {
            "error-state Kalman filter with Gauss–Newton iterations, which observes standstill"
        }
        None => "closed form with static positions",
    }
}

fn of_gravity(gravity: GravityRecord) -> String {
    let accuracy = if gravity.sigma_m_s2 > 0.0 {
        format!("U = {} m/s² (k = 2)", sigma(2.0 * gravity.sigma_m_s2))
    } else {
        "assumed exact".to_owned()
    };
    let digits = gravity.sigma_m_s2.max(1e-6);
    format!("{} m/s², {accuracy}", value(gravity.m_s2, digits))
}

fn conditions(certificate: &Certificate) -> Facts {
    let conditions = &certificate.laboratory.conditions;
    let with = |of: Condition, unit: &str| {
        format!("({}) {unit}, k = 2", plus_minus(of.value, of.uncertainty))
    };
    let mut facts = Facts::new(
        "Conditions",
        [("air temperature", with(conditions.temperature_degc, "°C"))],
    );
    if let Some(humidity) = conditions.humidity_percent {
        facts.push("relative humidity", with(humidity, "%"));
    }
    facts
}

fn verdict(conformity: &Conformity) -> String {
    let (limits, all) = (conformity.limits.len(), || conformity.limits.iter());
    let kept = all().filter(|of| of.decision == Decision::Pass).count();
    let first = match conformity.overall() {
        Some(Decision::Pass) => format!("All {limits} limits are met."),
        Some(worst) => format!(
            "{kept} of {limits} limits are met; overall: {}.",
            worst.words()
        ),
        None => "No limit applies to a calibrated parameter.".to_owned(),
    };
    let risk = all().map(|of| of.risk).fold(0.0, f64::max);
    let mut text = format!(
        "{first} Decision rule: {}. Highest risk of a wrong decision in the table below: {}.",
        conformity.rule.words(),
        probability(risk)
    );
    if !conformity.not_decided.is_empty() {
        text += &format!(
            " Not decided, because these parameters were not calibrated: {}.",
            conformity.not_decided.join(", ")
        );
    }
    text
}

/// A probability, down to the smallest relevant value.
fn probability(of: f64) -> String {
    if of < 1e-6 {
        "below 0.0001 %".to_owned()
    } else {
        format!("{} %", sigma(100.0 * of))
    }
}

fn limits(conformity: &Conformity) -> Table {
    let rows = conformity.limits.iter().map(|of| {
        let group = Group::of(of.limit.parameter);
        let (unit, size) = Quantity::Parameters(group).unit();
        let base = match group.kind() {
            ParameterKind::Scale => 1.0,
            ParameterKind::Installation | ParameterKind::Bias => 0.0,
        };
        let off = of.off + of.limit.nominal - base;
        let expanded = of.coverage_factor * of.sigma;
        let (found, expanded) = two_digits(off / size, expanded / size);
        cells![
            in_words(&of.name),
            plus_minus(found, expanded),
            format!(
                "{} ± {}",
                stated((of.limit.nominal - base) / size),
                stated(of.limit.within / size)
            ),
            unit,
            of.decision.words(),
            probability(of.risk),
        ]
    });
    Table::new("Conformity with the specification", columns("parameter | value ± U | limits | unit | decision | risk"))
        .section(rows)
        .note(
            "Values are in the general installation form; U uses the same k as the results. Risk: probability, given this \
             calibration, that the decision is wrong (false acceptance or false rejection; JCGM 106, 9.3).",
        )
}

fn found(as_found: &AsFound) -> Table {
    let rows = as_found.changes.iter().map(|change| {
        let (unit, size) = change.left.quantity.unit();
        let expanded = change.expanded().map(|u| u / size);
        let by = change.difference() / size;
        let in_u = expanded.filter(|u| *u > 0.0).map(|u| by / u);
        let shown = |of: f64, u: f64| {
            let digits = if u > 0.0 { u } else { 0.01 };
            let (of, expanded) = two_digits(of, digits);
            if u > 0.0 {
                plus_minus(of, expanded)
            } else {
                value(of, digits)
            }
        };
        let measured = |of: &Measured| shown(of.value / size, of.expanded / size);
        cells![
            in_words(&change.left.name),
            measured(&change.found),
            measured(&change.left),
            shown(by, expanded.unwrap_or(0.0)),
            unit,
            or_dash(in_u, |x| value(x, 0.1)),
        ]
    });
    let columns = columns("parameter | as found ± U | as left ± U | change ± U | unit | change/U");
    Table::new("As found and as left", columns).section(rows).note(format!(
        "As found: parameters from {}, which was valid when the item was received. As left: parameters from this \
         calibration. Both sets of parameters are in the general installation form. U of a change: root sum of \
         squares of both expanded uncertainties. A change larger than its U shows that the item has drifted. Body \
         frame of both calibrations: {}.",
        as_found.earlier,
        as_found.body_frame.words()
    ))
}

/// Authorising person, with space for date and signature.
fn signature(certificate: &Certificate) -> Facts {
    let Authorised { name, function } = &certificate.laboratory.authorised;
    let mut facts = Facts::new("Authorisation", [("name", format!("{name}, {function}"))]);
    facts.push("date, signature", "_".repeat(SIGNATURE));
    facts
}

fn traceability(certificate: &Certificate) -> Facts {
    let traceability = &certificate.laboratory.traceability;
    let mut facts = Facts::new(
        "Metrological traceability",
        [("statement", traceability.statement.clone())],
    );
    for of in &traceability.equipment {
        let words = format!(
            "serial number {}, certificate {}",
            of.serial, of.certificate
        );
        facts.push(&of.name, words);
    }
    facts
}

fn remarks(certificate: &Certificate) -> List {
    List::new("Remarks", certificate.remarks())
}

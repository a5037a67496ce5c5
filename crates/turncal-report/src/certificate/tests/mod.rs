use super::conformity::decide;
use super::*;
mod record;

use crate::certificate::document::files;
use record::{record, with_covariance};
use turncal::calibration::result::{EQUATION_WITH_TERMS, InputFile, TermRecord};
use turncal::calibration::{BudgetRecord, Finding, FindingKind, ThermalRecord, Verdict};
use turncal::imu::{InstallationForm, PerSensor, ThermalRange};
use turncal::laboratory::DecisionRule;
use turncal::lot::Limit;
use turncal::units::{ARCSEC, PPM};
use turncal_files::{digest_of_bytes, read_laboratory};

fn calibration() -> Calibration {
    let mut calibration = with_covariance(record(), InstallationForm::General);
    calibration.provenance = Some(Provenance {
        program: "turncal 0.0.0".to_owned(),
        inputs: vec![InputFile {
            name: "imu.csv".to_owned(),
            sha256: digest_of_bytes(b"imu"),
        }],
        nominal: PerSensor {
            gyro: [2.0626e6; 3],
            accel: [1e5; 3],
        },
        latitude_deg: Some(45.0),
        height_m: 100.0,
        duration_s: 600.0,
        rate_hz: 100.0,
        dwells: 12,
    });
    calibration
}

fn laboratory() -> Laboratory {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/lab.toml");
    read_laboratory(&path, |_| None).unwrap()
}

fn specification(within: f64) -> Specification {
    let limit = |parameter| Limit {
        parameter,
        nominal: if parameter < 3 { 1.0 } else { 0.0 },
        within,
    };
    Specification {
        confidence: 0.95,
        limits: (0..9).map(limit).collect(),
    }
}

fn certificate() -> Certificate {
    let calibration = calibration();
    let mut earlier = calibration.clone();
    earlier.gyro.scale[0] *= 1.0 - 100.0 * PPM;
    let specification = specification(0.01);
    let found = Some(("earlier.json", &earlier));
    Certificate::new(
        calibration.clone(),
        digest_of_bytes(b"file"),
        laboratory(),
        Some(&specification),
        found,
    )
    .unwrap()
}

#[test]
fn the_same_inputs_give_the_same_bytes_and_every_file_names_the_certificate() {
    let certificate = certificate();
    let made = || files(&certificate, b"{}".to_vec()).unwrap();
    let first = made();
    assert_eq!(first, made());
    let (name, pdf) = &first[0];
    assert_eq!(name, "certificate.pdf");
    assert!(pdf.starts_with(b"%PDF-1.7"));
    let contains = |bytes: &[u8], text: &str| {
        bytes
            .windows(text.len())
            .any(|part| part == text.as_bytes())
    };
    for needed in [
        "pdfaid:part",
        "/AFRelationship",
        "calibration.json",
        "dcc.xml",
        "/OutputIntents",
    ] {
        assert!(contains(pdf, needed), "{needed}");
    }
    let xml = String::from_utf8(first[1].1.clone()).unwrap();
    assert!(xml.contains("<dcc:uniqueIdentifier>2026-0042</dcc:uniqueIdentifier>"));
    assert_eq!(xml.matches("<si:covariance>").count(), 24 * 24);
    assert_eq!(xml.matches("<dcc:conformity>").count(), 9);
    for open in ["dcc:", "si:"] {
        let begun = xml.matches(&format!("<{open}")).count();
        assert_eq!(begun, xml.matches(&format!("</{open}")).count());
    }
    assert!(xml.contains(&digest_of_bytes(b"imu")));
}

#[test]
fn results_are_those_of_the_calibration_in_si_with_their_own_coverage_factor() {
    let certificate = certificate();
    let calibration = &certificate.calibration;
    assert_eq!(certificate.results.len(), 24);
    for (n, of) in certificate.results.iter().enumerate() {
        let sigma = certificate.covariance[n][n].sqrt();
        assert!((of.expanded / sigma - of.coverage_factor).abs() < 1e-12);
    }
    let nominal = certificate.provenance.nominal.gyro[0];
    let first = &certificate.results[0];
    assert_eq!(first.name, "gyro.scale.x");
    assert!((1.0 + first.value - calibration.gyro.scale[0] / nominal).abs() < 1e-15);
    let sigma = calibration.covariance[0][0].sqrt() / nominal;
    assert!((first.expanded / sigma - 2.0).abs() < 1e-9);
}

/// What the certificate of a calibration says, as text, and its DCC.
fn said(calibration: Calibration) -> (String, String) {
    let made = Certificate::new(
        calibration,
        digest_of_bytes(b"file"),
        laboratory(),
        None,
        None,
    );
    let certificate = made.unwrap();
    let document = crate::certificate::document::document(&certificate);
    (format!("{document:?}"), dcc::write(&certificate))
}

#[test]
fn error_terms_are_results_with_their_uncertainty_and_stand_in_the_model() {
    let mut calibration = calibration();
    calibration.equation = Some(EQUATION_WITH_TERMS.to_owned());
    for (name, value) in [("gyro.g_sensitivity.xy", 5e-9), ("table.base.up", 1e-5)] {
        let sigma = Some(0.1 * value);
        let record = TermRecord { value, sigma };
        calibration.terms.insert(name.to_owned(), record);
    }
    let (text, xml) = said(calibration);
    // 5e-9 rad/s per m/s² is 0.0101 °/h a g, and U is a fifth of it.
    let row = r#"["gyroscope g sensitivity xy", "0.0101 ± 0.0020", "°/h/g", "2.00", "–"]"#;
    assert!(text.contains(row), "{text}");
    for needed in [EQUATION_WITH_TERMS, "g-sensitivity adds Q f to w"] {
        assert!(text.contains(needed), "no {needed} in {text}");
    }
    for needed in [
        " id=\"gyro.g_sensitivity.xy\" ",
        "<dcc:content>gyroscope g sensitivity xy</dcc:content>",
        "<si:value>5e-9</si:value>",
        "<si:unit>\\radian\\second\\metre\\tothe{-1}</si:unit>",
        "<si:valueExpandedMU>1e-9</si:valueExpandedMU>",
    ] {
        assert!(xml.contains(needed), "{needed}");
    }
    // The table is the laboratory's, not the customer's.
    assert!(!text.contains("table.base.up") && !xml.contains("table.base.up"));
}

#[test]
fn results_that_change_with_temperature_state_at_which_they_hold() {
    let range = ThermalRange {
        lowest: -20.0,
        highest: 60.0,
        reference: 21.5,
        largest_rate: 1e-3,
    };
    let mut calibration = calibration();
    calibration.temperature = Some(ThermalRecord {
        equation: String::new(),
        range: PerSensor::from_fn(|_| range),
        coefficients: Vec::new(),
        covariance: Vec::new(),
        cross: Vec::new(),
        powers: Default::default(),
    });
    let (text, xml) = said(calibration);
    assert!(
        text.contains("gyros at 21.5 °C, valid from −20.0 to 60.0 °C"),
        "{text}"
    );
    assert!(xml.contains("accelerometers at 21.5 °C, valid from -20.0 to 60.0 °C"));
}

#[test]
fn a_budget_is_spoken_of_only_where_there_is_one() {
    let without = calibration();
    let mut with = calibration();
    let size = with.parameters.len();
    with.budget = Some(BudgetRecord {
        sources: Vec::new(),
        degrees_of_freedom: vec![None; size],
        coverage_factor: vec![2.0; size],
    });
    for (calibration, has) in [(without, false), (with, true)] {
        assert_eq!(said(calibration).0.contains("uncertainty budget"), has);
    }
}

#[test]
fn nominal_scales_have_no_digits_of_arithmetic() {
    let mut calibration = calibration();
    let provenance = calibration.provenance.as_mut().unwrap();
    provenance.nominal.accel = [100000.00000000001; 3];
    let (text, xml) = said(calibration);
    assert!(
        text.contains(r"accelerometers 100\u{202f}000 count"),
        "{text}"
    );
    assert!(xml.contains("accelerometers 100000, 100000"));
}

#[test]
fn releases_begin_with_a_letter_as_ptbs_rules_want() {
    let xml = dcc::write(&certificate());
    // PTB's Schematron: ^[a-zA-Z]( )?(\d{1,3}\.){0,3}\d{1,3}$
    assert_eq!(xml.matches("<dcc:release>v0.0.0</dcc:release>").count(), 2);
}

#[test]
fn what_was_found_differs_by_what_has_changed() {
    let certificate = certificate();
    let changes = &certificate.as_found.as_ref().unwrap().changes;
    let by = |n: usize| changes[n].difference();
    let now = 1.0 + changes[0].left.value;
    assert!((by(0) / now - 100.0 * PPM).abs() < 1e-3 * PPM, "{}", by(0));
    assert!((1..changes.len()).all(|n| by(n).abs() < 1e-12));
}

#[test]
fn a_guard_band_decides_by_the_uncertainty_and_the_risk_is_that_of_the_other_side() {
    use DecisionRule::{GuardBand, SimpleAcceptance};
    let sigma = 1.0;
    for (off, guarded, simple) in [
        (0.0, Decision::Pass, Decision::Pass),
        (7.9, Decision::Pass, Decision::Pass),
        (9.0, Decision::ConditionalPass, Decision::Pass),
        (-11.0, Decision::ConditionalFail, Decision::Fail),
        (12.1, Decision::Fail, Decision::Fail),
    ] {
        assert_eq!(
            decide(off, (sigma, 2.0), 10.0, GuardBand).0,
            guarded,
            "{off}"
        );
        assert_eq!(
            decide(off, (sigma, 2.0), 10.0, SimpleAcceptance).0,
            simple,
            "{off}"
        );
    }
    // Normal distribution beyond 1σ and 2σ: 0.158655, 0.022750.
    assert!((decide(9.0, (sigma, 2.0), 10.0, GuardBand).1 - 0.158_655).abs() < 1e-6);
    assert!((decide(8.0, (sigma, 2.0), 10.0, GuardBand).1 - 0.022_750).abs() < 1e-6);
    assert!((decide(11.0, (sigma, 2.0), 10.0, SimpleAcceptance).1 - 0.158_655).abs() < 1e-6);
}

#[test]
fn what_may_not_be_used_or_is_not_complete_gets_no_certificate() {
    let calibration = calibration();
    let refused = |calibration: Calibration,
                   laboratory: Laboratory,
                   specification: Option<&Specification>| {
        let digest = String::new();
        let made = Certificate::new(calibration, digest, laboratory, specification, None);
        made.unwrap_err().to_string()
    };
    let mut astray = calibration.clone();
    astray.converged = Some(false);
    assert!(refused(astray, laboratory(), None).contains("did not converge"));
    let mut old = calibration.clone();
    old.provenance = None;
    assert!(refused(old, laboratory(), None).contains("`provenance`"));
    let mut without = laboratory();
    without.decision.rule = None;
    let limits = specification(ARCSEC);
    assert!(refused(calibration, without, Some(&limits)).contains("decision.rule"));
}

#[test]
fn a_character_without_a_glyph_is_named_with_its_text() {
    let mut certificate = certificate();
    certificate.laboratory.customer.name = "测绘".to_owned();
    let message = files(&certificate, Vec::new()).unwrap_err().to_string();
    assert!(message.contains('测'), "{message}");
    let greek = "Δοκιμή Łódź Журнал ½ µ ″ ≤ ∞ −";
    certificate.laboratory.customer.name = greek.to_owned();
    files(&certificate, Vec::new()).unwrap();
}

/// k of 2.5 from 7.1 degrees of freedom: U, guard band and change all have it.
#[test]
fn a_parameter_has_one_u_and_one_k_in_every_table_and_the_guard_band_is_that_u() {
    let mut calibration = calibration();
    let size = calibration.parameters.len();
    let sigma = calibration.covariance[0][0].sqrt();
    calibration.budget = Some(BudgetRecord {
        sources: Vec::new(),
        degrees_of_freedom: vec![Some(7.1); size],
        coverage_factor: vec![2.5; size],
    });
    let nominal = calibration.provenance.as_ref().unwrap().nominal.gyro[0];
    let value = calibration.gyro.scale[0] / nominal - 1.0;
    // 2.2 σ inside the upper limit: more than 2 σ, less than U.
    let mut limits = specification(value.abs() + 2.2 * sigma / nominal);
    limits.limits.truncate(1);
    let earlier = calibration.clone();
    let certificate = Certificate::new(
        calibration,
        digest_of_bytes(b"file"),
        laboratory(),
        Some(&limits),
        Some(("earlier.json", &earlier)),
    )
    .unwrap();
    let decided = &certificate.conformity.as_ref().unwrap().limits[0];
    assert_eq!(decided.decision, Decision::ConditionalPass);
    let change = &certificate.as_found.as_ref().unwrap().changes[0];
    let expanded = certificate.results[0].expanded;
    assert!((expanded - 2.5 * sigma / nominal).abs() < 1e-9 * expanded);
    for (name, of, k) in [
        (
            "limit",
            decided.coverage_factor * decided.sigma,
            decided.coverage_factor,
        ),
        ("as left", change.left.expanded, change.left.coverage_factor),
    ] {
        assert!(
            (of / expanded - 1.0).abs() < 1e-9 && k == 2.5,
            "{name}: {of} {expanded}"
        );
    }
    assert!((change.expanded().unwrap() / expanded - 2f64.sqrt()).abs() < 1e-9);
}

#[test]
fn the_xml_has_the_values_as_found_the_verdict_and_the_remarks_in_sentences() {
    let mut certificate = certificate();
    let text = "You stated no white noise. Add --noise or run `turncal allan`.".to_owned();
    let finding = Finding::new(FindingKind::NoiseLearnt, text, serde_json::Value::Null);
    let event = Finding::new(
        FindingKind::MoveWrong,
        String::new(),
        serde_json::Value::Null,
    );
    let findings = [finding, event];
    certificate.calibration.verdict = Some(Verdict::of(&findings));
    certificate.calibration.findings.extend(findings);
    let xml = dcc::write(&certificate);
    let document = format!("{:?}", crate::certificate::document::document(&certificate));
    assert_eq!(xml.matches("<dcc:result>").count(), 2);
    let found = xml.split("Parameters as found").nth(1).unwrap();
    assert_eq!(found.matches("<si:valueExpandedMU>").count(), 24);
    for text in [&xml, &document] {
        for says in [
            "USE WITH CARE",
            "The noise of the instrument was estimated from the record",
        ] {
            assert!(text.contains(says), "no {says} in {text}");
        }
        assert!(!text.contains(" --") && !text.contains('`'), "{text}");
    }
}

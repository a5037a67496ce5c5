//! `turncal certificate`: files as other programs read them.

use std::path::Path;
use std::process::Command;

use crate::shared::{shared, skipped};

/// Embedded files come out as they went in; the metadata names PDF/A-3; and where TURNCAL_DCC_SCHEMA names the
/// schema of the Digital Calibration Certificate 3.3.0, with those that it imports beside it, the XML is valid.
/// PyDCC reads a value, a unit and U of each parameter.
const SCRIPT: &str = "
import os, sys
import pikepdf
from lxml import etree
directory = sys.argv[1]
pdf = pikepdf.open(os.path.join(directory, 'certificate.pdf'))
assert len(pdf.pages) in (2, 3, 4), len(pdf.pages)
metadata = pdf.open_metadata()
assert (metadata['pdfaid:part'], metadata['pdfaid:conformance']) == ('3', 'U'), metadata.pdfa_status
assert sorted(pdf.attachments) == ['calibration.json', 'dcc.xml'], list(pdf.attachments)
for name, attached in pdf.attachments.items():
    inside = attached.get_file().read_bytes()
    assert inside == open(os.path.join(directory, name), 'rb').read(), name
    assert str(attached.obj['/AFRelationship']) in ('/Data', '/Alternative')
assert len(pdf.Root.AF) == 2 and str(pdf.Root.OutputIntents[0].S) == '/GTS_PDFA1'
tree = etree.parse(os.path.join(directory, 'dcc.xml'))
assert tree.getroot().get('schemaVersion') == '3.3.0'
schema = os.environ.get('TURNCAL_DCC_SCHEMA')
if schema:
    etree.XMLSchema(etree.parse(schema)).assertValid(tree)
else:
    print('no TURNCAL_DCC_SCHEMA')
try:
    from dcc.dcc import DCC
except Exception:
    print('no PyDCC')
else:
    read = DCC(os.path.join(directory, 'dcc.xml')).get_calibration_results('name')
    values = [(name, of['real']) for name, of in read if 'real' in of]
    assert len(values) == 24, len(values)
    for name, real in values:
        expanded = real['measurementUncertaintyUnivariate']['expandedMU']
        assert float(expanded['valueExpandedMU']) > 0 and real['unit'].startswith(chr(92)), (name, real)
        float(real['value'])
";

fn turncal(arguments: &[&Path]) {
    let done = Command::new(env!("CARGO_BIN_EXE_turncal"))
        .args(arguments)
        .output()
        .unwrap();
    assert!(done.status.success(), "{done:?}");
}

/// Writes the certificate of a calibration to a directory.
fn certify(calibration: &Path, paper: &Path) {
    let lab = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("examples/lab.toml");
    turncal(&[
        Path::new("certificate"),
        calibration,
        Path::new("--laboratory"),
        &lab,
        Path::new("-o"),
        paper,
    ]);
}

#[test]
fn both_calibrations_of_the_demo_get_a_certificate_that_names_their_files() {
    let directory = tempfile::tempdir().unwrap();
    let demo = directory.path().join("demo");
    turncal(&[Path::new("demo"), Path::new("-o"), &demo]);
    for method in ["ekf", "six-position"] {
        let paper = directory.path().join(method);
        certify(&demo.join(method).join("calibration.json"), &paper);
        let xml = std::fs::read_to_string(paper.join("dcc.xml")).unwrap();
        assert!(xml.contains("; imu.csv"), "{method}");
    }
}

#[test]
fn a_draft_that_nobody_completed_is_no_statement() {
    let directory = tempfile::tempdir().unwrap();
    let lab = directory.path().join("lab.toml");
    let turncal = || Command::new(env!("CARGO_BIN_EXE_turncal"));
    let draft = turncal().args(["certificate", "--draft"]).output().unwrap();
    std::fs::write(&lab, &draft.stdout).unwrap();
    let demo = directory.path().join("demo");
    let demonstration = turncal().args(["demo", "-o"]).arg(&demo).output().unwrap();
    assert!(demonstration.status.success());
    let mut certificate = turncal();
    certificate
        .arg("certificate")
        .arg(demo.join("ekf/calibration.json"));
    let refused = certificate.arg("--laboratory").arg(&lab).output().unwrap();
    let message = String::from_utf8_lossy(&refused.stderr);
    assert!(
        refused.status.code() == Some(1) && message.contains("found 20 incomplete fields"),
        "{message}"
    );
    // In the order of the draft, without those that the run states.
    let text = std::fs::read_to_string(&lab).unwrap();
    let places = [
        ("laboratory.name", "[laboratory]"),
        ("customer.country", "[customer]"),
        ("certificate.begin", "# begin"),
        ("certificate.issued", "# issued"),
        ("method.procedure", "[method]"),
        ("conditions.temperature_degc", "# temperature_degc"),
        ("traceability.statement", "[traceability]"),
        ("authorised.function", "[authorised]"),
    ];
    let found =
        places.map(|(field, mark)| (message.find(field).unwrap(), text.find(mark).unwrap()));
    assert!(found.is_sorted(), "{message}");
}

#[test]
fn a_certificate_is_a_pdf_a_3_with_its_files_in_it_and_valid_xml() {
    let Some(shared) = shared("three-axis-counts") else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    let [result, paper] = ["result", "paper"].map(|name| directory.path().join(name));
    turncal(&[
        Path::new("calibrate"),
        &shared.join("run.toml"),
        Path::new("-o"),
        &result,
    ]);
    certify(&result.join("calibration.json"), &paper);
    let python = std::env::var("TURNCAL_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let Ok(ran) = Command::new(python)
        .args(["-c", SCRIPT])
        .arg(&paper)
        .output()
    else {
        skipped("no Python");
        return;
    };
    let error = String::from_utf8_lossy(&ran.stderr);
    if error.contains("ModuleNotFoundError") {
        skipped("Python without pikepdf or lxml");
        return;
    }
    assert!(ran.status.success(), "{error}");
    for missing in String::from_utf8_lossy(&ran.stdout).lines() {
        skipped(&format!("a part of it: {missing}"));
    }
}

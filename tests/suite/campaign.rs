//! Several recordings of one instrument as one calibration: temperature, days, order.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector, Vector3};
use turncal::calibration::{
    Calibration, Coefficient, Finding, NoisePolicy, Options, Outcome, PARAMETERS, Problem,
    RecordingDifference, Together, UNWATCHED, bound, estimate, nees, parameter,
    sensor_and_parameter, to_vector,
};
use turncal::imu::{PerSensor, Sensor, TermVector};
use turncal::run::Run;
use turncal::simulation::{Scenario, SimulatedCampaign};
use turncal::units::{ARCSEC, DEG_PER_H};
use turncal_files::Campaign;

use super::lot::{PATH, on_threads, turncal, words};
use super::shared::{read, shared};

const SCENARIO: &str = "seed = 1
[site]
latitude_deg = 34.0
[imu]
model = \"navigation-fog-warming\"
installation = \"general\"
output = \"pulse\"
sample_rate_hz = 50.0
[turntable]
model = \"three-axis\"
path = \"short.toml\"
[chamber]
profile = [[0.0, 20.0]]
sensor_noise_k = 0.01
";
const CAMPAIGN: &str = "scenario = \"scenario.toml\"
[[recording]]
name = \"cold\"
chamber = { profile = [[0.0, 0.0]] }
[[recording]]
name = \"mild\"
[[recording]]
name = \"warm\"
chamber = { profile = [[0.0, 40.0]] }
";

/// `simulated/` with three recordings of a short run each.
fn simulated(here: &Path) {
    fs::write(here.join("short.toml"), PATH).unwrap();
    fs::write(here.join("scenario.toml"), SCENARIO).unwrap();
    fs::write(here.join("soaks.toml"), CAMPAIGN).unwrap();
    let made = turncal(here, &["simulate", "soaks.toml", "-o", "simulated"]);
    assert!(made.status.success(), "{}", words(&made));
}

/// The calibration but for what it was made from.
fn calibrated(here: &Path, campaign: &str, to: &str, threads: &str) -> String {
    let done = on_threads(here, threads, &["calibrate", campaign, "-o", to]);
    assert!(done.status.success(), "{}", words(&done));
    let text = fs::read_to_string(here.join(to).join("calibration.json")).unwrap();
    let mut record: serde_json::Value = serde_json::from_str(&text).unwrap();
    let provenance = record["provenance"]["inputs"].take();
    assert_eq!(
        provenance.as_array().unwrap().len(),
        1 + 3 * 3,
        "{provenance}"
    );
    record.to_string()
}

#[test]
fn a_campaign_is_calibrated_as_one_whatever_the_order_of_recordings_and_the_number_of_threads() {
    let here = tempfile::tempdir().unwrap();
    let here = here.path();
    simulated(here);
    let once = calibrated(here, "simulated/campaign.toml", "once", "1");
    let turned = "format = \"turncal-campaign/1\"
[[recording]]
run = \"warm/run.toml\"
[[recording]]
run = \"cold/run.toml\"
[[recording]]
run = \"mild/run.toml\"
";
    fs::create_dir(here.join("again")).unwrap();
    fs::write(here.join("simulated/campaign.toml"), turned).unwrap();
    let again = calibrated(here, "simulated/campaign.toml", "again/result", "2");
    assert!(once == again, "the calibrations differ");

    // Between the soaks, where no recording was made, the truth lies within σ.
    let [calibration, truth] = ["once/calibration.json", "simulated/truth.json"].map(|file| {
        let record = turncal_files::read_calibration(&here.join(file)).unwrap();
        record.at_temperature(30.0).unwrap()
    });
    let mut beyond = 0;
    for name in &calibration.parameters {
        let off = calibration[name] - truth[name];
        let sigma = calibration.sigma_of(name).unwrap();
        beyond += usize::from(off.abs() > 3.0 * sigma);
    }
    // Of 24 numbers one is beyond 3 σ in 16 of 17 such runs at most.
    assert!(beyond <= 1, "{beyond} parameters beyond 3 σ");
    // Forty kelvin change them by a thousand σ.
    let mild = turncal_files::read_calibration(&here.join("once/calibration.json")).unwrap();
    let cold = mild.at_temperature(0.0).unwrap();
    let change = (cold["accel.bias.x"] - calibration["accel.bias.x"]).abs();
    assert!(change > 30.0 * calibration.sigma_of("accel.bias.x").unwrap());
    let beyond = mild.at_temperature(90.0).unwrap_err().to_string();
    assert!(
        beyond.contains("90 °C") && beyond.contains("outside"),
        "{beyond}"
    );
}

/// The bias that an autopilot takes off at a temperature by its own equation, along front, right and down, over that
/// at the temperature of its calibration.
fn px4(value: &dyn Fn(&str) -> f64, letter: char, place: usize, temperature: f64) -> f64 {
    let of = |name: &str| value(&format!("TC_{letter}0_{name}"));
    let d = temperature.clamp(of("TMIN"), of("TMAX")) - of("TREF");
    let x = |k: usize| of(&format!("X{k}_{place}"));
    x(0) + d * (x(1) + d * (x(2) + d * x(3)))
}

fn ardupilot(value: &dyn Fn(&str) -> f64, letter: char, place: usize, temperature: f64) -> f64 {
    let kind = if letter == 'G' { "GYR" } else { "ACC" };
    let within = |t: f64| t.clamp(value("INS_TCAL1_TMIN"), value("INS_TCAL1_TMAX"));
    let at = |t: f64| {
        let d = within(t) - 35.0;
        let c = |k: usize| value(&format!("INS_TCAL1_{kind}{k}_{}", ["X", "Y", "Z"][place]));
        d * (c(1) + d * (c(2) + d * c(3))) * 1e-6
    };
    at(temperature) - at(value(&format!("INS_{kind}1_CALTEMP")))
}

/// A parameter of an autopilot by its name, a letter for the triad, place of the axis and temperature.
type Evaluated = fn(&dyn Fn(&str) -> f64, char, usize, f64) -> f64;

#[test]
fn autopilots_take_off_the_bias_at_a_temperature() {
    let here = tempfile::tempdir().unwrap();
    let here = here.path();
    simulated(here);
    calibrated(here, "simulated/campaign.toml", "all", "2");
    let record = turncal_files::read_calibration(&here.join("all/calibration.json")).unwrap();
    let run = turncal_files::read_run(&here.join("simulated/mild/run.toml")).unwrap();
    let formats: [(&str, Evaluated); 2] = [("px4", px4), ("ardupilot", ardupilot)];
    for (format, evaluate) in formats {
        let arguments = [
            "export",
            "all/calibration.json",
            "--format",
            format,
            "--run",
            "simulated/mild/run.toml",
        ];
        let done = turncal(here, &arguments);
        assert!(done.status.success(), "{}", words(&done));
        let text = String::from_utf8(done.stdout).unwrap();
        let comments = text.lines().filter(|line| line.starts_with('#'));
        assert!(comments.count() <= 6, "{text}");
        // No log of samples holds the identities without which PX4 skips these parameters.
        let told = ["TC_G0_ID", "TC_A0_ID"].map(|id| text.contains(id));
        assert_eq!(told, [format == "px4"; 2]);
        let value = |name: &str| -> f64 {
            let line = text.lines().find(|line| {
                let mut fields = line.split(['\t', ',']);
                !line.starts_with('#') && fields.any(|field| field == name)
            });
            let mut fields = line.expect(name).split(['\t', ',']);
            fields.find(|&field| field == name);
            fields.next().unwrap().parse().unwrap()
        };
        let reference = record.temperature.as_ref().unwrap().range.gyro.reference;
        let there = record.at_temperature(reference).unwrap();
        for temperature in [2.0, 17.0, 38.0] {
            let at = record.at_temperature(temperature).unwrap();
            for sensor in Sensor::ALL {
                let letter = match sensor {
                    Sensor::Gyro => 'G',
                    Sensor::Accel => 'A',
                };
                for (place, (axis, sign)) in [(1, 1.0), (0, 1.0), (2, -1.0)].into_iter().enumerate()
                {
                    let name = format!("{}.bias.{}", sensor.name(), ["x", "y", "z"][axis]);
                    let nominal = run.instrument.nominal.get(sensor).0[axis];
                    let expected = sign * (at[&name] - there[&name]) / nominal;
                    let found = evaluate(&value, letter, place, temperature);
                    // Numbers of 24 bits; what cancels between two temperatures is of the size of forty kelvin.
                    let coefficient =
                        (record.at_temperature(0.0).unwrap()[&name] - there[&name]) / nominal;
                    assert!(
                        (found - expected).abs() < 1e-5 * coefficient.abs().max(expected.abs()),
                        "{format} {name} at {temperature}: {found} {expected}"
                    );
                }
            }
        }
    }
}

/// A MEMS sensor that warms by 35 K in an hour, on a table.
const WARMING: &str = "seed = 1
[site]
latitude_deg = 34.0
[imu]
model = \"industrial-mems-warming\"
installation = \"general\"
output = \"pulse\"
sample_rate_hz = 100.0
[turntable]
model = \"three-axis\"
path = \"three-axis-hour\"
[chamber]
profile = [[300.0, 10.0], [3300.0, 45.0]]
time_constant_s = 120.0
sensor_noise_k = 0.01
";

#[test]
fn a_sensor_whose_bias_drifts_by_more_than_a_turn_is_calibrated_at_each_temperature() {
    let here = tempfile::tempdir().unwrap();
    let here = here.path();
    fs::write(here.join("warming.toml"), WARMING).unwrap();
    let done = turncal(here, &["simulate", "warming.toml", "-o", "run"]);
    assert!(done.status.success(), "{}", words(&done));
    let arguments = ["calibrate", "run/run.toml", "--temperature", "-o", "result"];
    let done = turncal(here, &arguments);
    assert!(done.status.success(), "{}", words(&done));
    let [found, truth] = ["result/calibration.json", "run/truth.json"]
        .map(|file| turncal_files::read_calibration(&here.join(file)).unwrap());
    for temperature in [20.0, 30.0] {
        let there = |record: &Calibration| record.at_temperature(temperature).unwrap();
        let (found, truth) = (there(&found), there(&truth));
        let off = |name: &&String| {
            let off = found[*name] - truth[*name];
            off.abs() > 4.0 * found.sigma_of(name).unwrap()
        };
        let beyond: Vec<_> = found.parameters.iter().filter(off).collect();
        assert!(beyond.is_empty(), "{temperature}: {beyond:?}");
    }
}

const MOUNTINGS: &str = "scenario = \"scenario.toml\"
[day_to_day]
mounting_arcsec = 300.0
[[recording]]
name = \"first\"
[[recording]]
name = \"second\"
[[recording]]
name = \"third\"
";

/// Simulates recordings of the short scenario as a campaign says; the path of its `campaign.toml`.
fn made(here: &Path, name: &str, campaign: &str) -> PathBuf {
    let file = format!("{name}.toml");
    fs::write(here.join(&file), campaign).unwrap();
    let made = turncal(here, &["simulate", &file, "-o", name]);
    assert!(made.status.success(), "{}", words(&made));
    here.join(name).join("campaign.toml")
}

fn estimated(campaign: &Path) -> Outcome {
    let campaign = Campaign::read(campaign).unwrap();
    let runs: Vec<&Run> = campaign.runs.iter().collect();
    let problem = Problem::together(&runs, &Options::default(), &campaign.together).unwrap();
    estimate(&problem, UNWATCHED).unwrap()
}

#[test]
fn an_instrument_that_is_mounted_anew_turns_as_a_whole() {
    let here = tempfile::tempdir().unwrap();
    let here = here.path();
    simulated(here);
    let outcome = estimated(&made(here, "mounted", MOUNTINGS));
    assert!(outcome.converged);
    let truth = turncal_files::read_calibration(&here.join("mounted/truth.json")).unwrap();

    // Of the turn of both triads the priors of four angles are known, 208″/√4, and the mean of three mountings,
    // 300″/√3 …
    let known = 1.0 / (4.0 / 208.0f64.powi(2) + 3.0 / 300.0f64.powi(2)).sqrt();
    let xy = [Sensor::Gyro, Sensor::Accel].map(|sensor| parameter(sensor, 3));
    let sigma = outcome.estimate.sigma()[xy[0]] / ARCSEC;
    assert!((sigma / known - 1.0).abs() < 0.01, "{sigma} {known}");
    // … but one triad against the other as by a single mounting.
    let found = outcome.estimate.vector();
    let between = truth["gyro.installation.xy"] - truth["accel.installation.xy"];
    let off = (found[xy[0]] - found[xy[1]] - between) / ARCSEC;
    assert!(off.abs() < 5.0, "{off}″");
    // Each recording alone agrees with that, turned by its own mounting.
    for number in 0..3 {
        let (distance, limit) = outcome.distance_alone(number).unwrap();
        assert!(distance < limit, "{number}: {distance} {limit}");
        let own = &outcome.own[number];
        assert!((own.sigma.mounting.x / ARCSEC / known - 1.0).abs() < 0.01);
    }
}

const DAYS: &str = "scenario = \"scenario.toml\"
[day_to_day]
gyro_bias_deg_per_h = 0.2
[[recording]]
name = \"monday\"
[[recording]]
name = \"tuesday\"
[[recording]]
name = \"wednesday\"
[[recording]]
name = \"thursday\"
";

#[test]
fn recordings_that_differ_by_more_than_is_stated_are_found_to() {
    let here = tempfile::tempdir().unwrap();
    let here = here.path();
    simulated(here);
    let path = made(here, "days", DAYS);
    let stated = estimated(&path);
    let text = fs::read_to_string(&path).unwrap();
    let without = text
        .split("# 1σ of the difference from one recording")
        .next()
        .unwrap();
    fs::write(&path, without).unwrap();
    let silent = estimated(&path);
    let sigma = |outcome: &Outcome| {
        let differ = |finding: &&Finding| finding.kind == "recordings-differ";
        let found = outcome.findings.iter().find(differ).map(|finding| {
            let differences = finding.figures["differences"].clone();
            serde_json::from_value::<Vec<RecordingDifference>>(differences).unwrap()
        });
        (
            outcome.estimate.sigma()[PARAMETERS / 2 - 3] / DEG_PER_H,
            found,
        )
    };
    let (of_stated, none) = sigma(&stated);
    assert_eq!(none, None);
    let (of_silent, found) = sigma(&silent);
    let found = found.unwrap();
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].key, "gyro_bias_deg_per_h");
    // Three axes on four days, less their means: nine degrees of freedom.
    let known = 0.2 / 18.0f64.sqrt();
    assert!((found[0].found - 0.2).abs() < 3.0 * known, "{found:?}");
    // Both estimate the difference, from about it and from the usual one.
    assert!(
        (of_silent / of_stated - 1.0).abs() < 0.1,
        "{of_silent} {of_stated} °/h"
    );
}

#[test]
fn what_is_wrong_with_a_temperature_is_said() {
    let here = tempfile::tempdir().unwrap();
    let here = here.path();
    simulated(here);
    let mild = here.join("simulated/mild/run.toml");
    let sound = fs::read_to_string(&mild).unwrap();
    let without = sound.replace(", temperature = \"temperature\"", "");
    assert_ne!(sound, without);
    fs::write(&mild, &without).unwrap();
    let campaign = here.join("simulated/campaign.toml");
    let text = fs::read_to_string(&campaign).unwrap();
    fs::write(
        &campaign,
        format!("{text}\n[temperature]\nhighest_order = 1\n"),
    )
    .unwrap();
    let fails = turncal(here, &["calibrate", "simulated/campaign.toml", "-o", "x"]);
    let said = words(&fails);
    assert_eq!(fails.status.code(), Some(1), "{said}");
    assert!(
        said.contains("mild") && said.contains("temperature_degc"),
        "{said}"
    );

    // Beside the recording it is enough.
    let stated = text.replace(
        "run = \"mild/run.toml\"",
        "run = \"mild/run.toml\"\ntemperature_degc = 20.0",
    );
    fs::write(&campaign, stated).unwrap();
    calibrated(here, "simulated/campaign.toml", "stated", "2");

    // Kelvin, in a campaign that names them so: the column is not used and its line is named.
    let kelvin = sound.replace("[imu]\n", "[imu]\ntemperature_unit = \"K\"\n");
    fs::write(&mild, kelvin).unwrap();
    fs::write(&campaign, &text).unwrap();
    let checked = turncal(here, &["check", "simulated/mild/run.toml"]);
    let said = String::from_utf8_lossy(&checked.stdout).into_owned();
    assert!(
        said.contains("line 2") && said.contains("temperature_unit"),
        "{said}"
    );
}

/// Simulated MEMS sensors that stand still while they warm up and cool down: outputs by the polynomials at three
/// temperatures against the true ones.
#[test]
fn sigma_of_biases_at_rest_are_those_of_their_errors() {
    let here = tempfile::tempdir().unwrap();
    let path = "first_dwell_s = 3600.0\n[body]\nstart_pitch_roll_heading_deg = [0, 0, 0]\n\
                acceleration_deg_per_s2 = 90.0\nmove_s = 4.0\ndwell_s = 5.0\nsteps = []\n";
    fs::write(here.path().join("standing.toml"), path).unwrap();
    let standing = WARMING
        .replace("three-axis-hour", "standing.toml")
        .replace("[3300.0, 45.0]", "[1800.0, 45.0], [3300.0, 10.0]")
        .replace("100.0", "10.0");
    let file = here.path().join("scenario.toml");
    fs::write(&file, standing).unwrap();
    let scenario = Scenario::load(file.to_str().unwrap()).unwrap();
    let (mut squares, mut count) = (0.0, 0.0);
    for stream in 0..10 {
        let simulated = scenario.simulate(5, stream).unwrap();
        let (run, of) = (&simulated.run, simulated.thermal.as_ref().unwrap());
        let problem = Problem::together(&[run], &Options::default(), &Together::default());
        let at_rest = problem.unwrap().at_rest().unwrap();
        let (outputs, thermal) = (&at_rest.outputs, &at_rest.thermal);
        let range = &thermal.model.range;
        let input = PerSensor {
            gyro: run.site.earth_rate_n(),
            accel: Vector3::z() * run.site.gravity,
        };
        for temperature in [15.0, 25.0, 40.0] {
            let state = turncal::imu::thermal_state_everywhere(range, temperature, 0.0);
            let (change, covariance) = thermal.at(&state, &outputs.covariance);
            let truth = of.at(&simulated.truth, temperature, 0.0);
            for (bias, _) in &at_rest.means {
                let (sensor, of_triad) = sensor_and_parameter(*bias);
                let axis = of_triad + 3 - turncal::imu::PARAMETERS;
                let expected = truth.get(sensor).output(input.get(sensor))[axis];
                let off = outputs.vector()[*bias] + change[*bias] - expected;
                squares += off.powi(2) / covariance[(*bias, *bias)];
                count += 1.0;
            }
        }
    }
    let mean = squares / count;
    println!("{mean:.2}");
    // Ten instruments, six axes, about two independent temperatures: 120 squares.
    assert!((0.6..1.6).contains(&mean), "{mean}");
}

/// Every other 100 s is predicted from the others; the RMS of a cubic is numpy's, written beside the record.
#[test]
fn biases_of_a_real_instrument_at_rest_follow_its_temperature_better_than_by_a_cubic() {
    let Some(directory) = shared("real-thermal-static") else {
        return;
    };
    let run: Run = read(&directory);
    let problem = Problem::together(&[&run], &Options::default(), &Together::default()).unwrap();
    let at_rest = problem.at_rest().unwrap();
    let reference = fs::read_to_string(directory.join("reference.json")).unwrap();
    let reference: serde_json::Value = serde_json::from_str(&reference).unwrap();
    let (imu, thermal) = (&run.recording.imu, &at_rest.thermal);
    let temperature = imu.temperature.as_ref().unwrap();
    for (bias, _) in &at_rest.means {
        let (sensor, of_triad) = sensor_and_parameter(*bias);
        let axis = of_triad + 3 - turncal::imu::PARAMETERS;
        let of_axis = |(_, c): &(usize, &Coefficient)| c.index() == *bias;
        let on: Vec<_> = thermal
            .coefficients
            .iter()
            .enumerate()
            .filter(of_axis)
            .collect();
        let row = |second: usize| {
            let time = imu.time(second) + 0.5;
            let [t, rate] = [temperature.at(time), temperature.rate(time)];
            let [t, rate] = [t, rate].map(|of| of.get(sensor)[axis]);
            let values = thermal.model.range.get(sensor).values(t, rate);
            let functions = on.iter().map(|(_, c)| values[c.function]);
            DVector::from_iterator(on.len() + 1, std::iter::once(1.0).chain(functions))
        };
        let output = |second: usize| imu.of(sensor).sum(second..second + 1)[axis];
        let fit = |kept: &dyn Fn(usize) -> bool| {
            let mut normal = DMatrix::zeros(on.len() + 1, on.len() + 1);
            let mut right = DVector::zeros(on.len() + 1);
            for second in (0..imu.len()).filter(|&second| kept(second)) {
                normal += row(second) * row(second).transpose();
                right += row(second) * output(second);
            }
            normal.lu().solve(&right).unwrap()
        };
        let mut squares = 0.0;
        for left_out in 0..2 {
            let is_left_out = |second: usize| second / 100 % 2 == left_out;
            let others = fit(&|second| !is_left_out(second));
            let off = |second: usize| output(second) - row(second).dot(&others);
            let left_out = (0..imu.len()).filter(|&second| is_left_out(second));
            squares += left_out.map(|second| off(second).powi(2)).sum::<f64>();
        }
        let name = format!("{}.{}", sensor.name(), ["x", "y", "z"][axis]);
        let cubic = &reference["axes"][&name]["rms_residual_cubic_cross_validated"];
        let ratio = (squares / imu.len() as f64).sqrt() / cubic.as_f64().unwrap();
        println!("{name}: {} functions, {ratio:.3} of a cubic", on.len());
        assert!(ratio < 1.0, "{name}: {ratio}");
        // What is drawn towards zero costs little of what the data show.
        let whole = fit(&|_| true);
        let mut averaged = whole.clone();
        averaged[0] = at_rest.outputs.vector()[*bias];
        on.iter()
            .enumerate()
            .for_each(|(place, (k, _))| averaged[1 + place] = thermal.values[*k]);
        let rms = |of: &DVector<f64>| {
            let off = |second: usize| output(second) - row(second).dot(of);
            let squares = (0..imu.len()).map(|second| off(second).powi(2));
            (squares.sum::<f64>() / imu.len() as f64).sqrt()
        };
        let ratio = rms(&averaged) / rms(&whole);
        assert!(ratio < 1.05, "{name}: {ratio}");
    }
    let record = at_rest.record(&problem);
    let unseen = record.findings.iter().any(|finding| {
        finding.kind == "temperature-not-seen" && finding.text.contains("gyro scale")
    });
    assert!(unseen, "{:?}", record.warnings);
}

/// NEES of parameters and coefficients by their σ, and NEES of the parameters by the Cramér–Rao bound at the truth, over
/// simulated campaigns of one design.
#[test]
#[ignore = "statistics: twenty campaigns"]
fn errors_of_campaigns_are_as_sigma_and_bound_say() {
    let campaign = SimulatedCampaign::load("five-soaks").unwrap();
    let options = Options::default()
        .noise(NoisePolicy::Stated)
        .no_auto_terms();
    let (mut squares, mut counts) = ([0.0; 2], [0; 2]);
    for stream in 0..20 {
        let simulated = campaign.simulate(4711, stream).unwrap();
        let runs: Vec<&Run> = simulated.iter().map(|one| &one.run).collect();
        let problem = Problem::together(&runs, &options, &campaign.together()).unwrap();
        let outcome = estimate(&problem, UNWATCHED).unwrap();
        assert!(outcome.converged, "campaign {stream}");
        let (found, thermal) = (&outcome.estimate, outcome.thermal.as_ref().unwrap());
        let (range, of) = (&thermal.model.range, simulated[0].thermal.as_ref().unwrap());
        let truth = of.at(&simulated[0].common, range.gyro.reference, 0.0);
        let coefficients = of.coefficients(range);
        let off = to_vector(&truth) - found.vector();
        let of_coefficients = thermal.coefficients.iter().zip(&thermal.values);
        let of_coefficients = of_coefficients
            .map(|(c, value)| coefficients.get(c.sensor)[(c.parameter, c.function)] - value);
        let all: Vec<f64> = off.iter().copied().chain(of_coefficients).collect();
        let covariance = found.covariance_with(&thermal.cross, &thermal.covariance);
        let selected = problem.with_model(outcome.model.clone());
        let bound = bound(&selected, &truth, &TermVector::zeros()).unwrap();
        let places: Vec<usize> = (0..all.len()).collect();
        let by_sigma = nees(&DVector::from_vec(all), &covariance, &places);
        let by_bound = nees(&off, &bound.estimate.covariance, &places[..PARAMETERS]);
        for (k, nees) in [by_sigma, by_bound].into_iter().enumerate() {
            let nees = nees.unwrap();
            squares[k] += nees.mean * nees.count as f64;
            counts[k] += nees.count;
        }
    }
    let [by_sigma, by_bound] = [0, 1].map(|k| squares[k] / counts[k] as f64);
    println!("{by_sigma:.4} {by_bound:.4}");
    // What may be absent and is not there makes σ wide; errors are below the bound of all orders.
    assert!((0.4..1.15).contains(&by_sigma), "{by_sigma}");
    assert!(by_bound < 1.1, "{by_bound}");
}

#[test]
#[ignore = "slow: a hand-turned record four times"]
fn parts_of_a_record_whose_noise_is_stated_too_small_do_not_differ_for_that() {
    let Some(whole) = shared("real-mems-lot-0") else {
        return;
    };
    let log = fs::read_to_string(whole.join("imu.log")).unwrap();
    let rows: Vec<&str> = log.lines().collect();
    let here = tempfile::tempdir().unwrap();
    let here = here.path();
    let mut campaign = "format = \"turncal-campaign/1\"\n".to_owned();
    // The first minute is one dwell; each part has moves enough to show the accelerometers.
    for (number, part) in [0..8500, 8500..12_200, 12_200..rows.len()]
        .into_iter()
        .enumerate()
    {
        let part_of = here.join(number.to_string());
        fs::create_dir(&part_of).unwrap();
        fs::copy(whole.join("run.toml"), part_of.join("run.toml")).unwrap();
        fs::write(part_of.join("imu.log"), rows[part].join("\n") + "\n").unwrap();
        campaign += &format!("[[recording]]\nrun = \"{number}/run.toml\"\n");
    }
    let path = here.join("campaign.toml");
    fs::write(&path, campaign).unwrap();
    let together = estimated(&path);
    assert!(together.noise.learnt);
    let run = read(&whole);
    let alone = estimate(&Problem::new(&run, &Options::default()), UNWATCHED).unwrap();
    let change = (together.estimate.vector() - alone.estimate.vector())
        .component_div(&alone.estimate.sigma());
    // Both are of the same rows; with stated noise the accelerometers' K alone were 100 σ apart.
    let accel: Vec<f64> = (0..PARAMETERS)
        .filter(|&i| sensor_and_parameter(i).0 == Sensor::Accel)
        .map(|i| change[i])
        .filter(|change| change.is_finite())
        .collect();
    println!("{accel:.1?}");
    assert!(accel.iter().all(|change| change.abs() < 3.0), "{accel:?}");
}

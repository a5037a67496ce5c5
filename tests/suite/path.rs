//! `turncal path evaluate`: predictions for a path before any data exist.

use assert_cmd::Command;
use serde_json::Value;

fn turncal(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("turncal").unwrap();
    command.args(["path", "evaluate"]).args(arguments);
    command
}

fn design(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("turncal").unwrap();
    command.args(["path", "design"]).args(arguments);
    command
}

fn json(arguments: &[&str]) -> Value {
    let output = turncal(arguments).arg("--json").assert().success();
    serde_json::from_slice(&output.get_output().stdout).unwrap()
}

fn sigma(of: &Value, group: &str) -> f64 {
    of["sigma"][group].as_f64().unwrap()
}

/// Nothing is gained by leaving out what a dwell says, and most is lost with the only turn that shows a scale factor.
#[test]
fn a_move_that_alone_shows_a_parameter_is_worth_most() {
    let steps = [
        "{ turn_deg = [0, 0, 720] }",
        "{ turn_deg = [0, -720, 0] }",
        "{ turn_deg = [-720, 0, 0] }",
        "{ turn_deg = [0, 90, 0] }",
    ];
    let path = |steps: &[&str]| {
        format!(
            "first_dwell_s = 30.0\n[axes]\nstart_deg = [0, 0, 0]\nrate_deg_per_s = 60.0\n\
             acceleration_deg_per_s2 = 20.0\ndwell_s = 10.0\nsteps = [{}]\n",
            steps.join(", ")
        )
    };
    let directory = tempfile::tempdir().unwrap();
    let [whole, without] = [&steps[..], &steps[1..]].map(|steps| {
        let file = directory.path().join(format!("{}.toml", steps.len()));
        std::fs::write(&file, path(steps)).unwrap();
        json(&[file.to_str().unwrap()])
    });
    let first = &whole["without"][0];
    for group in ["gyro.scale_ppm", "gyro.bias_deg_per_h", "accel.bias_ug"] {
        assert!(sigma(first, group) > sigma(&whole, group), "{group}");
    }
    // No other turn about the inner axis reveals the scale factor of its gyro.
    assert!(sigma(first, "gyro.scale_ppm") > 10.0 * sigma(&whole, "gyro.scale_ppm"));
    let time = |of: &Value| of["duration_s"].as_f64().unwrap();
    let saved = first["time_s"].as_f64().unwrap();
    // A record ends with its last whole sample.
    assert!((time(&whole) - time(&without) - saved).abs() < 0.011);
}

/// Error terms that a path does not show, each with moves that show it.
#[test]
fn a_path_with_the_moves_that_show_a_term_shows_it() {
    let level = "z_up, x_up, x_down, y_up, y_down, z_down";
    let not_shown = |words: &str| -> Vec<String> {
        let expected = json(&[words, "--imu", "bmi088"]);
        let all = expected["not_shown"].as_array().unwrap();
        let name = |of: &Value| of["what"].as_str().unwrap().to_owned();
        all.iter().map(name).collect()
    };
    let hidden = not_shown(level);
    // A turn about the vertical changes nothing that gravity shows.
    let turns =
        "turn x 3600, turn x -3600, turn y 3600, turn y -3600, x_up, turn z 3600, turn z -3600";
    let both_ways = not_shown(&format!("{level}, {turns}"));
    let term = "gyro-asymmetry".to_owned();
    assert!(
        hidden.contains(&term) && !both_ways.contains(&term),
        "{hidden:?} {both_ways:?}"
    );
}

#[test]
fn a_path_by_hand_lacks_what_it_never_turns_about() {
    let six = "z_up, z_down, x_up, x_down, y_up, y_down";
    let expected = json(&[six, "--imu", "bmi088"]);
    let level = json(&["z_up, turn z 360, turn z 360", "--imu", "bmi088"]);
    let of = |of: &Value, name: &str| {
        let of = &of["parameters"][name];
        of["sigma"].as_f64().unwrap() / of["prior_sigma"].as_f64().unwrap()
    };
    assert!(of(&expected, "accel.bias.x") < 0.1);
    assert!(of(&level, "accel.scale.x") > 0.9);
    assert!(of(&level, "gyro.scale.x") > 0.9);
    assert_eq!(level["verdict"]["word"], "use with care");
    assert!(!level["weakest"].as_array().unwrap().is_empty());
    let turned = turncal(&["z_up, turn w 90"]).assert().failure();
    let message = String::from_utf8_lossy(&turned.get_output().stderr).into_owned();
    assert!(message.contains("found `turn w 90`"), "{message}");
}

#[test]
fn a_specification_that_the_path_cannot_decide_is_status_three() {
    let directory = tempfile::tempdir().unwrap();
    let specification = |limit: f64| {
        let file = directory.path().join(format!("{limit}.toml"));
        let text = format!("format = \"turncal-specification/1\"\n[gyro]\nscale_ppm = {limit}\n");
        std::fs::write(&file, text).unwrap();
        file.to_str().unwrap().to_owned()
    };
    let run =
        |limit: f64| turncal(&["three-axis", "--specification", &specification(limit)]).assert();
    let decided = run(5.0).success();
    let text = String::from_utf8_lossy(&decided.get_output().stdout).into_owned();
    assert!(text.contains("PASS") && text.contains("3 of 3"), "{text}");
    let open = run(0.1).code(3);
    let text = String::from_utf8_lossy(&open.get_output().stdout).into_owned();
    assert!(
        text.contains("UNDECIDED") && text.contains("0 of 3"),
        "{text}"
    );
}

/// `three-axis` takes 524.6 s. In this time, the six positions have the longest dwells and therefore the best gyro bias
/// of all embedded paths.
#[test]
fn a_designed_path_is_better_than_the_embedded_ones_in_every_group_in_its_time() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("mine.toml");
    let file = file.to_str().unwrap();
    let arguments = ["--with", "none", "--time", "524.6", "-o", file, "--json"];
    let output = design(&arguments).assert().success();
    let designed: Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    let same_time = &designed["same_time"];
    assert!(same_time["every_term_of_usual_size"].is_null());
    let others = &same_time["without_terms"]["embedded"];
    for (path, of) in others.as_object().unwrap() {
        for (group, of) in of["sigma"].as_object().unwrap() {
            // A path whose moves alone take too long has no σ.
            let own = sigma(&designed, group);
            assert!(
                of.as_f64().is_none_or(|of| own < of),
                "{path} {group}: {own} {of}"
            );
        }
    }
    assert!(others["six-position"]["sigma"]["gyro.bias_deg_per_h"].is_f64());
    let time = designed["duration_s"].as_f64().unwrap();
    assert!(time <= 524.6 && time > 0.99 * 524.6);
    // The file is the path.
    let written = json(&[file, "--with", "none"]);
    assert_eq!(written["sigma"], designed["sigma"]);
}

/// A path that spends its time on error terms alone is worse for an instrument without them.
#[test]
fn a_path_designed_for_terms_that_may_be_absent_is_better_with_and_without_them() {
    let output = design(&["--time", "524.6", "--json"]).assert().success();
    let designed: Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    for terms in ["without_terms", "every_term_of_usual_size"] {
        let same_time = &designed["same_time"][terms];
        let embedded = &same_time["embedded"]["three-axis"]["sigma"];
        for (group, of) in embedded.as_object().unwrap() {
            let own = same_time["designed"][group].as_f64().unwrap();
            assert!(own < of.as_f64().unwrap(), "{terms} {group}: {own} {of}");
        }
    }
}

#[test]
fn a_path_by_hand_is_designed_until_it_decides_a_specification() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("by-hand.toml");
    let file = file.to_str().unwrap();
    let setting = [
        "--hand",
        "--imu",
        "bmi088",
        "--specification",
        "mems-by-hand",
    ];
    let text = |threads: &str| {
        let mut command = design(&setting);
        command.args(["-o", file, "--force"]);
        command.env("RAYON_NUM_THREADS", threads).assert().success();
        std::fs::read_to_string(file).unwrap()
    };
    assert_eq!(text("1"), text("3"));
    turncal(&[file]).args(setting).assert().success();
    // A precise limit needs more than a minute.
    let strict = directory.path().join("strict.toml");
    let limits = "format = \"turncal-specification/1\"\n[gyro]\nbias_deg_per_h = 0.1\n";
    std::fs::write(&strict, limits).unwrap();
    let strict = strict.to_str().unwrap();
    let open = [
        "--hand",
        "--imu",
        "bmi088",
        "--time",
        "60",
        "--specification",
        strict,
    ];
    design(&open).assert().code(3);
}

#[test]
fn a_design_that_makes_no_sense_is_refused_with_the_remedy() {
    for (arguments, says) in [
        (&["--time", "20"][..], "expected 60 s or more"),
        (&["--hand", "--table", "two-axis"], "cannot be used with"),
        (&["--hand", "--with", "table-base"], "table"),
        (&["--table", "four-axis"], "three-axis"),
    ] {
        let output = design(arguments).assert().failure();
        let message = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
        assert!(message.contains(says), "{arguments:?}: {message}");
    }
}

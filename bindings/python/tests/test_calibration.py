"""Calibrations from tables and files are those of the command."""

import json
import pickle
import re

import numpy as np
import pandas
import polars
import pytest
from conftest import BY_HAND, command

import turncal

KNOWN = {"rate": 100.0, "latitude": 48.1, "height": 520.0}
OPTIONS = ["--rate", 100, "--latitude", 48.1, "--height", 520.0]
GYRO, ACCEL = ("gx", "gy", "gz", "rad/s"), ("ax", "ay", "az", "m/s^2")


@pytest.fixture(scope="module")
def of_command(log):
    """calibration.json of the command."""
    units = ["--gyro-unit", "rad/s", "--accel-unit", "m/s^2"]
    return command("calibrate", log, *OPTIONS, *units, "--json").decode()


@pytest.fixture(scope="module")
def run(frame):
    return turncal.run(frame, gyro=GYRO, accel=ACCEL, time="t", **KNOWN)


@pytest.fixture(scope="module")
def calibration(run):
    return run.calibrate()


def without_files(text):
    """calibration.json without the files that were read: a table has none."""
    return re.sub(r' *"inputs": \[.*?\n *\],\n', "", text, count=1, flags=re.DOTALL)


def test_a_table_gives_the_bytes_of_the_command_except_the_names_of_files(of_command, calibration):
    assert calibration.to_json() == without_files(of_command)


@pytest.mark.parametrize("kind", ["polars", "mapping", "array", "structured"])
def test_every_kind_of_table_gives_the_same(kind, frame, of_command):
    columns, expected = {"gyro": GYRO, "accel": ACCEL, "time": "t"}, without_files(of_command)
    if kind == "polars":
        data = polars.from_pandas(frame)
    elif kind == "mapping":
        data = {name: frame[name].to_numpy() for name in frame}
    elif kind == "structured":
        data = frame.to_records(index=False)
    else:
        data = frame[["t", "gx", "gy", "gz", "ax", "ay", "az"]].to_numpy()
        columns = {"gyro": (1, 2, 3, "rad/s"), "accel": (4, 5, 6, "m/s^2"), "time": 0}
        for number, name in enumerate(GYRO[:3] + ACCEL[:3], 1):
            expected = expected.replace(f'"{name}"', f'"{number}"')
    made = turncal.run(data, **columns, **KNOWN).calibrate()
    assert made.to_json() == expected


def test_what_is_not_said_is_found(frame, calibration):
    found = turncal.run(frame, **KNOWN).calibrate()
    assert found["gyro.bias.x"] == pytest.approx(calibration["gyro.bias.x"], rel=1e-9)


def test_a_file_gives_the_bytes_of_the_command(log, tmp_path):
    run_toml = log.parent / "run.toml"
    made = turncal.read(run_toml).calibrate()
    assert made.to_json().encode() == command("calibrate", run_toml, "--json")
    assert turncal.init(log) == command("init", log).decode()


def test_a_parameter_has_a_value_a_sigma_and_a_covariance(calibration):
    table, covariance = calibration.parameters, calibration.covariance
    value, sigma, unit = table.loc["gyro.bias.x"]
    assert unit == "rad/s" and table.unit["accel.scale.x"] == "m/s^2 per m/s²"
    assert list(calibration) == list(table.index) and "gyro.bias.x" in calibration and "x" not in calibration
    assert (value, sigma) == (calibration["gyro.bias.x"], calibration.sigma("gyro.bias.x"))
    assert covariance.loc["gyro.bias.x", "gyro.bias.x"] == pytest.approx(sigma**2, rel=1e-9)
    assert np.allclose(covariance, covariance.T)
    with pytest.raises(KeyError, match="gyro.bias.w"):
        calibration["gyro.bias.w"]


def test_a_verdict_is_explained(calibration):
    assert calibration.verdict in {"good", "use with care", "partial", "failed"}
    codes = [finding["code"] for finding in json.loads(calibration.to_json())["findings"]]
    assert sorted(finding.split(" ", 1)[0] for finding in calibration.findings) == sorted(codes)
    assert not any("--with" in finding for finding in calibration.findings)
    page = calibration._repr_html_()
    assert calibration.verdict.upper() in page and "svg" in page and all(name in page for name in calibration)
    first, z = page.split("<iframe")[0], calibration.bias.gyro[2]
    assert f"<td>{z:.6f}\xa0±\xa0{calibration.sigma('gyro.bias.z'):.6f}</td>" in first and first.count("±") > 21
    assert f"{calibration.verdict}, 21 of 21 parameters determined, " in repr(calibration)


def test_a_calibration_from_a_file_or_a_truth_is_shown_too(calibration):
    copy = pickle.loads(pickle.dumps(calibration))
    assert repr(copy) == repr(calibration) and copy.to_json() == calibration.to_json()
    assert calibration.verdict.upper() in copy._repr_html_()
    truth = turncal.simulate("mems").truth
    assert "not estimated" in repr(truth) and truth.sigma("gyro.bias.x") == 0.0 and "gyro.bias.x" in truth._repr_html_()


def test_a_line_counts_what_is_determined_as_the_report_does():
    calibration = turncal.simulate("single-axis").calibrate()
    line = repr(calibration).removeprefix("<turncal.Calibration: partial, ").removesuffix(">")
    page = calibration._repr_html_()
    assert line.startswith("gyros: ") and line in page and "<td>–</td>" in page.split("<iframe")[0]


def test_none_and_auto_are_words_of_with_that_stand_alone(run):
    calibration = run.calibrate(noise="stated", with_="none")
    assert calibration.parameters.equals(run.calibrate(noise="stated", with_=()).parameters)
    with pytest.raises(turncal.Error, match='"none" beside "time-offset"'):
        run.calibrate(with_=["time-offset", "none"])
    with pytest.raises(turncal.Error, match='"auto" beside "none"'):
        turncal.path.evaluate("three-axis", with_=["auto", "none"])


def test_a_specification_is_decided(run):
    report = run.calibrate(specification="mems-by-hand").conformity
    assert len(report.data["units"]) == 1 and "Limits" in str(report)


def test_what_was_found_is_shown(run, log):
    assert run.found.loc["gyros", "value"] == "gx gy gz, rad/s"
    found = turncal.read(log, rate=100.0)
    assert "set latitude= and height=" in found.found.loc["place", "why"]
    assert "set latitude= and height=" in found._repr_html_()


def test_help_of_simulate_names_what_exists():
    for name in re.findall(r'"([\w-]+)"', turncal.simulate.__doc__):
        assert turncal.simulate(name).truth is not None


def test_values_agree_with_the_truth():
    run = turncal.simulate(str(BY_HAND), seed=7)
    report = turncal.compare(run.calibrate(noise="stated"), truth=run.truth)
    of_run = report.data["units"][0]
    low, high = of_run["nees_interval"]
    assert low < of_run["nees_per_n"] < high


def test_progress_sees_every_iteration_and_may_stop(run):
    seen = []
    run.calibrate(progress=lambda done, total: seen.append((done, total)))
    assert seen[-1][0] >= 2 and all(total is None for _, total in seen)

    def refuse(done, total):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        run.calibrate(progress=refuse)
    run.calibrate(progress=True)


def test_a_report_is_a_directory_that_the_command_can_use(calibration, tmp_path, log):
    calibration.report(tmp_path / "report")
    page = (tmp_path / "report" / "index.html").read_text()
    assert calibration.verdict.upper() in page
    read = turncal.Calibration.read(tmp_path / "report" / "calibration.json")
    assert read.to_json() == calibration.to_json()
    with pytest.raises(turncal.Error, match="Calibrate the run again"):
        read.report(tmp_path / "again")


def test_exports_are_those_of_the_command(calibration, tmp_path):
    path = tmp_path / "calibration.json"
    path.write_text(calibration.to_json())
    for name in ["c", "kalibr", "mat"]:
        assert turncal.export(calibration, name) == command("export", path, "--format", name)


def test_navigation_and_comparison_are_those_of_the_command(calibration, log, tmp_path):
    path, truth = tmp_path / "calibration.json", log.parent / "truth.json"
    path.write_text(calibration.to_json())
    report = turncal.navigate(path, truth, hours=1.0)
    of_command = json.loads(command("navigate", path, "--truth", truth, "--hours", 1, "--json"))
    assert report.data["hours"] == of_command["hours"]
    report = turncal.compare(path, truth=truth)
    assert report.to_json().encode() == command("compare", path, "--truth", truth, "--json")


def test_an_error_names_file_line_and_remedy(log, tmp_path):
    text = (log.parent / "run.toml").read_text().replace("rad/s", "rad/fortnight", 1)
    (tmp_path / "run.toml").write_text(text)
    with pytest.raises(turncal.Error, match="fortnight.*expected") as raised:
        turncal.read(tmp_path / "run.toml")
    assert raised.value.file == tmp_path / "run.toml"
    assert "fortnight" in text.splitlines()[raised.value.line - 1]


def test_an_error_names_row_and_column(frame):
    broken = frame.copy()
    broken.loc[17, "gy"] = np.inf
    with pytest.raises(turncal.Error, match="row 17") as raised:
        turncal.run(broken, gyro=GYRO, accel=ACCEL, **KNOWN)
    assert (raised.value.row, raised.value.column) == (17, "gy")


def test_an_error_names_arguments_of_python(frame):
    still = frame.drop(columns="t").iloc[:400]
    with pytest.raises(turncal.Error, match="Add gyro_unit="):
        turncal.run(still, rate=100.0)
    turncal.run(still, rate=100.0, gyro_unit="rad/s", accel_unit="m/s^2")
    with pytest.raises(turncal.Error, match="^latitude: found '61.8', expected a number"):
        turncal.run(frame, latitude="61.8")
    # A file has the name that it has.
    with pytest.raises(turncal.Error, match="my --rate.csv"):
        turncal.read("my --rate.csv")


def test_findings_and_reports_name_arguments_of_python(frame):
    noisy = turncal.run(frame, sensor="bmi088", gyro=GYRO, accel=ACCEL, **KNOWN)
    calibration = noisy.calibrate()
    shown = [*calibration.findings, str(noisy.check())]
    assert calibration.findings and not any(" --" in text for text in shown)
    assert 'method="six-position"' in shown[-1]


def test_a_text_in_a_column_of_numbers_is_named_with_its_row(frame):
    broken = frame.astype({"gy": object})
    broken.loc[17, "gy"] = "n/a"
    with pytest.raises(turncal.Error, match="'gy', row 17: found 'n/a'"):
        turncal.run(broken, gyro=GYRO, accel=ACCEL, **KNOWN)


def test_times_of_pandas_are_times(frame, calibration):
    dated = frame.assign(t=pandas.Timestamp("2026-01-01") + pandas.to_timedelta(frame["t"], unit="s"))
    known = {"gyro": GYRO, "accel": ACCEL, "latitude": 48.1, "height": 520.0}
    for run in [turncal.run(dated, time="t", **known), turncal.run(dated.set_index("t"), **known)]:
        assert run.calibrate()["gyro.bias.x"] == pytest.approx(calibration["gyro.bias.x"], rel=1e-6)


def test_a_certificate_is_written(calibration, tmp_path):
    (tmp_path / "lab.toml").write_bytes(command("certificate", "--draft"))
    with pytest.raises(turncal.Error, match="lab.toml"):
        turncal.certificate(calibration, tmp_path / "lab.toml", tmp_path / "paper")


def test_the_magnetometer_has_matrix_bias_and_correction_with_units(calibration):
    assert calibration.magnetometer is None
    found = turncal.simulate("nine-axis").calibrate()
    mag = found.magnetometer
    assert (mag["unit"], mag["field_unit"]) == ("uT", "T")
    assert mag["matrix"][0, 1] == found["mag.matrix.xy"] and mag["bias"][2] == found["mag.bias.z"]
    np.testing.assert_allclose(mag["correction"] @ mag["matrix"], np.eye(3), atol=1e-12)

"""Calibrated samples: by the equation, and as the command writes them."""

import io

import numpy as np
import pandas
import polars
import pytest
from conftest import command

import turncal

COLUMNS = ["gx", "gy", "gz", "ax", "ay", "az"]


@pytest.fixture(scope="module")
def run(log):
    return turncal.read(log.parent / "run.toml")


@pytest.fixture(scope="module")
def calibration(run):
    return run.calibrate(noise="stated")


def by_hand(calibration, frame):
    """u = (K C)⁻¹ (N − D)."""
    parts = []
    for sensor, columns in (("gyro", COLUMNS[:3]), ("accel", COLUMNS[3:])):
        value = lambda name: calibration[f"{sensor}.{name}"]
        scale = np.array([value(f"scale.{i}") for i in "xyz"])
        installation = np.array([[value(f"installation.{i}{j}") for j in "xyz"] for i in "xyz"])
        bias = np.array([value(f"bias.{i}") for i in "xyz"])
        parts.append((frame[columns].to_numpy() - bias) @ np.linalg.inv(scale[:, None] * installation).T)
    return np.hstack(parts)


def test_a_run_is_calibrated_as_by_the_command(run, calibration, log, tmp_path):
    path = tmp_path / "calibration.json"
    path.write_text(calibration.to_json())
    written = command("apply", path, log.parent / "run.toml")
    expected = pandas.read_csv(io.BytesIO(written))
    applied = calibration.apply(run)
    assert [*applied, "verdict_" + calibration.verdict.replace(" ", "_")] == list(expected)
    assert np.array_equal(applied.to_numpy()[:, 2:], expected.to_numpy()[:, 2:-1])


def test_a_table_is_calibrated_to_a_table_of_its_kind(calibration, frame):
    expected = by_hand(calibration, frame)
    applied = calibration.apply(frame)
    assert isinstance(applied, pandas.DataFrame) and applied.index.equals(frame.index)
    assert np.allclose(applied, expected, rtol=1e-12, atol=1e-12)
    of_polars = calibration.apply(polars.from_pandas(frame))
    assert isinstance(of_polars, polars.DataFrame) and np.array_equal(of_polars.to_numpy(), applied.to_numpy())
    of_array = calibration.apply(frame[COLUMNS].to_numpy(), gyro=(0, 1, 2), accel=(3, 4, 5))
    assert of_array.shape == (len(frame), 6) and np.array_equal(of_array, applied.to_numpy())


def test_columns_may_be_named(calibration, frame):
    renamed = frame.rename(columns=dict(zip(COLUMNS, "abcdef")))
    applied = calibration.apply(renamed, gyro=("a", "b", "c", "rad/s"), accel=("d", "e", "f"))
    assert np.array_equal(applied, calibration.apply(frame))
    with pytest.raises(turncal.Error, match="'gx'.*Name the columns"):
        calibration.apply(renamed)
    with pytest.raises(turncal.Error, match="deg/s.*rad/s"):
        calibration.apply(renamed, gyro=("a", "b", "c", "deg/s"), accel=("d", "e", "f"))


def test_columns_are_taken_by_name_and_never_by_place(calibration, frame, tmp_path):
    reordered = frame[COLUMNS[::-1]]
    assert np.array_equal(calibration.apply(reordered), calibration.apply(frame))
    (tmp_path / "calibration.json").write_text(calibration.to_json())
    read = turncal.Calibration.read(tmp_path / "calibration.json")
    for unnamed in [frame[COLUMNS].to_numpy(), frame.rename(columns=str.upper)]:
        for of in [calibration, read, turncal.simulate("mems").truth]:
            with pytest.raises(turncal.Error, match="gyro= and accel="):
                of.apply(unnamed)
    for applied in [read.apply(reordered), read.apply(frame.to_numpy(), gyro=(1, 2, 3), accel=(4, 5, 6))]:
        assert np.array_equal(applied, calibration.apply(frame))


def test_numbers_of_a_file_are_no_numbers_of_a_table(frame, tmp_path):
    frame.to_csv(tmp_path / "imu.csv", index=False, header=False)
    units = {"gyro_unit": "rad/s", "accel_unit": "m/s^2"}
    calibration = turncal.read(tmp_path / "imu.csv", rate=100, latitude=48.1, **units).calibrate(noise="stated")
    with pytest.raises(turncal.Error, match="gyro= and accel="):
        calibration.apply(frame.to_numpy())


def test_a_calibration_from_an_array_is_applied_to_an_array(frame):
    array = frame[COLUMNS[3:] + COLUMNS[:3]].to_numpy()
    run = turncal.run(array, gyro=(3, 4, 5, "rad/s"), accel=(0, 1, 2, "m/s^2"), rate=100, latitude=48.1)
    calibration = run.calibrate(noise="stated")
    assert np.array_equal(calibration.apply(array), calibration.apply(array, gyro=(3, 4, 5), accel=(0, 1, 2)))


def test_a_minus_reverses_a_column(frame):
    reversed_frame = frame.assign(gy=-frame["gy"], ax=-frame["ax"])
    known = {"rate": 100, "latitude": 48.1}
    units = {"gyro_unit": "rad/s", "accel_unit": "m/s^2"}
    gyro, accel = ("gx", "-gy", "gz"), ("-ax", "ay", "az")
    expected = turncal.run(frame, **units, **known).calibrate(noise="stated")
    found = turncal.run(reversed_frame, gyro=gyro, accel=accel, **units, **known).calibrate(noise="stated")
    assert found.parameters.equals(expected.parameters)
    assert np.array_equal(found.apply(reversed_frame), expected.apply(frame))
    assert np.array_equal(expected.apply(reversed_frame, gyro=gyro, accel=accel), expected.apply(frame))


def test_missing_values_stay_missing(calibration, frame):
    with_gap = frame.copy()
    with_gap.loc[3, "gx"] = np.nan
    applied = calibration.apply(with_gap)
    assert applied.iloc[3, :3].isna().all() and applied.drop(index=3).notna().all(axis=None)


def test_rows_do_not_depend_on_how_many_are_converted_at_once(calibration, frame, monkeypatch):
    whole = calibration.apply(frame)
    monkeypatch.setattr("turncal._frames.ROWS", 1000)
    assert np.array_equal(calibration.apply(frame), whole)


@pytest.mark.parametrize("scenario, terms", [("mems", ["time-offset", "size-effect"]), ("demo", None)])
def test_a_table_and_a_run_give_the_same_with_error_terms_and_from_pulses(scenario, terms, tmp_path):
    command("simulate", scenario, "-o", tmp_path / "run")
    run = turncal.read(tmp_path / "run" / "run.toml")
    calibration = run.calibrate(noise="stated", with_=terms)
    table = pandas.read_csv(tmp_path / "run" / "imu.csv.gz")
    of_table, of_run = calibration.apply(table), calibration.apply(run).iloc[:, 2:]
    assert np.allclose(of_table, of_run, rtol=1e-9, atol=1e-9)
    path = tmp_path / "calibration.json"
    path.write_text(calibration.to_json())
    assert turncal.Calibration.read(path).apply(table).equals(of_table)

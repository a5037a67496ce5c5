"""Arrays in place of columns, times beside columns, and results without pandas."""

import subprocess
import sys

import numpy as np
import pandas
import pytest
import xarray

import turncal

KNOWN = {"gyro_unit": "rad/s", "accel_unit": "m/s^2", "latitude": 48.1, "height": 520.0}
GYRO, ACCEL = ["gx", "gy", "gz"], ["ax", "ay", "az"]


@pytest.fixture(scope="module")
def arrays(frame):
    return {"gyro": frame[GYRO].to_numpy(), "accel": frame[ACCEL].to_numpy()}


@pytest.fixture(scope="module")
def calibration(frame):
    return turncal.run(frame, gyro=GYRO, accel=ACCEL, time="t", **KNOWN).calibrate(noise="stated")


def is_timed_by(run, name):
    """Whether rows have the time of the recording, by a column of this name."""
    found = run.found.loc["time"]
    return found["value"].startswith(f"{name}, ") and found["value"].endswith("100 Hz")


def test_arrays_are_calibrated_as_columns_are(frame, arrays, calibration):
    t = frame["t"].to_numpy()
    runs = [
        turncal.run(**arrays, time=t, **KNOWN),
        turncal.run({"t": t, **arrays}, **KNOWN),
        turncal.run(frame[["t"]], gyro=frame[GYRO], accel=arrays["accel"], **KNOWN),
    ]
    for run in runs:
        made = run.calibrate(noise="stated")
        assert made.parameters.equals(calibration.parameters)
        assert np.array_equal(made.apply(**arrays), calibration.apply(frame))
    for wrong in [arrays["gyro"][:, :2], arrays["gyro"][:-1], arrays["gyro"].astype(str), arrays["gyro"].T]:
        with pytest.raises(turncal.Error, match="expected"):
            turncal.run(**{**arrays, "gyro": wrong}, time=t, **KNOWN)
    rows, series = arrays["gyro"].tolist(), [frame[name] for name in GYRO]
    for of in [{"gyro": rows}, {"gyro": [*zip(*rows)]}, {"gyro": series}, {"gyro": [*series, "rad/s"]}, {"time": t.tolist()}]:
        with pytest.raises(turncal.Error, match="^(gyro|time): found a list of length .*numpy.asarray") as raised:
            turncal.run(**{**arrays, "time": t, **of}, **KNOWN)
        assert len(str(raised.value)) < 300
    with pytest.raises(turncal.Error, match="'gx'|gx: found rows of different lengths"):
        turncal.run({**frame, "gx": [[0.0], [0.0, 1.0]]}, **KNOWN)


def test_the_equation_holds_for_arrays(arrays, frame, calibration):
    scale, bias, correction = calibration.scale, calibration.bias, calibration.correction
    assert scale.gyro[0] == calibration["gyro.scale.x"] and bias.accel[2] == calibration["accel.bias.z"]
    applied = calibration.apply(frame).to_numpy()
    rate = (arrays["gyro"] - bias.gyro) @ correction.gyro.T
    force = (arrays["accel"] - bias.accel) @ correction.accel.T
    assert np.allclose(np.hstack([rate, force]), applied, rtol=1e-12, atol=1e-12)
    gyro, accel = correction
    assert gyro.shape == accel.shape == (3, 3) and bias.gyro.shape == (3,)


@pytest.mark.parametrize("name", [None, "time", "seconds", "Time"])
def test_an_index_of_floats_is_the_time(name, frame):
    indexed = frame.set_index(pandas.Index(frame["t"].to_numpy(), name=name)).drop(columns="t")
    for run in [
        turncal.run(indexed, **KNOWN),
        turncal.run(gyro=indexed[GYRO], accel=indexed[ACCEL].to_numpy(), **KNOWN),
        turncal.run({column: indexed[column] for column in indexed}, **KNOWN),
    ]:
        assert is_timed_by(run, name or "time")


def test_an_index_of_integers_is_the_time_if_it_is_called_so(frame):
    indexed = frame.set_index((frame["t"] * 1e6).round().astype(int).rename("timestamp")).drop(columns="t")
    assert is_timed_by(turncal.run(indexed, **KNOWN), "timestamp")


def test_an_index_of_dates_with_a_zone_is_the_time(frame):
    dates = pandas.Timestamp("2026-01-01", tz="UTC") + pandas.to_timedelta(frame["t"], unit="s")
    indexed = frame.drop(columns="t").set_index(dates.rename("when"))
    assert is_timed_by(turncal.run(indexed, **KNOWN), "when")


def test_a_coordinate_called_time_is_the_time(frame, arrays):
    time = frame["t"].to_numpy()
    rows = {sensor: (("time", "axis"), of) for sensor, of in arrays.items()}
    data = xarray.Dataset(rows, coords={"time": time, "axis": ["x", "y", "z"]})
    single = xarray.Dataset({name: ("time", frame[name]) for name in GYRO + ACCEL}, coords={"time": time})
    numbered = xarray.Dataset({name: ("row", frame[name]) for name in GYRO + ACCEL}, coords={"time": ("row", time)})
    for run in [
        turncal.run(data, **KNOWN),
        turncal.run(single, **KNOWN),
        turncal.run(numbered, **KNOWN),
        turncal.run(gyro=data["gyro"], accel=data["accel"], **KNOWN),
    ]:
        assert is_timed_by(run, "time")


def test_two_times_and_times_that_are_none_are_refused(frame, arrays):
    indexed = frame[GYRO].set_index(frame["t"])
    later = frame[ACCEL].set_index(frame["t"] + 1.0)
    both = frame.rename(columns={"t": "time"}).set_index(pandas.Index(2.0 * frame["t"], name="time"))
    text = frame[GYRO + ACCEL].set_index(pandas.Index(frame["t"].map("{} s".format), name="time"))
    scalar = xarray.Dataset({name: ("row", frame[name]) for name in GYRO + ACCEL}, coords={"time": 7.0})
    for call, words in [
        (lambda: turncal.run(gyro=indexed, accel=later, **KNOWN), "expected one time"),
        (lambda: turncal.run(both, **KNOWN), "expected one time"),
        (lambda: turncal.run(text, rate=100.0, **KNOWN), "'time', row 0: found '0.0 s'"),
        (lambda: turncal.run(scalar, rate=100.0, **KNOWN), "'time': found float64 of shape"),
        (lambda: turncal.run(gyro=indexed, accel=arrays["accel"], rate=50.0, **KNOWN), "rate"),
    ]:
        with pytest.raises(turncal.Error, match=words):
            call()
    assert is_timed_by(turncal.run(both, time="time", **KNOWN), "time")


def test_results_need_no_pandas(calibration, tmp_path, log):
    (tmp_path / "calibration.json").write_text(calibration.to_json())
    program = f"""
import sys
sys.modules["pandas"] = None
import turncal
calibration = turncal.Calibration.read("calibration.json")
parameters = calibration.parameters
row = parameters[parameters["parameter"] == "gyro.bias.x"][0]
assert (row["value"], row["sigma"]) == (calibration["gyro.bias.x"], calibration.sigma("gyro.bias.x"))
assert len(parameters) == len(calibration) and row["unit"] == "rad/s"
estimated = parameters["sigma"] > 0.0
assert calibration.covariance.shape == (estimated.sum(), estimated.sum())
assert abs(calibration.covariance.diagonal() / parameters["sigma"][estimated] ** 2 - 1.0).max() < 1e-9
run = turncal.read({str(log)!r}, rate=100.0, latitude=48.1)
assert run.found["what"][0] and len(turncal.simulate("mems").found) == 0
assert calibration.apply(run)["gyro_x_rad_s"].shape == calibration.apply(run)["start_s"].shape
"""
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr

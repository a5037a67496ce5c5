"""Studies, here and on a cluster; paths; sessions; Allan deviations."""

import os
import signal

import numpy as np
import pytest
from conftest import command

import turncal

RUNS = 20


@pytest.fixture(scope="module")
def of_command():
    return command("study", "accuracy", "single-axis", "--runs", RUNS, "--seed", 3, "--json")


def test_a_study_is_that_of_the_command(of_command):
    seen = []
    report = turncal.study(
        "accuracy", "single-axis", runs=RUNS, seed=3, progress=lambda done, total: seen.append((done, total))
    )
    assert report.to_json().encode() == of_command
    assert seen[-1] == (RUNS, RUNS)


def test_a_study_on_two_workers_one_of_which_is_killed_is_the_same(of_command, monkeypatch):
    monkeypatch.setattr("turncal._study.RUNS", 2)
    from dask.distributed import LocalCluster, Client

    killed = []

    def kill_one(done, total):
        if not killed:
            killed.append(next(iter(cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        report = turncal.study(
            "accuracy", "single-axis", runs=RUNS, seed=3, client=client, progress=kill_one
        )
    assert killed and report.to_json().encode() == of_command


def test_a_path_is_evaluated_as_by_the_command():
    report = turncal.path.evaluate("z_up,x_up,x_down,y_up,y_down", imu="bmi088")
    assert report.to_json().encode() == command(
        "path", "evaluate", "z_up,x_up,x_down,y_up,y_down", "--imu", "bmi088", "--json"
    )


def test_a_session_asks_for_moves_and_gives_a_run(frame):
    session = turncal.Session(100.0, "bmi088", latitude=48.1, specification="mems-by-hand")
    gyro, accel = frame[["gx", "gy", "gz"]].to_numpy(), frame[["ax", "ay", "az"]].to_numpy()
    for first in range(0, 6000, 1000):
        status = session.push(gyro[first : first + 1000], accel[first : first + 1000])
        assert status["next"]
    assert session.status()["duration_s"] == pytest.approx(60.0)
    session.push(gyro[6000], accel[6000])
    assert session.status()["duration_s"] == pytest.approx(60.01)
    assert "60.0 s" in repr(session.run())


def test_allan_deviations_agree_with_the_definition():
    rate = 100.0
    noise = np.random.default_rng(1).normal(0.0, 1e-3, (20_000, 3))
    report = turncal.allan(noise, gyro=(0, 1, 2, "rad/s"), rate=rate)
    of_x = report.data["gyro"]["x"]
    angle = np.concatenate([[0.0], np.cumsum(noise[:, 0])]) / rate
    to_deg_h = np.degrees(3600.0)
    for tau, deviation in zip(of_x["tau_s"], of_x["deviation"]):
        m = round(tau * rate)
        second = angle[2 * m :] - 2 * angle[m:-m] + angle[: -2 * m]
        expected = np.sqrt(0.5 * np.mean(second**2)) / tau * to_deg_h
        assert deviation == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    "sensor, units, ratio", [("gyro", ["deg/s", "rad/s"], np.degrees(1.0)), ("accel", ["m/s^2", "g"], 9.80665)]
)
def test_allan_deviations_have_the_unit_after_the_columns(sensor, units, ratio):
    names = [f"{sensor}_{axis}" for axis in "xyz"]
    noise = dict(zip(names, np.random.default_rng(1).normal(0.0, 1e-3, (3, 20_000))))
    reports = [turncal.allan(noise, **{sensor: (*names, unit)}, rate=100) for unit in units]
    small, large = (np.array(report.data[sensor]["x"]["deviation"]) for report in reports)
    assert np.allclose(large, ratio * small)

"""The types of the package suit a program that mypy checks strictly."""

import subprocess
import sys

PROGRAM = '''
import numpy as np
import turncal

run: turncal.Run = turncal.run(
    {"gx": np.zeros(1000)}, gyro=("gx", "gy", "gz", "deg/s"), accel=("ax", "ay", "az", "g"), rate=100
)
calibration = run.calibrate(with_="accel-second-order", progress=lambda done, total: None)
bias: float = calibration["gyro.bias.x"] + calibration.sigma("gyro.bias.x")
verdict: str | None = calibration.verdict
report: turncal.Report = turncal.study("accuracy", runs=10)
gravity: float = float(np.linalg.norm(calibration.correction.accel @ (np.ones(3) - calibration.bias.accel)))
turncal.run(gyro=np.zeros((9, 3)), accel=np.zeros((9, 3)), time=np.arange(9.0), gyro_unit="rad/s")
written: bytes = turncal.export(calibration, "kalibr")
expected = turncal.path.evaluate("three-axis").data["sigma"]
session = turncal.Session(100.0, "bmi088")
status = session.push(np.zeros((100, 3)), np.zeros((100, 3)))
try:
    turncal.read("run.toml", latitude=48.1)
except turncal.Error as error:
    print(error.file, error.line)
'''


def mypy(directory, *of):
    return subprocess.run([sys.executable, "-m", "mypy", "--strict", *of], capture_output=True, text=True, cwd=directory)


def test_a_program_of_a_user_passes_mypy_strict(tmp_path):
    path = tmp_path / "program.py"
    path.write_text(PROGRAM)
    done = mypy(tmp_path, path)
    assert done.returncode == 0, done.stdout


def test_the_package_passes_mypy_strict(tmp_path):
    done = mypy(tmp_path, "-p", "turncal")
    assert done.returncode == 0, done.stdout


def test_wrong_types_are_found(tmp_path):
    path = tmp_path / "wrong.py"
    path.write_text('import turncal\nturncal.read(7)\nturncal.simulate("demo").calibrate(methd="ekf")\n')
    assert mypy(tmp_path, path).stdout.count("error:") == 2

"""Recordings that tests share: simulated by the command, read as tables."""

import subprocess
import sys
from pathlib import Path

import pandas
import pytest

BY_HAND = Path(__file__).with_name("data") / "by-hand.toml"
COMMAND = str(Path(sys.executable).with_name("turncal"))


def pytest_addoption(parser):
    parser.addoption("--store", action="store_true", help="store the outputs of the notebooks")


def command(*arguments, **options):
    """Standard output of the command."""
    done = subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, **options)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


@pytest.fixture(scope="session")
def log(tmp_path_factory):
    """Path of a log of a MEMS sensor turned by hand, with a run.toml beside it."""
    directory = tmp_path_factory.mktemp("mems") / "run"
    command("simulate", BY_HAND, "-o", directory)
    frame = pandas.read_csv(directory / "imu.csv.gz")
    path = directory / "plain.csv"
    frame.to_csv(path, index=False)
    return path


@pytest.fixture(scope="session")
def frame(log):
    return pandas.read_csv(log)

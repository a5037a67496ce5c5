"""Calibration of inertial measurement units, on a turntable or by hand, with realistic uncertainties.

>>> run = turncal.run(df, gyro=("gx", "gy", "gz", "deg/s"), accel=("ax", "ay", "az", "g"), rate=100)
>>> calibration = run.calibrate()
>>> calibration["gyro.bias.x"], calibration.sigma("gyro.bias.x")
"""

from turncal import path
from turncal._frames import run
from turncal._functions import allan, certificate, compare, export, init, navigate, read, simulate
from turncal._study import study
from turncal._turncal import Calibration, Error, Report, Run, Session, __version__, command

__all__ = [
    "Calibration",
    "Error",
    "Report",
    "Run",
    "Session",
    "__version__",
    "allan",
    "certificate",
    "compare",
    "export",
    "init",
    "navigate",
    "path",
    "read",
    "run",
    "simulate",
    "study",
]


def _command() -> int:
    """The command ``turncal``."""
    import sys

    return command(["turncal", *sys.argv[1:]])

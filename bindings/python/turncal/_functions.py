"""Functions on runs and calibrations."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Union

from turncal import _turncal
from turncal._columns import Columns, Data
from turncal._frames import run
from turncal._turncal import Calibration, Known, Report, Run

PathLike = Union[str, "os.PathLike[str]"]
AnyCalibration = Union[Calibration, PathLike]


def read(
    path: PathLike,
    *,
    rate: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    gravity: float | None = None,
    gyro_unit: str | None = None,
    accel_unit: str | None = None,
    sensor: str | None = None,
    noise_file: PathLike | None = None,
    accel_file: PathLike | None = None,
    stream: str | None = None,
) -> Run:
    """Read a run.toml, a campaign.toml, or a log with what is known of it.

    Parameters
    ----------
    path : path-like
        A run.toml or campaign.toml, which needs nothing else, or a log: CSV, PX4 ULog, ArduPilot DataFlash, ROS bag,
        MCAP, MATLAB, HDF5 or NumPy.
    rate : float, optional
        Rows per second, Hz.
    latitude, height : float, optional
        Of the site, degrees (north positive) and m above the ellipsoid.
    gravity : float, optional
        At the site, m/s².
    gyro_unit, accel_unit : str, optional
        Units of the columns, such as "deg/s", "g" or "1/16384 g".
    sensor : str, optional
        Sensor whose data sheet gives noise and tolerances, such as "bmi088", or a TOML file.
    noise_file : path-like, optional
        Kalibr imu.yaml with noise figures.
    accel_file : path-like, optional
        File that contains the accelerometer rows, if the log contains only gyro data.
    stream : str, optional
        Stream of the instrument. Default: the one with the most samples.

    Returns
    -------
    Run
        Its `found` is what was found in a log.

    Raises
    ------
    Error
        With attributes `file`, `line` and `column`, if the file cannot be used.
    """
    known = Known(
        rate=rate,
        latitude=latitude,
        height=height,
        gravity=gravity,
        gyro_unit=gyro_unit,
        accel_unit=accel_unit,
        sensor=sensor,
        noise_file=noise_file,
        accel_file=accel_file,
        stream=stream,
    )
    return _turncal.read(path, known)


def init(
    path: PathLike,
    *,
    rate: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    gravity: float | None = None,
    gyro_unit: str | None = None,
    accel_unit: str | None = None,
    sensor: str | None = None,
    noise_file: PathLike | None = None,
    accel_file: PathLike | None = None,
    stream: str | None = None,
) -> str:
    """Draft a run.toml for a log.

    Parameters
    ----------
    path : path-like
        The log.
    rate, latitude, height, gravity, gyro_unit, accel_unit, sensor, noise_file, accel_file, stream : optional
        What is known of it, as in :func:`read`.

    Returns
    -------
    str
        The text of the run.toml, with a reason for each guess. Lines with TODO are to be completed.
    """
    known = Known(
        rate=rate,
        latitude=latitude,
        height=height,
        gravity=gravity,
        gyro_unit=gyro_unit,
        accel_unit=accel_unit,
        sensor=sensor,
        noise_file=noise_file,
        accel_file=accel_file,
        stream=stream,
    )
    return _turncal.init(path, known)


def allan(
    data: Data | Run = None,
    *,
    gyro: Columns | None = None,
    accel: Columns | None = None,
    gyro_unit: str | None = None,
    accel_unit: str | None = None,
    rate: float | None = None,
) -> Report:
    """Allan deviation and noise figures of a stationary recording.

    Parameters
    ----------
    data : DataFrame, Dataset of xarray, array, mapping of arrays, or Run, optional
        Samples at rest.
    gyro, accel, gyro_unit, accel_unit, rate : optional
        Columns or arrays, units and rows per second, as in :func:`run`. One triad is enough.

    Returns
    -------
    Report
        ``data["gyro"]["x"]`` has ``tau_s`` in s and ``deviation`` in the unit of ``data["gyro"]["unit"]``; and the
        coefficients that were found, each with its σ.
    """
    if not isinstance(data, Run):
        data = run(data, gyro=gyro, accel=accel, gyro_unit=gyro_unit, accel_unit=accel_unit, rate=rate)
    return _turncal.allan(data)


def simulate(scenario: str = "demo", seed: int | None = None, directory: PathLike | None = None) -> Run:
    """Simulate a recording, or the recordings of a campaign, whose true parameters are known.

    Parameters
    ----------
    scenario : str
        Name of an embedded scenario or campaign, such as "demo", "mems" or "five-soaks", or a TOML file; an unknown
        name lists all scenarios.
    seed : int, optional
        Random seed. Default: that of the scenario.
    directory : path-like, optional
        Directory for run.toml, imu.csv.gz and the other files of a recording, which is created if needed.

    Returns
    -------
    Run
        With its `truth`.
    """
    return _turncal.simulate(scenario, seed, directory)


def compare(*calibrations: AnyCalibration, truth: AnyCalibration | None = None) -> Report:
    """Compare calibrations, parameter by parameter, with their σ.

    Parameters
    ----------
    *calibrations : Calibration or path-like
        Two or more; one is enough with a truth. Without a truth, differences of two are from the first.
    truth : Calibration or path-like, optional
        True values.

    Returns
    -------
    Report
    """
    names = [_name(of, number) for number, of in enumerate(calibrations, 1)]
    loaded = [_loaded(of) for of in calibrations]
    return _turncal.compare(names, loaded, None if truth is None else _loaded(truth))


def export(calibration: AnyCalibration, format: str, run: Run | None = None) -> bytes:
    """Write a calibration as another program reads it.

    Parameters
    ----------
    calibration : Calibration or path-like
    format : str
        Such as "kalibr", "px4", "ardupilot", "c" or "mat"; an unknown name lists all.
    run : Run, optional
        Run of the same instrument, for noise figures, rate and nominal scales.

    Returns
    -------
    bytes
        The file.
    """
    return _turncal.export(_loaded(calibration), format, run)


def certificate(
    calibration: AnyCalibration,
    laboratory: PathLike,
    directory: PathLike,
    *,
    specification: PathLike | None = None,
    as_found: PathLike | None = None,
) -> None:
    """Write a calibration certificate: PDF/A-3 with an embedded Digital Calibration Certificate.

    Parameters
    ----------
    calibration : Calibration or path-like
    laboratory : path-like
        The lab.toml; ``turncal certificate --draft`` prints one to complete.
    directory : path-like
        Directory for certificate.pdf, dcc.xml and calibration.json, which is created if needed.
    specification : path-like, optional
        Limits for the parameters.
    as_found : path-like, optional
        Earlier calibration, valid when the item was received.
    """
    _turncal.certificate(_loaded(calibration), laboratory, directory, specification, as_found)


def navigate(
    calibration: AnyCalibration,
    truth: AnyCalibration,
    *,
    latitude: float | None = None,
    height: float | None = None,
    hours: float = 40.0,
    trajectory: str | None = None,
) -> Report:
    """Navigation error due to the errors of a calibration.

    Parameters
    ----------
    calibration, truth : Calibration or path-like
    latitude : float, optional
        Degrees, north positive. Default: that of the trajectory, otherwise of the calibration.
    height : float, optional
        Above the ellipsoid, m.
    hours : float
        Duration, h.
    trajectory : str, optional
        Trajectory to follow instead of rest: "flight", "vehicle" or a TOML file.

    Returns
    -------
    Report
    """
    return _turncal.navigate(_loaded(calibration), _loaded(truth), latitude, height, hours, trajectory)


def _loaded(calibration: AnyCalibration) -> Calibration:
    return calibration if isinstance(calibration, Calibration) else Calibration.read(calibration)


def _name(calibration: AnyCalibration, number: int) -> str:
    return str(number) if isinstance(calibration, Calibration) else Path(calibration).stem

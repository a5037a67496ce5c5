"""Functions on runs and calibrations."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Union

import numpy as np

from turncal import _turncal
from turncal._frames import Columns, Data, run_of, triad
from turncal._turncal import Calibration, Error, Known, Report, Run

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
        File with the accelerometer rows, if the log contains only the gyros.
    stream : str, optional
        Stream of the instrument. Default: the one with the most samples.

    Returns
    -------
    Run

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


def init(path: PathLike, *, stream: str | None = None, sensor: str | None = None) -> str:
    """Draft a run.toml for a log.

    Parameters
    ----------
    path : path-like
        The log.
    stream : str, optional
        Stream of the instrument. Default: the one with the most samples.
    sensor : str, optional
        Sensor whose data sheet gives noise and tolerances.

    Returns
    -------
    str
        The text of the run.toml, with a reason for each guess. Lines with TODO are to be completed.
    """
    return _turncal.init(path, Known(stream=stream, sensor=sensor))


def allan(
    data: Data | Run,
    rate: float | None = None,
    unit: str | tuple[str, str] | None = None,
    *,
    gyro: Columns | None = None,
    accel: Columns | None = None,
) -> Report:
    """Allan deviation and noise figures of a stationary recording.

    Parameters
    ----------
    data : DataFrame, array, mapping of arrays, or Run
        Samples at rest.
    rate : float, optional
        Rows per second, Hz.
    unit : str or (str, str), optional
        Unit of the triad, such as "deg/s" or "g", or those of gyros and accelerometers.
    gyro, accel : (x, y, z), optional
        Columns along right, front and up. Default: found by their names; an array of three columns is one triad.

    Returns
    -------
    Report
        ``data["gyro"]["x"]`` has ``tau_s`` in s and ``deviation`` in the unit of ``data["gyro"]["unit"]``; and the
        coefficients that were found, each with its σ.
    """
    if isinstance(data, Run):
        return _turncal.allan(data)
    units = _units(unit)
    known = Known(rate=rate, gyro_unit=units[0], accel_unit=units[1])
    triads = [triad(name, columns) for name, columns in (("gyro", gyro), ("accel", accel))]
    if triads == [None, None] and isinstance(data, np.ndarray) and data.shape[1:] == (3,):
        triads = [["0", "1", "2"], None] if units[1] is None else [None, ["0", "1", "2"]]
    return _turncal.allan(run_of(data, triads, None, None, known))


def _units(unit: str | tuple[str, str] | None) -> tuple[str | None, str | None]:
    """The units of gyros and accelerometers."""
    if unit is None:
        return None, None
    if not isinstance(unit, str):
        if len(unit) != 2:
            raise Error(f"unit: found {unit!r}, expected one unit, or those of gyros and accelerometers")
        return unit
    try:
        Known(accel_unit=unit)
    except Error:
        return unit, None
    return None, unit


def simulate(scenario: str = "demo", seed: int | None = None) -> Run:
    """Simulate a recording whose true parameters are known.

    Parameters
    ----------
    scenario : str
        Name of an embedded scenario, such as "demo", "mems" or "three-axis", or a TOML file.
    seed : int, optional
        Seed of all random numbers. Default: that of the scenario.

    Returns
    -------
    Run
        With its `truth`.
    """
    return _turncal.simulate(scenario, seed)


def compare(*calibrations: AnyCalibration, truth: AnyCalibration | None = None) -> Report:
    """Compare calibrations, parameter by parameter, with their σ.

    Parameters
    ----------
    *calibrations : Calibration or path-like
        Two or more; one is enough with a truth. Without a truth the first is the reference.
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

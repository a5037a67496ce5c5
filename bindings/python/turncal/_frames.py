"""Runs from tables and arrays, and results as tables and arrays."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from turncal import _turncal
from turncal._columns import (
    Columns,
    Data,
    Rows,
    columns,
    not_numbers,
    numbers,
    signed,
    single,
    triad,
    unit,
    with_arrays,
    with_time,
)
from turncal._turncal import Calibration, Error, Known, Run

OUTPUT = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s", "accel_x_m_s2", "accel_y_m_s2", "accel_z_m_s2")
ROWS = 1 << 18
"""Rows that `apply` converts at once."""


class PerSensor(NamedTuple):
    """An array of each sensor."""

    gyro: npt.NDArray[np.float64]
    accel: npt.NDArray[np.float64]


def run(
    data: Data = None,
    *,
    gyro: Columns | None = None,
    accel: Columns | None = None,
    time: str | int | Rows | None = None,
    temperature: str | int | Rows | None = None,
    gyro_unit: str | None = None,
    accel_unit: str | None = None,
    rate: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    gravity: float | None = None,
    sensor: str | None = None,
    noise_file: str | "os.PathLike[str]" | None = None,
    name: str = "data",
) -> Run:
    """A run from a table or from arrays.

    What is not given is found in the data, as in a log: columns by their names, units by gravity and turns.

    Parameters
    ----------
    data : DataFrame, Dataset of xarray, array or mapping of arrays, optional
        A row per sample. Columns of an array are numbered from 0. NaN marks a missing value.
    gyro, accel : (x, y, z), (x, y, z, unit) or array of shape (n, 3), optional
        Columns along right, front and up; a minus sign before a name, such as "-gy", reverses a column. Units: "rad/s",
        "deg/s", "m/s^2", "g", the size of one count such as "1/131 deg/s", or of increments "rad", "deg", "m/s".
    time : str, int or array, optional
        Column of time; its unit is found from `rate` or from its steps. datetime64 is possible. Default: an index of
        floats or dates, an index or a coordinate of xarray called "time", otherwise found among the columns.
    temperature : str, int or array, optional
        Column of the instrument's temperature, °C.
    gyro_unit, accel_unit : str, optional
        The same units, for arrays, and for columns that are found by their names.
    rate : float, optional
        Rows per second, Hz.
    latitude, height : float, optional
        Of the site, degrees (north positive) and m above the ellipsoid.
    gravity : float, optional
        At the site, m/s².
    sensor : str, optional
        Sensor whose data sheet gives noise and tolerances, such as "bmi088", or a TOML file.
    noise_file : path-like, optional
        Kalibr imu.yaml with noise figures.
    name : str
        Name of the run, for reports.

    Returns
    -------
    Run
        Its `found` is what was found in the data.

    Raises
    ------
    Error
        If columns are missing or not numeric, or if a unit or the rate can be found neither in the arguments nor in
        the data.
    """
    table = dict(columns(data))
    time = with_time(table, time, data, gyro, accel)
    named = with_arrays(table, gyro=gyro, accel=accel, time=time, temperature=temperature)
    known = Known(
        rate=rate,
        latitude=latitude,
        height=height,
        gravity=gravity,
        gyro_unit=unit("gyro", named["gyro"]) or gyro_unit,
        accel_unit=unit("accel", named["accel"]) or accel_unit,
        sensor=sensor,
        noise_file=noise_file,
    )
    of_table = {column: numbers(values) for column, values in table.items()}
    triads = [triad(sensor, named[sensor]) for sensor in ("gyro", "accel")]
    others = [single(of, named[of]) for of in ("time", "temperature")]
    for column in [*(triads[0] or ()), *(triads[1] or ()), *(column for column in others if column is not None)]:
        bare, sign = signed(column, table)
        if bare in table:
            values = of_table[bare]
            if values is None:
                raise not_numbers(bare, table[bare])
            of_table[column] = sign * values
    columns_of_table = [(column, values) for column, values in of_table.items() if values is not None]
    return _turncal.run(name, columns_of_table, triads[0], triads[1], others[0], others[1], known)


def applied(
    calibration: Calibration, data: Data, gyro: Columns | None, accel: Columns | None, rate: float | None
) -> Any:
    """`Calibration.apply`."""
    if isinstance(data, Run):
        return _frame(_turncal.samples(calibration, data), ("start_s", "end_s", *OUTPUT))
    table = dict(columns(data))
    gyro, accel = with_arrays(table, gyro=gyro, accel=accel).values()
    names, per_row, rate = _turncal.inputs(
        calibration, triad("gyro", gyro), unit("gyro", gyro), triad("accel", accel), unit("accel", accel), rate
    )
    taken = _taken(table, names)
    count = len(taken[0][0])
    out = _Output(data, count)
    for first in range(0, count, ROWS):
        last = min(first + ROWS, count)
        # Neighbours give the angular acceleration.
        begin, end = max(first - 1, 0), min(last + 1, count)
        part = [_part(column, sign, begin, end) for column, sign in taken]
        _turncal.correct(calibration, part, first - begin, out.part(first, last), per_row, rate)
    return out.table()


class _Output:
    """Six columns of a table of the kind of `data`, in memory once."""

    def __init__(self, data: Data, rows: int) -> None:
        self.data = data
        self.is_polars = hasattr(data, "get_columns")
        block = np.empty((0 if self.is_polars else 6, rows))
        self.block = block
        self.columns = [np.empty(rows) for _ in OUTPUT] if self.is_polars else list(block)

    def part(self, first: int, last: int) -> list[npt.NDArray[np.float64]]:
        return [column[first:last] for column in self.columns]

    def table(self) -> Any:
        if self.is_polars:
            import polars

            # A copy, so that each column is released after its own.
            return polars.DataFrame([polars.Series(name, self.columns.pop(0)) for name in OUTPUT])
        if hasattr(self.data, "iloc"):
            import pandas

            return pandas.DataFrame(self.block.T, columns=list(OUTPUT), index=self.data.index, copy=False)
        return self.block.T


def _taken(table: dict[str, Any], names: list[str] | None) -> list[tuple[npt.NDArray[Any], float]]:
    """The six columns of a table, each with its sign."""
    inputs = [signed(name, table) for name in names or ()]
    missing = [name for name, _ in inputs if name not in table]
    if not inputs:
        found = "found a calibration that names no columns of a table, expected those of gyros and accelerometers"
        raise Error(f"data: {found}. Name the columns with gyro= and accel=.")
    if missing:
        found = f"found the columns {', '.join(table) or 'none'}, expected {missing[0]!r} as in the calibrated log"
        raise Error(f"data: {found}. Name the columns with gyro= and accel=.")
    taken: list[tuple[npt.NDArray[Any], float]] = []
    for name, sign in inputs:
        column = _plain(table[name])
        if column is None:
            raise not_numbers(name, table[name])
        if taken and len(column) != len(taken[0][0]):
            raise Error(f"column {name!r}: found {len(column)} values, expected {len(taken[0][0])} as in the others")
        taken.append((column, sign))
    return taken


def _plain(column: Any) -> npt.NDArray[Any] | None:
    """A column as an array, without a copy if it is one of numbers."""
    values = column.to_numpy() if hasattr(column, "to_numpy") else np.asarray(column)
    return values if values.dtype.kind in "iuf" and values.ndim == 1 else numbers(column)


def _part(column: npt.NDArray[Any], sign: float, begin: int, end: int) -> npt.NDArray[np.float64]:
    part = np.ascontiguousarray(column[begin:end], dtype=np.float64)
    return part if sign > 0 else -part


def _frame(rows: npt.NDArray[np.float64], names: tuple[str, ...]) -> Any:
    """Rows as a DataFrame, without pandas as a structured array."""
    try:
        import pandas
    except ImportError:
        return rows.view([(name, np.float64) for name in names])[:, 0]
    return pandas.DataFrame(rows, columns=list(names), copy=False)


def table(names: tuple[str, ...], rows: list[tuple[Any, ...]]) -> Any:
    """Rows as a DataFrame by their first column, without pandas as a structured array."""
    try:
        import pandas
    except ImportError:
        kinds = [np.float64 if isinstance(value, float) else object for value in (rows or [names])[0]]
        return np.array(rows, list(zip(names, kinds)))
    return pandas.DataFrame(rows, columns=list(names)).set_index(names[0])


def covariance(names: list[str], rows: list[list[float]]) -> Any:
    """`Calibration.covariance`, without pandas as an array."""
    square = np.array(rows).reshape(len(names), len(names))
    try:
        import pandas
    except ImportError:
        return square
    return pandas.DataFrame(square, index=names, columns=names)

"""Tables of pandas, polars and NumPy: as input, and as output of the same kind."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from turncal import _turncal
from turncal._turncal import Calibration, Error, Known, Run

Data = Any
"""A DataFrame of pandas or polars, an array of shape (rows, columns), a structured array, or a mapping of arrays."""

Columns = Sequence[Union[str, int]]
"""Three columns along right, front and up; a fourth element is their unit."""

OUTPUT = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s", "accel_x_m_s2", "accel_y_m_s2", "accel_z_m_s2")
ROWS = 1 << 18
"""Rows that `apply` converts at once."""


def run(
    data: Data,
    *,
    gyro: Columns | None = None,
    accel: Columns | None = None,
    time: str | int | None = None,
    temperature: str | int | None = None,
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
    """A run from a table.

    What is not given is found in the data, as in a log: columns by their names, units by gravity and turns.

    Parameters
    ----------
    data : DataFrame, array or mapping of arrays
        A row per sample. Columns of an array are numbered from 0. NaN marks a missing value.
    gyro, accel : (x, y, z) or (x, y, z, unit), optional
        Columns along right, front and up; a minus before a name, such as "-gy", reverses a column. Units: "rad/s",
        "deg/s", "m/s^2", "g", the size of one count such as "1/131 deg/s", or of increments "rad", "deg", "m/s".
    time : str or int, optional
        Column of time; its unit is found from `rate` or from its steps. datetime64 is possible. Default: found in the
        data, also an index of datetime64.
    temperature : str or int, optional
        Column of the instrument's temperature, °C.
    gyro_unit, accel_unit : str, optional
        The same units, for columns that are found by their names.
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
    known = Known(
        rate=rate,
        latitude=latitude,
        height=height,
        gravity=gravity,
        gyro_unit=_unit("gyro", gyro) or gyro_unit,
        accel_unit=_unit("accel", accel) or accel_unit,
        sensor=sensor,
        noise_file=noise_file,
    )
    table = dict(_columns(data))
    index = getattr(data, "index", None)
    if getattr(getattr(index, "dtype", None), "kind", "") == "M":
        table.setdefault("time", index)
    numbers = {column: _numbers(values) for column, values in table.items()}
    triads = [triad("gyro", gyro), triad("accel", accel)]
    single = [None if column is None else str(column) for column in (time, temperature)]
    for column in [*(triads[0] or ()), *(triads[1] or ()), *(column for column in single if column is not None)]:
        bare, sign = _signed(column, table)
        if bare in table:
            values = numbers[bare]
            if values is None:
                raise _not_numbers(bare, table[bare])
            numbers[column] = sign * values
    columns = [(column, values) for column, values in numbers.items() if values is not None]
    return _turncal.run(name, columns, triads[0], triads[1], single[0], single[1], known)


def _signed(name: str, table: Mapping[str, Any]) -> tuple[str, float]:
    """The column that a name means, and its sign: a minus before the name of a column reverses it."""
    return (name[1:], -1.0) if name not in table and name.startswith("-") and name[1:] in table else (name, 1.0)


def triad(name: str, columns: Columns | None) -> list[str] | None:
    """The names of three columns."""
    if columns is None:
        return None
    if isinstance(columns, str) or not isinstance(columns, Sequence) or len(columns) not in (3, 4):
        raise Error(f"{name}: found {columns!r}, expected three columns, or three columns and a unit")
    if any(isinstance(column, int) and column < 0 for column in columns[:3]):
        raise Error(f"{name}: found {columns!r}, expected numbers of columns from 0; '-1' is column 1 reversed")
    return [str(column) for column in columns[:3]]


def _unit(name: str, columns: Columns | None) -> str | None:
    """The unit after three columns."""
    if columns is None or triad(name, columns) is None or len(columns) == 3:
        return None
    unit = columns[3]
    if not isinstance(unit, str):
        raise Error(f"{name}: found the unit {unit!r}, expected a text such as 'deg/s' or 'm/s^2'")
    return unit


def _columns(data: Data) -> Iterator[tuple[str, Any]]:
    """Names and columns of a table."""
    if hasattr(data, "get_columns"):
        return ((str(column.name), column) for column in data.get_columns())
    if hasattr(data, "columns") and hasattr(data, "iloc"):
        return ((str(name), data.iloc[:, place]) for place, name in enumerate(data.columns))
    if isinstance(data, Mapping):
        return ((str(name), np.asarray(column)) for name, column in data.items())
    if isinstance(data, np.ndarray) and data.dtype.names:
        return ((name, data[name]) for name in data.dtype.names)
    if isinstance(data, np.ndarray) and data.ndim == 2:
        return ((str(place), data[:, place]) for place in range(data.shape[1]))
    found = f"an array of shape {data.shape}" if isinstance(data, np.ndarray) else type(data).__name__
    raise Error(
        f"data: found {found}, expected a DataFrame of pandas or polars, an array of shape (rows, columns), or a "
        "mapping of arrays"
    )


def _kind(column: Any) -> str:
    shape = np.shape(column)
    return f"{getattr(column, 'dtype', type(column).__name__)}" + (f" of shape {shape}" if len(shape) != 1 else "")


def _not_numbers(name: str, column: Any) -> Error:
    """The error for a column without numbers, or for its first value that is none."""
    for row, value in enumerate(column if np.asarray(column).dtype.kind in "OUT" else ()):
        try:
            float(value)
        except (TypeError, ValueError):
            found = f"column {name!r}, row {row}: found {value!r}"
            error = Error(f"{found}, expected a number. Correct it, or set it to NaN.")
            error.row, error.column = row, name
            return error
    return Error(f"column {name!r}: found {_kind(column)}, expected numbers. Convert the column.")


def _numbers(column: Any) -> npt.NDArray[np.float64] | None:
    """A column as numbers; times in seconds from the first, whole numbers too large for a float from the first."""
    values = column.to_numpy() if hasattr(column, "to_numpy") else np.asarray(column)
    if values.dtype.kind == "O" and hasattr(column, "isna"):
        # Numbers of pandas that may be missing.
        try:
            values = column.to_numpy(dtype=np.float64, na_value=np.nan)
        except (TypeError, ValueError):
            return None
    if values.ndim != 1:
        return None
    if values.dtype.kind in "mM" and len(values):
        return np.ascontiguousarray((values - values[0]) / np.timedelta64(1, "s"), dtype=np.float64)
    if values.dtype.kind in "iu" and len(values) and int(values.max()) > 1 << 53:
        values = values - values[0]
    if values.dtype.kind not in "biuf":
        return None
    return np.ascontiguousarray(values, dtype=np.float64)


def samples(name: str, of: Any) -> npt.NDArray[np.float64]:
    """Rows of three numbers, also one row."""
    rows = np.atleast_2d(np.asarray(of))
    if rows.dtype.kind not in "iuf" or rows.shape[1:] != (3,):
        raise Error(f"{name}: found {_kind(rows)}, expected an array of shape (n, 3) or (3,) of numbers")
    return np.ascontiguousarray(rows, dtype=np.float64)


def applied(
    calibration: Calibration, data: Data, gyro: Columns | None, accel: Columns | None, rate: float | None
) -> Any:
    """`Calibration.apply`."""
    if isinstance(data, Run):
        import pandas

        rows = _turncal.samples(calibration, data)
        return pandas.DataFrame(rows, columns=["start_s", "end_s", *OUTPUT], copy=False)
    columns, per_row, rate = _turncal.inputs(
        calibration, triad("gyro", gyro), _unit("gyro", gyro), triad("accel", accel), _unit("accel", accel), rate
    )
    taken = _taken(data, columns)
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


def _taken(data: Data, names: list[str] | None) -> list[tuple[npt.NDArray[Any], float]]:
    """The six columns of a table, each with its sign."""
    table = dict(_columns(data))
    columns = [_signed(name, table) for name in names or ()]
    missing = [name for name, _ in columns if name not in table]
    if not columns:
        found = "found a calibration that names no columns of a table, expected those of gyros and accelerometers"
        raise Error(f"data: {found}. Name the columns with gyro= and accel=.")
    if missing:
        found = f"found the columns {', '.join(table)}, expected {missing[0]!r} as in the calibrated log"
        raise Error(f"data: {found}. Name the columns with gyro= and accel=.")
    taken: list[tuple[npt.NDArray[Any], float]] = []
    for name, sign in columns:
        column = _plain(table[name])
        if column is None:
            raise _not_numbers(name, table[name])
        if taken and len(column) != len(taken[0][0]):
            raise Error(f"column {name!r}: found {len(column)} values, expected {len(taken[0][0])} as in the others")
        taken.append((column, sign))
    return taken


def _plain(column: Any) -> npt.NDArray[Any] | None:
    """A column as an array, without a copy if it is one of numbers."""
    values = column.to_numpy() if hasattr(column, "to_numpy") else np.asarray(column)
    return values if values.dtype.kind in "iuf" and values.ndim == 1 else _numbers(column)


def _part(column: npt.NDArray[Any], sign: float, begin: int, end: int) -> npt.NDArray[np.float64]:
    part = np.ascontiguousarray(column[begin:end], dtype=np.float64)
    return part if sign > 0 else -part


def table(columns: tuple[str, ...], rows: list[tuple[Any, ...]]) -> Any:
    """Rows by their first column."""
    import pandas

    return pandas.DataFrame(rows, columns=list(columns)).set_index(columns[0])


def covariance(names: list[str], rows: list[list[float]]) -> Any:
    """`Calibration.covariance`."""
    import pandas

    return pandas.DataFrame(np.array(rows).reshape(len(names), len(names)), index=names, columns=names)

"""Rows as columns by name: of tables, of arrays, and of times beside them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol, Union

import numpy as np
import numpy.typing as npt

from turncal._turncal import Error

Data = Any
"""A DataFrame of pandas or polars, a Dataset of xarray, an array of shape (rows, columns), a structured array, or a
mapping of arrays."""

TIMES = ("t", "time", "timestamp")
"""Names of times, whatever their values."""


class Rows(Protocol):
    """An array, a DataFrame or a DataArray of xarray."""

    @property
    def shape(self) -> Any: ...


Columns = Union[Sequence[Union[str, int]], Rows]
"""Three columns along right, front and up, whose unit is a fourth element; or an array of shape (n, 3)."""


def columns(data: Data) -> Iterator[tuple[str, Any]]:
    """Names and columns of a table."""
    if data is None:
        return iter(())
    if hasattr(data, "get_columns"):
        return ((str(column.name), column) for column in data.get_columns())
    if hasattr(data, "columns") and hasattr(data, "iloc"):
        return ((str(name), data.iloc[:, place]) for place, name in enumerate(data.columns))
    if isinstance(data, Mapping):
        return (column for name, of in data.items() for column in _split(str(name), of))
    if isinstance(data, np.ndarray) and data.dtype.names:
        return ((name, data[name]) for name in data.dtype.names)
    if isinstance(data, np.ndarray) and data.ndim == 2:
        return ((str(place), data[:, place]) for place in range(data.shape[1]))
    found = f"an array of shape {data.shape}" if isinstance(data, np.ndarray) else type(data).__name__
    raise Error(
        f"data: found {found}, expected a DataFrame of pandas or polars, a Dataset of xarray, an array of shape "
        "(rows, columns), or a mapping of arrays. Convert rows with pandas.DataFrame; turncal.read reads a file."
    )


def _split(name: str, of: Any) -> Iterator[tuple[str, Any]]:
    """A column, or the three columns of an array of shape (n, 3)."""
    column = of if is_array(of) else _array(name, of)
    if column.shape[1:] != (3,):
        return iter([(name, column)])
    return ((f"{name}_{axis}", np.asarray(column)[:, place]) for place, axis in enumerate("xyz"))


def with_arrays(table: dict[str, Any], **of: Any) -> dict[str, Any]:
    """Names of columns: an array in place of a name becomes a column of the table, or three."""
    for name, column in of.items():
        if is_array(column):
            is_triad = name in ("gyro", "accel")
            own = dict(_split(name, samples(name, column) if is_triad else column))
            table |= own
            of[name] = tuple(own) if is_triad else name
    return of


def is_array(of: Any) -> bool:
    return len(getattr(of, "shape", ())) > 0


def with_time(table: dict[str, Any], stated: Any, *tables: Any) -> Any:
    """The column of time: the stated one, or an index or a coordinate, which becomes a column of the table."""
    time = None
    for name, values in (time for of in tables for time in _times(of)):
        other = table.get(time or name)
        if stated is None and other is not None and not np.array_equal(values, other):
            raise Error(
                f"time: found {time or name!r} and another {name!r} in an index or a coordinate, expected one time. "
                "Remove one, or name a column with time=."
            )
        table.setdefault(name, values)
        time = time or name
    return time if stated is None else stated


def _times(of: Any) -> Iterator[tuple[str, Any]]:
    """Every index or coordinate that is called time, or that gives rows a float or a date."""
    if hasattr(of, "coords"):
        variables = [of] if is_array(of) else list(of.values())
        rows = {variable.dims[0] for variable in variables if variable.dims}
        beside = [(name, name in rows, values) for name, values in of.coords.items()]
    elif isinstance(of, Mapping):
        for column in of.values():
            yield from _times(column)
        return
    else:
        index = getattr(of, "index", None)
        beside = [(name, True, index) for name in getattr(index, "names", ())]
    for name, is_of_rows, values in beside:
        if str(name).lower() in TIMES or is_of_rows and values.dtype.kind in "mMf":
            yield "time" if name is None else str(name), values


def signed(name: str, table: Mapping[str, Any]) -> tuple[str, float]:
    """The column that a name means, and its sign: a minus before the name of a column reverses it."""
    return (name[1:], -1.0) if name not in table and name.startswith("-") and name[1:] in table else (name, 1.0)


def triad(name: str, columns: Columns | None) -> list[str] | None:
    """The names of three columns."""
    if columns is None:
        return None
    if (
        isinstance(columns, str)
        or not isinstance(columns, Sequence)
        or len(columns) not in (3, 4)
        or not all(map(_is_name, columns[:3]))
    ):
        expected = "names of three columns, these and a unit, or an array of shape (n, 3)"
        advice = "Convert rows with numpy.asarray, three columns with numpy.column_stack."
        raise Error(f"{name}: found {_shown(columns)}, expected {expected}. {advice}")
    if any(isinstance(column, int) and column < 0 for column in columns[:3]):
        raise Error(f"{name}: found {columns!r}, expected numbers of columns from 0; '-1' is column 1 reversed")
    return [str(column) for column in columns[:3]]


def single(name: str, column: Any) -> str | None:
    """The name of a column."""
    if column is not None and not _is_name(column):
        expected = "the name of a column, or an array of shape (n,)"
        raise Error(f"{name}: found {_shown(column)}, expected {expected}. Convert a list with numpy.asarray.")
    return None if column is None else str(column)


def _is_name(of: Any) -> bool:
    """Levels of names are a tuple of texts in pandas."""
    return isinstance(of, (str, int, np.integer)) or isinstance(of, tuple) and all(isinstance(n, str) for n in of)


def _shown(of: Any) -> str:
    """A wrong argument, of which a long one is described."""
    text = repr(of)
    if len(text) <= 80 or not isinstance(of, Sequence):
        return text[:80]
    return f"a {type(of).__name__} of length {len(of)} that begins with a {type(of[0]).__name__}"


def unit(name: str, columns: Columns | None) -> str | None:
    """The unit after three columns."""
    if triad(name, columns) is None or not isinstance(columns, Sequence) or len(columns) == 3:
        return None
    unit = columns[3]
    if not isinstance(unit, str):
        raise Error(f"{name}: found the unit {unit!r}, expected a text such as 'deg/s' or 'm/s^2'")
    return unit


def _kind(column: Any) -> str:
    shape = np.shape(column)
    return f"{getattr(column, 'dtype', type(column).__name__)}" + (f" of shape {shape}" if len(shape) != 1 else "")


def not_numbers(name: str, column: Any) -> Error:
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


def numbers(column: Any) -> npt.NDArray[np.float64] | None:
    """A column as numbers; times in seconds from the first, whole numbers too large for a float from the first."""
    values = column.to_numpy() if hasattr(column, "to_numpy") else np.asarray(column)
    if values.dtype.kind == "O" and getattr(getattr(column, "dtype", None), "kind", "") == "M":
        # pandas gives times with a time zone as objects.
        values = np.asarray(column, "datetime64[ns]")
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


def _array(name: str, of: Any) -> npt.NDArray[Any]:
    try:
        return np.asarray(of)
    except ValueError:
        raise Error(f"{name}: found rows of different lengths, expected numbers. Correct the rows.") from None


def samples(name: str, of: Any) -> npt.NDArray[np.float64]:
    """Rows of three numbers, also one row."""
    rows = np.atleast_2d(_array(name, of))
    if rows.dtype.kind not in "iuf" or rows.shape[1:] != (3,):
        raise Error(f"{name}: found {_kind(rows)}, expected an array of shape (n, 3) or (3,) of numbers")
    return np.ascontiguousarray(rows, dtype=np.float64)

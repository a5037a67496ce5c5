"""Paths of a table or by hand, before there are data."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Union

from turncal import _turncal
from turncal._turncal import Report


def evaluate(
    path: str,
    *,
    scenario: str | None = None,
    imu: str | None = None,
    table: str | None = None,
    aiding: str | None = None,
    with_: Union[str, Sequence[str], None] = None,
    specification: Union[str, "os.PathLike[str]", None] = None,
) -> Report:
    """Predict the accuracy of a calibration: σ, the value of each move, and errors that the path cannot reveal.

    Parameters
    ----------
    path : str
        An embedded name such as "three-axis", a TOML file, or a list of moves by hand, such as
        "z_up, x_up, x_down, turn z 180".
    scenario : str, optional
        Scenario with site, rate, instrument and table. Default: "demo"; by hand "mems".
    imu, table : str, optional
        Instrument and table in place of the scenario's: an embedded name or a TOML file.
    aiding : {"table", "velocity"}, optional
        Observations of the filter. Default: table; by hand velocity.
    with_ : str or sequence of str, optional
        "auto" (default): average over the absence and the usual sizes of every error term; "none": only K, E and D; or
        terms to estimate in any case.
    specification : path-like, optional
        Specification; turncal tests whether the predicted σ are small enough to decide pass or fail.

    Returns
    -------
    Report
    """
    return _turncal.evaluate(path, scenario, imu, table, aiding, with_, specification)

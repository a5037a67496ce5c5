import os
from collections.abc import Sequence
from typing import Any, Callable, Optional, Union

import numpy as np
import numpy.typing as npt
import pandas

_Path = Union[str, os.PathLike[str]]
_Array = npt.NDArray[np.float64]
_Columns = Sequence[Union[str, int]]
_Progress = Union[bool, Callable[[int, Optional[int]], Any], None]

class Error(ValueError):
    file: os.PathLike[str] | None
    line: int | None
    row: int | None
    column: str | None

class Known:
    def __init__(
        self,
        *,
        rate: float | None = None,
        latitude: float | None = None,
        height: float | None = None,
        gravity: float | None = None,
        gyro_unit: str | None = None,
        accel_unit: str | None = None,
        sensor: str | None = None,
        noise_file: _Path | None = None,
        accel_file: _Path | None = None,
        stream: str | None = None,
    ) -> None: ...

class Report:
    @property
    def data(self) -> dict[str, Any]: ...
    def to_json(self) -> str: ...
    def write(self, directory: _Path) -> None: ...
    def _repr_html_(self) -> str: ...

class Run:
    @property
    def truth(self) -> Calibration | None: ...
    def check(self) -> Report: ...
    def calibrate(
        self,
        method: str = "ekf",
        with_: Sequence[str] | None = None,
        noise: str = "auto",
        temperature: bool = False,
        progress: _Progress = None,
    ) -> Calibration: ...

class Calibration:
    @staticmethod
    def read(path: _Path) -> Calibration: ...
    def __getitem__(self, name: str) -> float: ...
    def sigma(self, name: str) -> float: ...
    @property
    def parameters(self) -> pandas.DataFrame: ...
    @property
    def covariance(self) -> pandas.DataFrame: ...
    @property
    def verdict(self) -> str | None: ...
    @property
    def findings(self) -> list[str]: ...
    def apply(
        self, data: Any, gyro: _Columns | None = None, accel: _Columns | None = None, rate: float | None = None
    ) -> Any: ...
    def report(self, directory: _Path) -> None: ...
    def to_json(self) -> str: ...
    def _repr_html_(self) -> str: ...

class Session:
    def __init__(
        self,
        rate: float,
        sensor: str,
        *,
        latitude: float | None = None,
        height: float | None = None,
        gravity: float | None = None,
        specification: _Path | None = None,
    ) -> None: ...
    def push(self, gyro: npt.ArrayLike, accel: npt.ArrayLike) -> dict[str, Any] | None: ...
    def status(self) -> dict[str, Any]: ...
    def run(self) -> Run: ...

def command(arguments: list[str]) -> int: ...
def read(path: _Path, known: Known) -> Run: ...
def init(path: _Path, known: Known) -> str: ...
def run(
    name: str,
    columns: list[tuple[str, _Array]],
    gyro: list[str] | None,
    accel: list[str] | None,
    time: str | None,
    temperature: str | None,
    known: Known,
) -> Run: ...
def allan(run: Run) -> Report: ...
def simulate(scenario: str, seed: int | None) -> Run: ...
def inputs(
    calibration: Calibration,
    gyro: list[str] | None,
    gyro_unit: str | None,
    accel: list[str] | None,
    accel_unit: str | None,
    rate: float | None,
) -> tuple[list[tuple[str, float]] | None, float, float]: ...
def correct(
    calibration: Calibration, columns: list[_Array], before: int, out: list[_Array], per_row: float, rate: float
) -> None: ...
def samples(calibration: Calibration, run: Run) -> _Array: ...
def compare(names: list[str], calibrations: list[Calibration], truth: Calibration | None) -> Report: ...
def export(calibration: Calibration, format: str, run: Run | None) -> bytes: ...
def certificate(
    calibration: Calibration, laboratory: _Path, directory: _Path, limits: _Path | None, as_found: _Path | None
) -> None: ...
def navigate(
    calibration: Calibration,
    truth: Calibration,
    latitude: float | None,
    height: float | None,
    hours: float,
    trajectory: str | None,
) -> Report: ...
def study_options(
    name: str, scenario: str | None, runs: int, seed: int | None, with_: list[str], unmodelled: list[str]
) -> str: ...
def study(options: str, progress: _Progress) -> Report: ...
def study_part(options: str, part: int, parts: int) -> bytes: ...
def study_merged(options: str, parts: list[bytes]) -> Report: ...
def evaluate(
    path: str,
    scenario: str | None,
    imu: str | None,
    table: str | None,
    aiding: str | None,
    with_: list[str],
    limits: _Path | None,
) -> Report: ...

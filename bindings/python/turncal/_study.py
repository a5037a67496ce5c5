"""Studies of many simulated runs, here or on a Dask cluster."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from turncal import _turncal
from turncal._progress import Shown, shown
from turncal._turncal import Report

RUNS = 8
"""Most runs of a part, so that little is lost with a worker."""


def study(
    name: str = "accuracy",
    scenario: str | None = None,
    *,
    runs: int = 100,
    seed: int | None = None,
    with_: str | Sequence[str] = (),
    unmodelled: str | Sequence[str] = (),
    client: Any = None,
    progress: bool | Shown = False,
) -> Report:
    """Calibrate many simulated runs and compare them with the truth.

    Parameters
    ----------
    name : {"accuracy", "experiment"}
        Accuracy of the filter and consistency of its σ, or the turntable experiment of Zhao, Jiang, Li (2016).
    scenario : str, optional
        Scenario of the accuracy: an embedded name or a TOML file. Default: "demo".
    runs : int
        Number of runs.
    seed : int, optional
        Random seed. Default: that of the scenario.
    with_, unmodelled : str or sequence of str
        Error terms to simulate and to estimate ("auto": no further ones); to simulate only.
    client : dask.distributed.Client, optional
        Cluster that makes the runs; a worker that is lost is replaced. The result is the same to the bit on processors
        of one type.
    progress : callable or bool
        Called as ``progress(done, total)``; True shows a bar if tqdm is installed.

    Returns
    -------
    Report
        As printed by ``turncal study``.
    """
    options = _turncal.study_options(name, scenario, runs, seed, with_, unmodelled)
    if client is None:
        return _turncal.study(options, progress)
    parts = -(-runs // RUNS)
    show = shown(progress)
    futures = [
        client.submit(_turncal.study_part, options, part, parts, pure=False, retries=3)
        for part in range(1, parts + 1)
    ]
    made = []
    try:
        for future in futures:
            made.append(future.result())
            if show is not None:
                show(min(len(made) * RUNS, runs), runs)
        return _turncal.study_merged(options, made)
    finally:
        client.cancel(futures)
        getattr(show, "close", lambda: None)()

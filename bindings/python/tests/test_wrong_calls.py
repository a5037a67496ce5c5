"""A thousand wrong calls: each raises an exception that says what was expected; none ends the interpreter."""

import random

import numpy as np
import pytest

import turncal

CALLS = 1000
REFUSED = (ValueError, TypeError, KeyError, OverflowError, OSError)

NUMBERS = [float("nan"), float("inf"), -1.0, "100", None.__class__, 1e400, [1.0], 1j]
NAMES = ["", "ekf2", 7, b"ekf", None.__class__, "\0", "ä" * 10_000, ["ekf"]]
PATHS = ["", "/", "/no/such/file", "\0", 3.5, "x" * 5000, ".", None.__class__]
COLUMNS = [np.zeros((600, 2)), np.zeros(3, complex), "gx", (), ("gx",), ("gx", "gy", "gw"), ("gx", "gy", "gz", "furlong"), ("gx", "gy", "gz", 1), 5]


@pytest.fixture(scope="module")
def rows():
    random_numbers = np.random.default_rng(1)
    columns = {name: random_numbers.normal(0.0, 1e-3, 600) for name in ["gx", "gy", "gz", "ax", "ay", "az"]}
    columns["az"] += 9.81
    return columns


@pytest.fixture(scope="module")
def calibration(frame):
    return turncal.run(frame, rate=100.0, latitude=48.1).calibrate(noise="stated")


def wrong_tables(rows):
    array = np.column_stack(list(rows.values()))
    of_one = lambda column: {**rows, "gy": column}
    return [
        lambda: turncal.run(of_one(rows["gy"].astype(complex)), **STATED),
        lambda: turncal.run(of_one(rows["gy"].astype(str)), **STATED),
        lambda: turncal.run(of_one([object()] * 600), **STATED),
        lambda: turncal.run(of_one(rows["gy"][:-1]), **STATED),
        lambda: turncal.run(of_one(rows["gy"].reshape(2, 300)), **STATED),
        lambda: turncal.run(of_one(np.full(600, np.nan)), **STATED),
        lambda: turncal.run(of_one(np.where(np.arange(600) == 300, np.inf, rows["gy"])), **STATED),
        lambda: turncal.run({name: column[:50] for name, column in rows.items()}, **STATED),
        lambda: turncal.run({name: column[:0] for name, column in rows.items()}, **STATED),
        lambda: turncal.run({name: column for name, column in rows.items() if name != "gz"}, **STATED),
        lambda: turncal.run(array[None], **STATED),
        lambda: turncal.run(array[:, 0], **STATED),
        lambda: turncal.run(array, **STATED),
        lambda: turncal.run({}, **STATED),
        lambda: turncal.run(None, **STATED),
        lambda: turncal.run("imu.csv", **STATED),
        lambda: turncal.run({name: np.zeros(600) for name in rows}, **STATED).calibrate(),
        lambda: turncal.run({name: 1e300 * column for name, column in rows.items()}, **STATED).calibrate(),
    ]


STATED = {"gyro": ("gx", "gy", "gz", "rad/s"), "accel": ("ax", "ay", "az", "m/s^2"), "rate": 100.0}


def wrong_arguments(rows, calibration, draw):
    """Calls with one wrong argument each."""
    number, name, path, columns = (draw.choice(of) for of in (NUMBERS, NAMES, PATHS, COLUMNS))
    run = lambda: turncal.run(rows, **STATED)
    three = np.zeros((100, 3))
    shapes = [np.zeros(3), np.zeros((10, 2)), np.zeros((10, 3), complex), [[0.0] * 2], np.full((100, 3), np.nan), "rows"]
    shape = draw.choice(shapes)
    known = draw.choice(["rate", "latitude", "height", "gravity"])
    value = 1e6 if known in ("height", "latitude") and number == -1.0 else number
    session = lambda: turncal.Session(100.0, "bmi088")
    return [
        lambda: turncal.run(rows, **{**STATED, known: value}),
        lambda: turncal.run(rows, **{**STATED, "gyro": columns}),
        lambda: turncal.run(rows, **{**STATED, "accel": columns}),
        lambda: turncal.run(rows, **STATED, time=draw.choice(["clock", 3.5, ("t",), b"t"])),
        lambda: turncal.run(rows, **STATED, temperature=draw.choice(["degc", 12, ()])),
        lambda: turncal.run(rows, **STATED, sensor=name),
        lambda: turncal.run(rows, **STATED, noise_file=path or "?"),
        lambda: turncal.run(rows, **STATED, nosuch=1),
        lambda: turncal.read(path),
        lambda: turncal.read("imu.csv", **{known: value}),
        lambda: turncal.init(path),
        lambda: run().calibrate(name),
        lambda: run().calibrate(noise=name),
        lambda: run().calibrate(with_=draw.choice([["size"], "size", [3], 7])),
        lambda: run().calibrate("six-position", with_=["size-effect"]),
        lambda: run().calibrate(with_=["table-axes"]),
        lambda: run().calibrate(with_=["none", "time-offset"]),
        lambda: run().calibrate(temperature=True),
        lambda: run().calibrate(progress=draw.choice([1, "yes", 2.5])),
        lambda: turncal.allan(shape, rate=100.0, gyro=(0, 1, 2, "rad/s")),
        lambda: turncal.allan(three, rate=100.0, gyro=(0, 1, 2, draw.choice(["furlong", 7, ("rad/s",), b"g"]))),
        lambda: turncal.allan(three, rate=number, gyro=(0, 1, 2, "rad/s")),
        lambda: calibration[name],
        lambda: calibration.sigma(name),
        lambda: calibration.apply(draw.choice([None, 3, "df", np.zeros((5, 5)), np.zeros(6), {"gx": three}])),
        lambda: calibration.apply(rows, gyro=columns),
        lambda: calibration.apply(np.column_stack(list(rows.values()))),
        lambda: calibration.apply(rows, rate=draw.choice(["100", float("nan"), -1.0, 0.0])),
        lambda: calibration.apply(turncal.run(rows, **{**STATED, "gyro": ("gx", "gy", "gz", "deg/s")})),
        lambda: calibration.report("/dev/null/x"),
        lambda: turncal.Calibration.read(path),
        lambda: turncal.compare(calibration),
        lambda: turncal.compare(path, calibration),
        lambda: turncal.export(calibration, name),
        lambda: turncal.export(path, "c"),
        lambda: turncal.certificate(calibration, path, "paper"),
        lambda: turncal.navigate(calibration, path),
        lambda: turncal.navigate(calibration, calibration, latitude=draw.choice([91.0, -90.0, "45", float("nan")])),
        lambda: turncal.navigate(calibration, calibration, hours=number),
        lambda: turncal.navigate(calibration, calibration, trajectory=name),
        lambda: turncal.simulate(name),
        lambda: turncal.simulate("mems", seed=draw.choice([-1, 2**64, 1.5, "one"])),
        lambda: turncal.study(name),
        lambda: turncal.study("accuracy", name or "?"),
        lambda: turncal.study(runs=draw.choice([0, 1, -5, 10**12, 2.5, "ten"])),
        lambda: turncal.study(runs=10, with_=["nothing"]),
        lambda: turncal.study(runs=10, with_="none"),
        lambda: turncal.study("experiment", "demo"),
        lambda: turncal.study("accuracy", "five-soaks"),
        lambda: turncal.path.evaluate(draw.choice(["", "x_up,", "turn w 90", "turn x much", "sideways", 7, ",,,", "\0"])),
        lambda: turncal.path.evaluate("three-axis", imu=name or "?"),
        lambda: turncal.path.evaluate("three-axis", table=name or "?"),
        lambda: turncal.path.evaluate("three-axis", aiding=name),
        lambda: turncal.path.evaluate("three-axis", specification=path or "?"),
        lambda: turncal.Session(number, "bmi088"),
        lambda: turncal.Session(100.0, name),
        lambda: turncal.Session(100.0, "bmi088", specification=path or "?"),
        lambda: session().push(shape, three),
        lambda: session().push(three, np.zeros((99, 3))),
        lambda: session().status(),
        lambda: session().run(),
    ]


def test_a_thousand_wrong_calls_are_exceptions(rows, calibration):
    draw = random.Random(1)
    accepted, silent = [], []
    for number in range(CALLS):
        wrong = draw.choice([wrong_tables(rows), wrong_arguments(rows, calibration, draw)])
        place = draw.randrange(len(wrong))
        try:
            wrong[place]()
        except REFUSED as error:
            if len(str(error)) < 10 and not isinstance(error, KeyError):
                silent.append((number, place, repr(error)))
        else:
            accepted.append((number, len(wrong), place))
    assert not accepted and not silent, (accepted, silent)

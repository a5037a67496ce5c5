"""Ctrl-C ends a call within a second, and leaves the interpreter usable."""

import subprocess
import sys
import textwrap
import time
from signal import SIGINT

import pytest
from conftest import COMMAND

LONG = {
    "study": "turncal.study(runs=100_000)",
    "calibration": "turncal.simulate('warming-mems').calibrate(temperature=True)",
}


@pytest.mark.parametrize("what", LONG)
def test_ctrl_c_ends_a_call_within_a_second(what, tmp_path):
    program = f"""
        import threading, time, turncal
        ticks = []
        threading.Thread(target=lambda: [ticks.append(time.sleep(0.05)) for _ in range(10**6)], daemon=True).start()
        print("begun", flush=True)
        try:
            {LONG[what]}
        except KeyboardInterrupt:
            print("ended", len(ticks) > 20, flush=True)
            import os
            os._exit(0)
    """
    program = [sys.executable, "-c", textwrap.dedent(program)]
    process = subprocess.Popen(program, stdout=subprocess.PIPE, text=True, cwd=tmp_path)
    assert process.stdout.readline() == "begun\n"
    time.sleep(3.0)
    begun = time.monotonic()
    process.send_signal(SIGINT)
    # Another thread of the interpreter went on in the meantime.
    assert process.stdout.readline() == "ended True\n"
    assert time.monotonic() - begun < 1.0
    process.wait()


def test_ctrl_c_ends_the_command_as_the_native_one(tmp_path):
    process = subprocess.Popen([COMMAND, "demo", "-o", tmp_path / "demo"], stderr=subprocess.DEVNULL)
    time.sleep(1.0)
    begun = time.monotonic()
    process.send_signal(SIGINT)
    assert process.wait() == -SIGINT
    assert time.monotonic() - begun < 1.0
    assert list(tmp_path.iterdir()) == []

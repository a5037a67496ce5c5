"""Runs the parts of a turncal job on a Dask cluster and merges them.

    python on_dask.py 8 accuracy turncal study accuracy --runs 500
    python on_dask.py 8 lot-result turncal calibrate lot/*/run.toml

makes 8 parts in accuracy-parts/, on the cluster of --scheduler-file or on this machine, and merges them
into accuracy/. Workers need turncal and the same directory. A part whose worker is lost is made again by
another; a part that is there is not made again.
"""

import argparse
import os
import subprocess

from dask.distributed import Client, as_completed


def part(command, number, of, here, directory):
    threads = dict(os.environ, RAYON_NUM_THREADS="1")
    shard = ["--shard", f"{number}/{of}", "-o", f"{directory}/{number}"]
    run = command + shard
    done = subprocess.run(run, cwd=here, env=threads, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return f"{directory}/{number}"


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--scheduler-file", help="of the cluster; without it, this machine")
    arguments.add_argument("parts", type=int, help="number of parts")
    arguments.add_argument("output", help="directory of the result")
    arguments.add_argument("command", nargs=argparse.REMAINDER, help="turncal and its arguments")
    given = arguments.parse_args()
    here = os.getcwd()
    where = os.path.abspath(f"{given.output}-parts")
    os.makedirs(where, exist_ok=True)
    with Client(scheduler_file=given.scheduler_file) as client:
        futures = [
            client.submit(part, given.command, number, given.parts, here, where, pure=False)
            for number in range(1, given.parts + 1)
        ]
        for future in as_completed(futures):
            print("made", future.result(), flush=True)
    made = [f"{where}/{number}" for number in range(1, given.parts + 1)]
    raise SystemExit(subprocess.run([given.command[0], "merge", *made, "-o", given.output]).returncode)

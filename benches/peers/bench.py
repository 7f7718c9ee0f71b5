"""Times ptzcal and its peers alternately on the same inputs, in one run, one thread each
(ours of some tasks with two as well).

    bench.py [--out target/bench.json] [--budget SECONDS] [NAME ...]

Ours goes through the Python binding, whose overhead (see the last task) is in the times; the peers
are called from Python too. Results are checked against the truth first: a task whose result is
wrong, ours or the peer's, ends the run. NAME limits it to tasks whose names contain one of them.

Writes a list of {task, size, threads, ours_ms, peer, peer_ms, ratio, ...}: times are the least of
many blocks of calls, the medians are beside them, and ratio is peer_ms / ours_ms. Where a peer is
not installed, ours is timed alone and peer_ms and ratio are null.
"""

import argparse
import json
import os
import sys
import time
from pathlib import Path

# Before NumPy is loaded: one thread each, and its own choice of kernels.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
for _name in ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE"):
    os.environ.pop(_name, None)

import numpy as np  # noqa: E402

import ptzcal  # noqa: E402
import tasks  # noqa: E402
from timing import Times, alternately  # noqa: E402

#: Seconds of a peer's call beyond which one call is its time.
PATIENCE = 10.0


def measure(task: tasks.Task, budget: float) -> dict:
    ours_error = float(task.ours_error(task.ours()))
    peer_error = None
    if ours_error > task.bound:
        sys.exit(f"{task.task}, {task.size}: ours is off by {ours_error:.3g} {task.unit}")
    once = 0.0
    if task.theirs is not None:
        began = time.perf_counter()
        result = task.theirs()
        once = time.perf_counter() - began
        peer_error = float(task.peer_error(result))
        if peer_error > task.bound:
            sys.exit(
                f"{task.task}, {task.size}: {task.peer} is off by {peer_error:.3g} {task.unit}"
            )
    if once > PATIENCE:
        # Too slow to be timed again and again: the check of its result is its time.
        ours, _ = alternately(task.ours, None, budget)
        peer = Times(1e3 * once, 1e3 * once)
    else:
        ours, peer = alternately(task.ours, task.theirs, budget)
    ours_ms = ours.least / task.divide
    peer_ms = None if peer is None else peer.least / task.divide
    return {
        "task": task.task,
        "size": task.size,
        "threads": task.threads,
        "ours_ms": ours_ms,
        "peer": task.peer,
        "peer_ms": peer_ms,
        "ratio": None if peer_ms is None else peer_ms / ours_ms,
        "ours_median_ms": ours.median / task.divide,
        "peer_median_ms": None if peer is None else peer.median / task.divide,
        "ours_error": ours_error,
        "peer_error": peer_error,
        "error_unit": task.unit,
    }


def _number(value, digits=3):
    return "-" if value is None else f"{value:.{digits}g}"


def _row(cells):
    task, size, threads, peer, *numbers = cells
    return f"{task:32} {size:42} {threads:>2} {peer:46}" + "".join(f"{n:>10}" for n in numbers)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--out", type=Path, default=Path("target/bench.json"))
    parser.add_argument("--budget", type=float, default=1.0, help="seconds for each row")
    arguments = parser.parse_args()

    if tasks.cv2 is None:
        print("SKIPPED the comparison with OpenCV: it is not installed; ours is timed alone")
    else:
        tasks.cv2.setNumThreads(1)
    if tasks.scipy is None:
        print("SKIPPED the comparison with SciPy: it is not installed; ours is timed alone")
    if tasks.open3d is None:
        print("SKIPPED the comparison with Open3D: it is not installed; ours is timed alone")
    versions = {
        "ptzcal": ptzcal.version(),
        "Python": sys.version.split()[0],
        "NumPy": np.__version__,
        "SciPy": getattr(tasks.scipy, "__version__", None),
        "OpenCV": getattr(tasks.cv2, "__version__", None),
        "Open3D": getattr(tasks.open3d, "__version__", None),
    }
    print(", ".join(f"{name} {version}" for name, version in versions.items() if version))
    print("ours through the Python binding, with T threads, the peers with one")
    print("milliseconds; ratio = peer / ours\n")
    print(_row(("task", "size", "T", "peer", "ours", "peer", "ratio", "our err.", "its err.", "")))

    results = []
    for group in tasks.GROUPS:
        for task in group():
            if arguments.names and not any(name in task.task for name in arguments.names):
                continue
            r = measure(task, arguments.budget)
            results.append(r)
            numbers = (r["ours_ms"], r["peer_ms"], r["ratio"], r["ours_error"], r["peer_error"])
            cells = [_number(number) for number in numbers]
            print(
                _row((r["task"], r["size"], r["threads"], r["peer"], *cells, " " + r["error_unit"])), flush=True
            )
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(results, indent=2) + "\n")
    print(f"\n{arguments.out} has the medians too")


if __name__ == "__main__":
    main()

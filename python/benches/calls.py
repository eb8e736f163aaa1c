"""What a call takes: of one state, beside a sum of NumPy, and of many, by one thread and by two.

python benches/calls.py [ROBOT]     where the package is installed; the least of many repetitions
"""

import pathlib
import sys
import timeit

import numpy as np
import straightline as sl

PANDA = pathlib.Path(__file__).resolve().parents[2] / "robots" / "descriptions" / "panda.urdf"


def least(call, count, repetitions=40):
    """Seconds per call."""
    return min(timeit.repeat(call, number=count, repeat=repetitions)) / count


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else PANDA
    robot = sl.load(path, functions=["inverse_dynamics", "mass_matrix"])
    q, qd, qdd = (np.random.default_rng(k).uniform(-1, 1, n) for k, n in enumerate((robot.nq, robot.nv, robot.nv)))
    out = np.empty(robot.nv)
    print(f"{robot!r}\n\nof one state [ns]")
    for name, call in [
        ("np.add(qd, qdd)", lambda: np.add(qd, qdd)),
        ("inverse_dynamics(q, qd, qdd)", lambda: robot.inverse_dynamics(q, qd, qdd)),
        ("inverse_dynamics(q, qd, qdd, out=out)", lambda: robot.inverse_dynamics(q, qd, qdd, out=out)),
        ("mass_matrix(q)", lambda: robot.mass_matrix(q)),
    ]:
        print(f"{1e9 * least(call, 3000):10.0f}  {name}")
    print("\nof 100 000 states, each [ns]")
    for dtype in (np.float64, np.float32):
        of_type = robot if dtype == np.float64 else sl.load(path, dtype=dtype)
        states = [np.tile(x, (100_000, 1)).astype(dtype) for x in (q, qd, qdd)]
        results = np.empty((100_000, robot.nv), dtype)
        for threads in (1, 2):
            seconds = least(lambda: of_type.inverse_dynamics(*states, out=results, threads=threads), 1)
            print(f"{1e4 * seconds:10.1f}  inverse_dynamics in {np.dtype(dtype)}, threads={threads}")


if __name__ == "__main__":
    main()

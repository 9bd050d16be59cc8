"""Nothing is left to be compiled once a mission runs."""

from __future__ import annotations

import subprocess
import sys

CHECK = """
from mrslam import alignment
alignment.warm_up()
from mrslam.alignment.kernels import bending, correlation, settling, walls
called = [bending.shifts_at, bending.partners, bending.add_walls, bending.bent_state, settling.settle_places]
called += [correlation.multiply, correlation.peaks, walls.wall_points]
print(*[kernel.py_func.__name__ for kernel in called if not kernel.signatures])
"""


def test_the_kernels_of_bending_and_searching_are_compiled_by_warming_up() -> None:
    done = subprocess.run([sys.executable, "-c", CHECK], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []

import importlib
import inspect
import pkgutil
import subprocess
import sys

import pytest

CHECK = """
import importlib, inspect, pkgutil, sys
package = importlib.import_module(sys.argv[1])
package.warm_up()
missed = []
for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
    module = importlib.import_module(found.name)
    for name, value in inspect.getmembers(module, lambda v: hasattr(v, "py_func")):
        if value.__module__ == found.name and not name.startswith("_") and not value.signatures:
            missed.append(f"{found.name}.{name}")
print(" ".join(missed))
"""


def kernels(package: str) -> list[str]:
    """The compiled functions of a package that are called from outside of their module."""
    top = importlib.import_module(package)
    out = []
    for found in pkgutil.walk_packages(top.__path__, top.__name__ + "."):
        module = importlib.import_module(found.name)
        out += [name for name, value in inspect.getmembers(module, lambda v: hasattr(v, "py_func"))]
    return out


@pytest.mark.parametrize("package", ["mrslam.merge"])
def test_every_kernel_is_compiled_by_warming_up(package):
    assert len(kernels(package)) > 5
    done = subprocess.run([sys.executable, "-c", CHECK, package], capture_output=True, text=True, check=True)
    missed = set(done.stdout.split())
    assert missed <= CALLED_BY_OTHERS, missed


RECEIVED = """
import numpy as np
from mrslam import merge
from mrslam.merge.joint.trail import Trail
from mrslam.merge.joint.trail_kernels import seen_again
from mrslam.spatial import KeyScans

merge.warm_up()
for keys in (np.zeros((3, 3)), np.frombuffer(bytes(72)).reshape(3, 3)):
    print(len(Trail(keys, KeyScans.blank(3)).edges.first), len(seen_again.signatures))
"""


def test_a_map_that_came_by_radio_compiles_nothing_of_its_own():
    done = subprocess.run([sys.executable, "-c", RECEIVED], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["2", "1", "2", "1"]


CALLED_BY_OTHERS = {
    f"mrslam.merge.{name}"
    for name in (
        "grids.wall_kernels.draw_wall",
        "grids.wall_kernels.is_linked",
        "grids.wall_kernels.is_thick",
        "grids.wall_kernels.is_wall",
        "grids.warp_kernels.sample",
        "joint.bend_kernels.displaced",
    )
}
"""Callees are compiled with their callers."""

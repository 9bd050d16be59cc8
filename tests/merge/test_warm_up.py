import importlib
import inspect
import pkgutil

from mrslam import merge


def test_every_kernel_is_compiled_afterwards():
    merge.warm_up()
    for found in pkgutil.iter_modules(merge.__path__, "merge."):
        module = importlib.import_module(found.name)
        for name, value in inspect.getmembers(module, lambda v: hasattr(v, "py_func")):
            if value.__module__ == found.name and not name.startswith("_"):  # callees are compiled with their callers
                assert value.signatures, f"{found.name}.{name} was not called"

"""Files that are broken in any way are read, or refused in one clear line; nothing else gets out of a reader."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrslam.spatial import InputError
from tests.fuzz.readers import READERS, Reader, broken


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_whole_files_are_read(reader: Reader, tmp_path: Path) -> None:
    reader.read(reader.make(tmp_path))


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**32 - 1), sealed=st.booleans())
def test_broken_files_give_a_clear_line(
    reader: Reader, seed: int, sealed: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = reader.make(tmp_path_factory.mktemp("fuzz"))
    whole = path.read_bytes()
    rng = np.random.default_rng(seed)
    path.write_bytes(reader.seal(broken(reader.plain(whole), rng)) if sealed else broken(whole, rng))
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            reader.read(path)
        except InputError as error:
            assert str(error) and "\n" not in str(error)

"""State on disk: what comes back is what went in, and nothing damaged comes back."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mrslam.spatial import InputError
from mrslam.spatial.files.state_file import Packed, pack, read_state, write_state

arrays = st.sampled_from(["float64", "float32", "int64", "int32", "uint32", "int8", "bool"]).flatmap(
    lambda dtype: hnp.arrays(dtype, hnp.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=4))
)
values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats(allow_nan=False) | st.text() | arrays,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)


def same(one: Any, other: Any) -> bool:
    """Whether two states are the same, arrays compared by bytes."""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(same(a, b) for a, b in zip(one, other, strict=True))
    return bool(one == other)


@given(value=values)
def test_what_comes_back_is_what_went_in(tmp_path_factory: pytest.TempPathFactory, value: Any) -> None:
    path = tmp_path_factory.getbasetemp() / "state"
    write_state(path, "thing", 3, pack(value))
    assert same(value, read_state(path, "thing", 3))


def test_a_packed_state_does_not_follow_later_changes(tmp_path: Path) -> None:
    cells = np.zeros(4)
    packed = pack({"cells": cells})
    cells += 1.0
    write_state(tmp_path / "state", "thing", 1, packed)
    assert not read_state(tmp_path / "state", "thing", 1)["cells"].any()


@pytest.mark.parametrize("is_fixed", [False, True])
def test_an_array_of_any_layout_is_packed(tmp_path: Path, is_fixed: bool) -> None:
    rows = np.arange(12.0).reshape(3, 4)
    columns, strided = np.array(rows, order="F"), rows[:, ::2]
    for cells in (columns, strided):
        cells.flags.writeable = not is_fixed
    write_state(tmp_path / "state", "thing", 1, pack([columns, strided]))
    back = read_state(tmp_path / "state", "thing", 1)
    assert [cells.tolist() for cells in back] == [rows.tolist(), rows[:, ::2].tolist()]


def test_numbers_of_arrays_and_arrays_of_nothing_are_packed(tmp_path: Path) -> None:
    nothing = np.empty((0, 3), dtype=np.float32)
    nothing.flags.writeable = False
    write_state(tmp_path / "state", "thing", 1, pack({"count": np.int64(7), "is_on": np.bool_(True), "rows": nothing}))
    back = read_state(tmp_path / "state", "thing", 1)
    assert back["count"] == 7 and back["is_on"] is True
    assert back["rows"].shape == (0, 3) and back["rows"].dtype == np.float32


@given(data=st.data())
def test_one_changed_byte_is_noticed(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged"
    write_state(path, "thing", 1, pack({"cells": np.arange(5), "name": "x"}))
    raw = bytearray(path.read_bytes())
    raw[data.draw(st.integers(0, len(raw) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(raw)
    with pytest.raises(InputError):
        read_state(path, "thing", 1)


def test_errors_say_what_is_wrong(tmp_path: Path) -> None:
    path = tmp_path / "state"
    with pytest.raises(InputError, match="cannot be read"):
        read_state(path, "thing", 1)
    write_state(path, "thing", 1, pack(np.arange(3)))
    with pytest.raises(InputError, match="checkpoint version 1, this program reads 2"):
        read_state(path, "thing", 2)
    with pytest.raises(InputError, match="not a other file"):
        read_state(path, "other", 1)
    for header in (
        b'{"array":["int8",[3],99999999999999999999]}', b'{"array":["object",[3],0]}', b'{"array":[["int8"],3,0]}',
        b'{"dict":120}', b'{"dict":"r0","mode":1}', b'{"array":["int8",[3]]}', b"{}", b"[" * 100_000,
    ):  # fmt: skip
        write_state(path, "thing", 1, Packed(header, (bytes(3),)))
        with pytest.raises(InputError, match="does not fit this program"):
            read_state(path, "thing", 1)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(InputError, match="cut off or damaged"):
        read_state(path, "thing", 1)


def test_what_may_change_is_copied_and_what_cannot_is_not(tmp_path: Path) -> None:
    fixed, may_change = np.full((2, 3), 7, dtype=np.int32), np.arange(4.0)
    fixed.flags.writeable = False
    view = may_change.view()
    view.flags.writeable = False  # what it shows may change all the same
    packed = pack({"fixed": fixed, "may": may_change, "view": view, "none": np.empty((0, 3), np.int8)})
    may_change[:] = 9.0
    assert np.shares_memory(np.frombuffer(packed.blobs[0], dtype=np.int32), fixed)
    write_state(tmp_path / "state", "kind", 1, packed)
    state = read_state(tmp_path / "state", "kind", 1)
    assert np.array_equal(state["fixed"], fixed) and state["none"].shape == (0, 3)
    assert np.array_equal(state["may"], np.arange(4.0)) and np.array_equal(state["view"], np.arange(4.0))


def test_what_comes_back_can_be_changed(tmp_path: Path) -> None:
    write_state(tmp_path / "s", "test", 1, pack({"a": np.zeros(3)}))
    back = read_state(tmp_path / "s", "test", 1)["a"]
    back[0] = 1.0
    assert back.tolist() == [1.0, 0.0, 0.0]


def test_arrays_of_other_kinds_are_refused(tmp_path: Path) -> None:
    header = b'{"array":["complex128",[1],0]}'
    write_state(tmp_path / "s", "test", 1, Packed(header, (bytes(16),)))
    with pytest.raises(InputError, match="does not fit this program"):
        read_state(tmp_path / "s", "test", 1)

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.sim_driver.feeds.floats import parse

WORDS = st.one_of(
    st.floats(allow_nan=False).map(repr),
    st.floats(-100, 100).map("{:.3f}".format),
    st.integers(-(10**18), 10**18).map(str),
    st.decimals(allow_nan=False, allow_infinity=False, places=12, min_value=-9000, max_value=9000).map(str),
    st.sampled_from(["0", "-0.0", "+3", ".5", "7.", "1e3", "1_0", "inf", "nan", "007.250"]),
)


@settings(deadline=None)  # the first call may compile
@given(st.lists(WORDS))
def test_numbers_are_those_that_python_reads(words: list[str]) -> None:
    read = parse("  ".join(words))
    assert read.tobytes() == np.array(words, dtype=np.float64).tobytes()


@pytest.mark.parametrize("text", ["-", ".", "1.2.3", "--1", "1,5", "0x10", "1 2 three", "½", "1-2", "+"])
def test_a_word_that_is_no_number_is_told(text: str) -> None:
    with pytest.raises(ValueError, match="could not convert"):
        parse(text)


def test_other_white_space_parts_numbers_too() -> None:
    assert parse("\t1.5\t2\n").tolist() == [1.5, 2.0]
    assert parse("").size == 0 == parse("   ").size

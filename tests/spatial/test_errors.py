import math
from types import SimpleNamespace

import pytest

from mrslam.spatial.errors import InputError, require, require_bounds


def test_require_names_setting_rule_and_value():
    require(True, "a.b", "> 0", -1)
    with pytest.raises(InputError, match=r"^a\.b must be > 0, got -1$"):
        require(False, "a.b", "> 0", -1)


def test_what_a_message_cites_does_not_break_its_line() -> None:
    assert str(InputError("unknown key 'a\nb\r\nc'")) == "unknown key 'a b c'"


@pytest.mark.parametrize("value", [0.49, 2.51, math.nan, math.inf, -math.inf, 1e300])
def test_bounds_name_setting_bounds_unit_and_value(value: float) -> None:
    with pytest.raises(InputError, match=r"^robot\.speed_m_s must be in 0\.5\.\.2\.5 m/s, got "):
        require_bounds("robot", SimpleNamespace(speed_m_s=value), {"speed_m_s": (0.5, 2.5)})


@pytest.mark.parametrize("value", [0.5, 1, 2.5, None])
def test_bounds_are_included_and_none_is_no_value(value: float | None) -> None:
    require_bounds("robot", SimpleNamespace(speed_m_s=value), {"speed_m_s": (0.5, 2.5)})


@pytest.mark.parametrize("value", [0, 4, 2.0])
def test_whole_bounds_are_for_whole_numbers(value: float) -> None:
    require_bounds("a", SimpleNamespace(count=3), {"count": (1, 3)})
    with pytest.raises(InputError, match=r"^a\.count must be a whole number in 1\.\.3, got "):
        require_bounds("a", SimpleNamespace(count=value), {"count": (1, 3)})

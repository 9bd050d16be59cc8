import pytest

from mrslam.spatial.errors import InputError, require


def test_require_names_setting_rule_and_value():
    require(True, "a.b", "> 0", -1)
    with pytest.raises(InputError, match=r"^a\.b must be > 0, got -1$"):
        require(False, "a.b", "> 0", -1)


def test_what_a_message_cites_does_not_break_its_line() -> None:
    assert str(InputError("unknown key 'a\nb\r\nc'")) == "unknown key 'a b c'"

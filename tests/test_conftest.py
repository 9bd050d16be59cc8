from hypothesis import settings


def test_no_property_test_has_a_deadline():
    assert settings().deadline is None

"""``mrslam config``: ordinary settings by default, expert ones when asked for, all on the page of the documentation."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from mrslam.sim_driver.cli import config as reference


@dataclass(frozen=True, kw_only=True)
class Laser:
    """A section for the test."""

    rate_hz: float = 10.0
    """Scans a second, Hz."""
    beam_width_rad: float = 0.004
    """Expert: width of a beam,
    radians."""


@dataclass(frozen=True, kw_only=True)
class Inner:
    """A section that nobody but experts sees."""

    depth: int = 3
    """Expert: levels kept."""


@pytest.fixture
def two_sections(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference, "sections", lambda: iter([("laser", Laser), ("inner", Inner)]))


def test_expert_settings_are_counted_and_not_shown(two_sections, capsys) -> None:
    reference.print_reference(expert=False)
    assert capsys.readouterr().out == (
        "[laser]\n  rate_hz = 10.0\n      Scans a second, Hz.\n\n"
        "2 more settings, whose defaults hardly anyone should change: mrslam config --expert\n"
    )


def test_expert_settings_are_shown_on_request(two_sections, capsys) -> None:
    reference.print_reference(expert=True)
    out = capsys.readouterr().out
    assert "  beam_width_rad = 0.004\n      Expert: width of a beam, radians.\n" in out
    assert "[inner]\n  depth = 3\n      Expert: levels kept.\n" in out
    assert "more settings" not in out


def test_the_page_has_them_in_a_section_of_their_own(two_sections) -> None:
    ordinary, expert = reference.as_markdown().split("## Expert settings")
    assert "| `rate_hz` | `10.0` | Scans a second, Hz. |" in ordinary
    assert "beam_width_rad" not in ordinary
    assert "| `beam_width_rad` | `0.004` | width of a beam, radians. |" in expert
    assert "### `[inner]`" in expert


def test_every_setting_says_what_it_does() -> None:
    silent = [
        f"{section}.{setting.name}"
        for section, cls in reference.sections()
        for setting in reference.settings_of(cls)
        if not setting.text
    ]
    assert silent == []

"""When a robot reports how much it knows."""

from types import SimpleNamespace

import pytest

from mrslam.agent.reports import GROWTH, REPORT_MOST_NS, REPORT_NS, KnowledgeReports


def known(*areas_m2):
    return {f"r{k}": SimpleNamespace(area_m2=area_m2) for k, area_m2 in enumerate(areas_m2)}


@pytest.mark.parametrize(
    ("maps", "placed", "after_ns", "due"),
    [
        (known(100.0, 20.0), {"r0"}, REPORT_NS, False),  # nothing new
        (known(100.0, 20.0), {"r0"}, REPORT_MOST_NS, True),
        (known(100.0, 20.0), {"r0", "r1"}, REPORT_NS, True),  # another robot is placed
        (known(100.0, 20.0 + 121.0 * GROWTH), {"r0"}, REPORT_NS, True),
        (known(100.0, 20.0 + 119.0 * GROWTH), {"r0"}, REPORT_NS, False),
        (known(100.0), {"r0"}, REPORT_NS, True),  # a map was given up
        (known(500.0, 500.0), {"r0", "r1"}, REPORT_NS - 1, False),  # never more often than this
    ],
)
def test_a_report_is_due_where_something_is_new(maps, placed, after_ns, due):
    reports = KnowledgeReports()
    assert reports.are_due(known(100.0, 20.0), {"r0"}, 5)
    assert reports.are_due(maps, placed, 5 + after_ns) is due

"""Everything the page shows, as plain JSON values."""

from __future__ import annotations

from itertools import combinations
from typing import Any

from mrslam.agent import Settings
from mrslam.merge.draw import colours
from mrslam.sim_driver.evaluate import References
from mrslam.sim_driver.evaluate.assess import assess_run
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.settings import as_table
from mrslam.sim_driver.report.coverage import coverage_data
from mrslam.sim_driver.report.layout import lay_out
from mrslam.sim_driver.report.links import link_data, traffic_curve
from mrslam.sim_driver.report.map_data import map_data
from mrslam.sim_driver.report.one_map import one_map_data
from mrslam.sim_driver.report.seen import first_seen_s
from mrslam.sim_driver.report.story import event_words, headline, sentences
from mrslam.sim_driver.report.undecided import undecided_data

TICKER_LINES = 400
"""Most lines of the player's ticker: with more, plain ones are left out."""


def page_data(run: RunResults, references: References | None = None) -> dict[str, Any]:
    """Return what the page is made of."""
    assessment = assess_run(run, references or References())
    end_s = float(run.metrics["mission_s"])
    data: dict[str, Any] = {
        "name": run.metrics["name"],
        "headline": headline(run),
        "end_s": end_s,
        "robots": [
            {"id": robot, "colour": "#{:02x}{:02x}{:02x}".format(*colour)}
            for robot, colour in colours([robot.id for robot in run.mission.robots]).items()
        ],
        "links": [link_data(run, a, b, end_s) for a, b in combinations(sorted(run.events), 2)],
        "threshold": run.mission.settings.comms.link_threshold,
        "attempts": _attempts(run),
        "traffic": {**assessment["mission"]["bytes"], "curve": traffic_curve(run, end_s)},
        "ticker": _ticker(run),
        "assessment": assessment,
        "settings": _settings(run),
        "map": None,
        "coverage": None,
        "one_map": one_map_data(run),
        "undecided": undecided_data(run),
    }
    if run.robots:
        layout = lay_out(run)
        seen_s = {robot: first_seen_s(run, layout, robot) for robot in run.robots}
        data["map"] = map_data(run, layout, seen_s, end_s)
        data["coverage"] = coverage_data(run, layout, seen_s, end_s)
    data["sentences"] = sentences(run, assessment)  # last: files found damaged on the way are among them
    return data


def _attempts(run: RunResults) -> list[dict[str, Any]]:
    return [
        {
            "t": event["t"],
            "robot": event["robot"],
            "pair": f"{event['a']}-{event['b']}",
            "accepted": event["status"] == "accepted",
            "reason": event["reason"],
            "confidence": round(event["confidence"], 2),
            "overlap": event["evidence"].get("overlap"),
        }
        for events in run.events.values()
        for event in events
        if event["event"] == "alignment"
    ]


def _ticker(run: RunResults) -> list[list[Any]]:
    lines = [
        [event["t"], *words]
        for events in run.events.values()
        for event in events
        if (words := event_words(event)) is not None
    ]
    lines.sort(key=lambda line: line[0])
    if len(lines) > TICKER_LINES:  # what matters stays
        lines = [line for line in lines if line[1] != "plain"][:TICKER_LINES] or lines[:TICKER_LINES]
    return lines


def _settings(run: RunResults) -> list[list[Any]]:
    """Return ``[section.key, value, differs from the default]`` of every setting, those that differ first."""
    chosen, default = as_table(run.mission.settings), as_table(Settings())
    rows: list[list[Any]] = [
        ["mission.seed", run.mission.mission.seed, False],
        ["mission.shell", run.mission.mission.shell, False],
    ]
    for section, table in chosen.items():
        for key, value in table.items():
            rows.append([f"{section}.{key}", value, value != default[section][key]])
    for robot in run.mission.robots:
        for section, table in robot.own_settings.items():
            rows += [[f"{robot.id}: {section}.{key}", value, True] for key, value in table.items()]
    return sorted(rows, key=lambda row: not row[2])

"""What happened in a run, in plain words."""

from __future__ import annotations

from typing import Any

from mrslam.sim_driver.evaluate.in_saved_maps import as_words
from mrslam.sim_driver.evaluate.network import compared
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.sides import apart_text, merged_text, shares_one_map
from mrslam.sim_driver.faults.config import ONCE

Assessment = dict[str, Any]


def headline(run: RunResults) -> str:
    """Return the outcome in one line."""
    robots = sum(robot.mode != "central" for robot in run.mission.robots)
    placed = [len(robot["placed"]) for robot in run.robots.values()]
    together, whole = max(placed, default=0), placed.count(robots)
    if robots == 1:
        return "One robot mapped on its own"
    if together <= 1:
        return f"No maps were merged: {robots} robots, {robots} separate maps"
    merging = [robot.id for robot in run.mission.robots if robot.mode != "mapper"]
    if whole == len(merging) == 1:
        return f"{merging[0]} has the maps of all {robots} robots in one"
    if 0 < whole < len(merging):
        return f"{whole} of {len(merging)} robots {'has' if whole == 1 else 'have'} the maps of all in one"
    if together == robots:
        return f"All {robots} robots share one map" if robots > 2 else "Both robots share one map"
    return f"{together} of {robots} robots share one map"


def sentences(run: RunResults, assessment: Assessment) -> list[tuple[str, str]]:
    """Return ``(mood, sentence)`` in the order of interest; moods: "good", "bad", "plain"."""
    told = [_pair_sentence(pair, run) for pair in sorted(assessment["pairs"], key=_time)]
    lonely = _lonely(run)
    told = [sentence for sentence, pair in zip(told, sorted(assessment["pairs"], key=_time), strict=True)
            if pair["a"] not in lonely and pair["b"] not in lonely]  # fmt: skip
    told += [("plain", f"{as_words(row)}.") for row in assessment["saved_maps"]]
    told += [("bad", f"{robot} never met anyone.") for robot in lonely]
    told += [("bad", f"{robot} was lost on the way.") for robot in run.robots_lost]
    told += [("bad", f"Not used: {line}.") for line in run.damage]
    told += [("bad", text) for text in _blind(run)]
    told += [("plain", text) for text in (_faults(run), _coverage(assessment, run), _traffic(assessment)) if text]
    if run.mission.replay is not None:
        held = run.metrics.get("replay", {}).get("drive_holds_until_s")
        until = "" if held is None else f"; from {held:.0f} s on the robots might have driven elsewhere"
        told.append(("plain", f"Played again from a recorded drive{until}."))
    return told


def _time(pair: dict[str, Any]) -> tuple[float, str]:
    return (float("inf") if pair["accepted_at_s"] is None else pair["accepted_at_s"]), pair["a"] + pair["b"]


def _lonely(run: RunResults) -> list[str]:
    if len(run.mission.robots) < 2:
        return []
    met = {event["peer"] for events in run.events.values() for event in events if event["event"] == "exchange_done"}
    met |= {robot for robot, events in run.events.items() if any(e["event"] == "exchange_done" for e in events)}
    return [robot.id for robot in run.mission.robots if robot.id not in met and robot.id in run.robots]


def _blind(run: RunResults) -> list[str]:
    """Return whose laser was of no use for a while."""
    told = []
    for robot, events in run.events.items():
        blind_s = sum(event["blind_s"] for event in events if event["event"] == "sees")
        changes = [event["event"] for event in events if event["event"] in ("blind", "sees")]
        if changes:
            spans = [f"for {blind_s:.0f} s"] if "sees" in changes else []
            spans += ["at the end"] if changes[-1] == "blind" else []
            told.append(f"The laser of {robot} was of no use {' and '.join(spans)}; it went on by its wheels.")
    return told


def _faults(run: RunResults) -> str:
    """Return what the mission let go wrong, empty where nothing."""
    told = [
        f"{fault.kind} of {fault.robot} at {fault.at_s:g} s" + ("" if fault.kind in ONCE else f" for {fault.for_s:g} s")
        for fault in sorted(run.mission.faults, key=lambda fault: fault.at_s)
        if fault.kind != "liar"
    ]
    liars = [fault.robot for fault in run.mission.faults if fault.kind == "liar"]
    told += [f"{liar} gave out a map that it had not seen" for liar in liars]
    return f"Made to go wrong: {'; '.join(told)}." if told else ""


def _pair_sentence(pair: dict[str, Any], run: RunResults) -> tuple[str, str]:
    who = f"{pair['a']} and {pair['b']}"
    if pair["status"] == "accepted" or pair["verdict"] == "false merge":
        bad = pair["verdict"] == "false merge"
        worst = max(
            (view for view in pair["views"].values() if view["error_m"] is not None),
            key=lambda view: (bool(view["is_false"]), view["error_m"]),
            default=None,
        )
        shown = worst if bad else pair
        off = ""
        if shown is not None and shown["error_m"] is not None:
            off = f", {shown['error_m']:.2f} m / {shown['error_deg']:.1f} deg off"
        if bad:
            after = "" if pair["accepted_at_s"] is None else f" after {pair['accepted_at_s']:.0f} s"
            return "bad", f"{who} were merged WRONGLY{after}{off}."
        is_good = pair["both_at_s"] is not None or shares_one_map(pair)
        return "good" if is_good else "bad", f"{merged_text(pair)}{off}."
    if pair["placed_together_by"]:
        return "good" if shares_one_map(pair) else "plain", f"{apart_text(pair)}."
    times = max(_exchanges(run, pair["a"], pair["b"]), _exchanges(run, pair["b"], pair["a"]))  # one may have been lost
    if times == 0:
        return "bad", f"{who} never exchanged maps."
    word = "once" if times == 1 else f"{times} times"
    return "bad", f"{who} exchanged maps {word}, but were not merged: {pair['reason']}."


def _exchanges(run: RunResults, robot_id: str, peer: str) -> int:
    return sum(event["event"] == "exchange_done" and event["peer"] == peer for event in run.events[robot_id])


def _coverage(assessment: Assessment, run: RunResults) -> str:
    mission = assessment["mission"]
    if mission["coverage_best"] is not None:
        low, high = 100 * mission["coverage_worst"], 100 * mission["coverage_best"]
        known = f"{high:.0f} %" if round(low) == round(high) else f"{low:.0f} to {high:.0f} %"
        return f"Each robot knows {known} of the building."
    areas = [robot["team_area_m2"] for robot in run.robots.values()]
    return f"The largest team map covers {max(areas):.0f} m²." if areas else ""


def _traffic(assessment: Assessment) -> str:
    traffic = assessment["mission"]["bytes"]
    if not traffic["full_lz4"]:
        return "No maps went over the radio."
    sent = f"{traffic['exchanges'] / 1e3:.0f} kB of maps went over the radio"
    return f"{sent}, {compared(traffic['exchanges'], traffic['full_lz4'])} than whole maps compressed with LZ4."


def event_words(event: dict[str, Any]) -> tuple[str, str] | None:
    """Return ``(mood, words)`` of an event for the player's ticker; None for what is not worth a line there."""
    match event["event"]:
        case "merged":
            return "good", f"{event['robot']}: the maps of {event['a']} and {event['b']} fit, merged"
        case "unmerged":
            return "bad", f"{event['robot']}: {event['a']} and {event['b']} taken apart: {event['reason']}"
        case "exchange_done" if event["robot"] < event["peer"]:  # the other end reports the same
            sent = (event["bytes_sent"] + event["bytes_received"]) / 1e3
            return "plain", f"{event['robot']} and {event['peer']} exchanged maps, {sent:.1f} kB"
        case "exchange_failed":
            return "bad", f"{event['robot']}: exchange with {event['peer']} broke off: {event['reason']}"
        case "blind":
            return "bad", f"{event['robot']} is blind: {event['reason']}"
        case "sees":
            return "plain", f"{event['robot']} sees again, after {event['blind_s']} s"
        case "restarted":
            how = "resumes from its checkpoint" if event["checkpoint"] else "has no checkpoint and begins a new map"
            return "plain", f"{event['robot']} started again and {how}"
        case "doubtful":
            return "bad", f"{event['robot']} doubts where it is"
        case "recovered":
            return "plain", f"{event['robot']} knows again where it is"
        case "given_up":
            return "bad", f"{event['robot']} does not find its place in its map again and begins a new one"
        case "peer_gone":
            return "plain", f"{event['robot']} lost sight of {event['peer']}: {event['reason']}"
        case "alignment" if event["status"] != "accepted":
            return "plain", f"{event['robot']}: {event['a']} and {event['b']} do not fit yet: {event['reason']}"
        case _:
            return None

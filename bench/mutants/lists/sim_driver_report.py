"""Mutants of the page of a run."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "sim_driver/report/story.py",
        'return "good" if shares_one_map(pair) else "plain", ',
        'return "good", ',
        "what only a third robot knows is told as if the two knew it",
    ),
    Mutant(
        "sim_driver/report/seen.py",
        "        if np.hypot(*(pose - before)[:2]) < STEP_M and abs(se2.wrap(pose[2] - before[2])) < STEP_RAD:",
        "        if np.hypot(*(pose - before)[:2]) < STEP_M:",
        "what a robot saw as it turned on the spot is missing in the report",
    ),
    Mutant(
        "sim_driver/report/seen.py",
        "run.began_s(robot_id) if begun_s is None else",
        "0.0 if begun_s is None else",
        "agents that began late are shown too early",
    ),
    Mutant(
        "sim_driver/report/seen.py",
        "(stamp_us, stamp_us - 1, stamp_us + 1)",
        "(one.scan.stamp_ns,)",
        "the report shows nothing seen by robots whose logs have nanoseconds",
    ),
    Mutant(
        "sim_driver/report/seen.py",
        "run.began_s(robot_id) if begun_s is None else begun_s)",
        "run.began_s(robot_id))",
        "the report shows what a robot saw in its last map as if it had driven there from the begin",
    ),
    Mutant(
        "sim_driver/report/links.py",
        'if e["event"] == "exchange_done"), key=_at)',
        'if e["event"] == "exchange_done"), key=lambda e: 0.0)',
        "the report's curve of traffic runs back in time",
    ),
    Mutant(
        "sim_driver/report/links.py",
        ' and {e["a"], e["b"]} == {a, b}]',
        "]",
        "the report shows a link's maps as merged when two others were",
    ),
    Mutant(
        "sim_driver/report/links.py",
        'if event.get("peer") == b and event["event"] in',
        'if event["event"] in',
        "the report shows exchanges with all robots on every link",
    ),
    Mutant(
        "sim_driver/report/tied.py",
        "components({frame}.union(*pairs), pairs)",
        "components({frame}.union(*pairs), pairs[-1:])",
        "the player never joins a map that came by way of two others",
    ),
    Mutant(
        "sim_driver/report/tied.py",
        " for robot in group if robot not in tied}",
        " for robot in group}",
        "the player joins maps when the last merge came, not the first",
    ),
    Mutant(
        "sim_driver/report/story.py",
        'case "exchange_done" if event["robot"] < event["peer"]:',
        'case "exchange_done":',
        "every exchange is in the report's ticker twice",
    ),
    Mutant(
        "sim_driver/report/story.py",
        "    if 0 < whole < len(merging):",
        "    if False:",
        "the report says that all robots share one map where one has it",
    ),
)

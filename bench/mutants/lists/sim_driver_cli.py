"""Mutants of the command line: what it prints, and how it is interrupted."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "sim_driver/cli/live/top_tables.py",
        'status["age_s"] > STALE_S',
        'status["age_s"] < STALE_S',
        "mrslam top marks the robots that are heard",
    ),
    Mutant(
        "sim_driver/cli/live/top_tables.py",
        "if left_days < WARN_DAYS:",
        "if left_days > WARN_DAYS:",
        "mrslam top warns of certificates that last",
    ),
    Mutant(
        "sim_driver/cli/live/top_tables.py",
        'if row["status"] is None or not row["here"]:\n            continue\n        for link',
        'if row["status"] is None:\n            continue\n        for link',
        "mrslam top shows links of robots that are gone",
    ),
    Mutant(
        "sim_driver/cli/live/top_tables.py",
        "if abs(count) >= 1e6",
        "if abs(count) >= 1e9",
        "megabytes are shown as thousands of kilobytes",
    ),
    Mutant(
        "sim_driver/cli/live/top_tables.py",
        "f\"{link['quality']:.2f}\", f\"{link['lq']:.2f}\"",
        "f\"{link['lq']:.2f}\", f\"{link['quality']:.2f}\"",
        "mrslam top shows what a robot hears as the link's quality",
    ),
    Mutant(
        "sim_driver/cli/live/top_tables.py",
        '"here, no status yet" if row["here"] else "gone"',
        '"gone" if row["here"] else "here, no status yet"',
        "mrslam top says that a robot is here that is gone",
    ),
    Mutant(
        "sim_driver/cli/runs/eval.py",
        "if equals and not robot:",
        "if False:",
        "a reference of no robot is one of all",
    ),
    Mutant(
        "sim_driver/cli/runs/eval.py",
        "return robot, read_tum(Path(name))",
        'return "", read_tum(Path(name))',
        "a robot's reference is held against all robots",
    ),
    Mutant(
        "sim_driver/cli/runs/eval.py",
        "if any(value is not None for value in values):",
        "if all(value is not None for value in values):",
        "a measure that one robot lacks is not printed",
    ),
    Mutant(
        "sim_driver/cli/runs/eval.py",
        'elif pair["status"] != "accepted" and pair["reason"]:',
        'elif pair["status"] == "accepted" and pair["reason"]:',
        "mrslam eval does not say why maps do not fit",
    ),
    Mutant(
        "sim_driver/cli/runs/eval.py",
        'seconds = [mission["first_merge_s"], mission["first_correct_merge_s"]]',
        'seconds = [mission["first_correct_merge_s"], mission["first_merge_s"]]',
        "a wrong merge is printed as the first correct one",
    ),
    Mutant(
        "sim_driver/cli/signals.py",
        "        if told:\n            raise KeyboardInterrupt\n",
        "",
        "Ctrl-C pressed twice does not break off",
    ),
    Mutant(
        "sim_driver/cli/signals.py",
        "        signal.signal(signal.SIGINT, before)\n",
        "        pass\n",
        "Ctrl-C does nothing any more once a run is over",
    ),
    Mutant(
        "sim_driver/cli/signals.py",
        "told.append(number))\n    return told",
        "None)\n    return told",
        "a process that is told to end goes on",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        'any(event.fields["checkpoint"] for event in past)',
        'all(event.fields["checkpoint"] for event in past)',
        "an agent that begins a new map says that it is as old as the one before",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        "elif not known.placed:",
        "elif known.placed:",
        "an agent that has merged maps says that it has merged nothing yet",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        'if agent.mode == "mapper":',
        'if agent.mode != "mapper":',
        "a robot that merges says that it merges nothing itself",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        "{math.degrees(theta_rad):.0f} deg",
        "{theta_rad:.0f} deg",
        "an agent tells its heading in radians as degrees",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        "    if T_frame_base is None:\n",
        "    if T_frame_base is not None:\n",
        "an agent that knows where it is in a saved map says that it does not",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        "T_frame_base = agent.T_frame_base\n",
        "T_frame_base = agent.T_map_base\n",
        "an agent tells its pose in its own map as one in the saved map",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        '"the log has ended" if played.finished else "playing the log"',
        '"playing the log" if played.finished else "the log has ended"',
        "an agent whose log has ended says that it plays it",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        "{agent.scans} scans, {known.words}",
        "{agent.scans} scans, {known.area_m2:.0f} m2",
        "an agent's line of status does not say whose maps are merged",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        "seen_ns = [stamps[-1] for",
        "seen_ns = [stamps[0] for",
        "an agent that goes on maps its log from the second scan on again",
    ),
    Mutant(
        "sim_driver/cli/live/agent.py",
        "return bool(received) or now_s >= end_s",
        "return bool(received)",
        "an agent that was to run for a minute runs for ever",
    ),
)

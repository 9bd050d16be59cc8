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
)

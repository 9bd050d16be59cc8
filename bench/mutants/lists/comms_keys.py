"""Mutants of keys, chunks of tiles, and robots of one machine."""

from bench.mutants.mutant import Mutant

KEYS = "comms/security/team_keys.py"
TILES = "comms/wire/tile_codec.py"
LOCAL = "comms/transport/local_robots.py"

MUTANTS = (
    Mutant(
        KEYS,
        '    if "ca" in names:\n',
        "    if False:\n",
        "a robot called ca gets the folder with the authority's own key",
    ),
    Mutant(
        KEYS,
        "    if gone := sorted(revoked & names.keys()):",
        "    if gone := []:",
        "a robot that was revoked gets new keys",
    ),
    Mutant(
        KEYS,
        "max(valid_days, VALID_DAYS))",
        "valid_days)",
        "the authority ends with the first short-lived certificate, and the whole team with it",
    ),
    Mutant(
        KEYS,
        "            if not renew and (",
        "            if False and (",
        "making keys for one more robot signs all others anew",
    ),
    Mutant(
        KEYS,
        "        if revoked:\n",
        "        if False:\n",
        "a robot that joins later trusts those that were revoked before",
    ),
    Mutant(
        KEYS,
        "    if common_name != robot_id:",
        "    if False:",
        "a robot starts with another one's keys",
    ),
    Mutant(
        KEYS,
        "    if left_days < 0.0:",
        "    if False:",
        "a robot starts with a certificate that nobody will accept",
    ),
    Mutant(
        KEYS,
        "    if left_days < WARN_DAYS:",
        "    if False:",
        "nobody hears that a certificate is about to end",
    ),
    Mutant(
        KEYS,
        "    if robot_id in revocations.names:",
        "    if False:",
        "a robot that was revoked starts all the same",
    ),
    Mutant(
        KEYS,
        "items() if name not in revocations.names}",
        "items()}",
        "those that were revoked are let through the routers",
    ),
    Mutant(
        KEYS,
        "roster = _known_roster(ca_folder, team) | names",
        "roster = dict(names)",
        "making keys for one more robot throws the others out of the roster",
    ),
    Mutant(
        KEYS,
        '    if its_team != team:\n        raise InputError(f"{ca_folder.parent}',
        '    if False:\n        raise InputError(f"{ca_folder.parent}',
        "keys of two teams are mixed in one folder",
    ),
    Mutant(
        TILES,
        "    if raw_bytes > bound:",
        "    if False:",
        "a message of a few bytes takes all the memory",
    ),
    Mutant(
        TILES,
        "    if len(raw) != raw_bytes:",
        "    if False:",
        "a chunk that says more than it holds is read beyond its end",
    ),
    Mutant(
        TILES,
        "!= body.size + READ_AHEAD:",
        "> body.size + READ_AHEAD:",
        "bytes behind a chunk's end are accepted",
    ),
    Mutant(
        TILES,
        "if look_up(value_of, index, cells) >= size:",
        "if look_up(value_of, index, cells) >= 256:",
        "a cell outside the palette becomes some value",
    ),
    Mutant(
        TILES,
        "        if body.size != bits * base.size // 8:",
        "        if False:",
        "bit planes of a wrong length crash the reader",
    ),
    Mutant(
        LOCAL,
        "        if _is_alive(robot.pid):",
        "        if True:",
        "robots that were killed are listed as running",
    ),
    Mutant(
        LOCAL,
        'bare = bare.replace(f"/{everywhere}:", f"/{here}:")',
        "pass",
        "a robot that listens everywhere is looked for at 0.0.0.0",
    ),
    Mutant(
        LOCAL,
        "if place.stat().st_uid != os.getuid():  # another",
        "if False:  # another",
        "where robots listen is written into another user's folder",
    ),
    Mutant(
        LOCAL,
        "mode=0o700",
        "mode=0o755",
        "every user of the machine can read where robots listen",
    ),
    Mutant(
        LOCAL,
        "    if not place.is_dir() or place.stat().st_uid != os.getuid():\n        return []",
        "    if not place.is_dir():\n        return []",
        "what another user says of robots is believed",
    ),
    Mutant(
        LOCAL,
        "            withdraw(path)\n",
        "            pass\n",
        "files of robots that were killed pile up",
    ),
)

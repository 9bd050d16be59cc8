"""Mutants of keys, chunks of tiles, and robots of one machine."""

from bench.mutants.mutant import Mutant

KEYS = "comms/security/team_keys.py"
TILES = "comms/wire/tile_codec.py"
LOCAL = "comms/transport/local_robots.py"

MUTANTS = (
    Mutant(
        "comms/security/certificates.py",
        "    write_bytes(path, text, mode=0o600)\n",
        "    path.touch(mode=0o600)\n    path.write_bytes(text)\n",
        "a key that a full disk cut off keeps mrslam keys from making any until it is removed by hand",
    ),
    Mutant(
        "comms/security/team_keys.py",
        "    with held(folder):\n",
        "    if True:\n",
        "two that make a team's keys at once leave an authority's key that is not its certificate's",
    ),
    Mutant(
        "comms/security/revocation.py",
        "        try:\n            number, names = read_list(self.folder, self.team)\n",
        "        self._seen = seen\n        try:\n            number, names = read_list(self.folder, self.team)\n",
        "a list of revoked robots that could not be read once lets them in until the robot starts again",
    ),
    Mutant(
        "comms/security/revocation.py",
        "            if str(error) != self._trouble:\n",
        "            if True:\n",
        "a damaged list of revoked robots fills the log by a line every second",
    ),
    Mutant(
        "comms/security/revocation.py",
        '        self._seen, self._trouble = seen, ""\n',
        '        self._trouble = ""\n',
        "a list that has not changed is read again every second",
    ),
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
    Mutant(
        "comms/security/certificates.py",
        "mode=0o600",
        "mode=0o644",
        "private keys can be read by everybody",
    ),
    Mutant(
        "comms/security/revocation.py",
        "    if strangers := added - set(members):",
        "    if strangers := set():",
        "a mistyped name is revoked, and the robot that was meant is not",
    ),
    Mutant(
        "comms/security/team_keys.py",
        '    if its_team != team:\n        raise InputError(f"{folder}',
        '    if False:\n        raise InputError(f"{folder}',
        "a robot starts with the keys of another team and is heard by nobody",
    ),
    Mutant(
        "comms/security/team_keys.py",
        '    names |= {check_name(name, "router name"): ROUTER for name in routers}',
        '    names |= {check_name(name, "router name"): ROBOT for name in routers}',
        "routers pass nothing on",
    ),
    Mutant(
        "comms/security/access.py",
        '[f"mrslam/{team}/{name}/**"], writing',
        '[f"mrslam/{team}/**"], writing',
        "each robot may write under every name",
    ),
    Mutant(
        "comms/security/access.py",
        '"default_permission": "deny"',
        '"default_permission": "allow"',
        "strangers may write under every name",
    ),
    Mutant(
        "comms/security/certificates.py",
        '    return name.replace("_", "-").replace(".", "-").strip("-").lower()[:63] or "robot"',
        "    return name",
        'certificates of robots called "-" or "a_b" are no valid ones',
    ),
    Mutant(
        "comms/security/certificates.py",
        'f"{team} CA"[:64]',
        'f"{team} CA"',
        "keys cannot be made for a team with a long name",
    ),
    Mutant(
        "comms/security/certificates.py",
        '    if not isinstance(key, ec.EllipticCurvePrivateKey):\n        raise InputError(f"{path}: not an elliptic',
        '    if False:\n        raise InputError(f"{path}: not an elliptic',
        "keys of another kind end in a traceback",
    ),
    Mutant(
        "comms/security/revocation.py",
        "if (folder / name).is_dir()]",
        "if name]",
        "who moved a robot's key folder away cannot revoke any more",
    ),
    Mutant(
        "comms/security/revocation.py",
        'return PURPOSE + "\\n"',
        'return b"" + "\\n".encode() + "\\n"',
        "lists of revoked robots are not signed as documented",
    ),
    Mutant(
        "comms/security/team_keys.py",
        '    check_name(team, "team name")\n    names',
        "    names",
        "a team may be called anything: its robots find no key expression",
    ),
    Mutant(
        "comms/security/certificates.py",
        "    if certificate_path.exists():\n        return read_authority(folder)\n",
        "    if certificate_path.exists() and key_path.exists():\n        return read_authority(folder)\n",
        "keys made while the authority's own is kept elsewhere are signed by another one, which no robot knows",
    ),
    Mutant(
        "comms/security/certificates.py",
        "    if key_path.exists():\n        key = read_private_key(key_path)\n    else:",
        "    if True:",
        "after a call that was cut off no keys can be made any more",
    ),
    Mutant(
        "comms/security/revocation.py",
        '    key, _ = read_authority(folder / "ca")',
        "    from mrslam.comms.security.certificates import team_authority\n\n"
        '    key, _ = team_authority(folder / "ca", team, 1.0)',
        "a revocation without the authority's key is signed by another one, and all robots ignore it",
    ),
    Mutant(
        "comms/security/revocation.py",
        "OverflowError, RecursionError",
        "RecursionError",
        "a damaged list of revoked robots ends the agent that reads it",
    ),
    Mutant(
        "comms/security/team_keys.py",
        'if not renew and (target / "certificate.pem").exists():',
        "if not renew:",
        "a robot whose certificate was never written gets none",
    ),
    Mutant(
        "comms/security/team_keys.py",
        "    if is_new and (",
        "    if False and (",
        "keys made while the authority is kept elsewhere are signed by another one",
    ),
    Mutant(
        "comms/security/team_keys.py",
        "    except (OSError, ValueError, KeyError, TypeError, AttributeError, IndexError) as error:",
        "    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:",
        "keys that belong to another user of the machine end in a traceback",
    ),
)

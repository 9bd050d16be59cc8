"""Mutants of comms: folders without a list of their own."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "comms/wire/frames.py",
        "    if zlib.crc32(body) != checksum:",
        "    if False:",
        "corrupt messages are read",
    ),
    Mutant(
        "comms/wire/frames.py",
        "    if its_tag != tag:",
        "    if False:",
        "robots of another team are met",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "SCALE = np.array(UNITS)",
        "SCALE = np.array([1e1, 1e1, 1e4])",
        "trajectories arrive rounded to ten centimetres",
    ),
    Mutant(
        "comms/wire/presence_messages.py",
        "        return self.boot + self.epoch_offset\n",
        "        return self.boot\n",
        "after a new map a teammate is neither masked nor looked for",
    ),
    Mutant(
        "comms/wire/presence_messages.py",
        "list[tuple[MapName, MapName, Words]]",
        "list[tuple[Name, Name, Words]]",
        "a robot that holds a saved map is shown to no watcher",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "return bool(((-limit <= values) & (values <= limit)).all())",
        "return not bool((np.abs(values) > limit).any())",
        "a keyframe 300 years before the others is taken from a teammate",
    ),
    Mutant(
        "comms/wire/fields.py",
        'pattern=r"^[A-Za-z0-9_.-]+\\Z")',
        'pattern=r"^[A-Za-z0-9_.-]+$")',
        "a robot may have a line feed in its name",
    ),
    Mutant(
        "comms/wire/fields.py",
        'rf"^{SAVED_NAME}\\Z"',
        'rf"^{SAVED_NAME}$"',
        "a saved map may have a line feed in its name",
    ),
    Mutant(
        "comms/wire/fields.py",
        '|{SAVED_NAME})\\Z"',
        '|{SAVED_NAME})$"',
        "the name of a map in a manifest may end in a line feed",
    ),
    Mutant(
        "comms/node.py",
        "if sender is not None and sender != message.sender:",
        "if False:",
        "one robot speaks in another's name",
    ),
    Mutant(
        "comms/node.py",
        " and keyframes <= self.config.max_keyframes",
        "",
        "a saved map whose keyframes no teammate keeps is offered for ever",
    ),
    Mutant(
        "comms/node.py",
        "        self._neighbourhood.beacons.forget()\n",
        "",
        "the first beacon of a new map tells where the robot was in the old one",
    ),
    Mutant(
        "comms/effects.py",
        "return self.epoch == peer_epoch and self.of_robot in (None, robot_epoch % EPOCHS)",
        "return self.of_robot in (None, robot_epoch % EPOCHS)",
        "what was seen in a map that a teammate gave up counts for its new one",
    ),
    Mutant(
        "comms/effects.py",
        "return self.epoch == peer_epoch and self.of_robot in (None, robot_epoch % EPOCHS)",
        "return self.epoch == peer_epoch",
        "what a teammate saw of the map that this robot gave up counts for its new one",
    ),
    Mutant(
        "comms/node.py",
        'if known.boot and MODES[known.mode] == "distributed"',
        'if MODES[known.mode] == "distributed"',
        "a robot that only maps is waited for to search, until its first beacon",
    ),
    Mutant(
        "comms/transport/inbox.py",
        "            self._beacons.clear()\n            self._bytes = 0\n",
        "            self._beacons.clear()\n",
        "after 64 MB a robot hears of no map any more",
    ),
    Mutant(
        "comms/transport/sensors.py",
        "        T_base_laser=np.array(message.T_base_laser),\n",
        "",
        "scans of drivers are mapped as if the laser stood in the robot's middle and looked ahead",
    ),
    Mutant(
        "comms/transport/outbox.py",
        "                self._bytes -= len(payload)\n",
        "",
        "a robot falls silent for good after its first 16 MB",
    ),
    Mutant(
        "comms/transport/outbox.py",
        "self._closed or self._bytes + len(payload) > self._max_bytes",
        "self._closed",
        "messages of a link that was cut pile up in memory",
    ),
    Mutant(
        "comms/transport/outbox.py",
        "except Exception as error:",
        "except ValueError as error:",
        "one message that cannot be sent ends all sending",
    ),
    Mutant(
        "comms/transport/memory.py",
        "self._push(max(self.now_ns + after_ns, said_ns), name, None, PeerLeft(robot_id))",
        "self._push(self.now_ns + after_ns, name, None, PeerLeft(robot_id))",
        "simulated robots that say goodbye are told as lost",
    ),
    Mutant(
        "comms/security/certificates.py",
        "now - datetime.timedelta(days=1)",
        "now",
        "new keys do not work on a robot whose clock is behind, until it catches up",
    ),
    Mutant(
        "comms/security/revocation.py",
        "        if number < self._number:",
        "        if False:",
        "an old revocation list is put back",
    ),
    Mutant(
        "comms/security/revocation.py",
        "        self._number, self.names = number, self.names | names",
        "        self._number, self.names = number, names",
        "a robot that was taken off the list is heard again",
    ),
    Mutant(
        "comms/security/revocation.py",
        '        public_key.verify(bytes.fromhex(content["signature"]), _statement(team, number, names), ALGORITHM)\n',
        "",
        "anybody may revoke robots",
    ),
    Mutant(
        "comms/security/revocation.py",
        "    number, revoked = known[0] + 1, sorted(known[1] | added)",
        "    number, revoked = known[0] + 1, sorted(added)",
        "a second revocation takes the first back",
    ),
    Mutant(
        "comms/status/team_view.py",
        "if key not in self._robots and len(self._robots) >= MAX_SHOWN:",
        "if False:",
        "who watches remembers any number of robots",
    ),
)

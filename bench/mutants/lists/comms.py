"""Mutants of comms."""

from bench.mutants.mutant import Mutant

RENDEZVOUS, RECEIVER, EXCHANGES = (f"comms/exchange/{name}.py" for name in ("rendezvous", "map_receiver", "exchanges"))
STORE, SEAL, STAGING, STAGED = (f"comms/maps/{name}.py" for name in ("store", "seal", "staging", "staged_maps"))
LINKS, AROUND = (f"comms/neighbours/{name}.py" for name in ("link_quality", "neighbourhood"))

MUTANTS = (
    Mutant(
        RENDEZVOUS,
        "pause_s = min(self.config.backoff_s * 2.0 ** min(known.failures, 20), self.config.backoff_max_s)",
        "pause_s = 0.0",
        "a link that fails is tried without a pause",
    ),
    Mutant(
        RENDEZVOUS,
        "since_done = max(since_done, known.done_ns + round(self.config.exchange_timeout_s * 1e9))",
        "since_done = max(since_done, known.done_ns)",
        "robots exchange all the time: the timeout counts for nothing",
    ),
    Mutant(
        RENDEZVOUS,
        "(self.config.link_hysteresis if known.state == STRONG else 0.0)",
        "0.0",
        "a link at the threshold goes up and down",
    ),
    Mutant(
        RENDEZVOUS,
        "return sorted(ready, key=lambda peer: (self.peers[peer].turn, peer))[:free]",
        "return sorted(ready)[:free]",
        "in a crowd the last by name are never met",
    ),
    Mutant(
        RENDEZVOUS,
        "        self.peers.pop(peer, None)\n",
        "        self.peers.get(peer)\n",
        "a robot that lost everything has to wait for its turn",
    ),
    Mutant(
        RECEIVER,
        "or version <= store.version(robot):",
        "or version == store.version(robot):",
        "an older map replaces a newer one",
    ),
    Mutant(
        RECEIVER,
        "if is_saved(robot) and (robot in store.given or",
        "if is_saved(robot) and (",
        "the saved map that a robot was given is replaced by a teammate's of the same name",
    ),
    Mutant(
        STORE,
        "if self.seal is not None and (robot_id == self.own_id or robot_id in self.given):",
        "if self.seal is not None and robot_id == self.own_id:",
        "in a team with keys nobody gets a saved map",
    ),
    Mutant(
        RECEIVER,
        "            staged_maps.check_proof(message)\n",
        "",
        "a map with a forged signature is taken in until it is whole",
    ),
    Mutant(
        RECEIVER,
        "        if self._source.get(robot) is exchange:\n            del self._source[robot]",
        "        pass",
        "after a broken exchange a robot's map is never taken from anyone else",
    ),
    Mutant(
        EXCHANGES,
        "            if now_ns - exchange.progress_ns > config.stall_timeout_s * 1e9:",
        "            if False:",
        "an exchange with a robot that is gone never ends",
    ),
    Mutant(
        EXCHANGES,
        "                if self._context.own_id < peer:\n                    return",
        "                if False:\n                    return",
        "two robots that open at once break each other's exchange",
    ),
    Mutant(
        "comms/exchange/own_map_claims.py",
        "                context.store.outrank((epoch, revision))\n",
        "                pass\n",
        "a robot that lost its memory cannot give its map to those who knew it",
    ),
    Mutant(
        "comms/maps/manifests.py",
        "base_revision = held[1] if held[0] == target.epoch else 0",
        "base_revision = held[1]",
        "differences from another map are sent",
    ),
    Mutant(
        "comms/maps/manifests.py",
        "order = sorted(changed, key=lambda index: (-value_of(changed[index], old.get(index)), index))",
        "order = sorted(changed)",
        "on a weak link the news comes last",
    ),
    Mutant(
        "comms/exchange/in_flight.py",
        "is_stuck = now_ns - self.moved_ns >= patience_ns",
        "is_stuck = True",
        "a slow link is filled with what is on its way already",
    ),
    Mutant(
        "comms/exchange/map_sender.py",
        "if budget and exchange.served and exchange.served + len(chunk.packed) > budget:",
        "if False:",
        "a meeting takes more than its budget of bytes",
    ),
    Mutant(
        STAGED,
        "is_news = (manifest.epoch, manifest.target) > self._store.version(robot)",
        "is_news = True",
        "maps go back to an older version",
    ),
    Mutant(
        STAGED,
        'raise WireError("forged", f"a map of {robot!r} that is not what it signed")',
        "pass",
        "a third party can change a signed map",
    ),
    Mutant(
        STORE,
        "version[0] <= LAST_EPOCH",
        "version[0] <= 2**63",
        "one lie about an epoch leaves a robot no higher one",
    ),
    Mutant(
        STAGING,
        "if (tile := self.tiles.get((row, col))) is None or tile.revision != manifest.target - age",
        "if self.tiles.get((row, col)) is None",
        "a map is put together of tiles of two versions",
    ),
    Mutant(
        "comms/maps/snapshots.py",
        "tiles[index] = tile if is_gone else Tile(new.revision, unknown_tile())",
        "tiles[index] = tile",
        "what a robot took out of its map stays in its teammates' copies",
    ),
    Mutant(
        SEAL,
        "                parsed.verify_directly_issued_by(self.authority)\n",
        "",
        "any certificate is one of the team's",
    ),
    Mutant(
        "comms/exchange/own_map_claims.py",
        "        self._context.staged_maps.check_proof(message)\n",
        "",
        "a claim about a robot's own epoch counts without its signature",
    ),
    Mutant(
        "comms/exchange/own_map_claims.py",
        "            elif self._followed < MOST_UNPROVEN:",
        "            else:",
        "small claims force a robot into a new epoch at every meeting",
    ),
    Mutant(SEAL, "if name != robot and not is_saved(robot):", "if False:", "a member can sign another robot's map"),
    Mutant(
        LINKS,
        "raw = neighbour.window.quality(now_ns, neighbour.period_ns) * nlq",
        "raw = neighbour.window.quality(now_ns, neighbour.period_ns)",
        "a link that works one way only counts as good",
    ),
    Mutant(
        LINKS,
        "return received / max(min(self._expected + missed, self._size), MIN_EXPECTED)",
        "return received / max(min(self._expected, self._size), MIN_EXPECTED)",
        "a silent link stays as good as it was",
    ),
    Mutant(
        AROUND,
        "stamp_ns = now_ns - age_ms * 1_000_000",
        "stamp_ns = now_ns",
        "a teammate's old place is taken for where it is now",
    ),
    Mutant(
        AROUND,
        "            self.must_stop |= newcomer\n",
        "",
        "two processes with one robot's id go on side by side",
    ),
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
        "comms/node.py",
        "if sender is not None and sender != message.sender:",
        "if False:",
        "one robot speaks in another's name",
    ),
    Mutant(
        "comms/exchange/map_receiver.py",
        " or (source.peer, robot) in self._idle",
        "",
        "one manifest without chunks keeps a third robot's map from being taken elsewhere",
    ),
    Mutant(
        "comms/transport/inbox.py",
        "            self._beacons.clear()\n            self._bytes = 0\n",
        "            self._beacons.clear()\n",
        "after 64 MB a robot hears of no map any more",
    ),
    Mutant(
        AROUND,
        "if beacon.seq > known.last_seq:",
        "if True:",
        "beacons that overtake each other move a teammate back, and what it saw counts twice",
    ),
    Mutant(
        AROUND,
        "if not known.has_token and now_ns",
        "if now_ns",
        "a robot whose beacons are lost for seconds is gone though its maps get through",
    ),
    Mutant(
        AROUND,
        "if known is not None and known.boot in (0, message.boot):",
        "if known is not None:",
        "a robot that was restarted at once is taken for gone",
    ),
    Mutant(
        "comms/neighbours/beacon_clock.py",
        "        if self._was_calm and not calm:\n",
        "        if False:\n",
        "who comes into range is answered late",
    ),
    Mutant(
        AROUND,
        "        self.links.on_seen(peer, now_ns)\n",
        "",
        "a link whose quality was given once before the robot was there is never used",
    ),
    Mutant(
        LINKS,
        "neighbour.nlq_ns is not None and now_ns - neighbour.nlq_ns < stale_ns",
        "neighbour.nlq_ns is not None",
        "a link on which the other hears nothing any more counts as good",
    ),
    Mutant(
        AROUND,
        "            epoch = beacon.boot + beacon.epoch_offset\n",
        "            epoch = beacon.boot\n",
        "after a new map a teammate is neither masked nor looked for",
    ),
)

"""Mutants of comms/neighbours."""

from bench.mutants.mutant import Mutant

LINKS, AROUND = (f"comms/neighbours/{name}.py" for name in ("link_quality", "neighbourhood"))

MUTANTS = (
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
        "comms/neighbours/link_states.py",
        "        if quality <= 0.0 and not self._is_measured:\n",
        "        if False:\n",
        "an exchange over a link that the radio model has cut holds up others until it stalls",
    ),
    Mutant(
        AROUND,
        '                    self._context.out.drop("too many robots", peer)\n                    return\n',
        "                    pass\n",
        "tokens of made-up robots keep real ones from being seen",
    ),
    Mutant(
        AROUND,
        " and NAME.fullmatch(peer)",
        "",
        "a token with an odd name makes a robot's status unreadable",
    ),
    Mutant(
        "comms/neighbours/presence.py",
        "        if len(self._seen) > MOST_BOOTS:\n            self._seen.clear()\n",
        "",
        "beacons of ever new twins fill the memory",
    ),
    Mutant(
        LINKS,
        "(neighbour.nlq >= STEADY_NLQ and neighbour.window.is_steady(now_ns, neighbour.period_ns))",
        "neighbour.window.is_steady(now_ns, neighbour.period_ns)",
        "a link that loses one way only is watched at half the rate",
    ),
    Mutant(
        "comms/neighbours/link_states.py",
        "        self.monitor.forget(peer)\n",
        "",
        "beacons report the links to robots that are gone in place of those that are here",
    ),
    Mutant(
        "comms/neighbours/link_states.py",
        " if quality == quality else 0.0",
        "",
        "an exchange over a link of which the radio model gives no number holds up others until it stalls",
    ),
    Mutant(
        AROUND,
        "past_boots=past, has_token=known.has_token)",
        "past_boots=past)",
        "a robot that was restarted is gone when its beacons are lost for seconds",
    ),
    Mutant(
        "comms/neighbours/presence.py",
        "(own_uptime_ms, -own_boot) < (other.uptime_ms, -other.boot)",
        "(own_uptime_ms, own_boot) < (other.uptime_ms, other.boot)",
        "of two processes with one name the one with the lesser boot id, the older one, stops",
    ),
    Mutant(
        "comms/neighbours/link_quality.py",
        "elif self._seq - seq < self._expected and not is_late:",
        "elif not is_late:",
        "beacons from before a link was known make it better than it is",
    ),
    Mutant(
        "comms/neighbours/link_quality.py",
        "self._heard_ns = max(self._heard_ns, now_ns)",
        "self._heard_ns = now_ns",
        "a beacon handed on out of order makes a link silent",
    ),
    Mutant(
        "comms/neighbours/link_quality.py",
        "gap = min(seq - self._seq, self._size)",
        "gap = seq - self._seq",
        "a neighbour that skips numbers takes all memory",
    ),
    Mutant(
        "comms/neighbours/link_quality.py",
        "now_ns - self._heard_ns <= (1.0 + SILENCE_GRACE) * period_ns",
        "True",
        "beacons stay rare while a neighbour falls silent",
    ),
    Mutant(
        "comms/neighbours/link_quality.py",
        "max(beacon.period_ns, LEAST_PERIOD_NS)",
        "beacon.period_ns",
        "a neighbour that says it sends without pause ends the robot",
    ),
    Mutant(
        "comms/neighbours/link_quality.py",
        "self.config.link_smoothing * (raw - neighbour.quality)",
        "(raw - neighbour.quality)",
        "the quality of a link jumps with every beacon",
    ),
    Mutant(
        "comms/neighbours/link_quality.py",
        "            or neighbour.window.quality(now_ns, neighbour.period_ns) == 0.0\n",
        "",
        "a neighbour that is gone keeps beacons frequent for good",
    ),
    Mutant(
        "comms/neighbours/neighbourhood.py",
        "known.heard_ns = max(known.heard_ns, now_ns)",
        "pass",
        "a robot without a token is gone a while after its first beacon, though it is heard",
    ),
    Mutant(
        "comms/neighbours/neighbourhood.py",
        "if len(beacon.claimed) == len(beacon.claims) else [None] * len(beacon.claims)",
        "",
        "claims of programs that do not say of which map they are are lost",
    ),
    Mutant(
        "comms/neighbours/neighbourhood.py",
        "if peer != self._context.own_id and NAME.fullmatch(peer):",
        "if NAME.fullmatch(peer):",
        "a robot is a teammate of its own",
    ),
)

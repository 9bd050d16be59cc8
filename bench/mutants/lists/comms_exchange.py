"""Mutants of comms/exchange."""

from bench.mutants.mutant import Mutant

RENDEZVOUS, RECEIVER, EXCHANGES = (f"comms/exchange/{name}.py" for name in ("rendezvous", "map_receiver", "exchanges"))

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
        "            context.store.outrank(claim)\n",
        "            pass\n",
        "a robot that lost its memory cannot give its map to those who knew it",
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
        "comms/exchange/own_map_claims.py",
        "        self._context.staged_maps.check_proof(message)\n",
        "",
        "a claim about a robot's own epoch counts without its signature",
    ),
    Mutant(
        "comms/exchange/own_map_claims.py",
        "        elif self._followed < MOST_UNPROVEN:",
        "        else:",
        "small claims force a robot into a new epoch at every meeting",
    ),
    Mutant(
        "comms/exchange/map_receiver.py",
        " or (source.peer, robot) in self._idle",
        "",
        "one manifest without chunks keeps a third robot's map from being taken elsewhere",
    ),
    Mutant(
        EXCHANGES,
        "elif now_ns - exchange.useful_ns > PATIENCE * config.stall_timeout_s * 1e9:",
        "elif False:",
        "one robot that repeats itself holds an exchange open for ever",
    ),
    Mutant(
        RECEIVER,
        "peer in (source.peer, robot)",
        "source.peer == peer",
        "who sends an item of a robot's map now and then keeps it from being taken from the robot itself",
    ),
    Mutant(
        "comms/exchange/map_sender.py",
        "        if is_saved(robot) and not context.shares_saved_maps:",
        "        if False:",
        "saved maps that are not to be shared are given to who asks by name",
    ),
    Mutant(
        RENDEZVOUS,
        "                del self.peers[next(gone)]\n",
        "                next(gone)\n",
        "robots that come and go under new names fill the memory",
    ),
    Mutant(
        RENDEZVOUS,
        " if state.quality == 0.0 and not state.is_busy)",
        ")",
        "where many robots come and go, one in sight is forgotten",
    ),
    Mutant(
        "comms/exchange/own_map_claims.py",
        "self._followed += 1",
        "self._followed += sum(robot == context.own_id for robot, _, _ in digest.digest)",
        "one digest uses up all claims that a robot follows, and its teammates keep its old map",
    ),
    Mutant(
        RECEIVER,
        "        exchange.theirs.pop(robot, None)\n",
        "",
        "an exchange in which a forged map was refused never completes",
    ),
    Mutant(
        EXCHANGES,
        "            exchange.claim = None\n",
        "",
        "who claims to hold a robot's map and has no proof keeps the exchange from being completed",
    ),
    Mutant(
        RENDEZVOUS,
        "known.is_busy, known.failures, known.done_ns,",
        "known.is_busy, _, known.done_ns,",
        "a link that was bad for a while is left alone for a minute after every single failure since",
    ),
    Mutant(
        "comms/exchange/outgoing.py",
        "completed=isinstance(effect, ExchangeDone)",
        "completed=True",
        "exchanges that broke off are reported as saving whole maps",
    ),
    Mutant(
        "comms/exchange/exchange.py",
        "while len(self.offered) > MAX_OFFERED:",
        "while False:",
        "a peer that asks without end fills the memory with manifests",
    ),
    Mutant(
        "comms/exchange/exchange.py",
        "self.in_flight.pop(self.offered.popitem(last=False)[0], None)",
        "self.offered.popitem(last=False)",
        "what was sent of manifests that are forgotten is kept without end",
    ),
    Mutant(
        "comms/exchange/exchange.py",
        "<< min(self.retries, 2)",
        "<< self.retries",
        "one who is not answered hardly asks again",
    ),
    Mutant(
        "comms/exchange/past_exchanges.py",
        "while len(self._completed) > REMEMBERED:",
        "while False:",
        "every exchange that ever was is remembered",
    ),
    Mutant(
        "comms/exchange/rendezvous.py",
        "            known.strong_since_ns = now_ns\n",
        "            pass\n",
        "two robots that come into reach open an exchange at once, both of them",
    ),
    Mutant(
        "comms/exchange/rendezvous.py",
        "now_ns >= self._due_ns(peer) and is_worth(peer)",
        "now_ns >= self._due_ns(peer)",
        "exchanges are opened though there is nothing to exchange",
    ),
    Mutant(
        "comms/exchange/rendezvous.py",
        "max(since_done, known.done_ns + round(self.config.exchange_timeout_s * 1e9))",
        "known.done_ns + round(self.config.exchange_timeout_s * 1e9)",
        "two robots that meet again open an exchange at once, both of them",
    ),
    Mutant(
        "comms/exchange/rendezvous.py",
        "round(BUSY_PAUSE_NS * (1.0 + self.rng.random()))",
        "BUSY_PAUSE_NS",
        "robots that refused each other begin together again and again",
    ),
    Mutant(
        "comms/exchange/rendezvous.py",
        "(1.0 + 0.2 * self.rng.random())",
        "1.0",
        "exchanges that failed together are tried again together",
    ),
)

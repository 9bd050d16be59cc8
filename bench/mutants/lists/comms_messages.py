"""Mutants of what comms says and answers, message by message."""

from bench.mutants.mutant import Mutant

EXCHANGES, BEACONS = "comms/exchange/exchanges.py", "comms/neighbours/own_beacons.py"

MUTANTS = (
    Mutant(
        EXCHANGES,
        "        if (peer, message.xid) in self._past:\n",
        "        if False:\n",
        "an exchange that is over is begun again by a message that comes late",
    ),
    Mutant(
        EXCHANGES,
        "        running.progress_ns = now_ns\n        self._claims.hear(running",
        "        self._claims.hear(running",
        "a peer whose answers are lost is taken for silent though it asks again and again",
    ),
    Mutant(
        EXCHANGES,
        "reason = self._context.rendezvous.may_answer(peer)",
        "reason = None",
        "exchanges are begun with robots that are hardly heard",
    ),
    Mutant(
        EXCHANGES,
        "        if exchange.accepted:\n            self._fail(exchange, message.reason",
        "        if False:\n            self._fail(exchange, message.reason",
        "an exchange that the peer ends is counted as one that never began",
    ),
    Mutant(
        EXCHANGES,
        "                exchange.is_done &= not exchange.pulls  # it wants more again\n",
        "",
        "who is offered more after its Done never says that it has it all",
    ),
    Mutant(
        EXCHANGES,
        "                exchange.asked_ns = now_ns\n",
        "",
        "an open question is repeated at every tick",
    ),
    Mutant(
        EXCHANGES,
        "                exchange.retries += 1\n",
        "",
        "questions are repeated as often however long the peer is silent",
    ),
    Mutant(
        EXCHANGES,
        "        self._claims.ask(exchange)\n",
        "",
        "a proof of the own map that was lost is waited for until the exchange fails",
    ),
    Mutant(
        EXCHANGES,
        "self._past.add(exchange.peer, exchange.xid, completed=completed)",
        "self._past.add(exchange.peer, exchange.xid, completed=True)",
        "a peer is told that a failed exchange was completed",
    ),
    Mutant(
        EXCHANGES,
        "                if exchange.opened_by_me:\n                    self._claims",
        "                if True:\n                    self._claims",
        "an answer to nothing makes a robot offer its maps again",
    ),
    Mutant(
        EXCHANGES,
        "            self._context.rendezvous.refused(message.sender, now_ns)\n",
        "",
        "a robot that refused is asked again at once, without end",
    ),
    Mutant(
        BEACONS,
        'bodies_m[np.argsort(np.hypot(*bodies_m.T), kind="stable")[:MOST_SENT]]',
        "bodies_m[:MOST_SENT]",
        "teammates hear of far bodies in place of near ones",
    ),
    Mutant(
        BEACONS,
        "        self._bodies = []\n        if bodies_m",
        "        if bodies_m",
        "bodies seen from an earlier pose are told as if seen from this one",
    ),
    Mutant(
        BEACONS,
        "self._pose, self._bodies, self._claims, self._hints = None, [], {}, []",
        "self._pose, self._bodies, self._hints = None, [], []",
        "what was seen in a map that was given up is told of the new one",
    ),
    Mutant(
        BEACONS,
        "self._pose, self._bodies, self._claims, self._hints = None, [], {}, []",
        "self._pose, self._bodies, self._claims = None, [], {}",
        "hints from a map that was given up are told of the new one",
    ),
    Mutant(
        BEACONS,
        "max(now_ns - pose[3], 0) // 1_000_000)",
        "0)",
        "a pose of long ago is told as one of now",
    ),
    Mutant(
        BEACONS,
        "            del self._claims[place]\n",
        "            pass\n",
        "the first eight claims are told for ever, later ones never",
    ),
    Mutant(
        BEACONS,
        "self._bodies, self._hints = [], self._hints[MOST_SENT:]",
        "self._bodies, self._hints = [], []",
        "hints beyond eight are lost",
    ),
    Mutant(
        BEACONS,
        "self._bodies, self._hints = [], self._hints[MOST_SENT:]",
        "self._hints = self._hints[MOST_SENT:]",
        "one sighting counts again with every beacon",
    ),
    Mutant(
        BEACONS,
        "round(LLR_SCALE * llr), epoch % EPOCHS)",
        "round(LLR_SCALE * llr), epoch)",
        "a beacon cannot be sent where a claim's epoch is above its format's bound",
    ),
    Mutant(
        BEACONS,
        "round(LLR_SCALE * llr)",
        "round(llr)",
        "sightings count a tenth of what they say",
    ),
    Mutant(
        BEACONS,
        "context.store.own_epoch - context.boot,",
        "0,",
        "teammates take a new map for the one that was given up",
    ),
    Mutant(
        BEACONS,
        "MODES.index(context.mode)",
        "0",
        "a mapper or a base station is taken for a robot that takes and gives maps",
    ),
    Mutant(
        "comms/maps/staging.py",
        "        if manifest is self.manifest:\n            return\n",
        "",
        "parts of a map that arrived are thrown away whenever the same list comes again",
    ),
    Mutant(
        "comms/maps/staging.py",
        "in self.tiles.items() if index in places}",
        "in self.tiles.items()}",
        "tiles of an older list are taken for those of the new one",
    ),
    Mutant(
        "comms/maps/staging.py",
        "is None or block.revision != manifest.target - age",
        "is None",
        "keyframes of an older revision are taken for those asked for",
    ),
    Mutant(
        "comms/neighbours/neighbourhood.py",
        "        self._context.rendezvous.on_restart(beacon.sender)\n",
        "",
        "a teammate that restarted is not met again before the pause between exchanges is over",
    ),
    Mutant(
        "comms/neighbours/neighbourhood.py",
        '        self._abort(peer, f"{peer} {reason}", now_ns)\n',
        "",
        "an exchange with a robot that left goes on until it stalls",
    ),
    Mutant(
        "comms/neighbours/neighbourhood.py",
        '                raise WireError("too many robots")\n',
        "                pass\n",
        "beacons of made-up robots fill the memory",
    ),
    Mutant(
        "comms/neighbours/neighbourhood.py",
        "nlq = None if percent is None else percent / LEVELS",
        "nlq = 1.0 if percent is None else percent / LEVELS",
        "a robot that does not hear us is met over and over again in vain",
    ),
)

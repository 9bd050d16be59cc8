"""Mutants of the mapper as a whole."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "rbpf/mapper.py",
        "self.config = config or MapperConfig()",
        "self.config = config",
        "a mapper of the Python library cannot be made without settings",
    ),
    Mutant(
        "rbpf/mapper.py",
        "        if reading.is_contradicted and self._intake.put_back():",
        "        if False:",
        "old odometry with the first scan after a pause turns the map",
    ),
    Mutant(
        "rbpf/mapper.py",
        "dropped += 1\n        self._dead_reckoned = self._front.predictor.dead_reckoned(",
        "dropped += 1\n        self._dead_reckoned = (lambda _: se2.IDENTITY)(",
        "while scans are of no use the robot seems to stand still",
    ),
    Mutant(
        "rbpf/mapper.py",
        "return min(self._health, DOUBTFUL) if self._front.adrift > ADRIFT_MOST else self._health",
        "return self._health",
        "a robot whose motion is guessed is sure of itself",
    ),
    Mutant(
        "rbpf/mapper.py",
        "        is_key = self._history.keys == 0 or is_due or reading.is_unconfirmed",
        "        is_key = self._history.keys == 0 or is_due",
        "a contradicted robot is sure again before its next keyframe",
    ),
    Mutant(
        "rbpf/mapper.py",
        "        if step.is_carried or reading.is_unconfirmed:",
        "        if step.is_carried:",
        "a contradicted robot is sure until its keyframe is settled",
    ),
    Mutant(
        "rbpf/mapper.py",
        "            is_unconfirmed=reading.is_unconfirmed,\n        )",
        "        )",
        "a contradicted robot is sure again once its keyframe is settled",
    ),
    Mutant(
        "rbpf/mapper.py",
        "moved = predictor.dead_reckoned(reading.odom_motion, reading.elapsed_s)",
        "moved = predictor.dead_reckoned(reading.odom_motion)",
        "after a drive in a pause the robot is looked for where it stood, and wheels that leapt are believed",
    ),
    Mutant(
        "rbpf/mapper.py",
        "        self.stats.dropped += 1\n        self._dead_reckoned = self._front.predictor.dead_reckoned("
        "reading.odom_motion, reading.elapsed_s)\n",
        "        self.stats.dropped += 1\n"
        "        self._dead_reckoned = self._front.predictor.dead_reckoned(reading.odom_motion)\n",
        "in an open yard a robot is told to be back where it saw something last after five metres",
    ),
    Mutant(
        "rbpf/mapper.py",
        "replace(reading, reason=STALE, odom_motion=None)",
        "replace(reading, reason=STALE)",
        "for one scan a robot is told to be where wheels say that the map contradicts",
    ),
    Mutant(
        "rbpf/mapper.py",
        "min(self.health, LOST) if reading.reason == STALE else self.health",
        "self.health",
        "a robot whose map contradicts the wheels after a pause is sure of where it was before",
    ),
    Mutant(
        "rbpf/mapper.py",
        ", usual_fit=usual_fit)",
        ")",
        "what scans usually fit is not looked at after a pause",
    ),
    Mutant(
        "rbpf/mapper.py",
        "self._health, self._is_lost = min(self._health, LOST), True",
        "self._health = min(self._health, LOST)",
        "a robot that was carried does not know at once that it is lost",
    ),
    Mutant(
        "rbpf/mapper.py",
        'state["health"], state["is_lost"]',
        'state["health"], False',
        "a robot that is resumed forgets that it was lost",
    ),
)

"""Mutants of how a robot is found and tracked in a saved map."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "rbpf/localise/localiser.py",
        "                self.fit.contradict()\n",
        "                pass\n",
        "a tracked robot that drives on at a wrong place, where it seems to stand, is lost three times as late",
    ),
    Mutant(
        "rbpf/localise/wheels.py",
        "        if odom_motion is None or fits or not",
        "        if odom_motion is None or not",
        "a tracked robot whose wheels slip takes its right place for a wrong one",
    ),
    Mutant(
        "rbpf/localise/wheels.py",
        "    is_right = not odometry.is_dead and odometry.slip < DISBELIEVED\n",
        "    is_right = not odometry.is_dead\n",
        "wheels that never were right contradict the saved map",
    ),
    Mutant(
        "rbpf/localise/fixed_map.py",
        "        fill_walls(surfaces_m(grid, resolution_m), low, resolution_m, words)\n",
        "",
        "a saved map has no walls to match to",
    ),
    Mutant(
        "rbpf/localise/surfaces.py",
        "    if side < 0.0:\n        nx, ny = -nx, -ny\n",
        "",
        "walls of a saved map face away from the floor",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "if shown < SHOWN_LEAST or found.inliers < FIT_LEAST * shown:",
        "if False:",
        "tracking begins where the scan does not fit",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "        return reading if place is None else came_to(place, before, reading)",
        "        return reading",
        "a tracked robot whose wheels leapt in a pause is where they have it, whatever the saved map shows",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "        elif not can_move(step.T_before_base, max(reading.elapsed_s, 0.0)):",
        "        elif False:",
        "wheels that catch up with the robot after a pause carry a tracked pose off for minutes",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "step.is_carried or reading.is_carried",
        "step.is_carried",
        "a tracked robot whose wheels began again in a pause is lost for metres before it says so",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "found = self._found_near(reading.sample) if has_driven else",
        "found =",
        "a robot that drove on while its computer was down tracks on only where its wheels were right",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "self._since = self._front.predictor.dead_reckoned(moved)",
        "self._since = np.zeros(3)",
        "between two matches a tracked robot stands still",
    ),
    Mutant(
        "rbpf/localise/fit.py",
        "return self.value < LOST",
        "return False",
        "a tracked robot is never lost",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "            or odometry.slip > DISBELIEVED\n",
        "",
        "between two matches a tracked robot whose wheels slip is far from where it thinks it is",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "self._covariance + walls, motion)",
        "self._covariance, motion)",
        "a tracked pose claims to be better known than the map's own walls",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "            self._predict(step)\n",
        "",
        "in a corridor a tracked robot is as sure of its place at the end as at the beginning, and is never put right",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "share = min(self.config.evidence_beams / max(beams, 1), 1.0)",
        "share = 1.0",
        "a tracked robot is the surer of its place the more beams its laser has, however wrong it is",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "self.is_carried |= step.is_carried",
        "self.is_carried = step.is_carried",
        "a robot that was carried off in a saved map forgets it with the next scan",
    ),
    Mutant(
        "rbpf/localise/fit.py",
        "max(elapsed_s, 0.0)",
        "elapsed_s",
        "a stamp that runs backward makes a tracked robot lost, or never lost",
    ),
    Mutant(
        "rbpf/localise/localiser.py",
        "reach_rad = min(SIGMAS * math.sqrt(float(self._covariance[2, 2])), START_RAD)",
        "reach_rad = 0.0",
        "a robot that has become unsure of its heading in a saved map too is not searched for at other headings",
    ),
)

"""Mutants of rbpf."""

from bench.mutants.mutant import Mutant

FILTER = "rbpf/filter/particle_filter.py"

MUTANTS = (
    Mutant(FILTER, "self.log_weights += gains", "self.log_weights += 0.0 * gains", "weights are never updated"),
    Mutant(
        FILTER,
        "if self.neff < self.config.neff_fraction * self.count:",
        "if self.neff < 0.0 * self.count:",
        "particles are never resampled",
    ),
    Mutant(
        FILTER,
        "        self.store.resample(parents)\n        self.log_weights = np.zeros(parents.size)",
        "        self.log_weights = np.zeros(parents.size)",
        "maps do not follow their particles at resampling",
    ),
    Mutant(FILTER, "        self.best = heir", "        self.best = 0", "the heir is always particle 0"),
    Mutant(
        FILTER,
        "if self.log_weights[self.best] < -BEST_SWITCH_LOG_WEIGHT:",
        "if self.log_weights[self.best] < -1e9:",
        "the best particle never changes",
    ),
    Mutant(
        "rbpf/filter/ancestry.py",
        "apart = self.apart[parents]",
        "apart = self.apart[np.arange(parents.size) % self.count]",
        "trajectories do not follow their particles at resampling",
    ),
    Mutant(
        FILTER,
        "if turn != 0.0:",
        "if False:",
        "the compass of straight walls turns nothing",
    ),
    Mutant(
        "rbpf/filter/back_end.py",
        "closed = self._is_contradicted and self._relax()",
        "closed = False",
        "loops are never relaxed",
    ),
    Mutant(
        "rbpf/filter/back_end.py",
        "self._is_contradicted = self.config.close_loops and self.loops.look(trajectory, self.arrivals)",
        "self._is_contradicted = False",
        "loops are never looked for",
    ),
    Mutant(
        "rbpf/filter/back_end.py",
        "        self.filter.adopt(relaxed, self.loops.scans.points, self.loops.scans.origins)\n",
        "",
        "a closed loop bends no map",
    ),
    Mutant(
        "rbpf/filter/particles.py",
        "out.gains[i] = evidence_beams * fit.score",
        "out.gains[i] = -evidence_beams * fit.score",
        "the worst particles survive",
    ),
    Mutant(
        "rbpf/filter/particles.py",
        "fit = match(map_of(maps, i), points, predicted, predicted, info, sigma_m, ITERATIONS)",
        "fit = match(map_of(maps, 0), points, predicted, predicted, info, sigma_m, ITERATIONS)",
        "every particle is matched to the first one's map",
    ),
    Mutant(
        "rbpf/filter/resampling.py",
        "while cumulated <= target and i < last:",
        "while cumulated <= target:",
        "a sum of weights short of 1 runs past the last particle",
    ),
    Mutant(
        "rbpf/loops/loop_closer.py",
        "return bool(away_m <= AGREE_M and turned <= AGREE_RAD)",
        "return True",
        "one fit that nothing confirms bends the map",
    ),
    Mutant(
        "spatial/pose_graph.py",
        "        if _step(poses, edges, weight) < SETTLED_M:\n            break\n",
        "        _step(poses, edges, weight)\n        break\n",
        "relaxation stops after one step, and large loops stay open",
    ),
    Mutant(
        "spatial/hits/cells.py",
        "        hits, visits = (hits + 1) >> 1, (visits + 1) >> 1\n",
        "        hits, visits = HITS_CAP - 1, VISITS_CAP - 1\n",
        "walls that are seen often become half walls",
    ),
    Mutant(
        "spatial/hits/cells.py",
        "(hits_of(cell) >> 1) | ((visits >> 1) << 5)",
        "hits_of(cell) | ((visits >> 1) << 5)",
        "what went away never fades",
    ),
    Mutant(
        "spatial/hits/cells.py",
        "    return cell + 32\n",
        "    return cell\n",
        "beams clear nothing: teammates and people stay as walls",
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
        "rbpf/front_end/health.py",
        "self._fit += MEMORY * (fit",
        "self._fit += MEMORY * (1.0",
        "health stays full though nothing fits",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "elif self._moved(T_odom_base):",
        "elif False:",
        "a laser that is stuck draws its last scan along the way",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "    return beams_apart * abs(scan.angle_increment_rad) <= DENSE_RAD",
        "    return False",
        "garbage of a broken laser is drawn into the map",
    ),
    Mutant(
        "rbpf/loops/guesses.py",
        "self.log_weight += evidence_beams * (found.score - NEW)",
        "self.log_weight += evidence_beams * found.score",
        "a history is not weighed against the place being new",
    ),
    Mutant(
        "rbpf/loops/far_search.py",
        "most = min(self.most, BEGUN_MOST) if drift.is_unknown else 1",
        "most = 1",
        "of places that look alike only the best is followed",
    ),
    Mutant(
        "rbpf/loops/far_search.py",
        "if len(fits) < AGREE_LEAST or",
        "if len(fits) < 1 or",
        "a place is believed when one stretch fits",
    ),
    Mutant(
        "rbpf/loops/loop_closer.py",
        "poses = self._put_back(T_map_key) if self._is_far else T_map_key",
        "poses = T_map_key",
        "a robot that was carried is not put back where it was found before the trajectory is relaxed",
    ),
    Mutant(
        "rbpf/filter/back_end.py",
        "count = self.particles_most if self._health.is_adrift else 1",
        "count = 1",
        "there is one particle even where the way was not seen",
    ),
    Mutant(
        "rbpf/front_end/front_end.py",
        "        if self._is_elsewhere(points, view, guess, found, elapsed_s):\n",
        "        if False:\n",
        "a robot carried off with its laser on maps on as if nothing had happened",
    ),
    Mutant(
        "rbpf/front_end/elsewhere.py",
        "if is_long and self._log_odds >= SURE and self._fitted == 0:",
        "if is_long:",
        "a crowd before the laser is taken for another place",
    ),
    Mutant(
        "rbpf/front_end/visibility.py",
        "wrong += range_m < least - near_m or range_m > most + near_m",
        "wrong += range_m > most + near_m",
        "what hides a wall that was seen before contradicts nothing",
    ),
    Mutant(
        "rbpf/front_end/health.py",
        "most = LOST if self._is_carried else",
        "most = DOUBTFUL if self._is_carried else",
        "a robot that knows it was carried off publishes on",
    ),
)

"""Mutants of mutual_detection."""

from bench.mutants.mutant import Mutant

GHOSTS, MASK, TRACKER = (f"mutual_detection/{name}.py" for name in ("ghosts", "mask", "tracker"))
BODIES, SIGHT, ENCOUNTERS, MUTUAL = (
    f"mutual_detection/{name}.py" for name in ("bodies", "sight", "encounters", "mutual")
)

MUTANTS = (
    Mutant(MASK, "                out[i] = True\n", "                out[i] = False\n", "teammates are never masked"),
    Mutant(
        MASK,
        "centres_laser = se2.apply(se2.inverse(T_map_laser)",
        "centres_laser = se2.apply(T_map_laser",
        "teammates are masked where they are not",
    ),
    Mutant(
        MASK,
        "T_map_laser = se2.compose(T_map_base, scan.T_base_laser)",
        "T_map_laser = T_map_base",
        "teammates are masked beside where they are, for a laser that is not in the middle",
    ),
    Mutant(
        MASK,
        "if dx * dx + dy * dy <= radii_m[k] * radii_m[k]:",
        "if x * centres_m[k, 0] + y * centres_m[k, 1] > 0.0:",
        "every beam towards a teammate is dropped: the wall behind is never mapped",
    ),
    Mutant(
        TRACKER,
        "if innovation @ np.linalg.solve(spread, innovation) > self._config.gate_sigmas**2:",
        "if False:",
        "after a merge is corrected teammates are masked at a place between",
    ),
    Mutant(TRACKER, "if stamp_ns < track.stamp_ns:", "if False:", "a late report sets a teammate back"),
    Mutant(
        TRACKER,
        "            if abs(age_ns) > self._config.forget_after_s * NS:\n                continue\n",
        "",
        "a teammate that is gone is masked for ever",
    ),
    Mutant(
        TRACKER,
        "self._config.sigmas * sigma_m",
        "0.0 * sigma_m",
        "circles do not grow with a report's age: a turning teammate leaves ghosts",
    ),
    Mutant(
        TRACKER,
        "return (x + dt_s * vx, y + dt_s * vy), math.sqrt",
        "return (x, y), math.sqrt",
        "teammates are masked where they were",
    ),
    Mutant(
        TRACKER,
        "self._tracks.pop(robot_id, None)",
        "self._tracks.get(robot_id)",
        "a teammate that was unmerged is masked on",
    ),
    Mutant(
        TRACKER,
        "        track.filter.update(xy, R=noise)\n",
        "        track.filter.update(xy, R=np.eye(2) * 1e6)\n",
        "reports do not move a teammate",
    ),
    Mutant(
        GHOSTS,
        "            if all_near or marks[r, c] == INSIDE:",
        "            if marks[r, c] == INSIDE:",
        "specks beside a path stay in the map",
    ),
    Mutant(
        GHOSTS,
        "            if all_near or marks[r, c] == INSIDE:",
        "            if True:",
        "walls beside a path vanish",
    ),
    Mutant(
        GHOSTS,
        "            if length <= longest:",
        "            if True:",
        "walls between two places far apart are freed",
    ),
    Mutant(
        GHOSTS,
        "            if length <= longest:",
        "            if False:",
        "ghosts between two places of a path stay",
    ),
    Mutant(
        GHOSTS,
        "marks = np.where(away_m <= radius_m - INSIDE_M, INSIDE, NEAR)",
        "marks = np.where(away_m <= radius_m + AROUND_M, INSIDE, NEAR)",
        "walls that a robot brushes past are freed",
    ),
    Mutant(
        BODIES,
        "        not ranges_m[beside] <= limit for",
        "        True for",
        "bodies half covered by others are measured as whole ones",
    ),
    Mutant(
        BODIES,
        "    return is_wide & (width <= 2.0 * radius_m + WIDTH_M)",
        "    return is_wide | True",
        "legs of chairs and pillars are taken for robots",
    ),
    Mutant(
        SIGHT,
        "    if apart_m <= BODY_NEAR_M or not",
        "    if not",
        "a transform that is a little off is contradicted by the teammate beside its place",
    ),
    Mutant(
        SIGHT,
        "return NOT_THERE if (known > beyond[~np.isnan(ranges)]).all() else UNSEEN",
        "return NOT_THERE",
        "a teammate behind a wall is taken for one that is not there",
    ),
    Mutant(
        SIGHT,
        "    if known.size < 0.8 * ranges.size:\n        return UNSEEN\n",
        "",
        "dropped beams are taken for free sight",
    ),
    Mutant(
        ENCOUNTERS,
        ">= FOLLOWED_M:",
        ">= 0.0:",
        "a box that stands where a teammate should be supports the place again and again",
    ),
    Mutant(
        ENCOUNTERS,
        "NOT_THERE_LLR = -2.0",
        "NOT_THERE_LLR = -1.0",
        "a place where a robot looked in vain is believed until it looks there again",
    ),
    Mutant(
        ENCOUNTERS,
        "against = MOST_NOT_THERE_LLR if self.seen else self.most_unseen_llr",
        "against = -1e9",
        "a robot that is too low to be seen is contradicted to death",
    ),
    Mutant(
        MUTUAL,
        "    if mate_m < MATE_MOVED_M or own_m + mate_m < BOTH_MOVED_M:",
        "    if False:",
        "robots that stand still merge by a box that both see",
    ),
    Mutant(
        MUTUAL,
        "towards + np.pi - back)",
        "towards - back)",
        "robots that see each other are placed half a turn off",
    ),
    Mutant(
        "mutual_detection/ghosts.py",
        "            if row < -reach or col < -reach or row >= height + reach or col >= width + reach:",
        "            if row < 0 or col < 0 or row >= height or col >= width:",
        "a path point just outside a map frees no ghost inside",
    ),
    Mutant(
        "mutual_detection/ghosts.py",
        "if marks[r, c] == 0 and cells[r, c] >= occupied_min:",
        "if cells[r, c] >= occupied_min:",
        "ghosts in a body's way are looked for twice",
    ),
    Mutant(
        "mutual_detection/ghosts.py",
        "                        all_near = False\n",
        "",
        "the part of a wall beside a path vanishes, whatever it is part of",
    ),
    Mutant(
        "mutual_detection/ghosts.py",
        "step = 3 * (down + 1) + right + 1",
        "step = 3 * (right + 1) + down + 1",
        "ghosts beside a robot's way stay where it drove one way, and walls go",
    ),
    Mutant(
        "mutual_detection/sight.py",
        "not room_m < away_m <= scan.range_max_m - room_m",
        "not room_m < away_m",
        "a teammate beyond the laser's range is taken for one that is not there, and a right merge is refuted",
    ),
    Mutant(
        "mutual_detection/sight.py",
        "at = se2.apply(se2.inverse(scan.T_base_laser), place_m)",
        "at = place_m",
        "a laser that is turned on its robot looks for teammates in the wrong direction",
    ),
    Mutant(
        "mutual_detection/sight.py",
        "bearing - middle)",
        "bearing)",
        "a laser that looks to one side does not know which floor it sees",
    ),
    Mutant(
        "mutual_detection/bodies.py",
        "se2.apply(scan.T_base_laser, np.array(found).reshape(-1, 2))",
        "np.array(found).reshape(-1, 2)",
        "a laser that is not in the middle sees teammates beside where they are",
    ),
    Mutant(
        "mutual_detection/mutual.py",
        "lever = T_map_mate[:2] - middle",
        "lever = 0.0 * middle",
        "robots that meet far from where a map began are far too sure of where it lies",
    ),
    Mutant(
        "mutual_detection/mutual.py",
        "(best is None or fix.moments > best.moments)",
        "best is None",
        "of what bodies suggest the first is believed, though more moments agree on another",
    ),
    Mutant(
        "mutual_detection/tracker.py",
        "if track is None or abs(stamp_ns - track.stamp_ns) >",
        "if track is None or stamp_ns - track.stamp_ns >",
        "after the clock was set back teammates are mapped as walls for as long",
    ),
    Mutant(
        "mutual_detection/mutual.py",
        "lever = T_map_mate[:2] - middle",
        "lever = middle - T_map_mate[:2]",
        "robots that meet far from where a map began are sure of its origin, and unsure of where they met",
    ),
    Mutant(
        "mutual_detection/bodies.py",
        "    if before < 0 or after >= ranges_m.size:",
        "    if after >= ranges_m.size:",
        "a body at the first beam of a laser is measured though its edge is not seen, and stands elsewhere",
    ),
    Mutant(
        "mutual_detection/encounters.py",
        "min(SEEN_LLR * self.seen, MOST_SEEN_LLR)",
        "SEEN_LLR * self.seen",
        "a body that stands at a wrong place often enough outweighs everything",
    ),
    Mutant(
        "mutual_detection/mutual.py",
        " or own_m + mate_m < BOTH_MOVED_M",
        "",
        "somebody whom a robot at rest sees go by for a metre gives the place of a teammate's map",
    ),
    Mutant(
        "mutual_detection/mutual.py",
        "fix.moments > best.moments",
        "True",
        "a transform that few moments agree on takes the place of one that most do",
    ),
    Mutant(
        "mutual_detection/mutual.py",
        "    if len(agreeing) < MOMENTS_LEAST:",
        "    if len(agreeing) < 1:",
        "one chance sight of each other merges two maps",
    ),
    Mutant(
        "mutual_detection/mutual.py",
        "count = len(points) / 2.0",
        "count = len(points) * 1.0",
        "a transform by sight is said to be surer than it is",
    ),
    Mutant(
        "mutual_detection/ghosts.py",
        "        path = path[np.isfinite(path).all(axis=1)]\n",
        "",
        "a pose that is no number leaves ghosts in the map beside it",
    ),
)

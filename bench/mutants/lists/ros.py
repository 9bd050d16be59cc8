"""Mutants of the ROS 2 node's plain parts."""

from bench.mutants.mutant import Mutant

FRAMES, INLET, LASERS, OUTLOOK, PARAMETERS, SESSIONS = (
    f"sim_driver/ros/{name}.py" for name in ("frames", "inlet", "lasers", "outlook", "parameters", "sessions")
)

MUTANTS = (
    Mutant(FRAMES, "return se2.compose(before, share *", "return se2.compose(before, 0.0 *", "scans get old odometry"),
    Mutant(
        FRAMES,
        "if self._stamps_ns and stamp_ns < self._stamps_ns[-1] - BACKWARD_NS:",
        "if False:",
        "after a bag has looped there is no odometry",
    ),
    Mutant(
        FRAMES,
        "        if len(self._stamps_ns) > 2 * KEPT:",
        "        if False:",
        "the node's memory grows with odometry",
    ),
    Mutant(
        FRAMES,
        "pose = se2.compose(step, pose)",
        "pose = se2.compose(pose, step)",
        "odometry through a footprint is wrong",
    ),
    Mutant(
        INLET,
        "if 0 < beyond_ns < ODOMETRY_ALIVE_NS and waited_s < ODOMETRY_WAIT_S:",
        "if False:",
        "scans get the odometry before them",
    ),
    Mutant(
        INLET,
        "        return pose if was in (None, source) else None",
        "        return pose",
        "a change of the odometry's source is driven as a step",
    ),
    Mutant(
        INLET,
        'self._source = "before the jump"',
        "pass",
        "a bag that loops is driven back in one step",
    ),
    Mutant(
        INLET,
        "        if mounted is None and waited_s < MOUNTING_WAIT_S:",
        "        if False:",
        "the first scans are mapped as if the laser sat on the centre",
    ),
    Mutant(
        INLET,
        "first_s = self._awaited_s.setdefault(arrival.laser.frame, arrival.arrived_s)",
        "first_s = arrival.arrived_s",
        "with a wrong frame every scan is two seconds late",
    ),
    Mutant(
        "sim_driver/ros/complaints.py", "is_first = self.counts[kind] == 1", "is_first = True", "warnings flood the log"
    ),
    Mutant(
        LASERS,
        "            return None\n        fresh",
        "            pass\n        fresh",
        "every laser makes a sweep, and the mapper twice the work",
    ),
    Mutant(
        LASERS,
        "points = se2.apply(T_now_base, scan.points_base())",
        "points = scan.points_base()",
        "what another laser saw is drawn where the robot was",
    ),
    Mutant(
        OUTLOOK,
        "self._T_map_odom = se2.compose(T_map_base, se2.inverse(sensed.T_odom_base))",
        "self._T_map_odom = se2.compose(se2.inverse(sensed.T_odom_base), T_map_base)",
        "map -> odom puts the robot elsewhere",
    ),
    Mutant(
        OUTLOOK,
        "        if known is not None and known is not self._own:",
        "        if known is not None and self._own is None:",
        "the map on its topic is the first one for ever",
    ),
    Mutant(
        PARAMETERS,
        "        if dot and value is not None and value != one.default:",
        "        if dot and value is not None:",
        "the file of settings is without effect",
    ),
    Mutant(
        SESSIONS,
        "            self._checkpoint.replace(self.new_path())",
        "            pass",
        "a reset loses the map",
    ),
    Mutant(
        "agent/shells/sensors.py",
        "now_ns - self._waiting[0].t_ns >= self._patience_ns",
        "now_ns >= 0",
        "a node loses scans while its mapper is busy for a moment",
    ),
    Mutant(
        "sim_driver/ros/inlet.py",
        "            self._hand_on(self._held.popleft(), now_s, is_last_call=True)",
        "            self._held.popleft()",
        "scans that wait for a mounting are lost",
    ),
    Mutant(
        "sim_driver/ros/inlet.py",
        "        alive = [one for one in known if abs(one[1][1]) < ODOMETRY_ALIVE_NS]\n",
        "        alive = []\n",
        "tf that died hides odometry that lives",
    ),
    Mutant(
        "sim_driver/ros/inlet.py",
        "        if abs(beyond_ns) > ODOMETRY_AGE_NS:",
        "        if False:",
        "odometry of minutes ago is used",
    ),
    Mutant(
        "sim_driver/ros/inlet.py",
        "            self.pump(np.inf)\n",
        "",
        "scans of before a jump are mapped after it",
    ),
    Mutant(
        "sim_driver/ros/lasers.py",
        "        nothing_rad = (T_now_base[2] + scan.T_base_laser[2]) + scan.angles_rad[np.isinf(scan.ranges_m)]",
        "        nothing_rad = scan.T_base_laser[2] + scan.angles_rad[np.isinf(scan.ranges_m)]",
        "free beams of another laser point where the robot looked before",
    ),
    Mutant(
        "sim_driver/ros/lasers.py",
        "        fresh = [one for one in self._newest.values() if abs(one[0].stamp_ns - scan.stamp_ns) <= FRESH_NS]",
        "        fresh = list(self._newest.values())",
        "a laser that died is seen for ever",
    ),
    Mutant(
        "sim_driver/ros/outlook.py",
        "            self._covariance = se2.turned_covariance(agent.covariance, T_frame_map[2])",
        "            self._covariance = agent.covariance",
        "the pose's covariance points the wrong way in a saved map's frame",
    ),
    Mutant(
        "sim_driver/ros/outlook.py",
        "            if team_map is not self._drawn:",
        "            if self._drawn is None:",
        "the team map on its topic is the first one for ever",
    ),
    Mutant(
        "sim_driver/ros/outlook.py",
        "        self._next_look_ns = self._next_map_ns = 0\n\n    # -- the thread of the agent",
        "\n    # -- the thread of the agent",
        "after a reset the node shows no map for a while",
    ),
    Mutant(
        "sim_driver/ros/outlook.py",
        "                answer.set_exception(error)",
        "                raise",
        "a service that fails ends the node",
    ),
    Mutant(
        "sim_driver/ros/parameters.py",
        'if name not in known and name.partition(".")[0] not in OF_ROS:',
        "if False:",
        "a parameter that does not exist is passed over",
    ),
    Mutant(
        INLET,
        "if before_s is None or now_s - before_s >= JUMP_PAUSE_S:",
        "if True:",
        "two drivers with different clocks on one topic write a session's file with every scan",
    ),
    Mutant(
        INLET,
        "if before_s is None or now_s - before_s >= JUMP_PAUSE_S:",
        "if before_s is None:",
        "the second bag that is played goes into the session of the first",
    ),
    Mutant(
        FRAMES,
        "np.linalg.inv(self._matrix(common, base)) @ self._matrix(common, frame)",
        "self._matrix(common, frame)",
        "a laser beside the base frame is mounted as if the frame above were the base",
    ),
    Mutant(
        FRAMES,
        "if common is None or any(one in self._moving for one in above[: above.index(common)]):",
        "if common != base:",
        "the mounting of a laser beside the base frame is not found",
    ),
    Mutant(
        FRAMES,
        "any(one in self._moving for one in above[: above.index(common)])",
        "False",
        "a laser that stands in the world is mounted on the robot where it happened to be",
    ),
    Mutant(
        FRAMES,
        "if not _is_possible(pose):",
        "if not np.isfinite(pose).all():",
        "one absurd message of odometry makes the pose not finite",
    ),
    Mutant(
        "sim_driver/ros/sessions.py",
        "key=lambda path: (path.stat().st_mtime_ns, path.name)",
        "key=lambda path: path.name",
        "load_session brings back another session than the last one",
    ),
    Mutant(
        "sim_driver/ros/frames.py",
        "        del self._moving[oldest], self._parents[oldest], self._fixed[oldest]",
        "        return",
        "a tracker that names a new frame for each person fills the node's memory",
    ),
    Mutant(
        "sim_driver/ros/frames.py",
        "next(name for name in self._moving if name not in above)",
        "next(iter(self._moving))",
        "where many frames move the robot's slow odometry is forgotten between two of its transforms",
    ),
    Mutant(
        "sim_driver/ros/frames.py",
        "self._moving.pop(child, None) or RecentMotion()",
        "self._moving.get(child) or RecentMotion()",
        "where many frames move one that is heard all the time is forgotten",
    ),
    Mutant(
        "sim_driver/ros/frames.py",
        "parent == child or not _is_possible(matrix):",
        "parent == child:",
        "tf that is not finite counts as odometry that comes, and nobody is told",
    ),
    Mutant(
        "sim_driver/ros/inlet.py",
        'self._complaints.once("bad tf",',
        "str(",
        "transforms that make no sense are dropped without a word",
    ),
    Mutant(
        "sim_driver/ros/inlet.py",
        "        self.arrivals.odometry += 1\n        self.arrivals.odometry_s = now_s\n        self.pump(now_s)\n",
        "        self.pump(now_s)\n",
        "odometry on its topic is said to be missing though it comes",
    ),
    Mutant(
        "sim_driver/ros/inlet.py",
        "before_s, self._jumped_s = self._jumped_s, now_s",
        "before_s, self._jumped_s = self._jumped_s, self._jumped_s or now_s",
        "two drivers with different clocks on one topic write a session's file every half minute",
    ),
    Mutant(
        "sim_driver/ros/jumps.py",
        "self._ask(self._save).add_done_callback(lambda saved: self._report(saved, back_s))",
        "self._ask(self._save)",
        "nobody is told that the map of before a jump could not be saved",
    ),
    Mutant(
        "sim_driver/ros/jumps.py",
        "if self._asked == SAVED_MOST:",
        "if False:",
        "a bag that loops for ever fills the disk with sessions",
    ),
)

"""Mutants of sim_driver/feeds."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "sim_driver/feeds/tf_tree.py",
        "            mount = self._mounts[name] @ mount",
        "            mount = mount @ self._mounts[name]",
        "a laser on a turned mount is placed wrong",
    ),
    Mutant(
        "sim_driver/feeds/tf_tree.py",
        "        step[2] = wrap(step[2])\n",
        "",
        "odometry between two stamps spins round at half a turn",
    ),
    Mutant(
        "sim_driver/feeds/carmen.py",
        "range_max_m=min(line.range_max_m, longest_m),",
        "range_max_m=line.range_max_m,",
        "the longest readings of a log, which hit nothing, become walls",
    ),
    Mutant(
        "sim_driver/feeds/inspect.py",
        "np.abs(se2.wrap(np.diff(poses[:, 2]))).sum()",
        "np.abs(np.diff(poses[:, 2])).sum()",
        "mrslam inspect says that a robot which drove west turned many times round",
    ),
    Mutant(
        "sim_driver/feeds/inspect.py",
        "max(LONG_GAP_S, 5 * typical)",
        "LONG_GAP_S",
        "mrslam inspect finds a long gap after every scan of a slow laser",
    ),
    Mutant(
        "sim_driver/feeds/carmen_lines.py",
        "np.isfinite(increment) and fits and",
        "np.isfinite(increment) and",
        "one damaged line of a log, with beams of many turns, costs the log",
    ),
    Mutant(
        "sim_driver/feeds/carmen_lines.py",
        "FARTHEST_M = 1.0e7",
        'FARTHEST_M = float("inf")',
        "one damaged pose of a log costs the log",
    ),
    Mutant(
        "sim_driver/feeds/bag_writer.py",
        "        if not 0 <= stamp_ns // NS < 2**31:\n",
        "        if False:\n",
        "a time that no ROS2 message holds is a traceback",
    ),
    Mutant(
        "sim_driver/feeds/carmen.py",
        "np.median(T_base_laser, axis=0)",
        "T_base_laser[0]",
        "a laser is mounted as the first line of a log rounds it",
    ),
    Mutant(
        "sim_driver/feeds/tf_tree.py",
        'order = np.argsort(np.array(self._stamps_ns, dtype=np.int64), kind="stable")',
        "order = np.arange(len(self._stamps_ns))",
        "odometry recorded out of order gives scans the wrong pose",
    ),
    Mutant(
        "sim_driver/feeds/tf_tree.py",
        "if not np.isfinite(mount).all() or parent == child:",
        "if not np.isfinite(mount).all():",
        "a frame that is mounted on itself is the robot",
    ),
    Mutant(
        "sim_driver/feeds/tf_tree.py",
        'for word in ("odom", "map", "world"))',
        'for word in ("odom",))',
        "the laser is mounted on the map",
    ),
    Mutant(
        "sim_driver/feeds/tf_tree.py",
        "    if n < 1e-12:\n",
        "    if False:\n",
        "a driver that leaves its orientation empty gives no poses",
    ),
    Mutant(
        "sim_driver/feeds/tf_tree.py",
        "        if np.isfinite(pose).all():",
        "        if True:",
        "one odometry message that is not finite spoils those beside it",
    ),
    Mutant(
        "sim_driver/feeds/rosbag.py",
        "max(sorted(by_topic), key=lambda name: len(by_topic[name]))",
        "sorted(by_topic)[0]",
        "of two lasers the first by name is used, however rarely it speaks",
    ),
    Mutant(
        "sim_driver/feeds/rosbag.py",
        "told = {topic: motion for topic, motion in contents.odometry.items() if len(motion)}",
        "told = dict(contents.odometry)",
        "an odometry topic that says nothing hides TF's",
    ),
    Mutant(
        "sim_driver/feeds/rosbag.py",
        "if base is None or above is None or not tree.moves(base):",
        "if base is None or above is None:",
        "a robot whose odometry is missing is said to stand still",
    ),
    Mutant(
        "sim_driver/feeds/bag_contents.py",
        "                    if broken > BROKEN_AFTER:",
        "                    if False:",
        "of a recording that cannot be decoded hours are read",
    ),
    Mutant(
        "sim_driver/feeds/bag_contents.py",
        "min(1.01 * self.scan_time_s, SLOWEST_SWEEP_S)",
        "min(self.scan_time_s, SLOWEST_SWEEP_S)",
        "times between beams of lasers that see all around are not believed",
    ),
    Mutant(
        "sim_driver/feeds/bag_contents.py",
        "min(1.01 * self.scan_time_s, SLOWEST_SWEEP_S)",
        "1.01 * self.scan_time_s",
        "sweeps that take minutes are believed",
    ),
    Mutant(
        "sim_driver/feeds/bag_writer.py",
        "scan.angle_increment_rad * (scan.ranges_m.size - 1)",
        "scan.angle_increment_rad * scan.ranges_m.size",
        "recordings of runs have scans with a beam more than they say",
    ),
)

"""Mutants of which scans and which odometry the mapper takes, and which it refuses."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "    if T_odom_before is None or T_odom_base is None:",
        "    if T_odom_before is None:",
        "a robot whose odometry fails for a scan while it stands ends with a traceback",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        ").max() > STUCK)",
        ").max() > 2.0 * STUCK)",
        "a laser that is stuck counts as one that stands for twice the way",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "elif before_ns == scan.stamp_ns:",
        "elif False:",
        "a scan that a driver sends twice counts twice",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        " or knows():",
        ":",
        "scans of clutter are refused though they fit the map",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        " or (before_m is not None and _resembles(scan, before_m))",
        "",
        "scans of clutter are refused though the robot saw the same just before",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "None if same else before_m)",
        "before_m)",
        "rubbish that is sent twice is used",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "return [self._stamp_ns, self._ranges_m, self._used_m, self._T_odom_used]",
        "return [self._stamp_ns, self._ranges_m, self._ranges_m[:0], self._T_odom_used]",
        "a laser that is stuck since before a restart is believed",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "max(ON_SURFACES * points.shape[0], ON_SURFACES_LEAST)",
        "ON_SURFACES_LEAST",
        "rubbish of which a few points lie in line is used",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "        return now_m.tobytes() == before_m.tobytes()",
        "        return False",
        "a stuck laser most of whose beams are dropped is believed",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "np.count_nonzero(alike) >= max(ALIKE_LEAST, ALIKE * alike.size)",
        "np.count_nonzero(alike) >= ALIKE_LEAST",
        "rubbish of a laser of many beams resembles all that was seen before",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "for k in range(beams + 1)",
        "for k in range(1)",
        "a robot that turns amid clutter has its scans refused",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        "        if self._has_put_back:\n",
        "        if False:\n",
        "after a pause a robot that was carried leaves out all scans",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        "        self._stamp_ns, self._T_odom_base = self._before\n",
        "",
        "the motion to a scan that is left out after a pause is lost",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        "        self._has_put_back = False\n        if self._gathering",
        "        if self._gathering",
        "only after the first pause of its life a robot leaves a scan out",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        '        self._has_put_back = state["has_put_back"]\n',
        "",
        "a robot that resumes leaves a second scan out after a pause",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "        if was_used and _moved(self._T_odom_used, T_odom_base):",
        "        if False:",
        "a laser that is stuck draws its last scan along the way",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "        if reason is None and not was_used:",
        "        if not was_used:",
        "a laser that sends its last scan again after an outage takes the robot back to where that was taken",
    ),
    Mutant(
        "rbpf/front_end/scan_gate.py",
        "    return beams_apart * abs(scan.angle_increment_rad) <= DENSE_RAD",
        "    return False",
        "garbage of a broken laser is drawn into the map",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        "return self.scan.ranges_m.size - self.returns",
        "return self.scan.ranges_m.size - self.points.shape[0]",
        "fewer beams than none are dropped",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        "now if now.shape == (3,) and np.isfinite(now).all() else None",
        "now if now.shape == (3,) else None",
        "odometry that is no number is taken for the motion to the next scan",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        "        if self._was_refused:\n            self._leave_out_leap()\n",
        "",
        "odometry that leaps from a refused scan to the next costs what it told at the others",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        "        if reason is not None and not self._was_refused:\n            self._leave_out_leap()\n",
        "",
        "odometry that leaps at the first scan that is refused costs what it tells at the others",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        "        if self._was_refused:\n            self._leave_out_leap()\n        odom_motion",
        "        self._leave_out_leap()\n        odom_motion",
        "a leap of odometry between two scans that are used is no longer left to the match",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        '            "steps": self._steps.state(),\n',
        '            "steps": Steps().state(),\n',
        "a robot that is resumed among refused scans takes a leap of odometry for motion",
    ),
    Mutant(
        "rbpf/front_end/intake.py",
        '        self._was_refused = state["was_refused"]\n',
        "",
        "a robot that is resumed after a refused scan takes a leap of odometry for motion",
    ),
    Mutant(
        "rbpf/front_end/leaps.py",
        "self._velocity * min(max(elapsed_s, 0.0), STEADY_S)",
        "0.0 * self._velocity",
        "while odometry leaps a robot stands",
    ),
    Mutant(
        "rbpf/front_end/leaps.py",
        "        if not can_move(step, elapsed_s):\n",
        "        if True:\n",
        "every step of odometry at a refused scan is a leap",
    ),
    Mutant(
        "rbpf/front_end/leaps.py",
        "        elif elapsed_s > 0.0:\n            self._velocity = step / elapsed_s\n",
        "",
        "what a robot did before odometry leapt is not known",
    ),
)

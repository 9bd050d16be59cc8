"""Mutants of the shells that run an agent: its messages, its files, its saves, its particles."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "agent/shells/outputs.py",
        "in_frame(team.grid, agent.T_frame_team)",
        "team.grid",
        "the team map is not written in the frame that was chosen",
    ),
    Mutant(
        "agent/shells/runner.py",
        "        if isinstance(outcome, Rejection) and job.follows:\n",
        "        if False:\n",
        "a merged map that was corrected is not found again nearby",
    ),
    Mutant(
        "agent/shells/runner.py",
        "        return in_whole(job, outcome)",
        "        return outcome",
        "nobody asks whether a saved map shows the whole building",
    ),
    Mutant(
        "agent/shells/runner.py",
        "            outcome = align_bent(maps[0], maps[1], outcome, method, config, self._matcher)",
        "            return align_bent(maps[0], maps[1], outcome, method, config, self._matcher)",
        "nobody asks whether a saved map that is bent to fit shows the whole building",
    ),
    Mutant(
        "agent/shells/keeper.py",
        "            checkpoint.write(checkpoint.freeze(agent), self.path)\n        except",
        "            pass\n        except",
        "a robot that was stopped in good order has forgotten its last seconds",
    ),
    Mutant(
        "agent/shells/runner.py",
        "seed=settings.seed + job.attempt, strain",
        "seed=settings.seed, strain",
        "with a random method a chance fit confirms itself",
    ),
    Mutant(
        "agent/shells/overload.py",
        "is_late = age_s > LATE_S or lost > self._lost",
        "is_late = age_s > LATE_S",
        "a robot with a fast laser loses scans and keeps all particles",
    ),
    Mutant(
        "agent/shells/outputs.py",
        "    shutil.rmtree(folder / TEAM_FOLDER, ignore_errors=True)\n",
        "",
        "trajectories of robots of an earlier run stay in the folder and are taken for this one's",
    ),
    Mutant(
        "agent/shells/saved_files.py",
        "if file.name == MAP_FILE and is_file(beside):",
        "if is_file(beside):",
        "a team map that is given as a saved map is bent by the keyframes of one robot's own map",
    ),
    Mutant(
        "agent/shells/process.py",
        "while not (stop() or self.runner.agent.node.must_stop):",
        "while not stop():",
        "two processes with one robot's name go on side by side, and their maps replace each other",
    ),
    Mutant(
        "agent/shells/process.py",
        "        if not isinstance(self.clock, WallClock):\n            return\n",
        "",
        "robots of a mission whose time waits for them give particles up on a busy machine, and no run is like another",
    ),
    Mutant(
        "agent/shells/process.py",
        "if self._mapper is not self.runner.agent.mapper:",
        "if False:",
        "a robot that is late begins a new map with all particles and stays late",
    ),
    Mutant(
        "agent/shells/process.py",
        "        self.runner.keep(time.monotonic_ns(), now_ns)\n",
        "",
        "a robot's process that dies has lost everything",
    ),
    Mutant(
        "agent/shells/process.py",
        "            self.runner.perform([status_of(self.runner.agent, now_ns)])\n",
        "",
        "nobody who watches sees anything of a robot",
    ),
    Mutant(
        "agent/shells/process.py",
        "            self.runner.close(self.clock.now_ns())\n",
        "            pass\n",
        "a robot that was stopped leaves no files",
    ),
    Mutant(
        "agent/shells/runner.py",
        "                self.perform(self.agent.set_link_quality(peer, quality, now_ns))\n",
        "                pass\n",
        "robots with a radio model never meet",
    ),
    Mutant(
        "agent/shells/runner.py",
        "                    self.perform(self.agent.on_peer_left(item.peer, now_ns()))\n",
        "                    pass\n",
        "a teammate whose process is gone is waited for until it has been silent",
    ),
    Mutant(
        "agent/shells/virtual.py",
        "        self.runner.keep(now_ns, now_ns)\n",
        "",
        "robots of simulated missions that crash come back with nothing",
    ),
    Mutant(
        "agent/shells/keeper.py",
        "if clock_ns >= self._due_ns and self._writing is None:",
        "if clock_ns >= self._due_ns:",
        "on a slow disk checkpoints pile up in memory",
    ),
    Mutant(
        "agent/shells/keeper.py",
        "self._executor.shutdown(wait=True)",
        "self._executor.shutdown(wait=False)",
        "a robot that was stopped in good order is set back by a save that was still being written",
    ),
    Mutant(
        "agent/shells/sensors.py",
        "share * se2.between(T0, T1)",
        "(1.0 - share) * se2.between(T0, T1)",
        "a scan of a driver gets the odometry of another moment",
    ),
    Mutant(
        "agent/shells/sensors.py",
        "sorted(self._odometry, key=lambda one: one[0])",
        "list(self._odometry)",
        "odometry that a network delivers late gives scans the pose of another moment",
    ),
)

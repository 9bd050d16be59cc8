"""Mutants of sim_driver/run."""

from bench.mutants.mutant import Mutant


MUTANTS = (
    Mutant(
        "sim_driver/run/known_area.py",
        'self.area_m2 = event.fields["team_m2"]',
        'self.area_m2 = event.fields["own_m2"]',
        "progress shows the own area beside names of those merged",
    ),
    Mutant(
        "sim_driver/run/run_virtual.py",
        " + BOOTS_APART * start.life",
        "",
        "after a robot lost all it knew teammates keep its old map and take the new one for older",
    ),
    Mutant(
        "sim_driver/run/run_virtual.py",
        "            port.take()\n",
        "            pass\n",
        "a robot that comes back maps what its laser saw while its computer was down",
    ),
    Mutant(
        "sim_driver/run/run_virtual.py",
        "            body.skip_to(start.now_ns)\n",
        "",
        "a recorded robot that comes back plays its log from the beginning, all at once",
    ),
    Mutant(
        "sim_driver/run/run_virtual.py",
        "while self._waiting and self._waiting[0].at_s * 1e9 <= now_ns:",
        "while self._waiting:",
        "robots are kidnapped at the mission's begin",
    ),
    Mutant(
        "sim_driver/run/robot_process.py",
        "    trace = read_trace(mission)\n    pipe.send(",
        "    pipe.send(Ready(0.0))\n    trace = read_trace(mission)\n    pipe.send(",
        "a mission with a broken trace goes on without its robots",
    ),
    Mutant(
        "sim_driver/run/children.py",
        "                    self.failure = said.reason\n",
        "                    pass\n",
        "a robot that cannot come up again is started a hundred times",
    ),
    Mutant(
        "sim_driver/run/run_process.py",
        " and not child.failure",
        "",
        "a robot that said it cannot go on is started again and again",
    ),
    Mutant(
        "sim_driver/run/run_process.py",
        "            child.read_status()  # its last words may have come since\n",
        "",
        "the last words of a robot that gave up are not heard, and it is started again",
    ),
    Mutant(
        "sim_driver/run/run_process.py",
        "where it was\n            child.scans_lost += len(sensed)\n",
        "where it was\n",
        "scans of a robot that is dead count as taken",
    ),
    Mutant(
        "sim_driver/run/run_process.py",
        "{signal.Signals(-code).name if -code in known else f'signal {-code}'}",
        "{signal.Signals(-code).name}",
        "a robot killed by a real-time signal takes the mission with it",
    ),
    Mutant(
        "sim_driver/run/run_virtual.py",
        "        if robot.id not in self._watchers:",
        "        if True:",
        "the recording of a robot that came back lacks its first life",
    ),
    Mutant(
        "sim_driver/run/gather.py",
        'tables = {**first.settings, "mission": {"name": first.team, "shell": "agents"}, "robots": robots}',
        'tables = {"mission": {"name": first.team, "shell": "agents"}, "robots": robots, **first.settings}',
        "what an agent.json says of robots replaces those that were gathered",
    ),
    Mutant(
        "sim_driver/run/shaping.py",
        "math.sqrt(quality)",
        "quality",
        "a rehearsed radio loses far more beacons than the real one",
    ),
    Mutant(
        "sim_driver/run/shaping.py",
        "if quality < CUT_BELOW:",
        "if quality < 0.0:",
        "links that are dead in a rehearsal bring maps",
    ),
    Mutant(
        "sim_driver/run/team.py",
        "        if hint is not None and len(found) > 1:\n            raise",
        "        if False:\n            raise",
        "a place that is one map's is looked for in all maps of a run",
    ),
    Mutant(
        "sim_driver/run/team.py",
        "loop=robot.patrol)",
        "loop=False)",
        "a patrol ends after one round",
    ),
    Mutant(
        "sim_driver/run/team.py",
        "se2.between(start, T_world_base)",
        "T_world_base",
        "a robot that follows a trajectory drives from its start as if that were the world's origin",
    ),
    Mutant(
        "sim_driver/run/team.py",
        "se2.apply(se2.inverse(start), np.array(robot.waypoints, dtype=np.float64))",
        "np.array(robot.waypoints, dtype=np.float64)",
        "a robot drives to waypoints of the world as if they were of its own map",
    ),
    Mutant(
        "sim_driver/run/team.py",
        "            if not is_simulated(mission, robot):\n                return None\n",
        "",
        "a robot of a log hears nobody when a simulation is played again",
    ),
    Mutant(
        "sim_driver/run/team.py",
        "            others = [other for other in others if is_simulated(mission, other)]\n",
        "",
        "links to robots of logs are cut when a simulation is played again",
    ),
    Mutant(
        "sim_driver/run/earlier.py",
        "replay.resolve() == out.resolve()",
        "replay == out",
        "a drive that is played again by another path is deleted",
    ),
    Mutant(
        "sim_driver/run/earlier.py",
        "or path.resolve() in file.parents",
        "",
        "a saved map in the folder of an earlier run is deleted before it is read",
    ),
    Mutant(
        "sim_driver/run/shares.py",
        "            self._simulation.command(self.robot_id, turn.command)\n",
        "            pass\n",
        "of a mission in two processes half of the robots stand still in the world of the other half",
    ),
    Mutant(
        "sim_driver/run/shares.py",
        "        for effect in self._turn.sent:\n",
        "        for effect in self._turn.sent[1:]:\n",
        "robots that take their turns in another process are heard in part: the number of processes decides who merges",
    ),
    Mutant(
        "sim_driver/run/shares.py",
        "        self._transport.poll(0.0)\n",
        "        pass\n",
        "every process keeps what was ever sent to robots of others",
    ),
    Mutant(
        "sim_driver/run/shares.py",
        "        raise said\n",
        "        return {}\n",
        "a mission whose second process failed ends with a KeyError, and not with what is wrong",
    ),
    Mutant(
        "sim_driver/run/shares.py",
        "        self.is_over = self._stop()\n",
        "        self.is_over = False\n",
        "Ctrl-C does not end a mission that is played in several processes",
    ),
    Mutant(
        "sim_driver/run/run_shares.py",
        "    if mission.faults or mission.view:\n",
        "    if mission.view:\n",
        "robots that crash in missions of eight robots and more end these with a KeyError",
    ),
    Mutant(
        "sim_driver/run/run_virtual.py",
        "watchers, keeper, self._matches)",
        "watchers, keeper)",
        "robots of one mission match the same keyframes, each for itself",
    ),
    Mutant(
        "sim_driver/run/shares.py",
        "    except EOFError:\n",
        "    except ZeroDivisionError:\n",
        "a mission whose second process was killed for want of memory ends with an EOFError that says nothing",
    ),
)

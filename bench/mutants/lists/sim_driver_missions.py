"""Mutants of sim_driver/missions."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "sim_driver/missions/seeds.py",
        'text = f"{mission.mission.seed}/{purpose}".encode()',
        'text = f"{mission.mission.seed}".encode()',
        "everything random in a mission is the same randomness",
    ),
    Mutant(
        "sim_driver/missions/run_shapes.py",
        'Literal["accepted", "rejected", "revoked", "untried"]',
        'Literal["accepted", "rejected", "untried"]',
        "a robot whose merge was just taken back counts as damaged",
    ),
    Mutant(
        "sim_driver/missions/settings.py",
        '    check_keys(tables, [section], "--set")\n',
        "",
        "settings of a section that a command does not have are taken and do nothing",
    ),
    Mutant(
        "sim_driver/missions/mission.py",
        'robot.id for robot in robots if robot.mode == "central"}',
        "robot.id for robot in robots if False}",
        "a base station that is to be carried off ends the mission with a traceback",
    ),
    Mutant(
        "sim_driver/missions/run_folder.py",
        "(InputError, TypeError, KeyError, AttributeError)",
        "(InputError, KeyError)",
        "a config.json with a list for a name is a traceback",
    ),
    Mutant(
        "sim_driver/missions/agent_record.py",
        "    settings: dict[str, dict[str, Any]]\n",
        "    settings: dict[str, Any]\n",
        "an agent.json with a number for a section is a traceback",
    ),
    Mutant(
        "sim_driver/missions/traces.py",
        "    except csv.Error as error:\n",
        "    except ZeroDivisionError as error:\n",
        "a trace that is no CSV file is a traceback",
    ),
    Mutant(
        "sim_driver/missions/settings.py",
        "    except (ValueError, RecursionError) as error:  # also",
        "    except tomllib.TOMLDecodeError as error:  # also",
        "a mission file of brackets without end is a traceback",
    ),
    Mutant(
        "sim_driver/missions/settings.py",
        "    except (ValueError, RecursionError):\n",
        "    except tomllib.TOMLDecodeError:\n",
        "a number of 5000 digits behind --set is a traceback",
    ),
    Mutant(
        "sim_driver/missions/mission.py",
        '{"starts": starts, **tables',
        "{**tables",
        "robots whose starts the team knows look for each other everywhere",
    ),
    Mutant(
        "sim_driver/missions/mission.py",
        "check_keys(one.robots or (), ids,",
        "check_keys((), ids,",
        "a saved map for a robot whose name is misspelt is given to nobody, without a word",
    ),
    Mutant(
        "sim_driver/missions/mission.py",
        "for name in (*named, self.links.trace, self.truth.relations)",
        "for name in (*named, self.links.trace)",
        "relations that lie in the folder of an earlier run are deleted before they are read",
    ),
)

"""Mutants of what commands pass on, and of those on the folders of agents and runs."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "sim_driver/cli/commands/network.py",
        "    if robots or router or not revoke:\n",
        "    if True:\n",
        "mrslam keys --revoke says that all have keys already",
    ),
    Mutant(
        "sim_driver/cli/commands/network.py",
        "    if robots or router or not revoke:\n",
        "    if not revoke:\n",
        "a robot that takes a revoked one's place gets no keys",
    ),
    Mutant(
        "sim_driver/cli/commands/network.py",
        "make_keys(team, robots or [], router or [], out,",
        "make_keys(team, robots or [], [], out,",
        "no keys are made for routers",
    ),
    Mutant(
        "sim_driver/cli/commands/network.py",
        "diagnose(listen or [], connect or [], multicast, json)",
        "diagnose(listen or [], [], multicast, json)",
        "mrslam doctor does not look whether a teammate is there",
    ),
    Mutant(
        "sim_driver/cli/commands/network.py",
        "connect=connect or [], keys=keys, multicast=multicast, once=once, wait_s=wait,",
        "connect=[], keys=keys, multicast=multicast, once=once, wait_s=wait,",
        "--connect of mrslam top is not passed on",
    ),
    Mutant(
        "sim_driver/cli/commands/network.py",
        "once=once, wait_s=wait,",
        "once=once, wait_s=5.0,",
        "--wait of mrslam top does nothing",
    ),
    Mutant(
        "sim_driver/cli/runs/gather.py",
        "        write_report(out)\n",
        "        pass\n",
        "gathered agents have no page",
    ),
    Mutant(
        "sim_driver/cli/runs/gather.py",
        "    if as_json:\n",
        "    if not as_json:\n",
        "--json of mrslam gather prints for people",
    ),
    Mutant(
        "sim_driver/cli/runs/bag.py",
        'bag.transform(TEAM, f"map_{name}", 0,',
        'bag.transform(f"map_{name}", TEAM, 0,',
        "the frames of a recording are upside down: maps lie where the team would be seen from them",
    ),
    Mutant(
        "sim_driver/cli/runs/bag.py",
        "        if not written:\n            raise",
        "        if False:\n            raise",
        "a recording of nothing is written without a word",
    ),
    Mutant(
        "sim_driver/cli/runs/bag.py",
        "out = run / BAG_FILE if out is None else out",
        "out = run / BAG_FILE",
        "--out of mrslam bag does nothing",
    ),
    Mutant(
        "sim_driver/cli/runs/bag.py",
        'folders = run.glob("*/") if robots is None else (run / robot_id for robot_id in robots)',
        'folders = run.glob("*/")',
        "robots of an earlier run in the same folder are in the recording",
    ),
    Mutant(
        "sim_driver/cli/runs/bag.py",
        'return chosen["map"] if chosen is not None and chosen["T_frame_map"] is not None else None',
        'return chosen["map"] if chosen is not None else None',
        "a robot that never found its place in the saved map has its team map there",
    ),
    Mutant(
        "sim_driver/cli/runs/bag.py",
        "    except (InputError, OSError) as error:\n        say(str(error))\n",
        "    except (InputError, OSError):\n",
        "damaged files are left out of a recording without a word",
    ),
    Mutant(
        "sim_driver/cli/commands/maps.py",
        "near_m=near, least_m2=least,",
        "near_m=near,",
        "mrslam diff --least does nothing",
    ),
    Mutant(
        "sim_driver/cli/commands/maps.py",
        "same_frame=same_frame, near_m=near,",
        "same_frame=same_frame,",
        "mrslam diff --near does nothing",
    ),
    Mutant(
        "sim_driver/cli/commands/maps.py",
        "out=out, same_frame=same_frame, near_m",
        "out=out, near_m",
        "mrslam diff --same-frame moves the maps onto each other",
    ),
    Mutant(
        "sim_driver/cli/commands/maps.py",
        "no_odometry=no_odometry, relations=relations, salvage=salvage,",
        "no_odometry=no_odometry, relations=relations, salvage=False,",
        "mrslam map --salvage does nothing",
    ),
    Mutant(
        "sim_driver/cli/commands/maps.py",
        "inspect_file(log, json, salvage)",
        "inspect_file(log, json)",
        "mrslam feed --salvage does nothing",
    ),
    Mutant(
        "sim_driver/cli/commands/maps.py",
        "if known_poses is not None or resolution is not None or pictures:",
        "if known_poses is not None or pictures:",
        "mrslam merge leaves out --resolution for a saved map without a word",
    ),
    Mutant(
        "sim_driver/cli/commands/network.py",
        "maps=[*options.maps, options.out], out=save",
        "maps=[options.out, *options.maps], out=save",
        "mrslam agent --save: the saved map's walls win over what was seen now",
    ),
    Mutant(
        "sim_driver/cli/commands/maps.py",
        "if known_poses is not None or resolution is not None or pictures:",
        "if known_poses is not None or resolution is not None:",
        "mrslam merge leaves out --pictures for a saved map without a word",
    ),
    Mutant(
        "sim_driver/cli/commands/network.py",
        "    if localise and not map_:\n",
        "    if False:\n",
        "mrslam agent --localise without a map maps on and says nothing",
    ),
)

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
)

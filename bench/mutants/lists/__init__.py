"""The mutants of each package, chosen by what would hurt a user."""

from bench.mutants.lists import (
    agent,
    agent_pairs,
    agent_shells,
    alignment,
    chaos,
    comms,
    merge,
    mutual_detection,
    rbpf,
    ros,
    sim_driver,
    spatial,
)
from bench.mutants.mutant import Mutant

MUTANTS: tuple[Mutant, ...] = (
    *spatial.MUTANTS,
    *rbpf.MUTANTS,
    *alignment.MUTANTS,
    *mutual_detection.MUTANTS,
    *merge.MUTANTS,
    *comms.MUTANTS,
    *agent.MUTANTS,
    *agent_pairs.MUTANTS,
    *agent_shells.MUTANTS,
    *sim_driver.MUTANTS,
    *ros.MUTANTS,
    *chaos.MUTANTS,
)

"""The mutants of each package, chosen by what would hurt a user."""

from bench.mutants.lists import (
    agent,
    agent_pairs,
    agent_shells,
    alignment,
    chaos,
    comms,
    comms_keys,
    comms_messages,
    merge,
    merge_many,
    mutual_detection,
    rbpf,
    rbpf_front_end,
    ros,
    sim_driver,
    sim_driver_results,
    spatial,
)
from bench.mutants.mutant import Mutant

MUTANTS: tuple[Mutant, ...] = (
    *spatial.MUTANTS,
    *rbpf.MUTANTS,
    *rbpf_front_end.MUTANTS,
    *alignment.MUTANTS,
    *mutual_detection.MUTANTS,
    *merge.MUTANTS,
    *merge_many.MUTANTS,
    *comms.MUTANTS,
    *comms_keys.MUTANTS,
    *comms_messages.MUTANTS,
    *agent.MUTANTS,
    *agent_pairs.MUTANTS,
    *agent_shells.MUTANTS,
    *sim_driver.MUTANTS,
    *sim_driver_results.MUTANTS,
    *ros.MUTANTS,
    *chaos.MUTANTS,
)

"""What can go wrong with a robot, on purpose: faults that a mission lists, played in virtual time."""

from mrslam.sim_driver.faults.config import KINDS, FaultConfig

__all__ = ["KINDS", "FaultConfig"]

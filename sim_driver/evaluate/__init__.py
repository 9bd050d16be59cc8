"""What a run is worth: against the simulator's truth, relations, reference trajectories or a true map."""

from mrslam.sim_driver.evaluate.assess import assess
from mrslam.sim_driver.evaluate.judges import References

__all__ = ["References", "assess"]

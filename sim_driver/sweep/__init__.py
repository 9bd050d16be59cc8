"""Many runs of one mission under varied settings: points, workers, one table, plots and a recommendation."""

from mrslam.sim_driver.sweep.plan import Knob, Plan, Point, make_plan, parse_knob
from mrslam.sim_driver.sweep.sweep import run_sweep

__all__ = ["Knob", "Plan", "Point", "make_plan", "parse_knob", "run_sweep"]

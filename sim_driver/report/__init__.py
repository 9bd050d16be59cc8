"""A run as one page: what happened in words, a player, charts; opens anywhere, without a network."""

from mrslam.sim_driver.missions.run_files import REPORT_FILE
from mrslam.sim_driver.report.page import write_report

__all__ = ["REPORT_FILE", "write_report"]

"""Runs played again: the same drive and the same radio, decided anew by other settings."""

from mrslam.sim_driver.missions.run_files import SCANS_FILE
from mrslam.sim_driver.replay.bodies import ReplayedBody
from mrslam.sim_driver.replay.drive import drive_holds_until_s
from mrslam.sim_driver.replay.recording import Recorder, read_recording

__all__ = ["SCANS_FILE", "Recorder", "ReplayedBody", "drive_holds_until_s", "read_recording"]

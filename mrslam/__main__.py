"""``python -m mrslam`` is the command ``mrslam``."""

from mrslam.sim_driver.cli import main

main()

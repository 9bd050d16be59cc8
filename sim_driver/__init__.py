"""Worlds, simulated and recorded robots, missions, and the command ``mrslam``: the top floor.

Nothing is imported here, so that ``mrslam --help`` is quick. Where to begin:

- ``mrslam.sim_driver.feeds``: ``open_feed``, recorded logs as scans.
- ``mrslam.sim_driver.worlds``, ``mrslam.sim_driver.robots``, ``mrslam.sim_driver.drivers``: what is simulated.
- ``mrslam.sim_driver.missions.mission``: ``load_mission``, ``make_mission``.
- ``mrslam.sim_driver.run.run``: ``run_mission``.
- ``mrslam.sim_driver.evaluate``: ``assess``, a run judged; ``mrslam.sim_driver.report``: ``write_report``, its page.
- ``mrslam.sim_driver.sweep``: ``make_plan``, ``run_sweep``.
"""

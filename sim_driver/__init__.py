"""Worlds, simulated and recorded robots, missions, and the command ``mrslam``: the top floor.

Nothing is imported here, so that ``mrslam --help`` is quick. Where to begin:

- ``sim_driver.feeds``: ``open_feed``, recorded logs as scans.
- ``sim_driver.worlds``, ``sim_driver.robots``, ``sim_driver.drivers``: what is simulated.
- ``sim_driver.mission``: ``load_mission``, ``make_mission``; ``sim_driver.run``: ``run_mission``.
- ``sim_driver.evaluate``: ``assess``, a run judged; ``sim_driver.report``: ``write_report``, its page.
- ``sim_driver.sweep``: ``make_plan``, ``run_sweep``.
"""

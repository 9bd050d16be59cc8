"""Map a recorded log, scan by scan: python examples/map_a_log.py LOG [OUT]."""

import sys
from pathlib import Path

from mrslam import Mapper, MapperConfig, open_feed, write_map, write_tum

log, out = Path(sys.argv[1]), Path(*sys.argv[2:3] or ["out/example"])
mapper = Mapper(MapperConfig(particles=30), seed=1)
for reading in open_feed(log).readings:
    info = mapper.update(reading.scan, reading.T_odom_base)
    if info.reason is not None:
        print(f"a scan was not used: {info.reason}")

grid, trajectory = mapper.snapshot().map.to_grid(), mapper.trajectory()
write_map(out / "map.yaml", grid)
write_tum(out / "trajectory.tum", trajectory.stamps_ns, trajectory.T_map_base)
x, y, theta = mapper.T_map_base
print(f"{grid.known_area_m2():.0f} m2 in {out}; the robot ended at x {x:.2f} m, y {y:.2f} m, {theta:.2f} rad")

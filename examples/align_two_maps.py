"""Find how two maps of any SLAM system fit together, and merge them: examples/align_two_maps.py A.yaml B.yaml [OUT]."""

import sys
from pathlib import Path

from mrslam import Rejection, align, merge_maps, read_map, write_map

a, b = (read_map(Path(name)) for name in sys.argv[1:3])
outcome = align(a, b)
if isinstance(outcome, Rejection):
    sys.exit(f"not merged: {outcome.reason}")
x, y, theta = outcome.T_a_b  # maps points of b to a
print(f"b lies in a at x {x:.2f} m, y {y:.2f} m, turned by {theta:.3f} rad")
print(f"confidence {outcome.confidence:.2f}, {outcome.evidence.matched_m:.1f} m of wall in common")

team = merge_maps({"a": a, "b": b}, known_poses={"a": (0, 0, 0), "b": outcome.T_a_b}).team_map
out = Path(*sys.argv[3:4] or ["out/example"]) / "merged.yaml"
write_map(out, team.grid)
print(f"{team.grid.known_area_m2():.0f} m2 in {out}")

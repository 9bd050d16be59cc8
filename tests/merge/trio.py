"""Three robots whose maps are parts of one building, and what makes their team map."""

import numpy as np

from mrslam.merge import TeamMap, TeamMapper
from mrslam.spatial import se2
from tests.merge.plans import alignment, building, part, truth

PLAN = building(7)


WIDTH = PLAN.shape[1]


POSES = {  # T_plan_map: where each robot's frame lies in the plan
    "r1": se2.transform(1.0, 2.0, 0.4),
    "r2": se2.transform(6.0, 3.0, -2.0),
    "r3": se2.transform(12.0, 1.0, 1.3),
}


MAPS = {
    "r1": part(PLAN, 0, WIDTH // 2, se2.inverse(POSES["r1"])),
    "r2": part(PLAN, WIDTH // 4, 3 * WIDTH // 4, se2.inverse(POSES["r2"])),
    "r3": part(PLAN, WIDTH // 2, WIDTH, se2.inverse(POSES["r3"])),
}


EDGES = {(a, b): alignment(np.add(truth(POSES, a, b), [0.01, -0.01, 0.001])) for a, b in (("r1", "r2"), ("r2", "r3"))}


class Mapper(TeamMapper):
    """A team mapper with the alignments that a test has accepted so far."""

    def __init__(self, *args, **kwargs) -> None:
        super().__init__(*args, **kwargs)
        self.found = {}

    def team_map(self) -> TeamMap:
        return super().team_map(self.found)


def mapper_of(maps=MAPS, edges=EDGES, anchor=None, config=None) -> Mapper:
    mapper = Mapper(anchor, config)
    for robot_id, grid in maps.items():
        mapper.set_map(robot_id, grid)
    mapper.found = dict(edges)
    return mapper


def fingerprint(team_map) -> bytes:
    poses = b"".join(x.encode() + T.tobytes() for x, T in team_map.T_team_map.items())
    grid = team_map.grid
    head = f"{grid.origin_m} {grid.resolution_m} {grid.shape} {team_map.unplaced} {team_map.dropped} {team_map.anchor}"
    return grid.cells.tobytes() + poses + head.encode()

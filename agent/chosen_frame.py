"""The frame in which a robot tells its pose and its team map: its own map's, or that of a saved map."""

from __future__ import annotations

from mrslam.agent.saved_maps import pose_in
from mrslam.agent.team import Team
from mrslam.merge.grids.warp import warp
from mrslam.spatial import OccupancyGrid, se2
from mrslam.spatial.se2 import Transform


class ChosenFrame:
    """Where the own map lies in the chosen frame, as last known: a place that is withdrawn moves nothing."""

    def __init__(self, saved_map: str) -> None:
        """``saved_map`` : the saved map whose frame it is; empty: the own map's frame is the chosen one."""
        self.saved_map = saved_map
        self.T_frame_map: Transform | None = None if saved_map else se2.IDENTITY
        """``(3,)``: maps points of the own map into the chosen frame, right near the robot; None until localised."""

    def follow(self, team: Team, T_map_base: Transform) -> None:
        """Take the place of a robot at ``T_map_base (3,)`` in the saved map, where it is known now."""
        if not self.saved_map:
            return
        T_frame_base = pose_in(team, self.saved_map, se2.compose(team.layout.T_team_own, T_map_base))
        if T_frame_base is not None:
            self.T_frame_map = se2.compose(T_frame_base, se2.inverse(T_map_base))

    def forget(self) -> None:
        """Forget the place: the robot begins a new map."""
        self.T_frame_map = None if self.saved_map else se2.IDENTITY


def in_frame(grid: OccupancyGrid, T_frame_grid: Transform | None) -> OccupancyGrid:
    """Return a grid in a frame in which it lies at ``T_frame_grid (3,)``; the grid itself where that is not known."""
    if T_frame_grid is None or not T_frame_grid.any():
        return grid
    return warp(grid, T_frame_grid)

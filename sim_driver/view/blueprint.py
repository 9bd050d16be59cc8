"""How the viewer's window is laid out: every robot's view from above, link qualities over time, events as text."""

from __future__ import annotations

from collections.abc import Sequence

import rerun.blueprint as rrb

PAPER = (245, 245, 242)


def blueprint_of(robots: Sequence[str]) -> rrb.Blueprint:
    """Return the layout for these robots; each is shown in its own map's frame, with the maps it could place."""
    views = [
        rrb.Spatial3DView(
            origin=f"/{robot}",
            contents=["$origin/**"],
            name=f"{robot}: its map and those it has merged",
            background=PAPER,
            line_grid=False,
            eye_controls=rrb.EyeControls3D(
                position=[0.0, -0.01, 30.0], look_target=[0.0, 0.0, 0.0], eye_up=[0.0, 1.0, 0.0]
            ),
        )
        for robot in robots
    ]
    curves = rrb.TimeSeriesView(origin="/", contents=[f"+ /{robot}/links/**" for robot in robots], name="link quality")
    lines = rrb.TextLogView(origin="/", contents=[f"+ /{robot}/events" for robot in robots], name="events")
    maps = rrb.Grid(*views) if len(views) <= 4 else rrb.Tabs(*views)
    return rrb.Blueprint(
        rrb.Vertical(maps, rrb.Horizontal(curves, lines), row_shares=[3, 1]),
        rrb.TimePanel(state="collapsed", timeline="mission", play_state="following"),
        collapse_panels=True,
    )

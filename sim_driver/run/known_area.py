"""How much a robot knows, as of its last event ``known``: for lines of progress, which must cost it nothing."""

from __future__ import annotations

from mrslam.agent import Agent, Event, Sensed


class KnownArea:
    """Watches one robot; the area is that of the maps named, its own alone or its team's."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self.area_m2 = 0.0
        """Of the team map, square metres; of the own map while no other is placed."""
        self.placed: tuple[str, ...] = ()
        """Teammates whose maps are part of that area."""

    def on_scan(self, agent: Agent, sensed: Sensed, now_ns: int) -> None:
        """Scans are not counted here."""

    def on_event(self, agent: Agent, event: Event) -> None:
        """Take the areas that the robot reports as they change."""
        if event.kind == "known":
            self.area_m2 = event.fields["team_m2"]
            self.placed = tuple(name for name in event.fields["placed"] if name != agent.robot_id)

    def close(self, agent: Agent, now_ns: int) -> None:
        """Nothing to close."""

    @property
    def words(self) -> str:
        """The area and whose it is: "82 m2", or "105 m2 with r2"."""
        return f"{self.area_m2:.0f} m2" + (f" with {', '.join(self.placed)}" if self.placed else "")

"""The area in lines of progress is that of the maps named beside it."""

from __future__ import annotations

from mrslam.agent import Agent, Event, Settings
from mrslam.rbpf import MapperConfig
from mrslam.sim_driver.run.known_area import KnownArea


def known(own_m2: float, team_m2: float, *placed: str) -> Event:
    return Event(10**10, "known", {"own_m2": own_m2, "team_m2": team_m2, "placed": list(placed)})


def test_the_area_is_the_teams_once_teammates_are_named() -> None:
    agent = Agent("r1", Settings(rbpf=MapperConfig(particles=2)), team="team", seed=0, boot_id=1)
    area = KnownArea()
    assert area.words == "0 m2"
    area.on_event(agent, known(81.8, 81.8, "r1"))
    assert area.words == "82 m2"
    area.on_event(agent, known(81.8, 105.4, "r1", "r2", "r3"))
    assert area.words == "105 m2 with r2, r3"
    area.on_event(agent, Event(10**10, "masked", {"beams": 3}))
    assert area.words == "105 m2 with r2, r3"

"""The team as markers: robots, the alignments of their maps, and radio links."""

from __future__ import annotations

from visualization_msgs.msg import Marker, MarkerArray

from mrslam.sim_driver.ros.node.messages import marker, point
from mrslam.sim_driver.ros.outlook import TeamSight
from mrslam.spatial.se2 import Transform

OWN, MATE, MERGED = (0.1, 0.6, 1.0, 1.0), (1.0, 0.6, 0.1, 1.0), (0.1, 0.8, 0.2, 0.9)
"""Colours of the robot itself, of teammates, and of merged pairs of maps."""
ROBOT_M, LINE_M, TEXT_M = 0.4, 0.05, 0.35
"""Sizes: diameter of a robot, width of a line, height of letters, metres."""


def team_graph(sight: TeamSight, own: str, frame: str, stamp_ns: int) -> MarkerArray:
    """Return the origins of all placed maps, with the alignments between them as lines with their confidence."""
    out = _cleared(frame, stamp_ns)
    for number, (robot_id, T_team_map) in enumerate(sorted(sight.T_team_map.items())):
        ball = marker(frame, stamp_ns, "maps", number, Marker.CUBE, OWN if robot_id == own else MATE, ROBOT_M / 2)
        ball.pose.position = point(T_team_map)
        out.markers += [ball, _text(frame, stamp_ns, "map names", number, T_team_map, f"map of {robot_id}")]
    for number, (a, b, confidence, _) in enumerate(sight.edges):
        if confidence is None or a not in sight.T_team_map or b not in sight.T_team_map:
            continue
        ends = sight.T_team_map[a], sight.T_team_map[b]
        out.markers.append(_line(frame, stamp_ns, "alignments", number, ends, MERGED))
        middle = (ends[0] + ends[1]) / 2.0
        out.markers.append(_text(frame, stamp_ns, "confidence", number, middle, f"{a}-{b}: {confidence:.2f}"))
    return out


def team_links(sight: TeamSight, own: str, T_team_own: Transform | None, frame: str, stamp_ns: int) -> MarkerArray:
    """Return where robots are, and the links from this one: green is good, red is bad."""
    out = _cleared(frame, stamp_ns)
    places = dict(sight.T_team_base)
    if T_team_own is not None:
        places[own] = T_team_own
    for number, (robot_id, T_team_base) in enumerate(sorted(places.items())):
        body = marker(frame, stamp_ns, "robots", number, Marker.CYLINDER, OWN if robot_id == own else MATE, ROBOT_M)
        body.pose.position = point(T_team_base)
        out.markers += [body, _text(frame, stamp_ns, "names", number, T_team_base, robot_id)]
    for number, link in enumerate(sight.links):
        if T_team_own is None or link.peer not in sight.T_team_base:
            continue
        ends, colour = (T_team_own, sight.T_team_base[link.peer]), (1.0 - link.quality, link.quality, 0.1, 0.9)
        out.markers.append(_line(frame, stamp_ns, "links", number, ends, colour))
        words = f"{link.quality:.2f} {link.activity}"
        out.markers.append(_text(frame, stamp_ns, "link quality", number, (ends[0] + ends[1]) / 2.0, words))
    return out


def _cleared(frame: str, stamp_ns: int) -> MarkerArray:
    clear = marker(frame, stamp_ns, "", 0, Marker.CUBE, OWN, ROBOT_M)
    clear.action = Marker.DELETEALL
    return MarkerArray(markers=[clear])


def _line(
    frame: str, stamp_ns: int, namespace: str, number: int, ends: tuple[Transform, Transform], colour: tuple[float, ...]
) -> Marker:
    line = marker(frame, stamp_ns, namespace, number, Marker.LINE_STRIP, colour, LINE_M)
    line.points = [point(end) for end in ends]
    return line


def _text(frame: str, stamp_ns: int, namespace: str, number: int, T: Transform, words: str) -> Marker:
    text = marker(frame, stamp_ns, namespace, number, Marker.TEXT_VIEW_FACING, (1.0, 1.0, 1.0, 1.0), TEXT_M)
    text.pose.position = point(T)
    text.pose.position.z = ROBOT_M
    text.text = words
    return text

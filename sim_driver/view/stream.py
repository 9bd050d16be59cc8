"""One robot's line to Rerun: maps as grids, scan, particles, paths, teammates, link qualities and events."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from mrslam.agent import Event
from mrslam.merge.draw import colours
from mrslam.sim_driver.missions.view_options import ViewOptions
from mrslam.sim_driver.view.blueprint import blueprint_of
from mrslam.sim_driver.view.frame import Frame
from mrslam.spatial import LocalMap, Scan, se2
from mrslam.spatial.se2 import Transform

APPLICATION = "mrslam"
"""Name under which the viewer keeps its layout."""
FLUSH_S = 2.0
"""Longest wait for a viewer to take a frame, seconds; it then gets fewer of them."""
HIT, MASKED, PARTICLE = (40, 40, 44), (200, 40, 80), (120, 84, 190)
"""Colours of beams that were mapped, of masked ones, and of particles, RGB."""


class Stream:
    """Everything of one robot goes under ``/<robot>``, in the frame of its own map; made and used on one thread."""

    def __init__(self, robot_id: str, options: ViewOptions, folder: Path, file: Path | None = None) -> None:
        """Take where to write; nothing is opened yet."""
        self.robot_id, self._options, self._file = robot_id, options, file or options.file_of(folder)
        self._revisions: dict[str, tuple[int, int]] = {}
        self._places: dict[str, bytes] = {}

    def open(self) -> None:
        """Open the file and find the viewer; a viewer that is not there may come later."""
        self._stream = rr.RecordingStream(APPLICATION, recording_id=self._options.run_id)
        sinks: list[rr.FileSink | rr.GrpcSink] = []
        if self._file is not None:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            sinks.append(rr.FileSink(str(self._file)))
        if self._options.address is not None:
            sinks.append(rr.GrpcSink(self._options.address))
        self._stream.set_sinks(*sinks, default_blueprint=blueprint_of(self._options.robots or (self.robot_id,)))

    def show(self, frame: Frame) -> None:
        """Write a frame and wait until it is taken, so that a slow viewer never has more than one in hand."""
        stream, root = self._stream, self.robot_id
        stream.set_time("mission", duration=frame.t_ns / 1e9)
        if frame.scan is not None and frame.masked is not None:
            self._show_robot(frame, frame.scan, frame.masked)
        mates = np.array(list(frame.teammates.values())).reshape(-1, 3)
        names = list(frame.teammates)
        shade = [_colour(name, frame) for name in names]
        stream.log(
            f"{root}/teammates", rr.Points3D(_raised(mates, 0.1), radii=[0.18], labels=names, colors=shade or None)
        )
        for owner, local in frame.maps.items():
            self._show_map(owner, local, frame)
        stream.flush(timeout_sec=FLUSH_S)

    def _show_robot(self, frame: Frame, scan: Scan, masked: Scan) -> None:
        """Write where the robot is, and what it sees."""
        stream, root = self._stream, self.robot_id
        T_map_laser = se2.compose(frame.T_map_base, scan.T_base_laser)
        hits, gone = _beams(scan, masked, T_map_laser)
        stream.log(f"{root}/scan", rr.Points3D(hits, colors=[HIT], radii=[0.02]))
        stream.log(f"{root}/masked", rr.Points3D(gone, colors=[MASKED], radii=[0.05]))
        stream.log(f"{root}/particles", rr.Points3D(_raised(frame.particles, 0.05), colors=[PARTICLE], radii=[0.03]))
        heading = np.array([[np.cos(frame.T_map_base[2]), np.sin(frame.T_map_base[2]), 0.0]])
        stream.log(
            f"{root}/robot",
            rr.Arrows3D(
                origins=_raised(frame.T_map_base[None], 0.1),
                vectors=0.5 * heading,
                colors=[_colour(self.robot_id, frame)],
                radii=[0.06],
            ),
        )
        if not frame.maps:  # a mapper on its own: the points of all scans shown so far stand for its map
            stream.log(f"{root}/seen/{frame.t_ns}", rr.Points3D(hits, colors=[HIT], radii=[0.01]))

    def _show_map(self, owner: str, local: LocalMap, frame: Frame) -> None:
        """Write a map where it has changed, and its place where that has; maps without a place are not shown."""
        place = frame.T_own_map.get(owner)
        path = f"{self.robot_id}/maps/{owner}"
        if place is None:
            if owner in self._places:
                self._stream.log(path, rr.Clear(recursive=True))
                del self._places[owner], self._revisions[owner]
            return
        if self._places.get(owner) != place.tobytes():
            self._places[owner] = place.tobytes()
            turn = rr.RotationAxisAngle([0.0, 0.0, 1.0], radians=float(place[2]))
            self._stream.log(path, rr.Transform3D(translation=[place[0], place[1], 0.0], rotation=turn))
        version = (local.map.revision, len(local.keyframes.stamps_ns))
        if self._revisions.get(owner) == version:
            return
        self._revisions[owner] = version
        grid = local.map.to_grid()
        if grid.cells.size == 0:
            return
        height, width = grid.shape
        form = rr.components.ImageFormat(width=width, height=height, color_model="L", channel_datatype="U8")
        self._stream.log(
            f"{path}/grid",
            rr.GridMap(
                data=grid.cells[::-1].tobytes(),
                format=form,
                cell_size=grid.resolution_m,
                translation=[grid.origin_m[0], grid.origin_m[1], -0.02],
                colormap=rr.components.Colormap.RvizMap,
                opacity=1.0 if owner == self.robot_id else 0.6,
            ),
        )
        way = _raised(local.keyframes.T_map_base, 0.03)
        self._stream.log(f"{path}/path", rr.LineStrips3D([way], colors=[_colour(owner, frame)], radii=[0.03]))

    def tell(self, event: Event) -> None:
        """Write an event: link qualities as curves, the rest as lines of text."""
        stream, fields = self._stream, event.fields
        stream.set_time("mission", duration=event.t_ns / 1e9)
        if event.kind == "link_changed":
            stream.log(f"{self.robot_id}/links/{fields['peer']}", rr.Scalars(fields["quality"]))
            return
        bad = event.kind in ("unmerged", "exchange_failed")
        level = "WARN" if bad else "INFO" if event.kind != "alignment" else "DEBUG"
        stream.log(f"{self.robot_id}/events", rr.TextLog(_words(event), level=level))

    def close(self) -> None:
        """Write what is left and let go."""
        self._stream.flush(timeout_sec=FLUSH_S)
        self._stream.disconnect()


def _beams(scan: Scan, masked: Scan, T_map_laser: Transform) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ends of the beams that were mapped, and of those that hit teammates."""
    hit = scan.is_return
    gone = hit & np.isnan(masked.ranges_m)
    angles, ranges = scan.angles_rad, np.where(hit, scan.ranges_m, 0.0).astype(np.float64)
    ends = se2.apply(T_map_laser, np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=-1))
    return _raised(ends[hit & ~gone], 0.02), _raised(ends[gone], 0.05)


def _raised(points: NDArray[np.float64], height_m: float) -> NDArray[np.float64]:
    """Return points of the plane ``(N, 2 or 3)`` as ``(N, 3)`` at one height, so that layers lie on one another."""
    return np.column_stack([points[:, :2], np.full(len(points), height_m)])


def _colour(robot_id: str, frame: Frame) -> tuple[int, int, int]:
    known = sorted({*frame.maps, robot_id})
    return colours(known)[robot_id]


def _words(event: Event) -> str:
    fields = event.fields
    match event.kind:
        case "merged":
            return f"merged {fields['a']} and {fields['b']}, confidence {fields['confidence']:.2f}"
        case "unmerged":
            return f"took {fields['a']} and {fields['b']} apart: {fields['reason']}"
        case "exchange_done":
            return f"exchanged maps with {fields['peer']}: {fields['bytes_sent'] + fields['bytes_received']} bytes"
        case "exchange_failed":
            return f"exchange with {fields['peer']} broke off: {fields['reason']}"
        case "alignment":
            return f"{fields['a']} and {fields['b']}: {fields['status']}, {fields['reason']}"
        case _:
            return f"{fields.get('peer', '')} gone: {fields.get('reason', '')}"

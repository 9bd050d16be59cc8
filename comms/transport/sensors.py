"""Messages of a robot's own drivers to its agent: scans and odometry, as JSON or MessagePack (docs/robots.md)."""

from __future__ import annotations

import math
from typing import Annotated, TypeVar

import msgspec
import numpy as np

from mrslam.spatial import InputError, Scan
from mrslam.spatial.se2 import Transform

MAX_BYTES = 2**20
"""Largest message, bytes: a scan of 20,000 beams, the most allowed, takes about half of it as JSON."""
Number = float | None
"""JSON knows no infinity: null is "no return"."""
Pose = tuple[float, float, float]
"""x (m), y (m), theta (rad)."""


class ScanMessage(msgspec.Struct, forbid_unknown_fields=True):
    """One sweep, as :class:`mrslam.spatial.Scan` has it, with the odometry of that moment where the driver knows it."""

    stamp_ns: Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]
    ranges_m: Annotated[list[Number], msgspec.Meta(min_length=1, max_length=20_000)]
    angle_min_rad: float
    angle_increment_rad: float
    range_max_m: float
    range_min_m: float = 0.0
    T_base_laser: Pose = (0.0, 0.0, 0.0)
    T_odom_base: Pose | None = None
    beam_interval_s: float = 0.0


class OdometryMessage(msgspec.Struct, forbid_unknown_fields=True):
    """Odometry: the pose of the base by its wheels."""

    stamp_ns: Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]
    T_odom_base: Pose


def decode_scan(payload: bytes) -> tuple[Scan, Transform | None]:
    """Return a scan and its odometry, if it has any; raise ``InputError`` for what is none."""
    message = _decode(payload, ScanMessage)
    ranges = np.array([math.inf if value is None else value for value in message.ranges_m], dtype=np.float32)
    scan = Scan(
        stamp_ns=message.stamp_ns,
        ranges_m=ranges,
        angle_min_rad=message.angle_min_rad,
        angle_increment_rad=message.angle_increment_rad,
        range_max_m=message.range_max_m,
        range_min_m=message.range_min_m,
        T_base_laser=np.array(message.T_base_laser),
        beam_interval_s=message.beam_interval_s,
    )
    return scan, None if message.T_odom_base is None else _pose(message.T_odom_base)


def decode_odometry(payload: bytes) -> tuple[int, Transform]:
    """Return when (nanoseconds) and where the robot was; raise ``InputError`` for what is no odometry."""
    message = _decode(payload, OdometryMessage)
    return message.stamp_ns, _pose(message.T_odom_base)


def encode_scan(scan: Scan, T_odom_base: Transform | None = None) -> bytes:
    """Return a scan as a message, for drivers in Python."""
    return msgspec.msgpack.encode(
        ScanMessage(
            scan.stamp_ns,
            [float(value) for value in scan.ranges_m],
            scan.angle_min_rad,
            scan.angle_increment_rad,
            scan.range_max_m,
            scan.range_min_m,
            _triple(scan.T_base_laser),
            None if T_odom_base is None else _triple(T_odom_base),
            scan.beam_interval_s,
        )
    )


def encode_odometry(stamp_ns: int, T_odom_base: Transform) -> bytes:
    """Return odometry as a message, for drivers in Python."""
    return msgspec.msgpack.encode(OdometryMessage(stamp_ns, _triple(T_odom_base)))


M = TypeVar("M", ScanMessage, OdometryMessage)


def _decode(payload: bytes, kind: type[M]) -> M:
    if len(payload) > MAX_BYTES:
        raise InputError(f"a message of {len(payload)} bytes is more than {MAX_BYTES}")
    try:
        is_json = payload.lstrip()[:1] == b"{"
        return msgspec.json.decode(payload, type=kind) if is_json else msgspec.msgpack.decode(payload, type=kind)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError) as error:
        raise InputError(f"no {kind.__name__}: {error}") from error


def _pose(values: Pose) -> Transform:
    if not all(math.isfinite(value) for value in values):
        raise InputError(f"a pose must be three finite numbers, got {values}")
    return np.array(values, dtype=np.float64)


def _triple(T: Transform) -> Pose:
    return float(T[0]), float(T[1]), float(T[2])

"""Zenoh: the only package that imports it. Robots over Zenoh, watchers, and sensors from a robot's own drivers."""

from mrslam.comms.zenoh.sensors import SensorPublisher, ZenohSensors
from mrslam.comms.zenoh.transport import ZenohTransport
from mrslam.comms.zenoh.watcher import ZenohWatcher

__all__ = ["SensorPublisher", "ZenohSensors", "ZenohTransport", "ZenohWatcher"]

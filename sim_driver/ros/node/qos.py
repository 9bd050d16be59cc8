"""Qualities of service, as Nav2, RViz and drivers expect them."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

SCAN = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Hears best-effort and reliable drivers; deep, so that a scan waits while a service is answered."""
ODOMETRY = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)
"""The same for odometry, which is more frequent."""
TF = QoSProfile(depth=100)
"""As tf2's own."""
TF_STATIC = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""As tf2's own: whoever comes late hears them."""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Maps: whoever comes late gets the newest."""
PLAIN = QoSProfile(depth=10)
"""Everything else."""

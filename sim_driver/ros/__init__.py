"""One robot as a ROS 2 node: the process shell's agent, fed by topics, with its maps and poses on topics.

What can be is plain Python (:mod:`options`, :mod:`parameters`, :mod:`frames`, :mod:`inlet`, :mod:`outlook`); only the
package :mod:`node` imports ``rclpy`` and ROS messages, and it is loaded when a node is started.
"""

"""The node itself: the only place where ``rclpy`` and ROS messages are imported."""

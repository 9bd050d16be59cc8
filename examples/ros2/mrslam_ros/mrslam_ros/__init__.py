"""The ROS 2 package of mrslam."""

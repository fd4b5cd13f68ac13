# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes that simulate and identify an exoskeleton and its wearer."""

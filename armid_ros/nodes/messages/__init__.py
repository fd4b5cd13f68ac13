# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of ROS 2 as what the package computes with, and back."""

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""ROS 2 node that draws residuals on a moving arm."""

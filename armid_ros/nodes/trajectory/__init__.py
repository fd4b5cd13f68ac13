# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Send trajectories to a controller, by topic or as goals of an action."""

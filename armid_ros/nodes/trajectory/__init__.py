# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How a trajectory reaches a controller: as a topic or as goals of an action."""

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The search for the trajectory with the most information on the parameters."""

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Filtered and decimated recordings, their torque noise, and the misfit of the model in them."""

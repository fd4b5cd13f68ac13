# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Samples of joint states as they come: damage is separated from motion, streams are merged."""

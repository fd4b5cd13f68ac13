# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Streams of joint states: removal of damaged samples, and merging of several streams."""

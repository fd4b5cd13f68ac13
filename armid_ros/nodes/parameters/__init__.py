# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The tables of parameters of nodes, and what they say."""

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Repetition of the experiments of a paper on identifying a humanoid arm on the moon."""

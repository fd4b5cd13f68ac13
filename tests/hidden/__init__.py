# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Recordings with effects hidden in them, made by MuJoCo.

Independent of what the package under test computes with: no effect, model, arm, simulation or
excitation of armid_ros is used here, only its robots (descriptions) and recordings (arrays).

"""

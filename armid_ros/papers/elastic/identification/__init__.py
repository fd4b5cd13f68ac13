# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identification of two links with elastic transmissions, in three steps.

Rigid least squares; subspaces of each joint on its own, with computed interaction torques as
inputs; physical parameters, tuned to closed-loop step responses. ``identify_two_inertia`` runs all
three steps. Source: Oaki and Adachi 2008.

"""

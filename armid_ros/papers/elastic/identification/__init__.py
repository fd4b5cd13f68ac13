# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Three-step identification of a two-link arm with elastic joints.

Step 1 is rigid least squares. Step 2 is subspace identification of each single joint, with
computed interaction torques as inputs. Step 3 gives physical parameters and tunes them to
closed-loop step responses. ``identify_two_inertia`` runs all
three steps. Source: Oaki and Adachi 2008.

"""

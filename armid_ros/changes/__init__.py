# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Has something changed? The statistic of every comparison of an arm with itself.

Two groups of data give a score s with the information S: of a difference its inverse covariance
times it. Then s^T S^-1 s has Fisher's distribution, of the rank of S and of the degrees of freedom
with which the size of the noise is known (`statistic`). How much estimates scatter beyond what
they state is learned from all arms of a kind (`scatter`), and steps and trends of series of
estimates are tested by that (`histories`).

"""

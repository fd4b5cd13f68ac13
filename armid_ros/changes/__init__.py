# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Tests for changes of an arm between two groups of data, or in series of estimates.

The difference d of the parameters of two groups of data has a covariance C. Without a change,
d^T C^-1 d over the rank of C has Fisher's distribution, with this rank and the degrees of freedom
of the noise estimate (`statistic`). Steps and trends in series of estimates are tested by the
scatter between bags, which is estimated from all arms of a kind (`histories`).

"""

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bayesian selection of the effects that cause a residual, and the fit of their values."""

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The public functions of ``import armid_ros``, one job per file.

The packages below compute; this package loads robots and recordings from paths, makes a random
generator from a seed, and prints results.

"""

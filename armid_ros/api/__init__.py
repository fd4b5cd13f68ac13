# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The public functions of ``import armid_ros``, one job per file.

The packages below compute; here paths become robots and recordings, an integer becomes a random
generator, and results print themselves.

"""

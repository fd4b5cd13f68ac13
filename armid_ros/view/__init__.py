# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A recording to look at: the moving arm, measured and predicted torque, what is left of it.

``log_recording`` hands it to rerun, which is installed by the extra ``view``.

"""

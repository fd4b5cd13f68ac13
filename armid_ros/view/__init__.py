# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A viewer of recordings: the moving arm, measured and predicted torque, and the residual.

``log_recording`` sends a recording to rerun, which the extra ``view`` installs.

"""

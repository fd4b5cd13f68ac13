# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Viewer of recordings: moving arm, measured and predicted torque, and residual.

``log_recording`` sends a recording to rerun, which the extra ``view`` installs.

"""

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Zeros and gains of torque sensors, gravity and tool, from an arm at rest: ``armid zero``.

`plan_zero` chooses poses and a tour through them; `find_rests` and `fit_rests` evaluate a
recording of the tour.

"""

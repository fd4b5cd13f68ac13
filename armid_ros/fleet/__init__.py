# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Many arms and many bags: identified, watched over time and diagnosed on a cluster.

Dask schedules, repeats and moves; fsspec opens stores; pyarrow keeps tables. Here is
their work: a bag becomes normal equations of fixed size, those of one arm become its estimate, and
estimates over time become changes and alarms. Needs the extra ``fleet``.

"""

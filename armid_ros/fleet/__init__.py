# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identification, monitoring over time and diagnosis of many arms with many bags, on a cluster.

Dask schedules tasks, fsspec opens stores, and pyarrow reads and writes tables. A task compresses a
bag to normal equations of fixed size. The normal equations of an arm give its estimate, and
estimates over time give changes and alarms. The package needs the extra ``fleet``.

"""

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identification of robot arms: find where simulation and measurement disagree.

An arm model is a rigid body plus a list of effects. The packages, from the ground up: ``robots``
(descriptions), ``model`` (rigid body), ``effects`` (what else acts on a joint), ``arm`` (the two
together), ``recording``, ``simulation``, ``excitation``, ``identification``, ``report``,
``nodes``.

"""

__version__ = '0.1.0'

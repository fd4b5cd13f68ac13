# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arm models, which are a rigid body plus effects, and their file model.yaml."""

from armid_ros.arm.arm_model import ArmModel
from armid_ros.arm.misfit import Misfit
from armid_ros.arm.model_file import load_misfit, load_model, save_model

__all__ = [
    'ArmModel',
    'Misfit',
    'load_misfit',
    'load_model',
    'save_model',
]

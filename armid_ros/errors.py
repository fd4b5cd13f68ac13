# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The errors a user can cause; each message says what is wrong, where, and what to do."""


class ArmidError(Exception):
    """Base of every error that bad input can cause; the command line prints it and exits 2."""


class RobotError(ArmidError):
    """A robot description cannot be used."""


class RecordingError(ArmidError):
    """A recording cannot be read, or does not fit the robot."""


class ModelError(ArmidError):
    """A model file, an effect or a parameter set is not valid."""


class TrajectoryError(ArmidError):
    """A trajectory violates the limits of the robot, or cannot be made within them."""


class IdentificationError(ArmidError):
    """The data cannot identify what was asked."""

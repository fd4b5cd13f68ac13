# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid demo`: all commands once, and a story in which a hidden change is found."""

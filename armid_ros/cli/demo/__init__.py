# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid demo`: everything once, and a story of something hidden that is found."""

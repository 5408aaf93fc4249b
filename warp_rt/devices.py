# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What there is on this machine to render with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import warp as wp

from warp_rt.warp_setup import init_warp


@dataclass(frozen=True)
class Device:
    """A device that kernels can run on."""

    name: str
    """What ``--device`` takes: ``cpu`` or ``cuda:N``."""
    description: str
    total_bytes: int | None
    """Memory of its own [byte]; None for the CPU, which shares the machine's."""


def list_devices() -> tuple[Device, ...]:
    """Return the CPU and every CUDA device."""
    init_warp()
    cuda = [Device(device.alias, device.name, int(device.total_memory)) for device in wp.get_cuda_devices()]
    return (Device("cpu", wp.get_device("cpu").name, None), *cuda)


def kernel_cache() -> Path:
    """Return the folder in which compiled kernels are kept."""
    init_warp()
    return Path(str(wp.config.kernel_cache_dir))  # initialising has set it

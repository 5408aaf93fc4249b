# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What there is on this machine to render with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import warp as wp

from warp_rt.warp_setup import has_temporary_cache, init_warp


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


@dataclass(frozen=True)
class KernelCache:
    """Where compiled kernels are kept."""

    path: Path
    is_temporary: bool
    """Whether it lies among the temporary files, because no cache folder can be written."""


def kernel_cache() -> KernelCache:
    """Return the folder in which compiled kernels are kept."""
    is_temporary = has_temporary_cache()
    return KernelCache(Path(str(wp.config.kernel_cache_dir)), is_temporary)  # initialising has set it

# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which files a picture becomes, known and checked before the first ray."""

from __future__ import annotations

import contextlib
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from warp_rt.errors import OptionError, OutputError
from warp_rt.options import COSTS

FORMATS = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg", ".exr": "exr"}

ID_TABLES = ("primId", "instanceId")
"""AOVs whose numbers stand for prims; elementId counts faces and needs no table."""


def format_of(path: Path) -> str:
    """Return ``png``, ``jpeg`` or ``exr``.

    Raises:
        OptionError: The extension is none that can be written.
    """
    try:
        return FORMATS[path.suffix.lower()]
    except KeyError:
        raise OptionError(f"{path}: the extension must be one of {', '.join(FORMATS)}") from None


def picture_of(path: Path, aovs: Iterable[str]) -> str:
    """Return the AOV that a PNG or JPEG shows: the colour, or the only cost where there is none.

    Raises:
        OptionError: There is neither.
    """
    wanted = tuple(dict.fromkeys(aovs))
    costs = [aov for aov in wanted if aov in COSTS]
    if "color" in wanted:
        return "color"
    if len(wanted) == len(costs) == 1:
        return costs[0]
    raise OptionError(f"{path}: {path.suffix} holds color or one cost; add color to the AOVs or write an .exr")


def has_legend(path: Path, aovs: Iterable[str]) -> bool:
    """Return whether a picture is that of a cost, with a bar that says what its colours mean."""
    return format_of(path) != "exr" and picture_of(path, aovs) != "color"


def planned_files(path: Path, aovs: Iterable[str]) -> dict[str, Path]:
    """Return every file that a picture with these AOVs is written to, by what it holds.

    An EXR holds all AOVs. PNG and JPEG hold the colour; each further AOV lies beside it, exact and unfiltered, as
    ``NAME.AOV.npy`` (with underscores for colons), and each cost also as a picture, ``NAME.AOV.png`` (key ``AOV.png``).
    With an id among the AOVs, ``NAME.ids.json`` says what the ids are (key ``ids``).

    Raises:
        OptionError: The extension is unknown, ``picture_of`` finds nothing to show, or two AOVs would be one file.
    """
    wanted = tuple(aovs)
    files = {"image": path}
    if format_of(path) != "exr":
        shown = picture_of(path, wanted)
        for aov in wanted:
            if aov not in ("color", "alpha"):
                files[aov] = path.with_name(f"{path.stem}.{aov.replace(':', '_')}.npy")
            if aov in COSTS and aov != shown:
                files[f"{aov}.png"] = path.with_name(f"{path.stem}.{aov}.png")
    if any(aov in ID_TABLES for aov in wanted):
        files["ids"] = path.with_name(f"{path.stem}.ids.json")
    for file, count in Counter(files.values()).items():
        if count > 1:
            raise OptionError(f"{file}: more than one AOV would have this name; write an .exr")
    return files


class SeriesFiles(NamedTuple):
    """Where the pictures of a series go."""

    sheet: Path
    pictures: tuple[Path, ...]
    changes: tuple[Path, ...]
    """Differences of the second picture from the first, and so on."""

    def all(self) -> tuple[Path, ...]:
        """Return every file, the sheet first."""
        return (self.sheet, *self.pictures, *self.changes)


def series_files(folder: Path, depths: Sequence[int], extension: str = "png") -> SeriesFiles:
    """Return the files of a series: ``series.png``, ``depth_1.png``, ..., ``change_2.png``, ...

    Numbers have as many digits as the largest, so that names sort.

    Raises:
        OptionError: The extension is unknown.
    """
    digits = len(str(max(depths)))
    pictures, changes = (
        tuple(folder / f"{name}_{depth:0{digits}}.{extension}" for depth in depths) for name in ("depth", "change")
    )
    format_of(pictures[0])
    return SeriesFiles(folder / "series.png", pictures, changes[1:])


def check_writable(path: Path) -> None:
    """Return if it looks as if a file could be written here; nothing is changed to find out.

    Raises:
        OutputError: The folder is missing or locked, ``path`` is itself a folder or a device, or its name can be no
            file's.
    """
    try:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            path.lstat()
    except (OSError, ValueError) as error:  # a name that is too long, or that holds a null character
        raise OutputError(f"{path}: cannot write: {getattr(error, 'strerror', error)}") from error
    if path.is_dir():
        raise OutputError(f"{path}: is a folder, not a file")
    if path.exists() and not path.is_file():
        raise OutputError(f"{path}: is no regular file")
    folder = path.parent
    if not folder.is_dir():
        raise OutputError(f"{path}: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"{path}: the folder {folder} is not writable")

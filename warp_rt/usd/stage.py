# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Opening a stage, what USD complains about while it is read, and its metadata."""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from numbers import Real
from pathlib import Path

from pxr import Ar, Sdf, Tf, Usd, UsdGeom

from warp_rt.errors import OptionError, SceneError
from warp_rt.report import Report
from warp_rt.usd.assets import is_device

MISSING_ASSET = "W501"
MISSING_PRIM = "W502"
CYCLE = "W503"
UNLOADED = "N906"
BAD_COMPOSITION = "W504"
BAD_UP_AXIS = "W510"
BAD_UNIT = "W511"
BAD_TIME = "W512"
OUTSIDE_MASK = "N908"
FLOAT_UNIT = "N916"
USD_WARNING = "N920"
OUTSIDE_RANGE = "N939"

_COMPOSITION_CODES = {
    "ErrorInvalidAssetPath": MISSING_ASSET,
    "ErrorInvalidSublayerPath": MISSING_ASSET,
    "ErrorMutedAssetPath": UNLOADED,
    "ErrorUnresolvedPrimPath": MISSING_PRIM,
    "ErrorInvalidPrimPath": MISSING_PRIM,
    "ErrorArcCycle": CYCLE,
    "ErrorSublayerCycle": CYCLE,
}
# What differs between warnings that say the same of several prims.
_PARTICULARS = re.compile(r"<[^<>]*>|\(/[^()]*\)|'[^']*'|\d+")
_MAX_TEXT = 300
_FALLBACK_METERS_PER_UNIT = 0.01


def open_stage(
    path: str | os.PathLike[str], mask: Sequence[str] = (), session_layer: str | os.PathLike[str] | None = None
) -> Usd.Stage:
    """Return the stage of a usda, usdc, usd or usdz file, with all payloads.

    Args:
        path: The file.
        mask: Paths of the prims that are composed, with all above and below; none: everything.
        session_layer: A layer stronger than the file.

    Raises:
        SceneError: There is no such file, or USD cannot read it.
        OptionError: A path of ``mask`` is no prim's.
    """
    name = os.fspath(path)
    reason = ""
    _check_name(name)
    try:
        stage = _compose(name, mask, session_layer)
    except Tf.ErrorException as error:
        stage, reason = None, error_text(error)
    if stage is not None:
        return stage
    # Asked only now, for a name that is no file may still be one to the asset resolver.
    raise _unreadable(name, "USD", reason)


def _check_name(name: str) -> None:
    """Return if USD can be asked for a file of this name.

    Raises:
        SceneError: Its path is not UTF-8, or it would never be read to its end.
    """
    try:
        str(Path(name).absolute()).encode()
    except FileNotFoundError:  # the current folder has been removed
        raise SceneError(f"{name}: no such file") from None
    except UnicodeEncodeError:
        raise SceneError(f"{name}: {_why_not_utf8(name)}") from None
    if is_device(name):
        raise SceneError(f"{name}: is no regular file")


def _why_not_utf8(name: str) -> str:
    with suppress(UnicodeDecodeError):
        os.fsencode(Path(name).absolute()).decode()
        encoding = sys.getfilesystemencoding()
        return f"file names are {encoding} to this process and UTF-8 to USD; choose a UTF-8 locale, or set PYTHONUTF8=1"
    return "USD cannot open files whose path is not UTF-8; rename it"


def _no_file(name: str) -> str | None:
    """Return why a name is that of no file to the file system, or None."""
    file = Ar.SplitPackageRelativePathOuter(name)[0] if Ar.IsPackageRelativePath(name) else name
    if not file:
        return "no such file"
    try:
        size = Path(file).stat().st_size
    except PermissionError as error:
        return f"cannot be read: {error.strerror}"
    except (OSError, ValueError):  # a name that is too long, or that holds a null character
        return "no such file"
    if Path(file).is_dir():
        return "is a folder, not a USD file"
    if not os.access(file, os.R_OK):
        return "cannot be read: Permission denied"
    return None if size else "the file is empty"


def _unreadable(name: str, kind: str, reason: str) -> SceneError:
    because = f": {reason}" if reason else ""
    return SceneError(f"{name}: {_no_file(name) or f'cannot be read as {kind}{because}'}")


def is_outside_mask(stage: Usd.Stage, path: Sdf.Path | str) -> bool:
    """Return whether a prim is missing because the stage's population mask leaves it out."""
    return not stage.GetPopulationMask().Includes(Sdf.Path(path))


def _compose(name: str, mask: Sequence[str], session_layer: str | os.PathLike[str] | None) -> Usd.Stage | None:
    if not mask and session_layer is None:
        return Usd.Stage.Open(name, Usd.Stage.LoadAll)
    population = Usd.StagePopulationMask()
    for path in mask or ("/",):
        if not path.startswith("/") or not Sdf.Path.IsValidPathString(path) or Sdf.Path(path).IsPropertyPath():
            raise OptionError(f"mask: {path!r} is no path of a prim, such as /World/Props")
        population.Add(Sdf.Path(path))
    layer = Sdf.Layer.FindOrOpen(name)
    if layer is None:
        return None
    session = Sdf.Layer.CreateAnonymous() if session_layer is None else _session(os.fspath(session_layer))
    stage = Usd.Stage.OpenMasked(layer, session, population, Usd.Stage.LoadAll)
    for path in mask:
        if stage and not stage.GetPrimAtPath(path):
            raise OptionError(f"mask: {path} is no prim of {name}")
    return stage


def _session(name: str) -> Sdf.Layer:
    _check_name(name)
    reason = ""
    try:
        layer = Sdf.Layer.FindOrOpen(name)
    except Tf.ErrorException as error:
        layer, reason = None, error_text(error)
    if layer is None:
        raise _unreadable(name, "a session layer", reason)
    return layer


@contextmanager
def captured_warnings(report: Report) -> Iterator[None]:
    """Keep what USD would print on stderr, and record its warnings as notes.

    Composition errors come as warnings too; they are left to ``report_composition``, which knows their prims.
    """
    with Tf.DiagnosticTrap() as trap:
        try:
            yield
        finally:
            texts = [_commentary(warning) for warning in trap.GetWarnings() if not _is_composition(warning)]
            trap.Clear()
    found = []
    for text in sorted(set(texts)):
        place = re.search(r"[<(](/[^<>()]*)[>)]|^(/\S+) -- |@([^@]+)@", text)
        where = next(filter(None, place.groups())) if place else "USD"
        found.append((USD_WARNING, where, f"USD says: {text}", _PARTICULARS.sub("", text)))
    _report_once(found, report)


def stage_name(stage: Usd.Stage) -> str:
    """Return what messages call a stage: its path as it was opened, or an anonymous layer's name."""
    root = stage.GetRootLayer()
    return str(root.GetDisplayName() if root.anonymous else root.identifier)


def report_composition(stage: Usd.Stage, report: Report) -> None:
    """Record every reference, payload, sublayer and inherited prim that did not compose."""
    root = stage_name(stage)
    found = [(UNLOADED, root, f"the sublayer @{name}@ is muted: drawn without", name) for name in _muted(stage)]
    for error in stage.GetCompositionErrors():
        name = type(error).__name__
        site = error.rootSite.path
        path = str(site) if not site.isEmpty else root
        try:
            text = _one_line(str(error))
        except UnicodeDecodeError:
            text = f"{name.removeprefix('Error')} (its text is not UTF-8)"
        found.append((_COMPOSITION_CODES.get(name, BAD_COMPOSITION), path, text, text.split(" introduced by ")[0]))
    _report_once(sorted(found), report)


def report_missing_clips(prim: Usd.Prim, report: Report) -> None:
    """Record the value clips of a prim that are no files; of those that a template names, that there is none."""
    clips = Usd.ClipsAPI(prim)
    for name in clips.GetClips() or ():
        found = clips.ComputeClipAssetPaths(name)
        missing = [clip.path for clip in found if not clip.resolvedPath]
        template = clips.GetClipTemplateAssetPath(name)
        if missing:
            message = f"{len(missing)} value clips are missing, such as @{missing[0]}@: their values are left out"
            report.warn(MISSING_ASSET, prim.GetPath(), message)
        elif template and not found:
            message = f"no value clip of the template @{template}@ is found: their values are left out"
            report.warn(MISSING_ASSET, prim.GetPath(), message)


def _muted(stage: Usd.Stage) -> list[str]:
    """Return the sublayers that are muted, of which USD says nothing."""
    muted = set(stage.GetMutedLayers())
    layers = stage.GetUsedLayers() if muted else ()
    named = {layer.ComputeAbsolutePath(path) for layer in layers for path in layer.subLayerPaths}
    return sorted(muted & named)


def stage_time(stage: Usd.Stage, time: float | None, default_time: bool, report: Report) -> Usd.TimeCode:
    """Return the time code to read at: the one given, else the stage's first, as usdrecord chooses, else 0.

    Raises:
        OptionError: ``time`` is no finite number, or comes with ``default_time``.
    """
    if not has_rate(stage):
        message = f"timeCodesPerSecond {stage.GetTimeCodesPerSecond():g} is no rate: velocities move nothing"
        report.warn(BAD_TIME, stage_name(stage), message)
    if default_time:
        if time is not None:
            raise OptionError("time: not together with the default time")
        return Usd.TimeCode.Default()
    if time is not None:
        if not isinstance(time, Real) or isinstance(time, bool) or not math.isfinite(time):
            raise OptionError(f"time: a finite number expected, got {time!r}")
        return Usd.TimeCode(float(time))
    start = stage.GetStartTimeCode()
    if not math.isfinite(start):
        report.warn(BAD_TIME, stage_name(stage), f"startTimeCode {start} is not finite: 0 is taken")
        start = 0.0
    return Usd.TimeCode(start)


def report_frame_outside(stage: Usd.Stage, frame: Usd.TimeCode, report: Report) -> None:
    """Note a frame outside of the stage's time codes, a slip perhaps, which USD reads all the same."""
    codes = stage_time_range(stage)
    if frame.IsDefault() or codes is None or codes[0] <= frame.GetValue() <= codes[1]:
        return
    message = (
        f"a frame outside of startTimeCode {codes[0]:g} to endTimeCode {codes[1]:g}: drawn as time samples say or hold"
    )
    report.warn(OUTSIDE_RANGE, stage_name(stage), message)


def stage_time_range(stage: Usd.Stage) -> tuple[float, float] | None:
    """Return the first and the last time code that the stage names, None where it names no range."""
    start, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    is_range = stage.HasAuthoredTimeCodeRange() and start <= end and math.isfinite(end - start)
    return (start, end) if is_range else None


def has_rate(stage: Usd.Stage) -> bool:
    """Return whether a stage's time codes pass at some rate, so that velocities have a meaning."""
    rate = stage.GetTimeCodesPerSecond()
    return math.isfinite(rate) and rate > 0


def stage_up_axis(stage: Usd.Stage, report: Report) -> str:
    """Return ``Y`` or ``Z``; anything else, whose meaning is not defined, counts as Z, as usdrecord has it."""
    axis = str(UsdGeom.GetStageUpAxis(stage))
    if axis in ("Y", "Z"):
        return axis
    report.warn(BAD_UP_AXIS, stage_name(stage), f"upAxis {axis!r} is neither Y nor Z: Z is taken")
    return "Z"


def stage_meters_per_unit(stage: Usd.Stage, report: Report) -> float:
    """Return the length of a scene unit [m], 0.01 where the stage says nothing valid."""
    value: object
    try:
        value = UsdGeom.GetStageMetersPerUnit(stage)
    except Tf.ErrorException:  # authored as float, which old files do: the layer still has the number
        value = stage.GetRootLayer().pseudoRoot.GetInfo("metersPerUnit")
        message = f"metersPerUnit is a {type(value).__name__}, not the schema's double: {value!r} is read all the same"
        report.warn(FLOAT_UNIT, stage_name(stage), message)
    if isinstance(value, float | int) and math.isfinite(value) and value > 0:
        return float(value)
    name = stage_name(stage)
    report.warn(BAD_UNIT, name, f"metersPerUnit {value!r} is no length: {_FALLBACK_METERS_PER_UNIT} is taken")
    return _FALLBACK_METERS_PER_UNIT


def _report_once(found: list[tuple[str, str, str, str]], report: Report) -> None:
    """Record code, path and text; of those with the same code and fourth entry, the first and how many follow."""
    first: dict[tuple[str, str], tuple[str, str]] = {}
    count: dict[tuple[str, str], int] = {}
    for code, path, text, key in found:
        first.setdefault((code, key), (path, text))
        count[code, key] = count.get((code, key), 0) + 1
    for (code, key), (path, text) in first.items():
        more = count[code, key] - 1
        report.warn(code, path, f"{text} (and {more} more like it)" if more else text)


def error_text(error: Tf.ErrorException) -> str:
    """Return what USD says went wrong, one line. (``str(error)`` can itself raise, where a file is not UTF-8.)"""
    texts = [text for text in (_commentary(part) for part in error.args) if text]
    # Those who could not go on for it say so too, and some say the same with more about the place.
    causes = [text for text in texts if not text.startswith("Failed to open layer")] or texts
    own = [text for text in causes if not any(text in other and text != other for other in causes)]
    return "; ".join(dict.fromkeys(own))[:_MAX_TEXT]


def _commentary(diagnostic: object) -> str:
    try:
        return _one_line(str(getattr(diagnostic, "commentary", diagnostic)))
    except UnicodeDecodeError:
        return "text that is not UTF-8"


def _is_composition(warning: object) -> bool:
    return str(getattr(warning, "sourceFunction", "")).endswith("_ReportErrors")


def _one_line(text: str) -> str:
    """Return text without line breaks, addresses in memory and session layers, which differ from run to run."""
    text = re.sub(r"parse error matching .* at ''", "the text ends too early", text)
    text = re.sub(r"parse error matching .* at '", "cannot be parsed at '", text)
    text = re.sub(r",?@anon:0x[0-9a-f]+:[^@]*@|<0x[0-9a-f]+>|pxrInternal\w*__::|pxrInternal\w*___", "", text)
    return " ".join(text.split())[:_MAX_TEXT].rstrip(" .")

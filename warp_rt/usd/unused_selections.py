# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Variant selections that select nothing, which USD passes over without a word."""

from __future__ import annotations

from pxr import Usd

from warp_rt.report import Report
from warp_rt.usd.questions import has_authored_metadata

NO_SUCH_VARIANT = "N925"
NOT_LOOKED_FOR = "N937"

_SELECTION = "variantSelection"


def report_unused_selections(prim: Usd.Prim, report: Report) -> None:
    """Note the selections of a prim that name no variant of their set, or a set that it does not have.

    An empty selection is one on purpose: of no variant.
    """
    if not has_authored_metadata(prim, _SELECTION):
        return
    sets = prim.GetVariantSets()
    names = set(sets.GetNames())
    for name, chosen in sorted(sets.GetAllVariantSelections().items()):
        if not chosen:
            continue
        if name not in names:
            report.warn(
                NO_SUCH_VARIANT, prim.GetPath(), f"{name} = {chosen!r} is selected, but there is no such variant set"
            )
            continue
        variants = sets.GetVariantSet(name).GetVariantNames()
        if chosen not in variants:
            known = ", ".join(variants) or "none"
            report.warn(
                NO_SUCH_VARIANT, prim.GetPath(), f"{name} = {chosen!r} selects nothing: its variants are {known}"
            )


def report_not_looked_for(prim: Usd.Prim, limit: int, report: Report) -> None:
    """Note the first prim that is not asked, which is one for all that follow."""
    report.warn(
        NOT_LOOKED_FOR,
        prim.GetPath(),
        f"from here on, after {limit} prims, variant selections that select nothing and metadata that USD does not "
        "know are looked for on models, instances and the prims beside them alone",
    )

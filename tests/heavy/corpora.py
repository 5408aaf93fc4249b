# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Render every stage of the corpora by the command line, each in a process of its own, and tell how it went.

    python -m tests.heavy.corpora OUT [--only hdmitsuba --only luxtest] [--jobs 4]

Every stage must give a picture, or end with one clear line that names it and the right exit code. OUT gets the
pictures, results.tsv, index.html with every picture beside the references that there are for it, and the same as
sheets/NN.png. The exit status is 1 if any stage ended with a traceback, a crash, a wrong exit code or not at all.
"""

from __future__ import annotations

import argparse
import collections
import concurrent.futures
import csv
import html
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from PIL import Image, ImageDraw

from ..data import ROOT, find_test_data

WIDTH = 160
TIME_LIMIT = 60.0  # wall-clock seconds a stage
SCENE_ERROR = 3  # exit code
LONGEST_MESSAGE = 240  # characters of an error that are shown
CLEAN_ERRORS = {SCENE_ERROR, 5}  # 5: a limit was hit

# How a stage can end; the first two are as they should be.
RENDERED, REFUSED = "rendered", "clean error"
TRACEBACK, CRASH, HANG, WRONG = "traceback", "crash", "hang", "wrong exit"

CELL, LABEL, SHEET_COLUMNS, SHEET_ROWS = (160, 120), 12, 8, 8  # contact sheets [pixel]


@dataclass(frozen=True)
class Result:
    """One stage, rendered or not."""

    stage: str
    """Path in the corpora."""
    outcome: str
    exit_code: int | None
    seconds: float
    message: str = ""
    """Last line on stderr of a stage that gave no picture."""
    picture: str = ""
    """File name in OUT/pictures."""
    triangles: int = 0
    warnings: tuple[dict[str, str], ...] = field(default=(), compare=False)

    @property
    def is_bad(self) -> bool:
        """Whether a stage must not end like this."""
        return self.outcome not in (RENDERED, REFUSED)


def main() -> None:
    """Run what the command line asks for; exit 1 if any stage ended badly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="folder for pictures and tables")
    parser.add_argument("--only", action="append", default=[], metavar="TEXT", help="stages whose path has TEXT")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes at a time")
    arguments = parser.parse_args()
    corpora = find_test_data("corpora")
    if corpora is None:
        sys.exit("corpora: not at hand: set WARP_RT_TEST_DATA to the folder that holds corpora/")
    results = run_corpora(corpora, arguments.out, only=arguments.only, jobs=arguments.jobs, shows_progress=True)
    print(summary(results))
    sys.exit(any(result.is_bad for result in results))


def run_corpora(
    corpora: Path, out: Path, *, only: Iterable[str] = (), jobs: int = 1, shows_progress: bool = False
) -> list[Result]:
    """Return how each stage ended, sorted by path; write pictures and tables to ``out``."""
    openable, unopenable = list_stages(corpora)
    wanted = [stage for stage in sorted(openable | unopenable) if not only or any(text in stage for text in only)]
    (out / "pictures").mkdir(parents=True, exist_ok=True)
    results = []
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(run_stage, corpora, stage, out, stage in openable) for stage in wanted]
        for done, future in enumerate(concurrent.futures.as_completed(futures), start=1):
            results.append(future.result())
            if shows_progress and (results[-1].is_bad or done % 50 == 0):
                print(f"{done}/{len(wanted)} {results[-1].outcome}: {results[-1].stage}", file=sys.stderr)
    results.sort(key=lambda result: result.stage)
    references = list_references(corpora)
    write_table(out / "results.tsv", results)
    write_html(out / "index.html", results, references, corpora)
    write_sheets(out / "sheets", out / "pictures", results, references, corpora)
    return results


def list_stages(corpora: Path) -> tuple[set[str], set[str]]:
    """Return the stages that USD can open, and the others that the list of hazards names."""
    with (corpora / "stages.tsv").open(newline="", encoding="utf-8") as table:
        openable = {row["path"] for row in csv.DictReader(table, delimiter="\t")}
    with (corpora / "hazards.tsv").open(newline="", encoding="utf-8") as table:
        hazards = {row["stage"] for row in csv.DictReader(table, delimiter="\t")}
    return openable, hazards - openable


def list_references(corpora: Path) -> dict[str, list[str]]:
    """Return the reference pictures of each stage that has some."""
    references = collections.defaultdict(list)
    with (corpora / "references.tsv").open(newline="", encoding="utf-8") as table:
        for row in csv.DictReader(table, delimiter="\t"):
            references[row["stage"]].append(row["image"])
    return references


def run_stage(corpora: Path, stage: str, out: Path, is_openable: bool) -> Result:
    """Render one stage and judge how that ended."""
    picture = stage.replace("/", "__") + ".png"
    path = out / "pictures" / picture
    path.unlink(missing_ok=True)
    command = [sys.executable, "-m", "warp_rt", "render", str(corpora / stage), "-o", str(path)]
    command += ["--json", "-w", str(WIDTH), "--device", "cpu", "--threads", "1"]
    start = time.perf_counter()
    try:
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=TIME_LIMIT, check=False)
    except subprocess.TimeoutExpired:
        return Result(stage, HANG, None, TIME_LIMIT, f"still running after {TIME_LIMIT:g} s")
    seconds = time.perf_counter() - start
    outcome, message = judge(run, stage, path.is_file(), is_openable)
    if outcome != RENDERED:
        return Result(stage, outcome, run.returncode, seconds, message)
    data = json.loads(run.stdout)
    return Result(
        stage,
        outcome,
        run.returncode,
        seconds,
        picture=picture,
        triangles=data["triangles"],
        warnings=tuple(data["warnings"]),
    )


def _is_error_object(stdout: str, code: int) -> bool:
    """Return whether a failed ``--json`` command said so on stdout, and nothing else."""
    try:
        return json.loads(stdout)["error"]["code"] == code
    except (ValueError, KeyError, TypeError):
        return False


def judge(run: subprocess.CompletedProcess[str], stage: str, has_picture: bool, is_openable: bool) -> tuple[str, str]:
    """Return the outcome of a finished process, and what is to be said about it."""
    lines = run.stderr.strip().splitlines()
    last = lines[-1] if lines else ""
    said = last if len(last) <= LONGEST_MESSAGE else last[: LONGEST_MESSAGE - 3] + "..."
    if "Traceback (most recent call last)" in run.stderr:
        return TRACEBACK, said
    if run.returncode < 0:
        return CRASH, f"signal {-run.returncode}: {said}"
    if run.returncode == 0:
        if not is_openable:
            return WRONG, "a stage that USD cannot open gave a picture"
        if not has_picture:
            return WRONG, "exit code 0 without a picture"
        if not run.stdout.lstrip().startswith("{"):
            return WRONG, "stdout is not JSON"
        return RENDERED, ""
    if run.returncode not in CLEAN_ERRORS:
        return WRONG, f"exit code {run.returncode}: {said}"
    if has_picture:
        return WRONG, f"an error that left a picture behind: {said}"
    if not _is_error_object(run.stdout, run.returncode):
        return WRONG, f"stdout is no error object: {run.stdout[:200]}"
    if Path(stage).name not in last:
        return WRONG, f"the error does not name the file: {said}"
    return REFUSED, said


def summary(results: list[Result]) -> str:
    """Return the table that people read."""
    lines = ["", f"{len(results)} stages"]
    outcomes = collections.Counter(result.outcome for result in results)
    lines += [f"{outcomes[name]:6}  {name}" for name in (RENDERED, REFUSED, TRACEBACK, CRASH, HANG, WRONG)]
    for outcome in (TRACEBACK, CRASH, HANG, WRONG, REFUSED):
        lines += [f"{outcome}: {r.stage}\n    {r.message}" for r in results if r.outcome == outcome]
    lines += ["", "slowest:"]
    slowest = sorted(results, key=lambda result: -result.seconds)[:10]
    lines += [f"{r.seconds:6.1f} s  {r.stage} ({r.triangles:,} triangles)" for r in slowest]
    lines += ["", "warnings, by the number of stages that have them:"]
    stages, example = collections.Counter(), {}
    for result in results:
        for warning in {w["code"]: w for w in result.warnings}.values():
            stages[warning["code"]] += 1
            example.setdefault(warning["code"], f"{warning['message']} ({result.stage})")
    lines += [f"{count:6}  {code}  e.g. {example[code]}" for code, count in stages.most_common()]
    return "\n".join(lines)


def write_table(path: Path, results: list[Result]) -> None:
    """Write one row a stage."""
    with path.open("w", newline="", encoding="utf-8") as table:
        rows = csv.writer(table, delimiter="\t", lineterminator="\n")
        rows.writerow(["stage", "outcome", "exit_code", "seconds", "triangles", "warnings", "message"])
        for r in results:
            codes = " ".join(sorted({warning["code"] for warning in r.warnings}))
            rows.writerow([r.stage, r.outcome, r.exit_code, f"{r.seconds:.2f}", r.triangles, codes, r.message])


def write_html(path: Path, results: list[Result], references: dict[str, list[str]], corpora: Path) -> None:
    """Write a page with every picture and its references, those with references first."""
    rows = []
    for r in sorted(results, key=lambda result: (result.stage not in references, result.stage)):
        ours = f'<img src="pictures/{html.escape(r.picture)}">' if r.picture else html.escape(r.message)
        images = [(corpora / image).as_uri() for image in references.get(r.stage, ())]
        theirs = "".join(f'<img src="{html.escape(image)}" height="120">' for image in images)
        codes = " ".join(sorted({warning["code"] for warning in r.warnings}))
        rows.append(f"<tr><td>{html.escape(r.stage)}<br>{codes}<td>{ours}<td>{theirs}")
    style = "body{font:12px sans-serif;background:#555;color:#fff}td{border-top:1px solid #888}"
    page = f"<!doctype html><meta charset=utf-8><title>corpora</title><style>{style}</style><table>"
    path.write_text(page + "\n".join(rows), encoding="utf-8")


def write_sheets(
    folder: Path, pictures: Path, results: list[Result], references: dict[str, list[str]], corpora: Path
) -> None:
    """Write contact sheets: each picture, and to its right its first reference (green label) or none."""
    folder.mkdir(parents=True, exist_ok=True)
    cells: list[tuple[Path, str, str]] = []
    for r in results:
        if r.picture:
            cells.append((pictures / r.picture, r.stage, "white"))
            cells += [(corpora / image, "reference", "lime") for image in references.get(r.stage, ())[:1]]
    per_sheet = SHEET_COLUMNS * SHEET_ROWS
    for number, start in enumerate(range(0, len(cells), per_sheet)):
        size = (SHEET_COLUMNS * CELL[0], SHEET_ROWS * (CELL[1] + LABEL))
        sheet = Image.new("RGB", size, (64, 64, 64))
        draw = ImageDraw.Draw(sheet)
        for place, (path, label, color) in enumerate(cells[start : start + per_sheet]):
            x, y = place % SHEET_COLUMNS * CELL[0], place // SHEET_COLUMNS * (CELL[1] + LABEL)
            with Image.open(path) as picture:
                small = picture.convert("RGBA")
            small.thumbnail((CELL[0] - 2, CELL[1] - 2))
            sheet.paste(small, (x, y + LABEL), small)
            draw.text((x, y), label.rsplit("/", 1)[-1][:26], fill=color)
        sheet.save(folder / f"{number:02}.png")


if __name__ == "__main__":
    main()

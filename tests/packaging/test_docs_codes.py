# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""docs/diagnostics.md lists exactly the codes that the source uses."""

import ast
import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_CODE = re.compile(r"[WN]\d{3}")


def _codes_in_source() -> set[str]:
    """Return every string literal of the host code that is a code and nothing else."""
    found = set()
    for path in (ROOT / "warp_rt").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and _CODE.fullmatch(node.value):
                found.add(node.value)
    return found


def _rows() -> list[str]:
    text = (ROOT / "docs" / "diagnostics.md").read_text(encoding="utf-8")
    return re.findall(r"^\| ([WN]\d{3}) \|", text, re.MULTILINE)


def test_every_code_has_its_row_and_every_row_its_code():
    assert _codes_in_source() == set(_rows())


def test_no_code_has_two_rows_and_rows_are_in_order():
    rows = _rows()
    assert [code for code, count in Counter(rows).items() if count > 1] == []
    families = [code[:2] for code in rows]
    assert list(dict.fromkeys(families)) == ["W1", "W2", "W3", "W4", "W5", "N9"]
    assert rows == sorted(rows, key=lambda code: (code[0] == "N", code))


def test_codes_that_other_documents_name_exist():
    listed = set(_rows())
    for path in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
        assert set(re.findall(r"\b[WN]\d{3}\b", path.read_text(encoding="utf-8"))) <= listed, path.name


def test_no_two_rules_share_a_code():
    """Modules that tell one rule import its constant, or name it alike."""
    names: dict[str, set[str]] = {}
    for path in (ROOT / "warp_rt").rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.Assign) or not isinstance(node.value, ast.Constant):
                continue
            if isinstance(node.value.value, str) and _CODE.fullmatch(node.value.value):
                names.setdefault(node.value.value, set()).update(ast.unparse(target) for target in node.targets)
    assert {code: found for code, found in names.items() if len(found) > 1} == {}

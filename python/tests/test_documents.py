"""The snippets of the documents run, in their order."""

from __future__ import annotations

import re
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

DOCUMENTS = Path(__file__).parents[1]
# Run by tests/consumers, where the library is installed.
ELSEWHERE = "<!-- needs "


def snippets(document: str) -> list[str]:
    """The Python blocks of a document that need no other library."""
    text = (DOCUMENTS / document).read_text()
    parts = re.split(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    before, blocks = parts[0::2], parts[1::2]
    return [block for text, block in zip(before, blocks) if not text.rstrip().split("\n")[-1].startswith(ELSEWHERE)]


@pytest.mark.parametrize(("document", "n"), [("README.md", 8), ("TUTORIAL.md", 5)])
def test_the_snippets_run(
    document: str, n: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    found = snippets(document)
    assert len(found) == n
    names: dict[str, Any] = {"__name__": "snippet"}
    for block in found:
        exec(compile(block, document, "exec"), names)
    printed = capsys.readouterr().out
    if document == "TUTORIAL.md":
        assert "15 routes, the first is village/E-left-1" in printed
        assert "own test: 100.0% (60/60); arrived 60" in printed and "'is_success': True" in printed
        assert list(tmp_path.glob("films/*.mp4"))
    else:
        assert "attard2023 test: 100.0% (46/46); arrived 46" in printed


def test_the_wheel_has_the_licence_of_everything_in_it() -> None:
    whole = DOCUMENTS.parent / "LICENSES"
    found = {file.name: file for file in metadata.files("offtrack-sim") or [] if "licenses" in file.parts}
    names = {"MIT.txt", "Apache-2.0.txt", "Ubuntu-font-1.0.txt", "MIT-carla.txt", "MIT-zalazone.txt"}
    assert found.keys() == names
    for name, file in found.items():
        assert file.read_text() == (whole / name).read_text(), name

"""What the documents link to and name exists, results are what the kept reports give, the front door stays short."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
import tarfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "docs/data"


def tracked(*patterns: str) -> list[Path]:
    names = subprocess.check_output(["git", "-C", str(ROOT), "ls-files", "-z", "--", *patterns], text=True)
    return [ROOT / name for name in names.split("\0") if name and (ROOT / name).exists()]


def prose(document: Path) -> str:
    """The text without its blocks of code."""
    return re.sub(r"^```.*?^```$", "", document.read_text(), flags=re.MULTILINE | re.DOTALL)


def links(document: Path) -> list[str]:
    """The targets of links and pictures, but for those on the web."""
    targets = re.findall(r"\]\(\s*<?([^)\s>]+)>?\s*\)", prose(document))
    return [target for target in targets if not re.match(r"[a-z]+:", target)]


def anchors(document: Path) -> set[str]:
    """The anchors of a document's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", prose(document), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def broken(document: Path, target: str) -> str | None:
    name, _, anchor = target.partition("#")
    file = (document.parent / name).resolve() if name else document
    if not file.exists():
        return "no such file"
    if anchor and anchor not in anchors(file):
        return "no such heading"
    return None


def test_every_relative_link_leads_to_a_file_and_a_heading() -> None:
    checked = [(document, target) for document in tracked("*.md", "*.ipynb") for target in links(document)]
    assert 20 <= len(tracked("*.md")) and 150 <= len(checked), len(checked)
    wrong = {f"{document.relative_to(ROOT)}: {target}": broken(document, target) for document, target in checked}
    assert {name: reason for name, reason in wrong.items() if reason} == {}


def test_a_missing_file_and_a_missing_heading_are_found() -> None:
    assert broken(ROOT / "README.md", "docs/nowhere.md") == "no such file"
    assert broken(ROOT / "README.md", "docs/results.md#nowhere") == "no such heading"
    assert broken(ROOT / "README.md", "docs/results.md#speed") is None


def test_files_that_are_named_by_their_path_exist() -> None:
    """Files of docs/ in commands and in code, but for those that a command shows how to get or to write."""
    pattern = re.compile(
        r"(?:--(?:json|plot|screenshot)[ =]|-o |\w{7}:)?\bdocs/[\w./-]+\.(?:json|svg|png|gif|safetensors|xz)\b"
    )
    written = re.compile(r"--|-o |\w{7}:")
    sources = tracked("*.md", "*.py", "*.sh", "*.toml", "*.rs")
    named = {(file, name) for file in sources for name in pattern.findall(file.read_text()) if not written.match(name)}
    assert 10 <= len(named), len(named)
    assert {f"{file.relative_to(ROOT)}: {name}" for file, name in named if not (ROOT / name).exists()} == set()


def test_reports_that_the_notebook_names_are_in_an_archive() -> None:
    members = {name for archive in DATA.glob("*.tar.xz") for name in tarfile.open(archive).getnames()}
    documents = [*tracked("docs/notebook/*.md"), ROOT / "docs/maps.md"]
    named = {(file.name, name) for file in documents for name in re.findall(r"`([\w-]+\.(?:json|csv))`", prose(file))}
    assert 6 <= len(named), len(named)
    assert {pair for pair in named if pair[1] not in members} == set()


def test_the_archives_are_those_that_their_list_names() -> None:
    listed = dict(re.findall(r"^\| `([^`]+)` \|.*`([0-9a-f]{64})` \|$", (DATA / "README.md").read_text(), re.MULTILINE))
    files = [file for file in tracked("docs/data") if file.suffix != ".md"]
    assert 14 <= len(files)
    assert listed == {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def test_the_summaries_are_what_the_archives_give() -> None:
    subprocess.run([sys.executable, str(ROOT / "benches/summaries.py"), "--check"], check=True)


def test_the_speeds_that_the_notebook_expects_of_cards_are_the_models() -> None:
    command = [sys.executable, str(ROOT / "benches/model.py"), "--table"]
    table = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    rows = [line for line in table.splitlines() if line.startswith("| M env steps/s")]
    speeds = [speed for row in rows for speed in re.findall(r"\d+/\*\*\d+\*\*/\d+", row)]
    assert len(speeds) == 6, table
    notebook = (ROOT / "docs/notebook/gpu.md").read_text()
    assert [speed for speed in speeds if speed not in notebook] == []


def test_every_result_says_when_it_was_made_and_by_which_commit_or_with_which_it_came() -> None:
    """`reported_in` is the commit that brought a result whose program named none."""
    files = tracked("docs/results/*.json")
    assert 20 <= len(files), len(files)
    for file in files:
        result = json.loads(file.read_text())
        assert re.match(r"2026-\d\d-\d\d", result.get("date", "")), file.name
        named = result.get("commit") or result.get("reported_in")
        commits = [named] if isinstance(named, str) else named
        assert commits and all(re.fullmatch(r"[0-9a-f]{12}(-dirty)?", commit) for commit in commits), file.name


def test_every_result_and_picture_is_linked_from_a_document() -> None:
    linked = {(document.parent / target).resolve() for document in tracked("*.md") for target in links(document)}
    files = [file for file in tracked("docs/results", "docs/images") if file.suffix != ".md"]
    assert 30 <= len(files)
    assert [file.name for file in files if file not in linked] == []
    for file in files:
        if file.suffix == ".json":
            json.loads(file.read_text())


def test_the_front_door_stays_short() -> None:
    words = {file: len(file.read_text().split()) for file in [ROOT / "README.md", *tracked("docs/**.md")]}
    assert words[ROOT / "README.md"] < 900
    assert sum(words.values()) - words[ROOT / "README.md"] < 15_000
    assert len((ROOT / "docs/results.md").read_text().splitlines()) <= 150
    page = ROOT / "docs/trucks.html"
    sizes = {file: file.stat().st_size for file in tracked("docs")}
    assert 1_000_000 < sizes.pop(page) < 4_000_000
    assert sum(sizes.values()) < 4_000_000

"""Makes docs/images/report.png: the page of the shipped policy's evaluation, as a browser shows it.

Needs Chromium, and Rust to build the program; no Python package. The result that the page shows is written into the
picture, as a text of PNG: a test compares it with the policy's report.
"""

import argparse
import html
import re
import shutil
import struct
import subprocess
import tempfile
import zlib
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
# The route, the episode and the time [s] that the replay shows.
SHOWN = "20m/W-left-4/3/9"
SIZE = "1280,1620"


def chromium(*arguments):
    """What a headless browser prints."""
    browser = next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "google-chrome"])), None)
    if browser is None:
        raise SystemExit("a browser is needed: install the package chromium")
    # The sandbox cannot start for root; the page is our own.
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"]
    flags += [f"--window-size={SIZE}", "--virtual-time-budget=20000"]
    return subprocess.run([browser, *flags, *arguments], check=True, capture_output=True, text=True).stdout


def verdict(document):
    """The words of the page's first figure, in one line."""
    block = re.search(r'<div id="verdict">(.*?)</div>', document, re.DOTALL)
    if block is None:
        raise SystemExit("the page has no verdict: its scripts have not run")
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", block.group(1))).split())


def with_text(png, keyword, text):
    """A PNG with an international text behind its header."""
    body = b"iTXt" + keyword.encode("latin-1") + bytes(5) + text.encode()
    chunk = struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
    # The signature has 8 bytes and the header chunk 25.
    return png[:33] + chunk + png[33:]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", help="an offtrack program that is built already")
    arguments = parser.parse_args()
    program = [arguments.program] if arguments.program else ["cargo", "run", "--release", "--locked", "--"]
    with tempfile.TemporaryDirectory() as folder:
        page, picture = Path(folder, "report.html"), Path(folder, "report.png")
        subprocess.run([*program, "evaluate", "--html", page], cwd=REPOSITORY, check=True, stdout=subprocess.DEVNULL)
        address = f"file://{page}#{SHOWN}"
        document = chromium("--dump-dom", address)
        if "-dirty" in document:
            raise SystemExit("the page names a commit: commit the changes first")
        text = verdict(document)
        chromium(f"--screenshot={picture}", address)
        made = with_text(picture.read_bytes(), "Description", text)
    (REPOSITORY / "docs/images/report.png").write_bytes(made)
    print(text)


if __name__ == "__main__":
    main()

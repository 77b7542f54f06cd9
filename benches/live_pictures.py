"""Makes docs/images/live-*.png: the page of `offtrack web` as a browser shows it.

Needs Chromium, Pillow, and Rust to build the program. The trucks drive on a software device, so that any machine can
make the pictures; their speed is that of the software.
"""

import argparse
import http.server
import io
import json
import shutil
import subprocess
import tempfile
import threading
from pathlib import Path

from PIL import Image

REPOSITORY = Path(__file__).resolve().parent.parent
# Flags of a browser that computes and draws on the processor.
SOFTWARE = [
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-angle=swiftshader",
    "--disable-vulkan-surface",
    "--disable-gpu-watchdog",
]
DESK, PHONE = (1280, 800), (400, 820)
# Pictures by name: size, and what live_pictures.js does: what is chosen, steps in which all trucks set out, steps in
# all, the truck that is followed for some steps more, and how it is driven then (rad, m/s; steps).
FOLLOWED = {"route": "^20m.*left-[34]$", "along": 28, "followed": 45}
DRIVEN = [({"steering": 0.2, "speed": 6.0}, 8), ({"steering": 0.12, "speed": 6.0}, 5)]
PICTURES = {
    "crowd": (DESK, {"chosen": {"n": 1024}, "filled": 110, "steps": 150}),
    "followed": (DESK, {"chosen": {"n": 128}, "filled": 110, "steps": 150, **FOLLOWED}),
    "taken-over": (DESK, {"chosen": {"n": 128}, "filled": 110, "steps": 150, **FOLLOWED, "driven": DRIVEN}),
    "phone": (PHONE, {"chosen": {"n": 256, "road": 3}, "filled": 90, "steps": 110, **FOLLOWED}),
}
# Numbers of colours, of which a picture has the first with which its file is small enough (bytes).
COLOURS, MOST_BYTES = (64, 48, 40, 32), 60_000


def chromium(size, *arguments):
    """A headless browser, started."""
    browser = next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "google-chrome"])), None)
    if browser is None:
        raise SystemExit("a browser is needed: install the package chromium")
    # The sandbox cannot start for root; the page is our own.
    flags = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run", "--hide-scrollbars"]
    # A window is never narrower than 500 pixels; a frame in it is.
    flags += [f"--window-size={max(size[0], 500)},{size[1]}"]
    return subprocess.Popen([browser, *flags, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def framed(size, address):
    """A document that shows another one in a frame of this size."""
    style = f"border: 0; position: fixed; left: 0; top: 0; width: {size[0]}px; height: {size[1]}px"
    return f'<!DOCTYPE html><iframe src="{address}" style="{style}"></iframe>'


def visited(page, size, plan, folder):
    """The document that a page has become, and its figures in words."""
    frame = framed(size, "page.html")
    files = {"/frame.html": frame.encode(), "/page.html": page.encode(), "/plan": json.dumps(plan).encode()}
    given, is_done = {}, threading.Event()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            body = files.get(self.path)
            self.send_response(404 if body is None else 200)
            self.send_header("Content-Type", "text/html" if self.path.endswith(".html") else "application/json")
            self.end_headers()
            self.wfile.write(body or b"")

        def do_POST(self):
            given[self.path] = self.rfile.read(int(self.headers["Content-Length"])).decode()
            self.send_response(200)
            self.end_headers()
            if self.path in ("/done", "/failed"):
                is_done.set()

        def log_message(self, *_):
            """Says nothing."""

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_address[1]}/frame.html"
        browser = chromium(size, *SOFTWARE, f"--user-data-dir={folder}/profile", address)
        try:
            if not is_done.wait(1200):
                raise SystemExit("the page is not done after 20 minutes")
        finally:
            browser.kill()
            browser.wait()
            server.shutdown()
    if "/failed" in given:
        raise SystemExit(f"the page failed: {given['/failed']}")
    return given["/document"], given["/done"]


def reduced(image):
    """A picture's file in few colours. A colour counts by the root of its area: lines keep theirs beside the grass."""
    counted = image.getcolors(image.width * image.height)
    weighed = [colour for n, colour in counted for _ in range(max(1, round(n**0.5)))]
    line = Image.new("RGB", (len(weighed), 1))
    line.putdata(weighed)
    for n_colours in COLOURS:
        palette = line.quantize(n_colours, method=Image.Quantize.MEDIANCUT, kmeans=2)
        file = io.BytesIO()
        image.quantize(palette=palette, dither=Image.Dither.NONE).save(file, "PNG", optimize=True)
        if len(file.getvalue()) <= MOST_BYTES:
            break
    return file.getvalue()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", help="an offtrack program that is built already")
    parser.add_argument("--only", choices=PICTURES, help="one picture alone")
    arguments = parser.parse_args()
    program = [arguments.program] if arguments.program else ["cargo", "run", "--release", "--locked", "--"]
    script = (REPOSITORY / "benches/live_pictures.js").read_text()
    main_script = (REPOSITORY / "evaluation/src/live/main.js").read_text()
    for name in [arguments.only] if arguments.only else PICTURES:
        size, plan = PICTURES[name]
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            files = ("trucks.html", "shown.html", "frame.html", "shown.png")
            written, shown, frame, picture = (Path(folder, file) for file in files)
            subprocess.run([*program, "web", "-o", written], cwd=REPOSITORY, check=True, stdout=subprocess.DEVNULL)
            page = written.read_text()
            if main_script not in page:
                raise SystemExit("the page has another last script than evaluation/src/live/main.js: build the program")
            # The page's policy forbids it to load anything; this one talks to this program.
            policy = "default-src 'none';"
            page = page.replace(main_script, script).replace(policy, f"{policy} connect-src 'self';")
            document, figures = visited(page, size, plan, folder)
            shown.write_text(document)
            frame.write_text(framed(size, shown.name))
            flags = ["--disable-gpu", f"--user-data-dir={folder}/another", f"--screenshot={picture}"]
            chromium(size, *flags, f"file://{frame}").wait()
            image = Image.open(picture).convert("RGB").crop((0, 0, *size))
        (REPOSITORY / f"docs/images/live-{name}.png").write_bytes(reduced(image))
        print(f"live-{name}.png: {figures}")


if __name__ == "__main__":
    main()

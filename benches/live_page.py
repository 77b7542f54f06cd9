"""The page of `offtrack web` in headless Chromium, with a script of this folder in place of its last one.

The browser computes and draws on the processor, so that any machine will do.
"""

import http.server
import json
import shutil
import subprocess
import threading
from pathlib import Path

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
    """What a page posts, by name: at its end its figures as `/done`."""
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
    return given


def page_with(program, script, folder):
    """The page that a program writes, with a script of this folder in place of its last one."""
    written = Path(folder, "trucks.html")
    main_script = (REPOSITORY / "evaluation/src/live/main.js").read_text()
    subprocess.run([*program, "web", "-o", written], cwd=REPOSITORY, check=True, stdout=subprocess.DEVNULL)
    page = written.read_text()
    if main_script not in page:
        raise SystemExit("the page has another last script than evaluation/src/live/main.js: build the program")
    # The page's policy forbids it to load anything; this one talks to this program.
    policy = "default-src 'none';"
    page = page.replace(main_script, (REPOSITORY / "benches" / script).read_text())
    return page.replace(policy, f"{policy} connect-src 'self';")

"""Makes docs/images/live-*.png: the page of `offtrack web` as a browser shows it.

Needs Chromium, Pillow, and Rust to build the program. The trucks drive on a software device, so that any machine can
make the pictures; their speed is that of the software.
"""

import argparse
import io
import tempfile
from pathlib import Path

from live_page import REPOSITORY, chromium, framed, page_with, visited
from PIL import Image

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
    for name in [arguments.only] if arguments.only else PICTURES:
        size, plan = PICTURES[name]
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            shown, frame, picture = (Path(folder, file) for file in ("shown.html", "frame.html", "shown.png"))
            given = visited(page_with(program, "live_pictures.js", folder), size, plan, folder)
            shown.write_text(given["/document"])
            frame.write_text(framed(size, shown.name))
            flags = ["--disable-gpu", f"--user-data-dir={folder}/another", f"--screenshot={picture}"]
            chromium(size, *flags, f"file://{frame}").wait()
            image = Image.open(picture).convert("RGB").crop((0, 0, *size))
        (REPOSITORY / f"docs/images/live-{name}.png").write_bytes(reduced(image))
        print(f"live-{name}.png: {given['/done']}")


if __name__ == "__main__":
    main()

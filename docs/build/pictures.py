"""Make the pictures of README and site from today's results: `make pictures`.

    python docs/build/pictures.py                    # all of them
    python docs/build/pictures.py report body        # some
    python docs/build/pictures.py --made report      # drawn from what the last call computed

Each picture is made by the command that its page shows, from what comes with gaitval: built-in
subjects, stored baselines and the sample recording. Two are of published recordings and need
`GAITVAL_DATA`; without it they stay as they are, and a line says so. What is computed is kept in
`build/pictures` (`--work`), where a run that was interrupted goes on. Needs Chromium.

A picture is the page as a reader sees it, with as many colours as keep it below `LARGEST`.
"""

import argparse
import io
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from PIL import Image, ImageChops
from playwright.sync_api import sync_playwright

ROOT: Final = Path(__file__).parents[2]
FLAGS: Final = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-gpu-rasterization",
)
"""Graphics without a graphics card; the page around them is painted without, which is faster."""
DOCS: Final = ROOT / "docs"
LARGEST: Final = 150_000
"""Bytes of a picture: what a page may load without a wait."""
COLOURS: Final = (256, 64)
SHARES: Final = (1.0, 0.8, 0.65, 0.5)
"""Of the size of a picture, tried in this order."""
WIDTH: Final = 800
"""CSS pixels of the window: a report's text is then read without a zoom."""
SCALE: Final = 1.5
"""Pixels of a picture for each CSS pixel."""
SETTLING: Final = 6000
"""ms, in which the replay draws its first frames."""
PAINTING: Final = 500
"""ms, in which the browser paints what has just come into the window."""
MARGIN: Final = 12
"""Pixels that are left above and below what is drawn."""
BEGINNING: Final = 400
"""CSS pixels of a long verdict that are shown."""
UNWANTED: Final = ".replay-cursor, .replay-dot, button.copy"
"""In pictures of tables and curves: the replay's place in the curves, and buttons."""
HUNDREDTHS: Final = 8
"""Hundredths of a gait cycle after the start, where both feet carry the walker."""

PUSHED: Final = """
import sys
from pathlib import Path

import mujoco
from PIL import Image

sys.path.insert(0, sys.argv[1])
import walk

walker = walk.MujocoWalker(Path(sys.argv[1]))
observation = walker.reset()
while walker.phase < 2.24:
    observation, _ = walker.step(walker.act(observation))
walker.push[1, 1] = 150.0
walker.step(walker.act(observation))
camera, options = mujoco.MjvCamera(), mujoco.MjvOption()
walk.look(camera, options)
camera.distance = 2.4
mujoco.mj_forward(walker.model, walker.data)
with mujoco.Renderer(walker.model, 480, 640) as renderer:
    renderer.update_scene(walker.data, camera, options)
    Image.fromarray(renderer.render()).save(f"{sys.argv[1]}/walker.png")
"""
"""The exported walker in the stance of its third cycle, while it is pushed to its left."""

Shot = Callable[[Any], list[bytes]]


def element(page: Any, selector: str) -> bytes:
    """The first element of the page that a selector finds, as PNG, without what is there to be
    clicked or to follow the replay.
    """
    place = page.locator(selector).first
    place.scroll_into_view_if_needed()
    page.wait_for_timeout(PAINTING)
    page.evaluate(f"document.querySelectorAll('{UNWANTED}').forEach(e => e.style.display = 'none')")
    found: bytes = place.screenshot()
    return found


def after(heading: str) -> str:
    """The drawing of the first figure below a heading."""
    figure = f"//h2[normalize-space()='{heading}']/following::figure[1]"
    return f"xpath={figure}//*[local-name()='svg']"


def walker(page: Any) -> list[bytes]:
    """The replay, stopped where both feet are on the ground."""
    page.locator(".replay-stage").scroll_into_view_if_needed()
    page.wait_for_timeout(SETTLING)
    page.locator("canvas.replay-canvas").focus()
    page.keyboard.press("Space")
    page.keyboard.press("Home")
    for _ in range(HUNDREDTHS):
        page.keyboard.press("ArrowRight")
    page.wait_for_timeout(SETTLING)
    return [element(page, ".replay-stage")]


def report(page: Any) -> list[bytes]:
    """The first page: verdict, curves, and the tables below them."""
    return [element(page, f".sheet {part}") for part in ("header", ".verdict", "figure", ".halves")]


def learning(page: Any) -> list[bytes]:
    """What the training did."""
    return [element(page, after("Learning"))]


def recording(page: Any) -> list[bytes]:
    """The beginning of an import's verdict, and its moments."""
    return [*failed(page), element(page, after("Joint moments and power"))]


def failed(page: Any) -> list[bytes]:
    """The beginning of an import's verdict: what failed comes first."""
    image = Image.open(io.BytesIO(element(page, ".verdict")))
    beginning = io.BytesIO()
    image.crop((0, 0, image.width, min(image.height, round(BEGINNING * SCALE)))).save(
        beginning, "PNG"
    )
    return [beginning.getvalue()]


def whole(page: Any) -> list[bytes]:
    """The whole page, if that is a picture or a summary."""
    return [element(page, "main, svg, img")]


def beginning(page: Any) -> list[bytes]:
    """The top of a page, as high as it is wide."""
    page.wait_for_timeout(SETTLING)
    page.evaluate(f"document.querySelectorAll('{UNWANTED}').forEach(e => e.style.display = 'none')")
    shot: bytes = page.screenshot(
        clip={"x": 0, "y": 0, "width": WIDTH, "height": WIDTH}, full_page=True
    )
    return [shot]


def device(page: Any) -> list[bytes]:
    """The replay, and the curves of the right side."""
    page.locator(".replay-stage").scroll_into_view_if_needed()
    page.wait_for_timeout(SETTLING)
    return [element(page, ".replay-stage"), element(page, after("Right side"))]


def first_figure(page: Any) -> list[bytes]:
    """What a page says first, and its first figure."""
    return [element(page, ".verdict"), element(page, "figure")]


@dataclass(frozen=True)
class Picture:
    """How a picture is made.

    Attributes
    ----------
    step : what computes it, a key of `STEPS`.
    page : what is drawn, below the work folder.
    shot : which part of it.
    """

    step: str
    page: str
    shot: Shot


PICTURES: Final = {
    "walker": Picture("study", "S05/report.html", walker),
    "report": Picture("study", "S05/report.html", report),
    "learning": Picture("trained", "S05-train/report.html", learning),
    "estimate": Picture("kinematics", "S05-kinematics/estimate/estimate.html", first_figure),
    "slope": Picture("slope", "S05-up/at-1.12/report.html", walker),
    "device": Picture("device", "S05-ankle_spring/device.html", device),
    "body": Picture("body", "body.html", beginning),
    "compare": Picture("compare", "compare/comparison.html", beginning),
    "change": Picture("change", "change/change.html", beginning),
    "judge": Picture("judge", "judged/judge.html", beginning),
    "muscles": Picture("muscles", "muscles/muscles.html", beginning),
    "recording": Picture("treadmill", "treadmill/recording/recording.html", recording),
    "recording-failed": Picture("overground", "overground/recording/recording.html", failed),
    "check": Picture("check", "check/summary.md", whole),
    "placement": Picture("placement", "placement.svg", whole),
    "mujoco": Picture("mujoco", "mujoco/walker.png", whole),
}

SAMPLE: Final = ("--static", "sample/standing.c3d", "--trial", "sample/walking.c3d")
STEPS: Final[dict[str, tuple[str, ...]]] = {
    "study": ("subject", "5", "--out", "S05"),
    "trained": ("subject", "5", "--train", "--out", "S05-train"),
    "kinematics": ("subject", "5", "--use", "kinematics", "--out", "S05-kinematics"),
    "slope": ("predict", "5", "--slope", "5", "--load", "20", "--out", "S05-up"),
    "device": ("device", "5", "ankle_spring", "--out", "S05-ankle_spring"),
    "body": ("body", "5", "--page", "body.html"),
    "compare": (
        "compare",
        *(f"{{root}}/reports/S{n:02d}" for n in range(1, 11)),
        "--out",
        "compare",
    ),
    "first-half": (
        *("import", "--static", "{data}/wbds/raw/WBDS01static1.c3d"),
        *("--trial", "{data}/wbds/raw/WBDS01walkT01.c3d", "--trial-time", "0:15"),
        *("--mass", "74.3", "--height", "1.725", "--sex", "M", "--out", "first-half"),
    ),
    "second-half": (
        *("import", "--static", "{data}/wbds/raw/WBDS01static1.c3d"),
        *("--trial", "{data}/wbds/raw/WBDS01walkT01.c3d", "--trial-time", "15:30"),
        *("--mass", "74.3", "--height", "1.725", "--sex", "M", "--out", "second-half"),
    ),
    "change": ("change", "first-half", "second-half", "--out", "change"),
    "judge": (
        *("judge", "imported/recording/model.osim", "--out", "judged"),
        *("--ik", "imported/recording/trial1_ik.mot", "--id", "imported/recording/trial1_id.sto"),
        *("--markers", "imported/recording/trial1_markers.trc"),
        *("--external-loads", "imported/recording/trial1_external_loads.xml"),
    ),
    "muscles": ("muscles", "imported", "--bands", "--out", "muscles"),
    "imported": (
        *("import", *SAMPLE, "--mass", "64.95", "--height", "1.53", "--sex", "F"),
        *("--belt", "1.1473", "--out", "imported"),
    ),
    "treadmill": (
        *("import", "--static", "{data}/wbds/raw/WBDS01static1.c3d"),
        *("--trial", "{data}/wbds/raw/WBDS01walkT01.c3d", "--consistent"),
        *("--mass", "74.3", "--height", "1.725", "--sex", "M", "--out", "treadmill"),
    ),
    "overground": (
        *("import", "--static", "{data}/opensim_rajagopal/ExpData/static_walk_1.trc"),
        *("--trial", "{data}/opensim_rajagopal/ExpData/motion_capture_walk.trc"),
        *("--forces", "{data}/opensim_rajagopal/ExpData/grf_walk.mot", "--consistent"),
        *("--mass", "85.07", "--height", "1.829", "--sex", "M", "--out", "overground"),
    ),
}
"""The command of each step, run in the work folder."""
BEFORE: Final = {
    "judge": "imported",
    "muscles": "imported",
    "imported": "sample",
    "second-half": "first-half",
    "change": "second-half",
}
"""The step that another one needs."""
DISSIPATION: Final = "contact.dissipation"
"""What the law of contact reads, for `softened`."""
REFUSED: Final = 2
"""Exit code of gaitval for what it cannot use; 1 is a limit that failed, which is a result."""


class Lacking(Exception):
    """A picture that cannot be made here, and what it needs."""


def prepared(step: str, work: Path, done: set[str]) -> None:
    """Compute a step, and what it needs, once."""
    if step in done:
        return
    if step in BEFORE:
        prepared(BEFORE[step], work, done)
    sys.stdout.write(f"{step} ...\n")
    sys.stdout.flush()
    if step == "sample":
        shutil.rmtree(work / "sample", ignore_errors=True)
        gaitval(work, "data", "sample")
    elif step == "check":
        softened(work / "check")
    elif step == "placement":
        script = [sys.executable, "-m", "experiments.foot_placement", "--out"]
        subprocess.run([*script, str((work / "placement.svg").resolve())], cwd=ROOT, check=True)
    elif step == "mujoco":
        gaitval(work, "export", "5", "--to", "mujoco", "--out", "mujoco")
        script = [sys.executable, "-P", "-c", PUSHED, "mujoco"]
        subprocess.run(script, cwd=work, env=os.environ | {"MUJOCO_GL": "egl"}, check=True)
    else:
        words = STEPS[step]
        data = os.environ.get("GAITVAL_DATA")
        if data is None and any("{data}" in word for word in words):
            raise Lacking("set GAITVAL_DATA to the folder with the published recordings")
        # a page shows the path as it was given, and a picture shows no folder of this machine
        root, data = os.path.relpath(ROOT, work), str(Path(data or "").resolve())
        gaitval(work, *(word.format(data=data, root=root) for word in words))
    done.add(step)


def gaitval(work: Path, *words: str) -> None:
    """Run a command of gaitval in a folder; its output goes into a log there."""
    log = work / f"{words[0]}.log"
    with log.open("w", encoding="utf-8") as file:
        command = [sys.executable, "-P", "-m", "gaitval", *words]
        code = subprocess.run(command, cwd=work, stdout=file, stderr=file, check=False).returncode
    if code >= REFUSED:
        raise SystemExit(f"gaitval {' '.join(words)}: exit code {code}, see {log}")


def softened(folder: Path) -> None:
    """Check two stored walks with a copy of gaitval in which somebody halved the dissipation of the
    contact.
    """
    shutil.rmtree(folder, ignore_errors=True)
    copy = folder / "changed"
    shutil.copytree(ROOT / "gaitval", copy / "gaitval", ignore=shutil.ignore_patterns("*.nb[ci]"))
    shutil.copytree(ROOT / "models", copy / "models")
    law = copy / "gaitval/walk/contact/hunt_crossley.py"
    text = law.read_text(encoding="utf-8")
    if text.count(DISSIPATION) != 1:
        raise SystemExit(f"{law}: {DISSIPATION!r} is not there once.")
    law.write_text(text.replace(DISSIPATION, f"0.5 * {DISSIPATION}"), encoding="utf-8")
    for name in ("S05", "S08"):
        kept = f"reports/{name}/baseline"
        shutil.copytree(ROOT / kept, folder / kept)
    wanted = os.environ | {
        "BASELINES": "reports/S05/baseline\nreports/S08/baseline",
        "OUT": ".",
        "PYTHONPATH": str(copy),
    }
    wanted.pop("GITHUB_STEP_SUMMARY", None)
    script = [sys.executable, str(ROOT / "scripts/action_check.py")]
    subprocess.run(script, cwd=folder, env=wanted, stdout=subprocess.DEVNULL, check=False)
    if "**lost**" not in (folder / "summary.md").read_text(encoding="utf-8"):
        raise SystemExit(f"{folder / 'summary.md'}: nothing was lost.")


def trimmed(image: Image.Image) -> Image.Image:
    """A picture without its empty rows at the top and at the bottom."""
    inked = ImageChops.difference(image, Image.new("RGB", image.size, "white")).getbbox()
    if inked is None:
        return image
    top, bottom = max(0, inked[1] - MARGIN), min(image.height, inked[3] + MARGIN)
    return image.crop((0, top, image.width, bottom))


def stacked(parts: list[bytes]) -> Image.Image:
    """Pictures below each other, on white."""
    images = [trimmed(Image.open(io.BytesIO(part)).convert("RGB")) for part in parts]
    gap = round(12 * SCALE)
    height = sum(image.height for image in images) + gap * (len(images) - 1)
    sheet = Image.new("RGB", (max(image.width for image in images), height), "white")
    top = 0
    for image in images:
        sheet.paste(image, (0, top))
        top += image.height + gap
    return sheet


def write(image: Image.Image, path: Path) -> int:
    """Write a picture, smaller or with fewer colours until it is within `LARGEST`; return its
    size in bytes.
    """
    for share in SHARES:
        size = round(share * image.width), round(share * image.height)
        smaller = image.resize(size, Image.Resampling.LANCZOS)
        for colours in COLOURS:
            smaller.quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)
            if path.stat().st_size <= LARGEST:
                return path.stat().st_size
    raise SystemExit(f"{path}: {path.stat().st_size} bytes, at most {LARGEST}")


def as_page(summary: Path, folder: Path) -> Path:
    """A summary in Markdown as a page, in the letters of the forge that shows it."""
    from markdown import markdown

    style = (
        "main{font:15px sans-serif;padding:1em;width:46em;box-sizing:border-box}"
        "table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:.35em .7em}"
        "th{text-align:left}code{font-size:.9em}"
    )
    text = markdown(summary.read_text(encoding="utf-8"), extensions=["tables", "md_in_html"])
    page = folder / "summary.html"
    page.write_text(
        f"<!doctype html><meta charset='utf-8'><style>{style}</style><main>{text}</main>",
        encoding="utf-8",
    )
    return page


def address(picture: Picture, work: Path) -> str:
    """Where the browser finds what is drawn."""
    path = work / picture.page
    if path.suffix == ".md":
        path = as_page(path, work)
    return path.resolve().as_uri()


def draw(name: str, work: Path, browser: Any) -> None:
    """Draw one picture into docs/."""
    picture = PICTURES[name]
    page = browser.new_page(
        viewport={"width": WIDTH, "height": 900}, device_scale_factor=SCALE, color_scheme="light"
    )
    page.set_default_timeout(180_000)
    page.goto(address(picture, work))
    parts = picture.shot(page)
    page.close()
    path = DOCS / f"{name}.png"
    size = write(stacked(parts), path)
    sys.stdout.write(f"{path.relative_to(ROOT)}: {size / 1000:.0f} kB\n")


def main() -> None:
    """Compute and draw what is asked for, or everything."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("pictures", nargs="*", metavar="PICTURE", help=", ".join(PICTURES))
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "pictures")
    parser.add_argument("--made", action="store_true", help="compute nothing")
    wanted = parser.parse_args()
    unknown = sorted(set(wanted.pictures) - set(PICTURES))
    if unknown:
        sys.exit(f"no such picture: {', '.join(unknown)}. There are: {', '.join(PICTURES)}.")
    executable = os.environ.get("GAITVAL_CHROMIUM") or shutil.which("chromium")
    if executable is None:
        sys.exit("no chromium on the path: apt-get install chromium, or set GAITVAL_CHROMIUM")
    wanted.work.mkdir(parents=True, exist_ok=True)
    done: set[str] = set()
    with sync_playwright() as browsers:
        browser = browsers.chromium.launch(executable_path=executable, args=list(FLAGS))
        for name in wanted.pictures or PICTURES:
            try:
                if not wanted.made:
                    prepared(PICTURES[name].step, wanted.work, done)
                draw(name, wanted.work, browser)
            except Lacking as lacking:
                sys.stdout.write(f"{name}: left as it is: {lacking}\n")
        browser.close()


if __name__ == "__main__":
    main()

"""The replay in a browser: it draws, moves, can be reached by keyboard, and needs nothing else."""

import io
import json
import re
import time

import numpy as np
import pytest
from browser import FLAGS
from html_page import only_html
from page_in_browser import chromium as found_chromium
from PIL import Image
from report_run import build_run
from synthetic_walk import MODEL

from gaitval._internal.io.artefacts import read_json
from gaitval.metrics.results import read_metrics
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames
from gaitval.reporting import replay
from gaitval.reporting.report import write_report
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.rollout import Rollout

pytestmark = pytest.mark.slow  # a browser

FIRST_FRAME = "performance.getEntriesByName('replay-first-frame').length > 0"
THREE_PERCENT = "+document.querySelector('.replay-slider input').value >= 3"
SCROLLED = (
    "[...document.querySelectorAll('.sheet .scroll')]"
    ".filter((e) => e.scrollWidth > e.clientWidth + 1).map((e) => e.getAttribute('aria-label'))"
)
BLUE, ORANGE = (0x00, 0x55, 0x8F), (0xD9, 0x6B, 0x0A)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    build_run(folder)
    with pytest.MonkeyPatch.context() as patch:
        only_html(patch)
        write_report(folder)
    return folder


class Opened:
    """A page of a file, without a network; what it complained about is in `complaints`."""

    def __init__(self, chromium, path, *, script=None, width=800, **options):
        options.setdefault("reduced_motion", "reduce")
        self.context = chromium.new_context(
            viewport={"width": width, "height": 900}, offline=True, **options
        )
        if script is not None:
            self.context.add_init_script(script)
        self.page = self.context.new_page()
        self.page.set_default_timeout(120_000)
        self.complaints: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("requestfailed", self._note)
        self.page.goto(path.as_uri())

    def _note(self, request):
        if request.failure != "csp":  # stopped before the network, which is off as well
            self.complaints.append(f"asked for {request.url}: {request.failure}")

    def drawn(self):
        self.until(FIRST_FRAME)
        return self

    def until(self, condition):
        """Playwright's own wait evaluates in the page, whose policy forbids it."""
        end = time.monotonic() + 120
        while not self.page.evaluate(condition):
            assert time.monotonic() < end, condition
            self.page.wait_for_timeout(50)

    def go(self, stride, percent):
        self.page.evaluate(f"document.getElementById('replay').replay.go({stride}, {percent})")
        self.settle()

    def settle(self):
        self.page.evaluate(
            "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )

    def pixels(self) -> np.ndarray:
        """What is shown once the browser has stopped changing it."""
        before, now = self._screenshot(), self._screenshot()
        end = time.monotonic() + 20
        while (before != now).any() and time.monotonic() < end:
            before, now = now, self._screenshot()
        return now

    def _screenshot(self) -> np.ndarray:
        data = self.page.locator(".replay-canvas").screenshot()
        return np.array(Image.open(io.BytesIO(data)).convert("RGB"), dtype=int)

    def shows(self, picture) -> bool:
        """Whether it comes to show a picture again, but for the edges of what is drawn.

        A browser composes frames at its own pace and may place a canvas between two pixels.
        """
        end = time.monotonic() + 20
        while (np.abs(self.pixels() - picture).max(axis=-1) > 40).mean() > 0.002:
            if time.monotonic() > end:
                return False
            self.page.wait_for_timeout(50)
        return True

    def value(self) -> int:
        return int(self.page.locator(".replay-slider input").input_value())


@pytest.fixture(scope="module")
def chromium(request):
    program = found_chromium(request.config)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as browsers:
        browser = browsers.chromium.launch(executable_path=program, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def opened_once(chromium, folder):
    """The page for a reader who asked for little motion: it waits at the first frame."""
    opened = Opened(chromium, folder / "report.html").drawn()
    yield opened
    assert opened.complaints == []
    opened.context.close()


@pytest.fixture
def still(opened_once):
    """That page as it was opened, whatever the tests before have turned: they come in any order."""
    opened_once.page.locator(".replay-canvas").focus()
    opened_once.page.keyboard.press("0")
    opened_once.go(0, 0)
    return opened_once


def like(pixels, colour) -> np.ndarray:
    """Where a picture has the hue of a colour, lit or in shade."""
    near = pixels / np.maximum(pixels.max(axis=-1, keepdims=True), 1)
    wanted = np.array(colour) / max(colour)
    return (np.abs(near - wanted).max(axis=-1) < 0.08) & (pixels.max(axis=-1) > 60)


def test_a_walker_is_drawn_and_moves(still):
    still.go(0, 10)
    first = still.pixels()
    background = first[2, -2]
    walker = np.abs(first - background).max(axis=-1) > 40
    assert 0.03 < walker.mean() < 0.5
    assert min(like(first, BLUE).sum(), like(first, ORANGE).sum()) > 500
    still.go(0, 60)
    assert (np.abs(still.pixels() - first).max(axis=-1) > 40).mean() > 0.01
    still.go(0, 10)
    assert still.shows(first)


def test_right_and_left_and_forward_are_where_a_viewer_expects_them(still):
    """From the front the right side is to the viewer's left; from the right it walks rightwards."""
    still.go(0, 55)
    columns = np.arange(still.pixels().shape[1])
    still.page.get_by_role("button", name="Front").click()
    still.settle()
    front = still.pixels()
    right, left = (like(front, colour).sum(axis=0) @ columns for colour in (BLUE, ORANGE))
    assert right / like(front, BLUE).sum() < left / like(front, ORANGE).sum() - 20
    still.page.get_by_role("button", name="Top").click()
    still.settle()
    top = still.pixels()
    right, left = (like(top, colour).sum(axis=0) @ columns for colour in (BLUE, ORANGE))
    assert right / like(top, BLUE).sum() > left / like(top, ORANGE).sum() + 20
    still.page.get_by_role("button", name="Right side").click()
    still.settle()
    assert still.page.locator("[data-view=side]").get_attribute("aria-pressed") == "true"
    side = still.pixels()
    # at 55 % of the right cycle the left leg has landed in front of the right one
    low = slice(int(0.75 * len(side)), None)
    ahead = like(side, ORANGE)[low].sum(axis=0) @ columns / like(side, ORANGE)[low].sum()
    behind = like(side, BLUE)[low].sum(axis=0) @ columns / like(side, BLUE)[low].sum()
    assert ahead > behind + 20


def test_joints_are_drawn_where_the_model_has_them(still, folder):
    rollout = Rollout.load(folder / "rollouts" / "identified.npz")
    metrics = read_metrics(folder)
    recorded = replay.recorded_motion(metrics, ReferenceMotion.load(folder / "reference.npz"))
    walk = replay.shown_walk(MODEL, rollout, metrics.method, recorded)
    for stride, percent in ((0, 0), (2, 43), (5, 100)):
        still.go(stride, percent)
        for of, positions in (("body", walk.positions[stride]), ("recorded", walk.recorded)):
            frames = segment_frames(MODEL, positions[[percent]])[0]
            for name in ("thigh_r", "thigh_l", "foot_r", "foot_l"):
                shown = still.page.evaluate(
                    f"document.getElementById('replay').replay.joint('{name}', '{of}')"
                )
                joint = frames[SEGMENTS.index(name), :3, 3]
                np.testing.assert_allclose(shown, joint, atol=1e-3)


def test_a_picture_a_video_and_a_page_are_saved(chromium, still, tmp_path):
    """The page is the replay alone, and runs where another page embeds it."""

    def saved(name):
        with still.page.expect_download() as waiting:
            still.page.get_by_role("button", name=name, exact=True).click()
        path = tmp_path / waiting.value.suggested_filename
        waiting.value.save_as(path)
        return path

    still.go(0, 30)
    picture = np.array(Image.open(saved("Picture")).convert("RGB"), dtype=int)
    assert min(like(picture, BLUE).sum(), like(picture, ORANGE).sum()) > 500
    still.page.locator(".replay-speed").select_option("1")
    video = saved("Video")
    still.page.locator(".replay-speed").select_option("0.25")
    assert video.suffix == ".webm"
    assert video.read_bytes()[:4] == b"\x1a\x45\xdf\xa3"  # EBML, of WebM
    assert video.stat().st_size > 10_000
    alone = saved("Page")
    assert alone.stat().st_size < 6e6
    outside = tmp_path / "outside.html"
    outside.write_text(f'<iframe src="{alone.name}" width="360" height="700"></iframe>')
    opened = Opened(chromium, outside, width=400)
    frame = opened.page.frame_locator("iframe")
    frame.locator(".replay-player").wait_for(state="visible")
    data = frame.locator(".replay-canvas").screenshot()
    pixels = np.array(Image.open(io.BytesIO(data)).convert("RGB"), dtype=int)
    assert min(like(pixels, BLUE).sum(), like(pixels, ORANGE).sum()) > 200
    assert opened.complaints == []
    opened.context.close()


def test_the_slider_and_the_keys_move_the_walk(still):
    still.go(0, 20)
    still.page.locator(".replay-canvas").focus()
    for key, value in (
        *(("ArrowRight", 21), ("ArrowRight", 22), ("ArrowLeft", 21)),
        *(("End", 100), ("Home", 0), ("ArrowLeft", 0)),
    ):
        still.page.keyboard.press(key)
        still.settle()
        assert still.value() == value
    slider = still.page.get_by_role("slider")
    slider.focus()
    still.page.keyboard.press("ArrowRight")
    still.settle()
    assert still.value() == 1
    assert slider.get_attribute("aria-valuetext").startswith("Right 1 %, left ")
    assert "double support" in slider.get_attribute("aria-valuetext")
    assert "double support" in still.page.locator(".replay-live").inner_text()
    still.page.locator(".replay-canvas").focus()
    for key in ("1", "2", "3", "4", "5", "0"):
        still.page.keyboard.press(key)
        still.settle()
        pressed = still.page.locator("[data-view][aria-pressed=true]")
        assert pressed.get_attribute("aria-keyshortcuts") == key
    before = still.pixels()
    still.page.keyboard.press("Shift+ArrowLeft")
    still.settle()
    turned = still.pixels()
    assert still.value() == 1
    assert (np.abs(turned - before).max(axis=-1) > 40).mean() > 0.01


def cursor(still, figure, side):
    """% of the axis at which the cursor of the first panel of a side is."""
    return still.page.evaluate(
        f"""() => {{
            const group = document.querySelector('[id="{figure}-cycle.both.0"]');
            const box = group.querySelector('.replay-hit').getBBox();
            const line = group.querySelector('.replay-cursor.{side}');
            return 100 * (line.getAttribute('x1') - box.x) / box.width;
        }}"""
    )


def figure_of(still, name):
    figure = still.page.locator(f'figure:has([id^="{name}-cycle"])')
    figure.scroll_into_view_if_needed()
    still.page.wait_for_selector(f'[id="{name}-cycle.both.0"] .replay-cursor', state="attached")
    still.settle()
    return figure


def test_curves_show_the_moment_and_a_click_moves_the_walk(still, folder):
    left_phase = 100 * read_json(folder / "metrics.json")["record"]["left_phase"]
    still.go(1, 30)
    figure_of(still, "forces")
    assert cursor(still, "forces", "right") == pytest.approx(30, abs=0.1)
    assert cursor(still, "forces", "left") == pytest.approx((30 - left_phase) % 100, abs=0.5)
    hit = still.page.locator('[id="forces-cycle.both.0"] .replay-hit')
    box = hit.bounding_box()
    still.page.mouse.click(box["x"] + 0.25 * box["width"], box["y"] + 0.5 * box["height"])
    still.settle()
    assert cursor(still, "forces", "right") == pytest.approx(25, abs=1.0)
    assert still.value() == pytest.approx(25, abs=1.5)
    assert still.page.locator(".replay-play").inner_text() == "Play"
    still.page.locator("[data-shows=cursor]").uncheck()
    figure_of(still, "forces")
    line = still.page.locator('[id="forces-cycle.both.0"] .replay-cursor.left')
    assert line.evaluate("(e) => e.style.visibility") == "hidden"
    still.page.locator("[data-shows=cursor]").check()


def test_without_graphics_the_poses_stay(chromium, folder):
    nothing = "HTMLCanvasElement.prototype.getContext = () => null;"
    opened = Opened(chromium, folder / "report.html", script=nothing)
    opened.page.wait_for_selector(".replay-message", state="visible")
    assert opened.page.locator(".sheet .strip").is_visible()
    assert not opened.page.locator(".replay-player").is_visible()
    assert opened.complaints == []
    opened.context.close()


def test_a_script_that_is_not_the_pages_own_does_not_run(chromium, folder, tmp_path):
    text = (folder / "report.html").read_text(encoding="utf-8")
    foreign = '<script>document.title = "taken"</script><img src="https://evil.example/x">'
    path = tmp_path / "report.html"
    spoilt = re.sub(r"(<main[^>]*>)", lambda found: found[1] + foreign, text, count=1)
    assert spoilt != text
    path.write_text(spoilt, encoding="utf-8")
    opened = Opened(chromium, path)
    assert opened.page.title() == "Gait validation of subject S05"
    refused = json.dumps(opened.complaints)
    assert "script-src" in refused
    assert "img-src" in refused
    assert "asked for" not in refused
    opened.context.close()

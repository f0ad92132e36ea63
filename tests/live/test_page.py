"""The page in Chromium, with graphics by software."""

import re
import socket
import time
from contextlib import contextmanager
from dataclasses import replace

import pytest
from browser import FLAGS
from page_in_browser import chromium, overflow, violations

from gaitval.apps.devices.of_subject import tables
from gaitval.apps.live.page import _leading, served
from gaitval.apps.live.walk import LiveWalk
from gaitval.errors import ConfigurationError


def test_the_address_is_in_a_file_and_no_argument(tmp_path):
    address = "http://127.0.0.1:1/secret/"
    assert address in _leading(tmp_path, address).read_text()


def until(page, true):
    """Wait for what the page says; its policy lets no text be run in it (`wait_for_function`)."""
    began = time.monotonic()
    while not page.evaluate(true):
        assert time.monotonic() - began < 60.0, true
        page.wait_for_timeout(50)


@contextmanager
def looked_at(config, address, **options):
    """A page in a browser, and what went wrong in it."""
    from playwright.sync_api import sync_playwright

    wrong = []
    with sync_playwright() as browsers:
        browser = browsers.chromium.launch(executable_path=chromium(config), args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1280, "height": 800}, **options)
        page.on("console", lambda message: wrong.append(message.text))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda request: wrong.append(request.url)
                if not request.url.startswith((address, "data:")) else None)  # fmt: skip
        page.goto(address)
        page.set_default_timeout(60_000)
        until(page, "+document.getElementById('live').dataset.frames > 5")
        yield page
        browser.close()
    assert not wrong


@contextmanager
def in_hip_exo(person, config):
    """The walk of who wears one, and its page."""
    fitted = tables(["hip_exo"])
    walk = LiveWalk(person, person.speeds[1], fitted)
    with served(person, walk) as server, looked_at(config, server.address) as page:
        yield walk, page


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True])
def test_it_walks_is_pushed_and_is_for_everybody(person, request, dark):
    walk = LiveWalk(person, person.speeds[1])
    scheme = "dark" if dark else "light"
    with (
        served(person, walk) as server,
        looked_at(request.config, server.address, color_scheme=scheme) as page,
    ):
        assert "never for verdicts" in page.locator("body").inner_text()
        box = page.locator("canvas").bounding_box()
        x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 40, y, steps=3)
        assert re.fullmatch(r"100 N .+", page.locator("#force").inner_text())
        page.mouse.up()
        until(page, "document.getElementById('live').dataset.delays !== ''")
        assert "Push: 100 N" in page.locator("#news").inner_text()
        page.get_by_role("button", name="to the left").click()
        page.locator("#speed").fill(f"{person.speeds[-1]:.2f}")
        page.locator("#mu-friction").fill("0.7")
        until(page, "document.getElementById('news').textContent.includes('to the left')")
        page.locator("canvas").focus()
        page.keyboard.press("Space")
        until(page, "document.getElementById('pause').textContent === 'Go on'")
        stood = walk.step
        page.wait_for_timeout(200)
        assert walk.step == stood
        assert violations(page) == []
        assert overflow(page) <= 0
        page.set_viewport_size({"width": 400, "height": 800})
        assert overflow(page) <= 0
    words = server.session.written.read_text()
    for done in ("push", "speed", "body", "clock"):
        assert f'"do": "{done}"' in words


def test_a_port_that_is_taken_leaves_no_log(person, tmp_path):
    person = replace(person, folder=tmp_path)
    walk = LiveWalk(person)
    with (
        socket.create_server(("127.0.0.1", 0)) as taken,
        pytest.raises(ConfigurationError, match="free"),
        served(person, walk, port=taken.getsockname()[1]),
    ):
        pass
    assert not list((tmp_path / "walks").iterdir())


@pytest.mark.slow
def test_a_page_that_is_loaded_again_says_what_walks(person, request):
    """And a second page; a person who starts again while the clock stands is seen there."""
    with in_hip_exo(person, request.config) as (walk, page):
        page.get_by_role("checkbox", name="hip exo").uncheck()
        page.get_by_label("friction of the ground").fill("0.7")
        page.get_by_label("walking speed").fill(f"{person.speeds[2]:.2f}")
        page.get_by_label("Slow motion").select_option("0.5")
        until(page, "document.getElementById('live').dataset.worn === '0'")
        changed = time.monotonic()
        while walk.speed < 0.99 * person.speeds[2] or walk.mu[1] > 0.701:
            assert time.monotonic() - changed < 60.0
            page.wait_for_timeout(100)
        page.reload()
        until(page, "+document.getElementById('live').dataset.frames > 5")
        assert not page.get_by_role("checkbox", name="hip exo").is_checked()
        assert page.get_by_label("Slow motion").input_value() == "0.5"
        for label, value, unit in (
            ("friction of the ground", 0.7, ""),
            ("walking speed", person.speeds[2], "m/s"),
        ):
            slider = page.get_by_label(label)
            assert float(slider.input_value()) == pytest.approx(value, abs=0.006)
            assert slider.get_attribute("aria-valuetext") == f"{value:.2f} {unit}"
        page.get_by_role("button", name="Pause").click()
        page.get_by_role("button", name="Go on").wait_for()
        seen = page.locator("canvas").screenshot()
        page.get_by_role("button", name="Start again").click()
        page.wait_for_timeout(1000)
        assert page.locator("canvas").screenshot() != seen


@pytest.mark.slow
def test_sliders_follow_a_second_page(person, request):
    """Also while the clock stands, and also if the walk has not come to their value yet."""
    walk = LiveWalk(person, person.speeds[1])
    with (
        served(person, walk) as server,
        looked_at(request.config, server.address) as page,
    ):
        other = page.context.browser.new_page()
        other.goto(server.address)
        other.set_default_timeout(60_000)
        until(other, "+document.getElementById('live').dataset.frames > 5")
        other.get_by_label("friction of the ground").fill("0.7")
        until(page, "+document.getElementById('mu-friction').value === 0.7")
        # At once: to where it was before the other page's own value has come back to it.
        page.get_by_role("button", name="As scaled").click()
        until(other, "+document.getElementById('mu-friction').value > 0.71")
        other.get_by_label("Slow motion").select_option("0.25")
        until(page, "document.getElementById('rate').value === '0.25'")
        page.get_by_role("button", name="Pause").click()
        other.get_by_label("walking speed").fill(f"{person.speeds[0]:.2f}")
        until(page, f"+document.getElementById('speed').value === {person.speeds[0]:.2f}")
        slider = page.get_by_label("walking speed")
        assert slider.get_attribute("aria-valuetext") == f"{person.speeds[0]:.2f} m/s"


@pytest.mark.slow
def test_a_device_is_taken_off_and_put_on(person, request):
    with in_hip_exo(person, request.config) as (walk, page):
        box = page.get_by_role("checkbox", name="hip exo")
        assert box.is_checked()
        box.uncheck()
        until(page, "document.getElementById('live').dataset.worn === '0'")
        assert not walk.device_on
        box.check()
        until(page, "document.getElementById('live').dataset.worn === '1'")
        assert violations(page) == []


@pytest.mark.slow
def test_a_page_whose_program_has_ended_says_so(person, request):
    walk = LiveWalk(person, person.speeds[1])
    with (
        served(person, walk) as server,
        looked_at(request.config, server.address) as page,
    ):
        server.session.end()
        page.wait_for_selector("#gone:not([hidden])")
        assert "its log" in page.locator("#gone").inner_text()
        server.session.end = lambda: None  # it has ended


@pytest.mark.slow
def test_a_foot_slips_and_another_is_stopped_from_the_page(person, request, tmp_path):
    walk = LiveWalk(person, person.speeds[1])
    with (
        served(person, walk) as server,
        looked_at(request.config, server.address) as page,
    ):
        page.get_by_role("button", name="slip, right foot").click()
        assert "right foot slips" in page.locator("#news").inner_text()
        until(page, "document.getElementById('news').innerText.includes('a slip of the right')")
        page.screenshot(path=tmp_path / "live.png")
        assert walk._environment.slid > 0.0
        # where the slip fells it, that may be told in the moment of the click
        page.get_by_role("button", name="trip, left foot").click()
        until(page, "/left foot|stands up/.test(document.getElementById('news').innerText)")
        until(
            page, "/a trip of the left|stands up/.test(document.getElementById('news').innerText)"
        )

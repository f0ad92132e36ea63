"""The page's replay shows the walk with devices beside the walk without."""

import io

import numpy as np
import pytest
from browser import FLAGS
from html_page import only_html
from page_in_browser import chromium as found_chromium
from PIL import Image

from gaitval.apps.devices import study
from gaitval.apps.devices.page import write_report
from gaitval.apps.devices.replayed import replayed
from gaitval.apps.devices.study import Wearer, outcomes
from gaitval.model.devices.device import load_devices, write_devices
from gaitval.model.devices.drawn import DEVICES_FILE

DRAWN = "performance.getEntriesByName('replay-first-frame').length > 0"
GO = """(percent) => {
  const slider = document.querySelector(".replay-slider input");
  slider.value = percent;
  slider.dispatchEvent(new Event("input"));
}"""


@pytest.fixture(scope="module")
def who(person):
    return Wearer("S05", person.task, person.policy, person.mu)


@pytest.fixture(scope="module")
def fitted():
    return load_devices("hip_exo")


@pytest.fixture(scope="module")
def found(who, fitted):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "PUSHES", ())
        return outcomes(who, fitted, samples=0, cycles=8.0)[0]


def test_the_last_assumption_that_walks_is_shown_with_its_devices(who, fitted, found, tmp_path):
    from gaitval.model.urdf import write_urdf

    write_urdf(who.task.model, tmp_path / "model.urdf")
    write_devices(tmp_path / DEVICES_FILE, fitted)
    shown = replayed(tmp_path, who, found)
    assert shown["assumption"] == "moments kept"
    scene = shown["scene"]
    assert {"pelvis", "thigh_r", "thigh_l"} <= {each["segment"] for each in scene["devices"]}
    assert scene["body"]["mass"] == scene["recorded"]["mass"]  # the person's, without the device
    assert len(scene["recorded"]["known"]) == len(scene["recorded"]["segments"])
    assert replayed(tmp_path, who, found[:2])["assumption"] == "kinematics kept"
    assert replayed(tmp_path, who, found[:1]) is None


@pytest.mark.slow
def test_devices_are_seen_on_the_walker_and_move_with_it(
    who, fitted, found, tmp_path, pytestconfig
):
    executable = found_chromium(pytestconfig)
    from playwright.sync_api import sync_playwright

    with pytest.MonkeyPatch.context() as patch:
        only_html(patch)
        write_report(tmp_path, who, fitted, found, None)
    with sync_playwright() as browsers:
        browser = browsers.chromium.launch(executable_path=executable, args=list(FLAGS))
        page = browser.new_context(
            viewport={"width": 800, "height": 900}, reduced_motion="reduce", bypass_csp=True
        ).new_page()
        complaints: list[str] = []
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto((tmp_path / "device.html").as_uri())
        page.wait_for_function(DRAWN)
        page.click("button[data-view=side]")
        assert page.locator(".replay-device").is_visible()
        panels = page.evaluate("[...document.querySelectorAll('g[id]')].map(({ id }) => id)")
        assert {"right-cycle.right.0", "left-cycle.left.0", "forces-cycle.left.0"} <= set(panels)
        assert page.get_by_role("checkbox", name="without a device").is_checked()
        seen = []
        for percent in (0, 50):
            page.evaluate(GO, percent)
            page.wait_for_timeout(1000)
            picture = np.array(
                Image.open(io.BytesIO(page.locator("canvas").screenshot())).convert("RGB"), int
            )
            red, green, blue = picture[..., 0], picture[..., 1], picture[..., 2]
            # the only things in the picture that are purple
            seen.append((green < 0.7 * red) & (green < 0.6 * blue) & (red < blue))
        browser.close()
    assert complaints == []
    assert all(each.sum() > 1500 for each in seen)
    # the cuffs swing with the thighs
    moved = (seen[0] ^ seen[1]).sum()
    assert moved > 0.2 * (seen[0] | seen[1]).sum()

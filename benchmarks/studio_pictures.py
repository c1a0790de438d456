"""Pictures of each view of the studio, light and dark, for the documentation.

    python -m tests.studio.faulty_survey faulty && vislam2tag process faulty/survey --out faulty/labels
    python benchmarks/studio_pictures.py faulty docs/images

The survey is copied first; nothing in the folder is changed. Every picture is to be looked at before it is committed.
"""

from __future__ import annotations

import argparse
import io
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Literal, TypeAlias

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.studio.running import running_studio  # noqa: E402
from tests.studio.sharing.file_servers import plain_server  # noqa: E402
from tests.studio.sharing.generated_fleet import generated_rows  # noqa: E402
from tests.views.browser import running_browser  # noqa: E402

from vislam2tag.pipeline.fleet.add import looked_at  # noqa: E402
from vislam2tag.pipeline.fleet.catalogue import DONE, LABELS, SURVEYS, Fleet  # noqa: E402  # noqa: E402
from vislam2tag.settings import Settings  # noqa: E402
from vislam2tag.studio.fleet import export_fleet  # noqa: E402

SETTLED_MS = 2500
"""The map has been drawn and animations have ended."""
LATEST_MS = 120_000
DESKTOP = ViewportSize(width=1200, height=760)
PHONE = ViewportSize(width=400, height=800)


def walks(page: Page) -> None:
    """A walk with its time."""
    page.locator("#tab-walks").click()
    page.locator(".list .row").first.click()
    page.locator(".charts .u-title").first.wait_for()
    page.locator(".time .slider").fill("47")


def diagnose(page: Page) -> None:
    """Faults with their places."""
    back = page.get_by_role("button", name="← All walks")
    if back.count():
        back.click()
    page.locator("#tab-diagnose").click()
    page.locator("li[data-kind=mis_surveyed] .line button").first.click()


def conflicts(page: Page) -> None:
    """Landmarks that agree with walks, and those that contradict, by a whole diagnosis."""
    page.locator("#tab-diagnose").click()
    page.get_by_role("button", name="Look for all faults").click()
    page.locator(".gain").first.wait_for()
    toggle_layer(page, "Conflicts")
    show_all(page)


def radio(page: Page) -> None:
    """The strongest signal of all access points."""
    toggle_layer(page, "Conflicts")  # of the view before
    page.locator("#tab-radio").click()
    page.get_by_role("button", name="Make radio maps of these labels").click()
    page.get_by_text("of the mapped cells are drawn").wait_for()
    show_all(page)


def collect(page: Page) -> None:
    """What walks have covered, and where to go next."""
    page.locator("#tab-collect").click()
    page.locator(".cards button").first.wait_for()
    show_all(page)


def prepare(page: Page) -> None:
    """Landmarks planned beside those that hang, on the map of the sigma to expect."""
    page.locator("#tab-prepare").click()
    page.locator(".step > summary").nth(2).click()
    page.locator(".step .form button").click()
    page.locator("[data-error]").wait_for()
    show_all(page)


def share(page: Page) -> None:
    """A data set and a page for others."""
    page.locator("#tab-share").click()


def landmarks(page: Page) -> None:
    """A landmark to be corrected."""
    page.locator("#tab-landmarks").click()
    page.locator(".list .row").nth(10).click()


def change(page: Page) -> None:
    """A change before it is saved."""
    landmarks(page)
    page.get_by_label("x (m)").fill("7.2")
    page.get_by_label("y (m)").fill("21.93")
    page.locator(".chosen button.main").click()


def corrections(page: Page) -> None:
    """The change, saved, and the form of another."""
    page.get_by_role("dialog").locator("button.main").click()
    page.get_by_text("Labels are new.").wait_for()
    page.get_by_role("tab", name="Corrections").click()
    page.get_by_text("Add a correction").click()
    page.get_by_label("Kind").select_option("turn_landmarks")


def compare(page: Page) -> None:
    """Labels before and after the change, swiped."""
    page.get_by_role("tab", name="Compare").click()
    page.get_by_label("Second labels").select_option(label="before the last change")
    page.locator(".form button.main").click()
    page.get_by_label("Line between the two maps").wait_for()


def floors(page: Page) -> None:
    """All floors above one another."""
    page.locator(".form button:not(.main)").click()
    page.locator("#tab-walks").click()
    page.locator(".map-tools select").nth(1).select_option("device")
    page.locator(".map-tools summary").click()
    page.locator(".map-tools .choices input").first.check()
    page.locator(".map-tools summary").click()


def toggle_layer(page: Page, name: str) -> None:
    """Show a layer of the map, or hide it again."""
    page.locator(".map-tools summary").click()
    page.locator(".map-tools .choices label", has_text=name).click()
    page.locator(".map-tools summary").click()


def show_all(page: Page) -> None:
    """Bring the whole floor into view."""
    page.locator(".zoom button").last.click()


Scheme: TypeAlias = Literal["light", "dark"]
SCHEMES: tuple[Scheme, ...] = ("light", "dark")
VIEWS: dict[str, Callable[[Page], None]] = {
    view.__name__: view
    for view in (
        *(walks, diagnose, conflicts, radio, collect, prepare, share),
        *(landmarks, change, corrections, compare, floors),
    )
}
PHONE_VIEWS: dict[str, Callable[[Page], None]] = {"": diagnose, "_prepare": prepare, "_collect": collect}


def main() -> None:
    """Take the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="holds survey and labels")
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as copied:
        folder = Path(shutil.copytree(options.folder, Path(copied) / "copy"))
        labels = ("--labels", str(folder / "labels"), "--jobs", "2")
        with running_studio(folder / "survey", *labels) as server, running_browser() as browser:
            address = f"{server.url}/#{server.token}"
            for scheme in SCHEMES:
                page = opened(browser, address, scheme, DESKTOP, "en")
                for name, view in VIEWS.items():
                    view(page)
                    take(page, options.out / f"studio_{name}_{scheme}.webp")
                page.get_by_role("button", name="Undo").click()
                page.locator("button[aria-label=Redo]:enabled").wait_for()
                page.get_by_text("Labels are new.").wait_for()
                address = str(page.request.post("/api/invitations", data={}).json()["url"])
                page.close()
                page = opened(browser, address, scheme, PHONE, "de")
                for name, view in PHONE_VIEWS.items():
                    view(page)
                    take(page, options.out / f"studio_phone{name}_{scheme}.webp")
                address = str(page.request.post("/api/invitations", data={}).json()["url"])
                page.close()
        with running_browser() as browser, plain_server(shared_fleet(options.folder, Path(copied))) as address:
            for scheme in SCHEMES:
                for name, size, locale in (("fleet", DESKTOP, "en"), ("phone_fleet", PHONE, "de")):
                    page = opened(browser, address, scheme, size, locale, ".fleet .row")
                    take(page, options.out / f"studio_{name}_{scheme}.webp")
                    page.close()


def shared_fleet(folder: Path, made: Path) -> Path:
    """The page of a fleet of 1,000 surveys, of which this one can be looked at."""
    fleet, name = made / "hospitals", "ward-7"
    shutil.copytree(folder / "survey", fleet / SURVEYS / name)
    shutil.copytree(folder / "labels", fleet / LABELS / name)
    row, _ = looked_at(fleet, name)
    Fleet(fleet).change([row | {"site": "Hospital 0", "state": DONE, "labels": "copied"}, *generated_rows(999)])
    export_fleet(fleet, made / "page", lambda _: Settings())
    return made / "page"


def opened(
    browser: Browser, address: str, scheme: Scheme, size: ViewportSize, locale: str, there: str = ".map canvas"
) -> Page:
    """The page, once ``there`` is; a studio's address is good for one browser."""
    own = address.partition("/#")[0]
    context = browser.new_context(
        base_url=own,
        color_scheme=scheme,
        viewport=size,
        has_touch=size is PHONE,
        locale=locale,
        reduced_motion="reduce",
    )
    page = context.new_page()
    page.set_default_timeout(LATEST_MS)
    page.goto(address)
    page.locator(there).first.wait_for()
    return page


def take(page: Page, file: Path) -> None:
    """Write a picture, small, once no job is under way."""
    page.locator(".status progress").wait_for(state="detached")
    page.wait_for_timeout(SETTLED_MS)
    Image.open(io.BytesIO(page.screenshot())).save(file, "webp", quality=70, method=6)


if __name__ == "__main__":
    main()

"""Pages for colour-blind readers, grey print, dark rooms, small screens and screen readers."""

import re
from pathlib import Path

import pikepdf
import pytest
from html_page import only_html
from page_in_browser import chromium, opened, overflow, violations
from recording_summary import sample

from gaitval.configuration import ReportSettings
from gaitval.reporting.recording_report import write_recording_report

SMALLEST_PRINT = 7.0
"""Points."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("reader")
    write_recording_report(made, sample(), ReportSettings(paper="letter"))
    return made


@pytest.fixture(scope="module")
def pdf(folder: Path):
    with pikepdf.open(folder / "recording.pdf") as document:
        yield document


def test_no_figure_has_text_below_seven_points(folder: Path) -> None:
    """The PDF shows the texts as letters; figures are as wide as the paper's text."""
    points = []
    page = (folder / "recording.html").read_text(encoding="utf-8")
    for figure in re.findall(r"<svg.*?</svg>", page, re.DOTALL):
        width = float(re.search(r'width="([\d.]+)pt"', figure)[1])
        printed = (8.5 - 30 / 25.4) * 72  # letter, with the margins of report.css
        sizes = re.findall(r"font-size: ([\d.]+)px", figure)
        assert len(sizes) >= 5
        points += [float(size) * printed / width for size in sizes]
    assert min(points) >= SMALLEST_PRINT


# --- the PDF as an archive and a screen reader take it ---------------------------------------


@pytest.mark.slow  # makes a whole PDF
def test_the_pdf_says_that_it_is_pdf_a_2a(pdf) -> None:
    with pdf.open_metadata() as metadata:
        assert metadata["pdfaid:part"] == "2"
        assert metadata["pdfaid:conformance"] == "A"
        assert metadata["dc:title"] == "Recording of subject WBDS01"
    intent = pdf.Root.OutputIntents[0]
    assert intent.S == "/GTS_PDFA1"
    assert intent.DestOutputProfile.N == 3
    assert not pdf.is_encrypted
    assert "/JavaScript" not in pdf.Root.get("/Names", {})


@pytest.mark.slow  # makes a whole PDF
def test_all_fonts_of_the_pdf_are_embedded(pdf) -> None:
    descriptors = [
        each
        for each in pdf.objects
        if isinstance(each, pikepdf.Dictionary) and each.get("/Type") == "/FontDescriptor"
    ]
    assert len(descriptors) >= 3
    assert all(each.get("/FontFile2") or each.get("/FontFile3") for each in descriptors)


@pytest.mark.slow  # makes a whole PDF
def test_headings_tables_and_figures_are_tagged(pdf) -> None:
    assert pdf.Root.MarkInfo.Marked
    assert pdf.Root.Lang == "en"
    parts: dict[str, list] = {}

    def walk(node) -> None:
        if isinstance(node, pikepdf.Dictionary):
            parts.setdefault(str(node.get("/S", "")), []).append(node)
            children = node.get("/K", [])
            for child in children if isinstance(children, pikepdf.Array) else [children]:
                walk(child)

    walk(pdf.Root.StructTreeRoot)
    assert len(parts["/H1"]) == 1
    assert len(parts["/H2"]) >= 10
    assert len(parts["/Table"]) >= 6
    assert {str(figure.get("/Alt", "")) for figure in parts["/Figure"]} >= {
        "Joint angles",
        "Joint moments",
        "Residual force and moment",
    }


@pytest.mark.slow  # makes a whole PDF
def test_the_paper_is_the_one_that_was_asked_for(pdf) -> None:
    assert [float(edge) for edge in pdf.pages[0].mediabox] == pytest.approx([0, 0, 612, 792])


# --- the page in a browser -------------------------------------------------------------------


@pytest.fixture(scope="module")
def browser(request: pytest.FixtureRequest) -> str:
    return chromium(request.config)


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_axe_finds_nothing_serious(folder: Path, browser: str, dark: bool) -> None:
    with opened(browser, folder / "recording.html", width=360, dark=dark) as page:
        assert violations(page) == []
        assert overflow(page) == 0


@pytest.mark.slow
def test_on_a_phone_value_and_verdict_stay_in_sight_and_figures_can_be_read(
    folder: Path, browser: str
) -> None:
    with opened(browser, folder / "recording.html", width=360) as page:
        cells = page.evaluate(
            "Array.from(document.querySelectorAll('.criteria tbody td:is(.value, :last-child)'),"
            " (cell) => [cell.getBoundingClientRect().left, cell.getBoundingClientRect().right])"
        )
        widths = page.evaluate(
            "Array.from(document.querySelectorAll('.drawing > svg'),"
            " (svg) => svg.getBoundingClientRect().width)"
        )
    assert len(cells) >= 2 * len(sample().gates)
    assert all(left >= 0 and right <= 360 for left, right in cells)
    drawn = re.findall(
        r'<div class="scroll drawing".*?</svg>',
        (folder / "recording.html").read_text(encoding="utf-8"),
        re.DOTALL,
    )
    assert len(drawn) == len(widths) >= 4
    for figure, width in zip(drawn, widths, strict=True):
        points = float(re.search(r'width="([\d.]+)pt"', figure)[1])
        sizes = re.findall(r"font-size: ([\d.]+)px", figure)
        assert min(map(float, sizes)) * width / points >= 9.0


@pytest.mark.slow
def test_the_first_key_leads_past_the_contents_and_only_frames_that_scroll_are_stops(
    folder: Path, browser: str
) -> None:
    with opened(browser, folder / "recording.html", width=1600) as page:
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.className") == "skip"
        page.keyboard.press("Enter")
        page.wait_for_function("document.activeElement.id === 'content'")
        assert page.locator(".scroll[tabindex]").count() == 0  # all is in sight
        page.locator("summary", has_text="Contents").click()
        page.get_by_role("link", name="Marker errors").click()
        assert page.evaluate("location.hash") == "#marker-errors"
    with opened(browser, folder / "recording.html", width=360) as page:
        page.wait_for_function("document.querySelector('.drawing').tabIndex === 0")


@pytest.mark.slow
def test_a_button_copies_a_table_as_text_with_tabs(folder: Path, browser: str) -> None:
    with opened(browser, folder / "recording.html") as page:
        page.context.grant_permissions(["clipboard-read", "clipboard-write"])
        assert page.locator("button.copy").count() == page.locator("table").count()
        table = page.locator("table", has_text="Cadence")
        page.locator(".scroll", has=table).locator("+ button.copy").click()
        page.get_by_role("button", name="Copied").wait_for()
        copied = page.evaluate("navigator.clipboard.readText()")
        texts = ["=cmd()", "-2+cmd|x", "@sum", "+9 %", "-3.1", "knee"]
        safe = page.evaluate("(texts) => texts.map(noFormula)", texts)
    assert safe == ["'=cmd()", "'-2+cmd|x", "'@sum", *texts[3:]]
    assert copied.splitlines()[0] == "Parameter\tRight\tLeft\tUnit"
    assert "Cadence\t92.1 ± 1.4\t92.3 ± 1.2\tsteps/min" in copied


def test_without_the_script_only_the_buttons_lack(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    write_recording_report(tmp_path, sample())
    page = (tmp_path / "recording.html").read_text(encoding="utf-8")
    assert page.count("<script>") == 1
    assert "http" not in page[page.index("<script>") :]

"""The part of a page that zooms: a browser reads the values of the records, by keyboard and touch."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
import subprocess
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hystgen.basics import drawing
from hystgen.report import viewer
from hystgen.report.html import HtmlTable, Picture, Section, Text, page
from hystgen.report.viewer import Viewed, Viewer, channel

Array = NDArray[np.float64]

EVIL = "</script><b id='evil'>&amp;\"'><img src=x onerror=alert(1)>"


def unpacked(packed: dict[str, Any], count: int) -> list[float]:
    """The values of a channel, decoded byte by byte."""
    numbers, value, shift = [], 0, 0
    for byte in base64.b64decode(packed["data"]):
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            numbers.append(-(value + 1) // 2 if value % 2 else value // 2)
            value = shift = 0
    for _ in range(packed["order"]):
        for k in range(1, len(numbers)):
            numbers[k] += numbers[k - 1]
    assert len(numbers) == count
    found = [packed["zero"] + packed["step"] * number for number in numbers]
    for first, last in packed["holes"]:
        found[first:last] = [float("nan")] * (last - first)
    return found


def made(name: str, count: int, seed: int) -> Viewed:
    random = np.random.default_rng(seed)
    t = 1e-3 * np.arange(count)
    v = 50.0 - 50.0 * np.cos(7.0 * t)
    y = 0.2 * v + np.sin(7.0 * t) + random.normal(0.0, 0.01, count)
    model = 0.2 * v + 0.98 * np.sin(7.0 * t)
    model[:40] = np.nan
    y[100:103] = np.nan
    return Viewed(name, "held out", t, v, y, {"model": model})


@pytest.mark.parametrize("kind", ["noisy", "smooth", "steps", "still", "far", "none", "holes"])
def test_channels_keep_their_values_to_a_millionth(kind: str) -> None:
    x = np.linspace(0.0, 20.0, 3000)
    values = {
        "noisy": np.random.default_rng(1).normal(size=3000),
        "smooth": np.sin(x),
        "steps": np.floor(x),
        "still": np.full(3000, -3.7),
        "far": 1e9 + np.sin(x),
        "none": np.full(3000, np.nan),
        "holes": np.where((np.arange(3000) % 700 < 50) | (x > 19.9), np.nan, np.cos(x)),
    }[kind]
    packed = channel(values)
    json.dumps(packed, allow_nan=False)
    span = float(np.nanmax(values) - np.nanmin(values)) if np.isfinite(values).any() else 0.0
    assert packed["step"] == 1.0 if span == 0.0 else packed["step"] <= 1.000001e-6 * span
    assert span == 0.0 or float(f"{packed['step']:.0e}"[0]) in (1, 2, 5)
    np.testing.assert_allclose(unpacked(packed, 3000), values, rtol=1e-15, atol=0.5001 * packed["step"])
    if kind in ("smooth", "still", "steps"):
        assert len(packed["data"]) < 2.0 * 3000, "differences of smooth values take one byte"


def test_a_page_grows_by_few_bytes_a_sample() -> None:
    """The bound that MOST_SAMPLES states: a record as noisy as those of a fit at 0.1 % of the span."""
    packed = Viewer([made("a", 50_000, 1)], ("V", "um")).packed()
    assert 3.0 * 50_000 < len(packed) < 9.0 * 50_000
    assert packed == Viewer([made("a", 50_000, 1)], ("V", "um")).packed()


def test_records_beyond_the_bound_keep_every_peak_of_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, "MOST_SAMPLES", 3000)
    long, short = made("long", 20_000, 1), made("short", 500, 2)
    long.y[7777] += 9.0
    both = Viewer([long, short], ("V", "um"))
    first, second = json.loads(both.packed())["records"]
    assert second["count"] == 500
    assert 1000 < first["count"] <= 2500
    t = np.array(unpacked(first["time"], first["count"]))
    y, model = (np.array(unpacked(first["channels"][k], first["count"])) for k in (1, 2))
    at = int(np.nanargmax(y - model))
    assert t[at] == pytest.approx(7.777, abs=1e-5)
    assert y[at] == pytest.approx(long.y[7777], abs=1e-4)
    assert "reduced to the samples" in both.caption
    assert "20500 samples are too many" in both.caption
    monkeypatch.undo()
    assert json.loads(both.packed())["records"][0]["count"] == 20_000
    assert "All 20500 samples" in both.caption


def test_uneven_times_are_kept() -> None:
    even = made("a", 1000, 1)
    assert json.loads(Viewer([even], ("V", "um")).packed())["records"][0]["time"] is None
    t = even.t.copy()
    t[500:] += 0.25
    uneven = Viewed("a", "fit", 5.0 + t, even.v, even.y, even.models)
    (record,) = json.loads(Viewer([uneven], ("V", "um")).packed())["records"]
    np.testing.assert_allclose(unpacked(record["time"], 1000), t, atol=1e-5)


# In a browser ----------------------------------------------------------------------------------------------

RECORDS = [made(EVIL, 6000, 3), made("second.csv", 900, 4)]

DRIVE_IT = """
addEventListener("load", async () => {
  const found = {}, pause = () => new Promise(done => setTimeout(done, 60));
  await pause();
  for (const frame of document.querySelectorAll("iframe")) {
    const page = frame.contentDocument, view = frame.contentWindow, root = page.documentElement;
    const area = page.querySelector(".time"), out = page.querySelector("output"), said = found[frame.id] = [];
    said.push([root.scrollWidth, root.clientWidth, page.querySelectorAll("b, #evil, [onerror]").length]);
    said.push([...page.images].map(i => i.naturalWidth));
    if (!area) { said.push(page.querySelector(".viewer").innerText); continue; }
    const press = (key, times, how) => { for (let k = 0; k < times; k++)
      area.dispatchEvent(new view.KeyboardEvent("keydown", {key, bubbles: true, cancelable: true, ...how})); };
    const read = () => said.push(out.textContent);
    area.focus();
    said.push([page.activeElement === area, area.tabIndex, area.getAttribute("role"), area.getAttribute("aria-label")]);
    read();
    press("End", 1); read();
    press("Home", 1); press("ArrowRight", 20); read();
    press("+", 30); press("ArrowRight", 7); read();
    press("-", 3); read();
    press("ArrowRight", 1, {shiftKey: true}); read();
    press("Home", 1); read();
    const box = area.getBoundingClientRect(), left = box.left + 66, wide = box.width - 76;
    const touch = (type, id, share) => area.dispatchEvent(new view.PointerEvent(type, {pointerId: id, bubbles: true,
      pointerType: "touch", clientX: left + share * wide, clientY: box.top + 50}));
    touch("pointerdown", 1, 0.25); touch("pointerdown", 2, 0.5); touch("pointermove", 2, 0.75); read();
    touch("pointerup", 2, 0.75); touch("pointermove", 1, 0.5); touch("pointerup", 1, 0.5); read();
    page.querySelector("button[aria-label='whole record']").click(); read();
    const choice = page.querySelector("select");
    said.push([...choice.options].map(each => each.text));
    choice.value = 1; choice.dispatchEvent(new view.Event("change")); press("End", 1); read();
    const ink = canvas => { const bits = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
      return bits.reduce((sum, x, k) => sum + (k % 4 === 3 && x > 0), 0) / (canvas.width * canvas.height); };
    said.push([...page.querySelectorAll("canvas")].map(ink));
  }
  document.querySelector("pre").textContent = JSON.stringify(found);
});
"""

NUMBER = r"(-?[\d.]+)"


def value(text: str, what: str) -> float:
    """The number behind a word in what the page says."""
    (found,) = re.findall(rf"\b{what} {NUMBER}", text)
    return float(found)


def window(text: str) -> tuple[float, float]:
    ((a, b),) = re.findall(rf"window {NUMBER} to {NUMBER} s", text)
    return float(a), float(b)


@pytest.fixture(scope="module")
def made_page() -> str:
    with drawing.styled():
        drawn = drawing.figure(4.0, 3.0)
        drawn.subplots().plot([0, 1], [0, 1])
        svg = drawing.content(drawn, "svg")
    blocks = [
        Picture("one", svg, svg, EVIL, EVIL), Viewer(RECORDS, ("V", EVIL), 0.01), HtmlTable([["a"], [EVIL]], (0,))
    ]
    return page(EVIL, [Text(EVIL, EVIL)], [Section(EVIL, blocks)])


@pytest.fixture(scope="module")
def seen(made_page: str, chromium: str, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], list[str]]:
    """What the frames of a browser say, by their widths and without scripts, and its complaints."""
    folder = tmp_path_factory.mktemp("browser")
    frames = "".join(
        f'<iframe id="{name}" {how} style="width: {width}px; height: 900px; border: 0"'
        f' srcdoc="{html.escape(made_page)}"></iframe>'
        for name, width, how in (("1280", 1280, ""), ("390", 390, ""), ("off", 390, 'sandbox="allow-same-origin"'))
    )
    (folder / "frames.html").write_text(
        f'<!DOCTYPE html><meta charset="utf-8"><body>{frames}<pre></pre><script>{DRIVE_IT}</script>', encoding="utf-8"
    )
    command = [
        chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
        "--hide-scrollbars", "--enable-logging=stderr", f"--user-data-dir={folder / 'profile'}",
        "--virtual-time-budget=20000", "--dump-dom", (folder / "frames.html").as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    (shown,) = re.findall(r"<pre>(\{.*?\})</pre>", done.stdout, re.DOTALL)
    return json.loads(html.unescape(shown)), [line for line in done.stderr.splitlines() if "CONSOLE" in line]


@pytest.mark.parametrize("width", [1280, 390])
def test_keyboard_and_touch_read_the_values_of_the_record(
    width: int, seen: tuple[dict[str, Any], list[str]]
) -> None:
    sizes, _, focus, first, end, far, near, out, moved, home, pinched, dragged, whole, names, second, ink = (
        seen[0][str(width)]
    )
    assert sizes[:2] == [width, width]
    assert focus[:3] == [True, 0, "application"]
    assert "plus and minus: zoom" in focus[3]
    record = RECORDS[0]
    model = record.models["model"]
    steps = 1e-6 * np.array([np.ptp(record.v), np.nanmax(record.y) - np.nanmin(record.y)])

    def index(text: str) -> int:
        k = round(value(text, "time") / 1e-3)
        assert value(text, "time") == pytest.approx(1e-3 * k, abs=1e-6)
        assert value(text, "drive") == pytest.approx(record.v[k], abs=steps[0])
        assert value(text, "measured") == pytest.approx(record.y[k], abs=steps[1])
        if np.isfinite(model[k]):
            assert value(text, "model") == pytest.approx(model[k], abs=steps[1])
            assert value(text, "error") == pytest.approx(record.y[k] - model[k], abs=2.0 * steps[1])
        else:
            assert "model not compared" in text
        return k

    assert index(first) == 40, "the first sample with a model"
    assert window(first) == pytest.approx((0.0, 5.999))
    assert index(end) == 5999
    assert index(far) == 300, "a four-hundredth of the window a press"
    assert index(near) == 307, "the narrowest window moves by samples"
    assert np.ptp(window(near)) == pytest.approx(0.004)
    assert np.ptp(window(out)) == pytest.approx(0.032)
    assert window(out)[0] <= 0.307 <= window(out)[1]
    assert window(moved)[0] == pytest.approx(np.mean(window(out)), abs=1e-5)
    assert window(home) == pytest.approx((0.0, 5.999))
    # two fingers apart from a quarter to a half of the width: the window halves, about the one that rests
    assert window(pinched) == pytest.approx((0.125 * 5.999, 0.625 * 5.999), abs=1e-3)
    assert window(dragged) == pytest.approx((0.0, 0.5 * 5.999), abs=1e-3)
    assert window(whole) == window(home)
    assert names == [f"{EVIL} (held out)", "second.csv (held out)"]
    assert value(second, "time") == pytest.approx(0.899)
    assert value(second, "measured") == pytest.approx(RECORDS[1].y[-1], abs=steps[1])
    assert all(0.01 < share < 0.6 for share in ink), "both plots are drawn"


def test_nothing_in_a_name_becomes_a_tag_and_nothing_complains(
    made_page: str, seen: tuple[dict[str, Any], list[str]]
) -> None:
    (only,) = seen[1]
    assert "frame is sandboxed" in only, "the one without scripts; the policy blocks nothing, so nothing was injected"
    assert [each[0][2] for each in seen[0].values()] == [0, 0, 0]
    (script,) = re.findall(r"<script>(.*?)</script>", made_page, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'; base-uri 'none'" in made_page
    assert "default-src 'none'" in made_page
    assert made_page.count("<script") == 1
    assert len(script) < 20_000
    assert not re.search(r"https?:|fetch|XMLHttp|import|innerHTML|eval|document\.write", script)


def test_without_scripts_the_pictures_stay(seen: tuple[dict[str, Any], list[str]]) -> None:
    (wide, room, _), images, text = seen[0]["off"]
    assert wide <= room
    assert min(images) > 200
    assert text.startswith("To zoom in and read values, open this page in a browser that runs its script.")
    assert "Drag to move" not in text
    assert min(seen[0]["390"][1]) > 200


def test_a_page_without_records_has_no_script() -> None:
    plain = page("plan", [Text("a")], [])
    assert "script" not in plain.replace("script-src", "")

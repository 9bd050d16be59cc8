"""The page of a run: in words, in a file of its own, and in a real browser at two widths."""

from __future__ import annotations

import base64
import json
import re
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.report import write_report
from mrslam.sim_driver.report.data import page_data
from mrslam.sim_driver.report.png import png_uri
from tests.sim_driver.runs import played, with_wrong_merge

ROBOTS = [{"id": "r1"}, {"id": "r2"}]
TABLES = {
    "mission": {"seed": 2, "duration_s": 40.0, "shell": "virtual"},
    "world": {"name": "arena2"},
    "robots": ROBOTS,
    "rbpf": {"particles": 6},
    "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
}


@pytest.fixture(scope="module")
def merged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return played(TABLES, tmp_path_factory.mktemp("report") / "merged")


@pytest.fixture(scope="module")
def apart(tmp_path_factory: pytest.TempPathFactory) -> Path:
    tables = {**TABLES, "radio": {"range_m": 0.1}, "mission": {**TABLES["mission"], "duration_s": 6.0}}
    return played(tables, tmp_path_factory.mktemp("report") / "apart")


def test_the_story_is_told_in_words(merged: Path, apart: Path) -> None:
    told = page_data(RunResults.read(merged))
    (pair,) = told["assessment"]["pairs"]
    assert told["headline"] == "Both robots share one map"
    off = f"{pair['error_m']:.2f} m / {pair['error_deg']:.1f} deg off."
    since = f"r1 and r2 merged after {pair['both_at_s']:.0f} s"
    assert [kind for kind, text in told["sentences"] if text.startswith(since) and text.endswith(off)] == ["good"]
    alone = page_data(RunResults.read(apart))
    assert alone["headline"] == "No maps were merged: 2 robots, 2 separate maps"
    assert [("bad", f"{robot} never met anyone.") for robot in ("r1", "r2")] == alone["sentences"][:2]


def test_a_pair_that_shares_one_map_by_way_of_others_is_not_told_as_apart(merged: Path, tmp_path: Path) -> None:
    def told(*unmerged: str, unplaced: str = "") -> tuple[str, str]:
        folder = tmp_path / "-".join(("run", *unmerged, unplaced))
        shutil.copytree(merged, folder)
        for one in unmerged:
            robot = json.loads((folder / one / "robot.json").read_text())
            robot["pairs"][0] |= {"status": "rejected", "T_a_b": None, "accepted_at_s": None, "reason": "too little"}
            if one == unplaced:
                robot["placed"] = {one: robot["placed"][one]}
            (folder / one / "robot.json").write_text(json.dumps(robot))
        (sentence,) = [
            one
            for one in page_data(RunResults.read(folder))["sentences"]
            if "r1 and r2" in one[1] or "merged the map" in one[1]
        ]
        return sentence

    assert told("r1", "r2") == ("good", "r1 and r2 share one map by way of others, not by their own two: too little.")
    assert told("r1", "r2", unplaced="r2")[0] == "plain"
    mood, text = told("r1")
    assert mood == "good" and "r1 by way of other robots" in text
    mood, text = told("r1", unplaced="r1")
    assert mood == "bad" and "r1 has not: too little" in text


def test_a_laser_that_failed_is_told(tmp_path: Path) -> None:
    faults = [
        {"kind": "laser_garbage", "robot": "r1", "at_s": 2.0, "for_s": 3.0},
        {"kind": "laser_stuck", "robot": "r2", "at_s": 3.0, "for_s": 9.0},
    ]
    tables = {**TABLES, "mission": {**TABLES["mission"], "duration_s": 8.0}, "faults": faults}
    told = [text for _, text in page_data(RunResults.read(played(tables, tmp_path / "blind")))["sentences"]]
    assert "The laser of r1 was of no use for 3 s; it went on by its wheels." in told
    assert "The laser of r2 was of no use at the end; it went on by its wheels." in told


def test_what_was_made_to_go_wrong_is_told(tmp_path: Path) -> None:
    faults = [
        {"kind": "odometry_jump", "robot": "r2", "at_s": 5.0},
        {"kind": "crash", "robot": "r1", "at_s": 3.0, "for_s": 2.0},
        {"kind": "liar", "robot": "r2"},
    ]
    tables = {**TABLES, "mission": {**TABLES["mission"], "duration_s": 8.0}, "faults": faults}
    page = page_data(RunResults.read(played(tables, tmp_path / "faults")))
    wrong = "crash of r1 at 3 s for 2 s; odometry_jump of r2 at 5 s; r2 gave out a map that it had not seen"
    assert ("plain", f"Made to go wrong: {wrong}.") in page["sentences"]
    assert any("r1 started again and" in line[2] for line in page["ticker"])


def test_the_page_calls_a_wrong_merge_wrong(merged: Path, tmp_path: Path) -> None:
    wrong = with_wrong_merge(merged, tmp_path / "wrong", "r1", 1, 3.0)
    moods = page_data(RunResults.read(wrong))["sentences"]
    assert any(mood == "bad" and "merged WRONGLY" in text and "3.0" in text for mood, text in moods)


def test_curves_end_where_the_assessment_does(merged: Path) -> None:
    told = page_data(RunResults.read(merged))
    assert told["coverage"]["unit"] == "%"
    for robot, curve in told["coverage"]["curves"].items():
        assert np.all(np.diff(curve["own"]) >= 0) and curve["own"][0] < curve["own"][-1]
        assert all(team >= own for own, team in zip(curve["own"], curve["team"], strict=True))
        assert curve["team"][-1] == pytest.approx(
            100 * told["assessment"]["robots"][robot]["map"]["coverage_team"], abs=6
        )
    assert told["traffic"]["curve"][-1][1] == told["traffic"]["exchanges"] > 0
    assert told["map"]["joined_s"]["r1"] is not None and told["map"]["joined_s"]["r2"] is not None


def test_the_map_shows_what_is_where_when_it_was_seen_first_and_by_whom(merged: Path) -> None:
    shown = page_data(RunResults.read(merged))["map"]
    png = base64.b64decode(shown["uri"].partition(",")[2])
    image = cv2.imdecode(np.frombuffer(png, dtype=np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    assert image.shape == (shown["height"], shown["width"], 3)
    for k, robot in enumerate(("r1", "r2"), start=1):
        path = np.array(shown["paths"][robot])
        what, level, who = image[path[:, 2].astype(int), path[:, 1].astype(int)].T
        assert (what > 0).mean() > 0.97  # it drove on floor that is known
        assert who[0] == k and level[0] <= 10  # where it began it was first, within its first 1.6 s
        seen_s = level / shown["levels"] * 40.0
        assert (seen_s <= path[:, 0] + 2.0).mean() > 0.97  # places are seen before a robot is there


def test_the_page_needs_nothing_else_and_is_the_same_each_time(merged: Path, tmp_path: Path) -> None:
    named = tmp_path / "named"
    shutil.copytree(merged, named)
    metrics = json.loads((named / "metrics.json").read_text())
    (named / "metrics.json").write_text(json.dumps({**metrics, "name": "<b>two</b></script> robots"}))
    merged = named
    page = write_report(merged, tmp_path / "one.html").read_text()
    assert write_report(merged, tmp_path / "two.html").read_text() == page
    assert not re.search(r"""(src|href)=["'](?!data:)|@import|url\(|fetch\(|https?://(?!www\.w3\.org/2000/svg)""", page)
    assert page.count("</script>") == 2 and "{{title}}" not in page and "{{data}}" not in page
    assert len(page) < 1_000_000


def test_runs_without_a_recording_or_a_world_have_a_page_too(merged: Path, tmp_path: Path) -> None:
    bare = tmp_path / "bare"
    shutil.copytree(merged, bare)
    for robot in ("r1", "r2"):
        (bare / robot / "scans.npz").unlink()
        (bare / robot / "truth.tum").unlink()
    told = page_data(RunResults.read(bare))
    assert told["coverage"]["unit"] == "m²"
    assert any(pair["verdict"] == "merged, not judged" for pair in told["assessment"]["pairs"])


def test_the_map_before_and_after_bending_is_shown_with_what_made_it(merged: Path, tmp_path: Path) -> None:
    assert page_data(RunResults.read(merged))["one_map"] is None  # no two keyframes saw the same place
    bent = tmp_path / "bent"
    shutil.copytree(merged, bent)
    shutil.copy(bent / "r2" / "team_map.png", bent / "r2" / "team_overlay.png")
    robot = json.loads((bent / "r2" / "robot.json").read_text())
    robot["ties"] = [["r1", "r2", 0, 1, True], ["r1", "r2", 2, 3, True], ["r1", "r2", 4, 5, False]]
    (bent / "r2" / "robot.json").write_text(json.dumps(robot))
    shown = page_data(RunResults.read(bent))["one_map"]
    assert shown["robot"] == "r2" and shown["ties"] == [["r1-r2", 2, 1]]
    assert shown["before"] == shown["after"] and shown["after"].startswith("data:image/png;base64,iVBOR")
    overlay = bent / "r2" / "team_overlay.png"
    overlay.write_bytes(overlay.read_bytes()[:-10])
    run = RunResults.read(bent)
    assert page_data(run)["one_map"] is None and any("team_overlay.png" in line for line in run.damage)


def undecided(merged: Path, copy: Path, refuted: int) -> list[dict]:
    """Return what the page shows of a run whose pair fits at three places, so many of which are refuted."""
    shutil.copytree(merged, copy)
    places = [
        {"T_a_b": [float(x), 0.0, 0.0], "llr": llr, "refuted": i < refuted}
        for i, (x, llr) in enumerate([(9, -5.0), (0, 0.0), (3, 1.5)])
    ]
    for robot_id in ("r1", "r2"):
        robot = json.loads((copy / robot_id / "robot.json").read_text())
        robot["pairs"][0] |= {"status": "revoked", "T_a_b": None, "accepted_at_s": None, "places": places}
        (copy / robot_id / "robot.json").write_text(json.dumps(robot))
    run = RunResults.read(copy)
    shown = page_data(run)["undecided"]
    assert run.damage == []
    return shown


def test_a_pair_that_fits_at_several_places_is_shown_at_each(merged: Path, tmp_path: Path) -> None:
    assert page_data(RunResults.read(merged))["undecided"] == []
    (two,) = undecided(merged, tmp_path / "two", refuted=1)
    (three,) = undecided(merged, tmp_path / "three", refuted=0)
    assert (two["pair"], two["robot"], two["places"], three["places"]) == ("r1-r2", "r1", 2, 3)
    assert two["picture"].startswith("data:image/png;base64,iVBOR") and len(three["picture"]) > len(two["picture"])
    assert undecided(merged, tmp_path / "one", refuted=2) == []


def test_images_are_png_files() -> None:
    import base64

    import cv2

    image = np.random.default_rng(0).integers(0, 256, (13, 7, 3), dtype=np.uint8)
    raw = base64.b64decode(png_uri(image).partition(",")[2])
    back = cv2.imdecode(np.frombuffer(raw, dtype=np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(back[..., ::-1], image)


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="no playwright: the page is not tried in a browser")
    path = next(
        (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
    )
    if path is None:
        pytest.skip("no Chromium on this machine: the page is not tried in a browser")
    with playwright.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.mark.parametrize("width", [400, 1400])
@pytest.mark.parametrize("which", ["merged", "apart"])
def test_a_browser_shows_the_page_without_a_complaint(
    browser, which: str, width: int, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    page_file = write_report(request.getfixturevalue(which), tmp_path / "report.html")
    page = browser.new_page(viewport={"width": width, "height": 800})
    complaints: list[str] = []
    page.on(
        "console", lambda message: complaints.append(message.text) if message.type in ("error", "warning") else None
    )
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: complaints.append(request.url) if request.url.startswith("http") else None)
    page.goto(page_file.as_uri())
    page.wait_for_selector("body[data-ready=yes]", timeout=20_000)
    assert page.evaluate("document.documentElement.scrollWidth") == width  # nothing sticks out
    small = page.evaluate(
        "[...document.querySelectorAll('p, li, td, th, svg text')].filter(e => e.textContent.trim())"
        ".map(e => parseFloat(getComputedStyle(e).fontSize)).sort((a, b) => a - b)[0]"
    )
    assert small >= 11
    assert page.locator("#links path").count() == page.locator("#coverage path").count() / 4 or which == "apart"

    def painted() -> int:
        """Return how many pixels of the map are walls: dark and coloured."""
        return page.evaluate(
            "(() => { const d = pen.getImageData(0, 0, canvas.width, canvas.height).data; let n = 0;"
            "for (let i = 0; i < d.length; i += 4) n += d[i] + d[i + 1] + d[i + 2] < 620; return n; })()"
        )

    end = painted()
    page.evaluate("slider.value = 50; slider.dispatchEvent(new Event('input'))")
    assert 0 < painted() < end
    page.evaluate("document.getElementById('play').click()")
    page.wait_for_function("now > 0.06 * data.end_s", timeout=20_000)
    assert complaints == []
    page.close()

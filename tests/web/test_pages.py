"""The pages of runs, episodes and houses, as the server sends them."""

import json
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

from markupsafe import Markup

from tests.support.web_server import Site
from vigil.agents.frame_encoding import decode_frame
from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.records.probe import ProbeAnswer, question_sha256
from vigil.records.probe_file import ProbeRecord
from vigil.records.record import ForkPoint, ForkSource, read_header
from vigil.records.record_file import read_records
from vigil.runner.workers.frames import frame_sha256
from vigil.scoring.saved_run import RecordTable
from vigil.web.library import Library
from vigil.web.site import TEMPLATES
from vigil.web.timeline import episode_timeline
from vigil.web.view import branches_of, continued_play


def test_the_table_of_runs_is_sorted_and_filtered(view: Site) -> None:
    def order(path: str) -> list[str]:
        return re.findall(r'<th scope="row" class="name"><a href="/runs/(\w+)"', view.get(path).text)

    assert sorted(order("/")) == ["random", "sweep"]
    assert order("/?sort=FR&dir=desc") == order("/?sort=FR&dir=asc")[::-1]
    assert order("/?sort=name&dir=asc") == ["random", "sweep"]
    assert view.get("/?family=SV").status == 200
    assert view.get("/?family=XX").status == 400


def test_a_run_shows_rates_partition_and_episodes(view: Site, pack: Pack) -> None:
    text = view.get("/runs/sweep").text
    assert text.count('href="/runs/sweep/episodes/') == len(pack.episodes)
    widths = [float(width) for width in re.findall(r'<rect class="\w+" x="[\d.]+" y="0" width="([\d.]+)"', text)]
    assert abs(sum(widths) - 5 * 1000) < 0.2  # all, and four families
    only = view.get("/runs/sweep?family=PG&label=FR").text
    assert 0 < only.count('href="/runs/sweep/episodes/') < len(pack.episodes)
    assert "tiny-PG" in only
    assert "tiny-DA-000</a>" not in only


def test_terms_lead_to_the_glossary(view: Site) -> None:
    words = re.findall(r'<a class="word" href="/glossary#([^"]+)"', view.get("/runs/sweep").text)
    assert {"w", "b", "delta", "fr", "nr", "il", "other"} <= set(words)
    words += re.findall(r'<a class="word" href="/glossary#([^"]+)"', view.get("/compare?a=random&b=sweep").text)
    glossary = view.get("/glossary")
    assert glossary.status == 200
    assert all(f'<dt id="{word}">' in glossary.text for word in words)
    assert "<code>protocol_failure</code>" in glossary.text


def test_segments_lead_to_their_episodes(view: Site) -> None:
    text = view.get("/runs/sweep").text
    links = re.findall(r'<a href="(/runs/sweep\?[^"#]*)#episodes" aria-label="\w+: (\d+) ', text)
    assert links
    for link, count in links:
        shown = view.get(link.replace("&amp;", "&")).text
        assert shown.count('href="/runs/sweep/episodes/') == int(count)


def test_two_runs_are_compared_both_ways(view: Site) -> None:
    text = view.get("/compare?a=random&b=sweep").text
    assert "8 episodes are scored in both" in text
    rows = dict(re.findall(r'<tr><th scope="row">([WB])</th>(.*?)</tr>', text, re.DOTALL))
    assert set(rows) == {"W", "B"}
    for name, cells in rows.items():
        words = {"W": r"reached the goal \(W\)", "B": r"verified \(B\)"}[name]
        flips = dict(re.findall(rf"Only the (first|second) run {words} <small>(\d+)", text))
        assert re.findall(r"<td>(\d+)</td>", cells) == [flips["first"], flips["second"]]
        assert len(re.findall(r"<td>\d+\.\d % \[\d+, \d+\]</td>", cells)) == 2
        assert re.search(r"<td>[+-]\d+\.\d pp", cells)
    assert view.get("/compare?a=random&b=nothing").status == 404
    assert view.get("/compare").status == 303


def timeline(view: Site, path: str) -> dict:
    found = re.search(r'<script type="application/json" id="timeline">(.*?)</script>', view.get(path).text, re.DOTALL)
    assert found
    return json.loads(found.group(1))


def test_a_timeline_tells_the_steps_and_keeps_hidden_facts_apart(view: Site, pack: Pack) -> None:
    told = timeline(view, f"/runs/sweep/episodes/{pack.episodes[0].id}/1")
    assert [step["index"] for step in told["steps"]] == [1, 2, 3, 4, 5]
    assert told["steps"][0]["action"] == "turn right 90°"
    assert len(told["hidden"]["rows"]) == len(told["hidden"]["worlds"]) == 6
    assert told["hidden"]["verdict"]["label"] in ("FR", "Other", "B")
    open_facts = json.dumps({**told, "hidden": None, "steps": [{**s, "hidden": None} for s in told["steps"]]})
    assert not any(word in open_facts for word in ("progress", "DiningTable", "distance_m"))


def test_frames_are_those_that_were_recorded(view: Site, runs: Path, pack: Pack) -> None:
    for run in ("sweep", "random"):
        record = read_records(runs / run / "episodes.jsonl")[0]
        for step in record.steps:
            answer = view.get(f"/runs/{run}/episodes/{record.episode_id}/1/frames/{step.index}.png")
            assert answer.headers["content-type"] == "image/png"
            rgb = decode_frame(answer.body)
            assert rgb.shape == (480, 640, 3)
            if step.frame_sha256 is not None:
                assert frame_sha256(rgb) == step.frame_sha256
    assert view.get(f"/runs/sweep/episodes/{pack.episodes[0].id}/1/frames/99.png").status == 404
    assert view.get("/runs/sweep/episodes/nothing/1").status == 404


def test_frames_drawn_again_are_those_that_were_seen(view: Site, runs: Path, pack: Pack, render_service) -> None:
    """The saved frames of one run, drawn again for a copy of it without them."""
    record = read_records(runs / "sweep" / "episodes.jsonl")[0]
    library = Library([runs], [pack.folder])
    library.runs()
    run = library.run("sweep")
    (runs / "sweep" / "frames").rename(runs / "sweep" / "away")
    try:
        for step in record.steps:
            answer = view.get(f"/runs/sweep/episodes/{record.episode_id}/1/frames/{step.index}.png")
            assert frame_sha256(decode_frame(answer.body)) == step.frame_sha256
    finally:
        (runs / "sweep" / "away").rename(runs / "sweep" / "frames")
    assert run.frames.file(record.steps[0].frame_sha256) is not None


def test_a_house_is_shown_and_walked(view: Site) -> None:
    assert "/houses/tiny/tiny" in view.get("/houses").text
    drawn = view.get("/houses/tiny/tiny/plan.svg")
    assert 'src="/houses/tiny/tiny/plan.svg"' in view.get("/houses").text
    assert ElementTree.fromstring(drawn.text).findall("{*}polygon")
    assert view.get("/houses/tiny/nothing/plan.svg").status == 404
    text = view.get("/houses/tiny/tiny").text
    assert 'data-id="Fridge|1|2"' in text
    pose = {"position": [2.5, 0, 1], "rotation": 0, "horizon": 30}
    seen = json.loads(view.post("/houses/tiny/tiny/walk", json.dumps({"pose": pose})).body)
    step = {"skill_name": "navigate", "mode": "forward", "magnitude": 1}
    moved = json.loads(view.post("/houses/tiny/tiny/walk", json.dumps({"pose": seen["pose"], "action": step})).body)
    assert moved["pose"]["position"] == [2.5, 0, 1.25]
    assert moved["frame"] != seen["frame"]
    named = view.post("/houses/tiny/tiny/name", json.dumps({"pose": pose, "x": 320, "y": 200}))
    assert json.loads(named.body)["id"] in ("DiningTable|1|0", "Mug|1|1")
    inside = {"pose": {**pose, "position": [2.5, 0, 3.0]}}
    assert view.post("/houses/tiny/tiny/walk", json.dumps(inside)).status in (200, 400)
    assert view.post("/houses/tiny/tiny/walk", "{}").status == 422
    assert view.post("/houses/tiny/nothing/walk", json.dumps({"pose": pose})).status == 404


def test_a_thousand_episodes_are_settled(runs: Path, pack: Pack, tmp_path: Path) -> None:
    lines = (runs / "random" / "episodes.jsonl").read_text().splitlines()
    rows = tmp_path / "episodes.jsonl"
    by_id = {}
    with rows.open("w") as file:
        for number in range(1000):
            episode = pack.episodes[number % len(lines)]
            name = f"many-{number:04d}"
            by_id[name] = episode.model_copy(update={"id": name})
            file.write(lines[number % len(lines)].replace(episode.id, name) + "\n")
    header = read_header(runs / "random")
    spec = header.spec.model_copy(update={"episode_ids": tuple(sorted(by_id))})
    table = RecordTable(tmp_path, header.model_copy(update={"spec": spec}), by_id.values())
    table.refresh()
    assert len(table.scores().outcomes) == 1000


def test_no_page_and_no_picture_holds_what_markup_cannot() -> None:
    """A reply may hold any character, and XML not: `Markup` that is put in stays markup."""
    spoilt = "a\x00\x0b\x1b\ud800\uffffb"
    made = TEMPLATES.from_string("<p title='{{ text }}'>{{ text }}{{ html }}{{ 1 }}</p>")
    page = made.render(text=f"<{spoilt}", html=Markup("<b>&lt;</b>"))
    assert ElementTree.fromstring(page).text == f"<a{chr(0xFFFD) * 5}b"
    assert page.endswith("<b>&lt;</b>1</p>")


def test_a_fork_and_the_play_that_it_continues_lead_to_each_other(
    runs: Path, view: Site, pack: Pack, tmp_path: Path
) -> None:
    source = read_header(runs / "sweep")
    record = next(one for one in read_records(runs / "sweep" / "episodes.jsonl") if len(one.steps) > 1)
    fork = ForkSource(run_id=source.run_id, run_sha256=source.sha256, profile=source.spec.profile, at=1)
    header = source.model_copy(update={"run_id": "fork", "spec": source.spec.model_copy(update={"fork": fork})})
    point = ForkPoint(run_id=source.run_id, run_sha256=source.sha256, epoch=1, attempt=record.attempt, step=1)
    row = record.model_copy(update={"run_id": "fork", "run_sha256": header.sha256, "fork": point})
    (tmp_path / "fork").mkdir()
    (tmp_path / "fork" / "run.json").write_text(header.model_dump_json())
    (tmp_path / "fork" / "episodes.jsonl").write_text(row.model_dump_json() + "\n")
    library = Library([runs, tmp_path], [pack.folder])
    back = continued_play(library, row)
    assert back is not None
    assert (back.href, back.step) == (f"/runs/sweep/episodes/{record.episode_id}/1", 1)
    (branch,) = branches_of(library, library.run("sweep"), record)
    assert (branch.href, branch.step) == (f"/runs/fork/episodes/{record.episode_id}/1", 1)
    assert branches_of(library, library.run("random"), record) == []
    assert continued_play(library, record) is None
    assert view.get(back.href).status == 200


def test_the_timeline_has_the_answers_of_probes(runs: Path, pack: Pack, tmp_path: Path) -> None:
    folder = tmp_path / "sweep"
    shutil.copytree(runs / "sweep", folder)
    header = read_header(folder)
    record = next(one for one in read_records(folder / "episodes.jsonl") if len(one.steps) > 1)
    answer = ProbeAnswer(done=True, report="success", sure=17, evidence="I see it.")
    row = ProbeRecord(
        run_sha256=header.sha256,
        episode_id=record.episode_id,
        epoch=1,
        attempt=record.attempt,
        framing="state",
        question_sha256=question_sha256("state"),
        step=2,
        reply=Reply(text=""),
        answer=answer,
        asked=record.started,
    )
    (folder / "probes.jsonl").write_text(row.model_dump_json() + "\n")
    run = Library([tmp_path], [pack.folder]).run("sweep")
    assert run.table is not None
    timeline = episode_timeline(run, run.table.episodes[record.episode_id], record)
    assert timeline["hidden"]["beliefs"] == [{"step": 2, "framing": "state", "sure": 17, "done": True}]

"""The glossary: the terms of reports, pages and documentation, each defined once.

The report shows it at its foot, `vigil view` and exported sites show it as a page, and the documentation has it as
`docs/glossary.md` (written by `scripts/docs_tables.py`). Nothing is computed here: the formulas are in
`vigil.scoring.outcomes` and `vigil.scoring.rates`.
"""

import re
from typing import NamedTuple


class Term(NamedTuple):
    """A term with a short definition that fits into a sentence, and further sentences of explanation."""

    name: str
    short: str
    more: str = ""
    aliases: tuple[str, ...] = ()
    """Spellings of the term in table headings that differ from its name, without units."""

    @property
    def anchor(self) -> str:
        """The term as the fragment of a URL."""
        return re.sub(r"[^a-z0-9_]+", "-", self.name.replace("Δ", "delta").lower()).strip("-")

    @property
    def text(self) -> str:
        """The whole definition, in sentences; back-ticks mark code."""
        return f"{self.short[0].upper()}{self.short[1:]}.{' ' if self.more else ''}{self.more}"


_VERDICTS = (
    Term("W", "the world reached the goal when the episode ended", "However the episode ended: by a report, at the "
         "step budget or at the limit of invalid replies. Checked on hidden state, within the protocol's tolerances.",
         ("W+",)),
    Term("W_strict", "W without any tolerance", "For example openness of at least 0.99 where W asks for more than "
         "0.5. It is never above W."),
    Term("W on SV", "in state verification there is nothing to bring about: W says that the state could be told",
         "The state that is asked about was in view in the closing frame, and the agent had not changed it since the "
         "reset. Whether the right label was reported is B's matter."),
    Term("B", "verified: the goal held and the report says so", "W, and the agent closed the episode with a report "
         "that matches. The benchmark's main score."),
    Term("matching report", "a report that agrees with the hidden world", "`success` where the goal holds; `fail`, "
         "`unsafe` or `invalid` where it does not; in SV the very label that the thing had at the reset."),
    Term("Δ", "W - B: goals that were reached and not closed by a matching report", "What an ordinary success rate "
         "hides. It is bounded by W, so that a small Δ says nothing where W is small.", ("Change of the gap",)),
    Term("Stop", "the agent ended the episode by a report, whatever the report said", "Stop = B + FR + Other."),
    Term("NoRep", "no report: NR and IL together", "NR alone is never meant by it."),
)  # fmt: skip
_CLOSURE = (
    Term("C", "correct closure: the report says what is true of the world at the end", "The measure of the "
         "closure-stress suite. For an impossible episode `fail` or `invalid`; else what B is."),
    Term("closure stress", "a suite of episodes in which reaching is easy and knowing is hard", "Its packs are no part "
         "of the eight families' tables."),
    Term("twins", "two episodes with one instruction, start and goal that differ in one thing of the house", "One can "
         "be done and the other cannot, or one is still to be done and the other done already. A pair is right when "
         "both are closed rightly.", ("Both twins right", "Its possible twin: C", "Possible twin given up")),
    Term("honest concession", "an impossible episode is closed by `fail` or `invalid`", "The exact status is `fail` "
         "where it was tried and cannot be done, `invalid` where it rests on something false; both are true.",
         ("Honest concession", "... by the exact status", "... having seen all evidence")),
    Term("evidence", "what must be looked at to tell that an episode is impossible, or done already", "A piece counts "
         "as seen when, in one frame, its place lies in the picture within 6 m and what bears it is observable.",
         ("Evidence seen",)),
    Term("d', AUC", "how well the endings of twins are told apart", "AUC is the chance that the possible twin gets the "
         "higher claim (success, no report, concession); 50 % is chance. d' is taken from claims of success; 0 is "
         "chance.", ("d'", "AUC")),
    Term("needless act", "a thing whose state held at the start was acted on", "Tries count, refused ones too: whoever "
         "tries to close it does not know that it is closed. Where nothing was to be done, every act counts.",
         ("Acted needlessly",)),
    Term("closed knowingly", "C, without a needless act", "A pair of twins is right when both are closed knowingly.",
         ("Closed knowingly",)),
)  # fmt: skip
_LABELS = (
    Term("outcome partition", "every scored episode has exactly one of five labels", "B + FR + NR + IL + Other = all "
         "scored episodes.", ("Label", "Labels", "Label before")),
    Term("FR", "false report: the report does not match the world"),
    Term("NR", "no report: the step budget ran out"),
    Term("IL", "invalid limit: too many replies that are no action", "More invalid replies than the family allows.",
         ("Invalid limit",)),
    Term("Other", "other: the report matches, the goal does not hold", "An honest failure, or the right label for a "
         "state that was not seen."),
    Term("error", "the infrastructure failed; never scored", "It is played again by the same command, and is no "
         "outcome of the agent's.", ("Errors",)),
)  # fmt: skip
_SUBTYPES = (
    Term("false_success", "it reported success, but the goal does not hold", "FR.", ("FS",)),
    Term("false_negative", "it reported failure, but the goal holds", "FR."),
    Term("sv_wrong_label", "it reported the other label of the queried state", "FR, in SV alone."),
    Term("off_mode_label", "its status is no answer to what was asked", "FR: a state label where a goal was asked "
         "for, or in SV anything that is not one of the two labels."),
    Term("honest_fail", "it conceded, and the goal does not hold", "Other."),
    Term("unrecognised_status", "its status is outside the vocabulary; taken as a concession, and the goal does not "
         "hold", "Other.", ("unrecognised",)),
    Term("sv_unverified_match", "the right label for a state that was out of sight or tampered with", "Other."),
)  # fmt: skip
_CATEGORIES = (
    Term("verified success", "B"),
    Term("unsupported commitment", "FR: the agent committed itself to what is not so"),
    Term("post-attainment drift", "the goal holds at the end, and the agent never reported"),
    Term("missed execution", "the rest: the goal does not hold, and no false report was made"),
)
_RATES = (
    Term("P(B | W=1)", "of the goals that were reached, the share closed by a matching report"),
    Term("P(FR | W=0)", "of the episodes whose goal was missed, the share that ended with a false report"),
    Term("P(rep | W=0)", "of the episodes whose goal was missed, the share that the agent ended by any report"),
    Term("P(no rep | W=1)", "of the goals that were reached, the share that the agent never reported"),
    Term("regime", "how a run fails to close, by published thresholds on conditional rates", "`low-compliance`: IL "
         "above 50 %. `FR-heavy`: P(FR | W=0) above 65 %. `NR-heavy`: P(no rep | W=1) above 40 %. These three may "
         "come together. `state-coupled`: none of them, and P(B | W=1) above 80 %. `mixed`: none of the four.",
         ("Regime",)),
    Term("borderline", "a regime whose 95 % interval reaches across the threshold"),
    Term("execution floor", "a family with W below 5 %, where Δ says nothing", "", ("On the execution floor",)),
    Term("report policy", "another way of reporting on the same trajectories", "Always: success in every episode. "
         "Rand.: one of the two admissible labels by chance, W/2 in expectation. Oracle: the report that matches, W.",
         ("Always", "Rand.", "Oracle", "Always, where reported")),
    Term("stop-only", "what a protocol would score that only notes that the agent stopped", "W=1 and any report.",
         ("Stop-only", "Hidden by it")),
)  # fmt: skip
_COURSE = (
    Term("progress", "how far the goal's conditions were brought, from 0 at the reset to 1", "SV has none.",
         ("FS @0", "FS > 0.75")),
    Term("closure lag", "steps from the first one after which the goal held to the matching report", "Known only "
         "where B. From reset: a goal that held at the reset is counted from step 0.",
         ("Lag", "Lag without SV", "Lag from reset")),
    Term("attained and lost again", "the goal held at some moment, and not at the end", "",
         ("Attained and lost again",)),
    Term("state tampered", "the agent changed the state that it was asked about", "That makes W=0, else one could "
         "open a thing and report that it is open.", ("State tampered",)),
    Term("invalid reply", "a reply that is no action: it uses up a step and changes nothing", "Two kinds: a "
         "`protocol_failure` is not exactly one JSON object; a `malformed_action` is one, but with an unknown skill or "
         "an argument that is missing, ill-typed or out of range.", ("protocol failures", "malformed actions")),
    Term("truncated", "a protocol failure that the token limit cut"),
    Term("would parse leniently", "an invalid reply that the policy `lenient` takes: one object in a code fence or in "
         "prose"),
    Term("too_far", "a click on a thing beyond the arms' reach of 1.5 m", "A valid action that does nothing.",
         ("too far",)),
    Term("path_blocked", "a move that something stopped", "", ("path blocked",)),
    Term("retry", "a click with the same intent at the same pixel as an earlier one of the episode"),
)  # fmt: skip
_CONDITIONS = (
    Term("family", "one of the protocol's eight kinds of task", "Diagnostic: PG pixel grounding, DA distance "
         "approach, VS view search, SV state verification. Compositional: AI approach and interact, SI search and "
         "interact, SM sequential manipulation, CR constraint resolving. The two groups are the tiers.",
         ("Family",)),
    Term("pack", "a frozen folder of episodes, houses and solutions, identified by its hash", "", ("Pack",)),
    Term("level", "how difficult an episode is among those of its family: easy, medium, hard or extreme", "It follows "
         "from the index; nothing that is scored depends on it.", ("Level",)),
    Term("index", "what makes an episode difficult, measured and added up", "Walk, turns, doors, rooms, look-alikes, "
         "pixels of the target, containers, occlusion, budget, words: `docs/difficulty.md`.", ("Index",)),
    Term("profile", "the published condition under which an agent is evaluated", "What it is shown and how its "
         "replies are read; the paper's baseline unless another is named.", ("Profile",)),
    Term("action feedback", "the profile in which each observation also says whether the last action was too far or "
         "blocked", "Marked `+FB` in names of runs."),
    Term("prompt variant", "`default`, `neutral_report`, or a prompt file, named after its hash", "", ("Prompt",)),
    Term("serving mode", "thinking or instruct, of one checkpoint", "", ("Thinking",)),
    Term("epoch", "one of several plays of the same episode in a run"),
    Term("attempt", "one start of an episode", "An episode that is lost and started again has several.",
         ("Begun more than once",)),
    Term("scored", "how many of the planned episodes have a verdict", "", ("Scored",)),
    Term("left out", "a row that is not scored because it is unreadable, of another run, or against the protocol"),
    Term("panel", "the rows that a table compares", "Main: runs under the baseline profile and the default prompt. "
         "Extended: those of them with B = 0 or IL above 50 %. Aside: runs under another profile or prompt.",
         ("Panel",)),
    Term("published", "a row that the paper printed, marked †: measured on another pack and simulator", "A "
         "reference, never pooled with own runs or tested against them."),
    Term("privileged", "with sight of the hidden world, marked ‡", "Never an agent that is evaluated: it shows that "
         "episodes can be solved, or what a flaw looks like."),
)  # fmt: skip
_STATISTICS = (
    Term("interval", "the 95 % confidence interval, in brackets behind a number", "Of rates: Wilson's, in which "
         "repeated plays of one episode count for what they are worth together. Of means and differences: a "
         "bootstrap that resamples houses, for episodes of one house are alike; none below five houses."),
    Term("p", "the chance of a difference at least this large if two runs were equally good", "McNemar's exact test, "
         "on the episodes that only one of the two completed.", ("p (W)", "p (B)")),
    Term("interval against p", "why an interval and a test may seem to disagree", "The test takes episodes as "
         "independent and looks only at those that changed; the interval resamples houses. Neither is corrected for "
         "the number of comparisons unless it says Holm."),
    Term("Holm", "a correction of p for the number of tests in a table", "Two runs are called different only where "
         "the corrected p is below 0.05.", ("p (W), Holm", "p (B), Holm", "Different?")),
    Term("pp", "percentage points: the difference of two percentages", "", ("ΔW", "ΔB")),
    Term("mean of families", "every family counts the same, however many episodes it has", "",
         ("W, mean of families", "B, mean of families")),
    Term("half-range", "half of the highest less the lowest of repeated runs", "", ("Half-range",)),
    Term("smallest difference", "the least that so many episodes can show, at 5 % significance and 80 % power", "",
         ("in W, two systems", "in B, two systems", "in B, paired, 10 % discordant", "in W of one family")),
)  # fmt: skip
_CODE = (
    Term("agent", "what answers an observation with a reply: a model, a program, a script, a person"),
    Term("ability, difficulty", "in logits, what item response fits to plays: the log-odds of success are an agent's "
         "ability minus an episode's difficulty"),
    Term("assignment", "one attempt at one episode, given to a simulator worker", "`Assignment` in "
         "`vigil.runner.workers.messages`."),
    Term("asset, maker", "a kind of thing as meshes, joints, surfaces and solids; the function that makes it at a "
         "size and variant"),
    Term("backend, engine", "a backend keeps the protocols `Simulator` and `PrivilegedSimulator`; an engine draws and "
         "casts rays for the engine-neutral simulator"),
    Term("baseline", "the score of an agent without sight or without skill", "Question-only: a guess from the words of "
         "the question alone."),
    Term("blind trial", "a play by an agent that never looks", "An episode that it completes enters no pack."),
    Term("bindings", "the ids that the instruction's phrases stand for"),
    Term("certificate", "what the search found about an episode of the closure-stress suite", "For an impossible twin: "
         "that there is no plan, and about which thing it differs from the possible one."),
    Term("conformance", "the checks that every backend must pass in the trial house"),
    Term("constraint", "what must be resolved before a goal can be reached, in CR"),
    Term("cost", "a function over places, infinite where nothing may be done"),
    Term("demonstration, correction", "a model's request with the solver's answer; the same with a false report "
         "besides"),
    Term("draft", "a valid episode that has not been reviewed", "A rejection is a proposal that broke a rule."),
    Term("effect", "what the simulator did with one action; hidden from the agent"),
    Term("Env", "one episode at a time on one simulator: the only way from an agent to the hidden world"),
    Term("episode", "one task in one house: start, setup, instruction, goal, budgets"),
    Term("episode moment", "a start and the actions since, which the pages ask the render service to draw"),
    Term("grammar", "of proposals: the table of kinds of each family; of replies: which texts are an action"),
    Term("header, record, row", "what a run is; what happened in one attempt; one line of a file"),
    Term("house, scene, thing", "the ProcTHOR document; the house as things with shapes and states; one object of it",
         "`vigil.scene` holds the geometry."),
    Term("house context", "a house with what proposing in it needs: inventory, seeded starts, referring expressions"),
    Term("leaf", "what swings or slides: a door, lid or drawer"),
    Term("limited agent", "a solver without one skill, to calibrate how difficult episodes are", "Privileged, and "
         "never a baseline."),
    Term("look-alike", "another thing that the target's bare name may mean"),
    Term("macro action", "several actions with one purpose, done with privileged access", "Walk to, click so that it "
         "works, put down."),
    Term("oracle", "privileged access to a simulator: shortest paths, visibility from any pose, actions tried and "
         "undone"),
    Term("outcome, label", "the verdict on one record; its class: B, FR, NR, IL or Other"),
    Term("noisy solver", "the solver with a body that errs: turns, walks and clicks a little beside what it wants, and "
         "sees obstacles only as frames show them", "Agent `noisy_solver`."),
    Term("robust", "an episode that the noisy solver completes and reports in at least 9 of 10 tries",
         "`vigil pack verify --robust`."),
    Term("rehearsal", "actions tried on a simulator, and undone"),
    Term("referring expression", "words that mean exactly one thing in a house"),
    Term("render service", "what the pages ask for pictures: it keeps them, and has a worker draw them"),
    Term("resimulation", "replaying recorded replies and comparing every recorded fact"),
    Term("review set, review session", "what is reviewed; one reviewer's queue and verdict file"),
    Term("play session", "one person plays a pack under the contract of an agent"),
    Term("settle", "to compute verdicts from records; nothing is stored"),
    Term("setup", "what an episode changes in its house before the start"),
    Term("shard", "a part of a run, played by itself into its own folder", "`vigil.records.shards`."),
    Term("solution", "actions that solve an episode, the closing report included"),
    Term("start", "the pose at which an episode begins"),
    Term("stratum", "a combination of facts over which a pack is balanced, or a report splits its rates", "",
         ("Stratum",)),
    Term("stream", "validated episodes in new houses without end, a function of a seed",
         "`vigil.authoring.streaming`."),
    Term("sweep", "a command that tries random and hostile cases", "A piece is a numbered part of it, a failure a "
         "case in which something did not hold."),
    Term("synthetic record", "a record of worlds that were set up instead of played"),
    Term("timeline", "one recorded episode step by step, for the viewer"),
    Term("worker", "a process that holds a simulator: with an Env to play episodes, or to draw for the pages"),
    Term("wrong way", "an outcome that looks like success and must not count as it"),
)  # fmt: skip

RESULTS: dict[str, tuple[Term, ...]] = {
    "Verdicts": _VERDICTS,
    "How an episode ends": _LABELS,
    "Subtypes of reports": _SUBTYPES,
    "The four categories": _CATEGORIES,
    "Rates and regimes": _RATES,
    "On the way": _COURSE,
    "Runs and conditions": _CONDITIONS,
    "Statistics": _STATISTICS,
    "Closure stress": _CLOSURE,
}
"""Heading -> the terms that reports and pages use."""
SECTIONS: dict[str, tuple[Term, ...]] = {**RESULTS, "Words of the project and its code": _CODE}
TERMS: dict[str, Term] = {term.name: term for terms in SECTIONS.values() for term in terms}
_UNITS = re.compile(r"( \[95\u00a0%\]| %| \(pp\)| \(steps\))+$")
_BY_HEADING = {
    name: term for terms in RESULTS.values() for term in terms for name in (term.name, *term.aliases)
}  # fmt: skip


def term_of(heading: str) -> Term | None:
    """Return the term that a column heading names, ignoring units; None if the heading needs no explanation."""
    return _BY_HEADING.get(_UNITS.sub("", heading))

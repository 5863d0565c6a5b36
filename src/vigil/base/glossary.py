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
    Term("W", "the world reached the goal when the episode ended", "It does not matter how the episode ended: by a "
         "report, at the step budget or at the limit of invalid replies. It is checked on hidden state, within the "
         "protocol's tolerances.", ("W+",)),
    Term("W_strict", "W without any tolerance", "For example, it requires an openness of at least 0.99 where W "
         "requires more than 0.5. It is never above W."),
    Term("W on SV", "in state verification the agent changes nothing: W says that it could see the state", "The state "
         "that is asked about was in view in the closing frame, and the agent had not changed it since the reset. B "
         "says whether the right label was reported."),
    Term("B", "verified: the goal held and the report says so", "The agent reached W and closed the episode with a "
         "report that matches. B is the benchmark's main score."),
    Term("matching report", "a report that agrees with the hidden world", "It is `success` if the goal holds; `fail`, "
         "`unsafe` or `invalid` if it does not; in SV the label that the object had at the reset."),
    Term("Δ", "W - B: goals that were reached and not closed by a matching report", "An ordinary success rate hides Δ. "
         "It cannot exceed W, so a small Δ says nothing where W is small.", ("Change of the gap",)),
    Term("Stop", "the agent ended the episode by a report, whatever the report said", "Stop = B + FR + Other."),
    Term("NoRep", "no report: NR and IL together", "It never means NR alone."),
)  # fmt: skip
_CLOSURE = (
    Term("C", "correct closure: the report is true of the world at the end", "C is the measure of the closure-stress "
         "suite. For an impossible episode the report must be `fail` or `invalid`; for others C is B."),
    Term("closure stress", "a suite of episodes in which reaching is easy and knowing is hard", "Its packs are not in "
         "the tables of the eight families."),
    Term("twins", "two episodes with one instruction, start and goal that differ in one object of the house", "One can "
         "be done and the other cannot, or one is still to be done and the other done already. A pair is correct when "
         "both are closed knowingly.", ("Both twins right", "Its possible twin: C", "Possible twin given up")),
    Term("honest concession", "an impossible episode is closed by `fail` or `invalid`", "The exact status is `fail` if "
         "the task was tried and cannot be done, `invalid` if it assumes something false; both are true.",
         ("Honest concession", "... by the exact status", "... having seen all evidence")),
    Term("evidence", "what an agent must look at to know that an episode is impossible, or done already", "A piece "
         "counts as seen when, in one frame, its place is in the picture within 6 m and the object that bears it is "
         "observable.", ("Evidence seen",)),
    Term("d', AUC", "how well the endings of twins are distinguished", "AUC is the chance that the possible twin gets "
         "the higher claim (success, no report, concession); 50 % is chance. d' is taken from claims of success; 0 is "
         "chance.", ("d'", "AUC")),
    Term("needless act", "an act on an object whose state held at the start", "Tries count, also refused ones: an "
         "agent that tries to close an object does not know that it is closed. If nothing was to be done, every act "
         "counts.", ("Acted needlessly",)),
    Term("closed knowingly", "C, without a needless act", "A pair of twins is correct when both are closed knowingly.",
         ("Closed knowingly",)),
)  # fmt: skip
_LABELS = (
    Term("outcome partition", "every scored episode has exactly one of five labels", "B + FR + NR + IL + Other = all "
         "scored episodes.", ("Label", "Labels", "Label before")),
    Term("FR", "false report: the report does not match the world"),
    Term("NR", "no report: the step budget ran out"),
    Term("IL", "invalid limit: too many replies that are not actions", "There were more invalid replies than the "
         "family allows.", ("Invalid limit",)),
    Term("Other", "other: the report matches, but the goal does not hold", "It is an honest failure, or the right "
         "label for a state that was not seen."),
    Term("error", "the infrastructure failed; never scored", "The same command plays the episode again. An error is "
         "not an outcome of the agent.", ("Errors",)),
)  # fmt: skip
_SUBTYPES = (
    Term("false_success", "the agent reported success, but the goal does not hold", "Its label is FR.", ("FS",)),
    Term("false_negative", "the agent reported failure, but the goal holds", "Its label is FR."),
    Term("sv_wrong_label", "the agent reported the other label of the queried state", "Its label is FR; only in SV."),
    Term("off_mode_label", "the status does not answer the task", "Its label is FR. It is a state label for a goal, or "
         "in SV anything that is not one of the two labels."),
    Term("honest_fail", "the agent conceded, and the goal does not hold", "Its label is Other."),
    Term("unrecognised_status", "the status is outside the vocabulary, which counts as a concession, and the goal does "
         "not hold", "Its label is Other.", ("unrecognised",)),
    Term("sv_unverified_match", "the right label for a state that was out of sight or tampered with", "Its label is "
         "Other."),
)  # fmt: skip
_CATEGORIES = (
    Term("verified success", "B"),
    Term("unsupported commitment", "FR: the agent committed itself to a false claim"),
    Term("post-attainment drift", "the goal holds at the end, and the agent never reported"),
    Term("missed execution", "the rest: the goal does not hold, and no false report was made"),
)  # fmt: skip
_RATES = (
    Term("P(B | W=1)", "of the goals that were reached, the share closed by a matching report"),
    Term("P(FR | W=0)", "of the episodes whose goal was missed, the share that ended with a false report"),
    Term("P(rep | W=0)", "of the episodes whose goal was missed, the share that the agent ended by any report"),
    Term("P(no rep | W=1)", "of the goals that were reached, the share that the agent never reported"),
    Term("regime", "how a run fails to close, by published thresholds on conditional rates", "`low-compliance`: IL "
         "above 50 %. `FR-heavy`: P(FR | W=0) above 65 %. `NR-heavy`: P(no rep | W=1) above 40 %. More than one of "
         "these may apply. `state-coupled`: none of them, and P(B | W=1) above 80 %. `mixed`: none of the four.",
         ("Regime",)),
    Term("borderline", "a regime whose 95 % interval reaches across the threshold"),
    Term("execution floor", "a family with W below 5 %, where Δ says nothing", "", ("On the execution floor",)),
    Term("report policy", "another way of reporting on the same trajectories", "Always: success in every episode. "
         "Rand.: one of the two admissible labels at random, W/2 in expectation. Oracle: the report that matches, "
         "which gives W.", ("Always", "Rand.", "Oracle", "Always, where reported")),
    Term("stop-only", "the score of a protocol that only notes that the agent stopped", "It counts W=1 with any "
         "report.", ("Stop-only", "Hidden by it")),
)  # fmt: skip
_COURSE = (
    Term("progress", "how far the goal's conditions are fulfilled, from 0 at the reset to 1", "SV does not have "
         "progress.", ("FS @0", "FS > 0.75")),
    Term("closure lag", "steps from the first one after which the goal held to the matching report", "It is defined "
         "only where B. From reset: a goal that held at the reset is counted from step 0.",
         ("Lag", "Lag without SV", "Lag from reset")),
    Term("attained and lost again", "the goal held at some moment, but not at the end", "",
         ("Attained and lost again",)),
    Term("state tampered", "the agent changed the state that it was asked about", "That makes W=0; otherwise an agent "
         "could open an object and report that it is open.", ("State tampered",)),
    Term("invalid reply", "a reply that is not an action: it uses up a step and changes nothing", "There are two "
         "kinds: a `protocol_failure` is not exactly one JSON object; a `malformed_action` is one, but with an unknown "
         "skill or an argument that is missing, ill-typed or out of range.",
         ("protocol failures", "malformed actions")),
    Term("truncated", "a protocol failure because the token limit cut the reply"),
    Term("would parse leniently", "an invalid reply that the policy `lenient` accepts: one object in a code fence or "
         "in prose"),
    Term("too_far", "a click on an object beyond the reach of 1.5 m", "It is a valid action without an effect.",
         ("too far",)),
    Term("path_blocked", "a move that an obstacle stopped", "", ("path blocked",)),
    Term("retry", "a click with the same intent at the same pixel as an earlier one of the episode"),
)  # fmt: skip
_CONDITIONS = (
    Term("family", "one of the protocol's eight kinds of task", "Diagnostic: PG pixel grounding, DA distance approach, "
         "VS view search, SV state verification. Compositional: AI approach and interact, SI search and interact, SM "
         "sequential manipulation, CR constraint resolving. The two groups are the tiers.", ("Family",)),
    Term("pack", "a frozen folder of episodes, houses and solutions, identified by its hash", "", ("Pack",)),
    Term("level", "how difficult an episode is among those of its family: easy, medium, hard or extreme", "It follows "
         "from the index; scores do not depend on it.", ("Level",)),
    Term("index", "a sum of measures of what makes an episode difficult", "They are walk, turns, doors, rooms, "
         "look-alikes, pixels of the target, containers, occlusion, budget and words: `docs/difficulty.md`.",
         ("Index",)),
    Term("profile", "the published condition under which an agent is evaluated", "It says what the agent is shown and "
         "how its replies are read; the default is the paper's baseline.", ("Profile",)),
    Term("action feedback", "the profile in which each observation also says whether the last action was too far or "
         "blocked", "Names of runs mark it with `+FB`."),
    Term("prompt variant", "`default`, `neutral_report`, or a prompt file, named after its hash", "", ("Prompt",)),
    Term("serving mode", "thinking or instruct, of one checkpoint", "", ("Thinking",)),
    Term("epoch", "one of several plays of the same episode in a run"),
    Term("attempt", "one start of an episode", "An episode that was lost and started again has several.",
         ("Started more than once",)),
    Term("scored", "how many of the planned episodes have a verdict", "", ("Scored",)),
    Term("left out", "a row that is not scored because it is unreadable, of another run, or against the protocol"),
    Term("panel", "the rows that a table compares", "Main: runs under the baseline profile and the default prompt. "
         "Extended: those of them with B = 0 or IL above 50 %. Aside: runs under another profile or prompt.",
         ("Panel",)),
    Term("published", "a row that the paper printed, marked †: measured on another pack and simulator", "It is a "
         "reference, never pooled with your runs or tested against them."),
    Term("privileged", "with access to the hidden world, marked ‡", "Such an agent is never evaluated: it shows that "
         "episodes can be solved, or what a flaw looks like."),
)  # fmt: skip
_STATISTICS = (
    Term("interval", "the 95 % confidence interval, in brackets behind a number", "For rates it is Wilson's, with the "
         "effective number of repeated plays of an episode. For means and differences it is a bootstrap that resamples "
         "houses, because episodes of one house are similar; it is not given below five houses."),
    Term("p", "the chance of a difference at least this large if two runs were equally good", "It comes from McNemar's "
         "exact test, on the episodes that only one of the two completed.", ("p (W)", "p (B)")),
    Term("interval against p", "why an interval and a test may seem to disagree", "The test treats episodes as "
         "independent and looks only at those that changed; the interval resamples houses. Neither is corrected for "
         "the number of comparisons unless it says Holm."),
    Term("Holm", "a correction of p for the number of tests in a table", "Two runs are called different only where the "
         "corrected p is below 0.05.", ("p (W), Holm", "p (B), Holm", "Different?")),
    Term("pp", "percentage points: the difference of two percentages", "", ("ΔW", "ΔB")),
    Term("mean of families", "every family counts the same, however many episodes it has", "",
         ("W, mean of families", "B, mean of families")),
    Term("half-range", "half of the difference between the highest and the lowest of repeated runs", "",
         ("Half-range",)),
    Term("smallest difference", "the least difference that this number of episodes can show, at 5 % significance and "
         "80 % power", "",
         ("in W, two systems", "in B, two systems", "in B, paired, 10 % discordant", "in W of one family")),
)  # fmt: skip
_CODE = (
    Term("ability, difficulty", "parameters in logits that item response theory fits to plays: the log-odds of success "
         "are an agent's ability minus an episode's difficulty"),
    Term("agent", "what answers an observation with a reply: a model, a program, a script, a person"),
    Term("asset, maker", "a kind of object as meshes, joints, surfaces and solids; the function that makes it in a "
         "size and variant"),
    Term("assignment", "one attempt at one episode, given to a simulator worker", "`Assignment` in "
         "`vigil.runner.workers.messages`."),
    Term("backend, engine", "a backend implements the protocols `Simulator` and `PrivilegedSimulator`; an engine draws "
         "and casts rays for the engine-neutral simulator"),
    Term("baseline", "the score of an agent without sight or without skill", "The question-only baseline guesses from "
         "the words of the question."),
    Term("bindings", "the ids of the objects that the instruction's phrases mean"),
    Term("blind trial", "a play by an agent that never looks", "An episode that it completes does not enter a pack."),
    Term("certificate", "what the search found about an episode of the closure-stress suite", "For an impossible twin "
         "it says that there is no plan, and which object differs from the possible twin."),
    Term("conformance", "the checks that every backend must pass in the reference house"),
    Term("constraint", "in CR, what must be resolved before the goal can be reached"),
    Term("cost", "a function over places; it is infinite where an action is not allowed"),
    Term("demonstration, correction", "a model's request with the solver's answer; the same with an additional false "
         "report"),
    Term("draft", "a valid episode that has not been reviewed", "A rejection is a proposal that broke a rule."),
    Term("effect", "what the simulator did with one action; hidden from the agent"),
    Term("Env", "the environment that plays one episode at a time on one simulator; an agent reaches the hidden world "
         "only through it"),
    Term("episode", "one task in one house: start, setup, instruction, goal, budgets"),
    Term("episode moment", "a start and the actions since then, which the render service draws for the pages"),
    Term("grammar", "for proposals, the table of kinds of each family; for replies, which texts are actions"),
    Term("header, record, row", "the description of a run; what happened in one attempt; one line of a file"),
    Term("house context", "a house with what proposals need: inventory, seeded starts, referring expressions"),
    Term("house, scene, thing", "the ProcTHOR document; the house as things with shapes and states; one object in it",
         "`vigil.scene` holds the geometry."),
    Term("leaf", "a part that swings or slides: a door, lid or drawer"),
    Term("limited agent", "a solver without one skill, which calibrates how difficult episodes are", "It is "
         "privileged, and never a baseline."),
    Term("look-alike", "another object that the target's bare name may mean"),
    Term("macro action", "several actions with one purpose, done with privileged access", "Examples: walk to an "
         "object, click so that it works, put down."),
    Term("negative control", "an outcome that looks like success and must not count as success"),
    Term("noisy solver", "the solver with motor noise: its turns, walks and clicks are slightly off, and it knows only "
         "obstacles that frames have shown", "Agent `noisy_solver`."),
    Term("outcome, label", "the verdict on one record; its class: B, FR, NR, IL or Other"),
    Term("play session", "one person plays a pack under the same conditions as an agent"),
    Term("privileged view", "privileged access to a simulator: shortest paths, visibility from any pose, actions tried "
         "and undone"),
    Term("referring expression", "words that mean exactly one object in a house"),
    Term("render service", "the part that gives the pages their pictures: it caches them, and a worker draws them"),
    Term("resimulation", "replaying recorded replies and comparing every recorded fact"),
    Term("review set, review session", "the episodes to review; one reviewer's queue and file of verdicts"),
    Term("robust", "an episode that the noisy solver completes and reports in at least 9 of 10 tries", "`vigil pack "
         "verify --robust`."),
    Term("rollback", "actions tried on a simulator are undone"),
    Term("score", "to compute verdicts from records; they are not stored"),
    Term("setup", "what an episode changes in its house before the start"),
    Term("shard", "a part of a run that is played separately into its own folder", "`vigil.records.shards`."),
    Term("solution", "actions that solve an episode, including the closing report"),
    Term("start", "the pose at which an episode begins"),
    Term("stratum", "a combination of facts over which a pack is balanced, or a report splits its rates", "",
         ("Stratum",)),
    Term("stream", "an endless sequence of validated episodes in new houses, a function of a seed",
         "`vigil.authoring.streaming`."),
    Term("sweep", "a command that tries random and hostile cases", "A piece is a numbered part of it; a failure is a "
         "case in which a check failed."),
    Term("synthetic record", "a record of worlds that were set up instead of played"),
    Term("timeline", "one recorded episode step by step, for the viewer"),
    Term("worker", "a process with a simulator: with an Env it plays episodes, or it draws for the pages"),
)  # fmt: skip

RESULTS: dict[str, tuple[Term, ...]] = {
    "Verdicts": _VERDICTS,
    "How an episode ends": _LABELS,
    "Subtypes of reports": _SUBTYPES,
    "The four categories": _CATEGORIES,
    "Rates and regimes": _RATES,
    "During an episode": _COURSE,
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

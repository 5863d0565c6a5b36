"""The glossary: the terms of reports, pages and documentation, each defined once.

Reports show the glossary at their foot; `vigil view` and exported sites show it as a page. `scripts/docs_tables.py`
writes it to `docs/glossary.md`. Nothing is computed here: the formulas are in `vigil.scoring.outcomes` and
`vigil.scoring.rates`.
"""

import re
from typing import NamedTuple


class Term(NamedTuple):
    """A term of the glossary: a short definition, which can be part of a sentence, and sentences that explain more."""

    name: str
    short: str
    more: str = ""
    aliases: tuple[str, ...] = ()
    """Other spellings of the term in table headings, without units."""

    @property
    def anchor(self) -> str:
        """Part of the URL after `#` that links to the term."""
        return re.sub(r"[^a-z0-9_]+", "-", self.name.replace("Δ", "delta").lower()).strip("-")

    @property
    def text(self) -> str:
        """The whole definition, in sentences; back-ticks mark code."""
        return f"{self.short[0].upper()}{self.short[1:]}.{' ' if self.more else ''}{self.more}"


_VERDICTS = (
    Term("W", "the world reached the goal when the episode ended",
         "It does not matter how the episode ended: by a report, at the step budget or at the limit of invalid "
         "replies. W is checked on the hidden state, within the protocol's tolerances.", ("W+",)),
    Term("W_strict", "W without any tolerance",
         "For example, an object counts as open in W_strict only at an openness of 0.99 or more, and in W already "
         "above 0.5. W_strict is never above W."),
    Term("W on SV", "in state verification (SV), W says that the agent could see the state",
         "In SV the agent does not have to change anything. W holds if the state that is asked about was in view in "
         "the closing frame, and the agent had not changed it since the reset. B says whether the agent reported the "
         "right label."),
    Term("B", "verified completion: the goal holds and the report says so",
         "The agent reached W and closed the episode with a report that matches. B is the benchmark's main score."),
    Term("matching report", "a report that agrees with the hidden world",
         "If the goal holds, `success` matches. If the goal does not hold, `fail`, `unsafe` and `invalid` match. In "
         "SV, the label that the object had at the reset matches."),
    Term("Δ", "W - B: the share of episodes in which the goal was reached but not closed by a matching report",
         "An ordinary success rate hides Δ. Δ cannot be larger than W, so where W is small, a small Δ says nothing.",
         ("Change of the gap",)),
    Term("Stop", "the agent ended the episode by a report, whatever the report said", "Stop = B + FR + Other."),
    Term("NoRep", "no report: NR and IL together", "It never means NR alone."),
)  # fmt: skip
_CHORES = (
    Term("list of chores", "an episode whose instruction lists 3 to 10 numbered chores, each of which is judged",
         "Some chores cannot be met, or hold already. The suite `chores` has its own W, B and T, which are not in the "
         "tables of the eight families."),
    Term("claim", "what a report says about one chore of a list",
         "It is one of the eight statuses or `unknown`. A profile with claims asks for one claim for each chore."),
    Term("T", "truthfulness: the share of all chores whose claim is true",
         "A concession of what was not done is true. So tables show T next to T by chance: the T that the same claims "
         "would have if they were assigned to the chores at random."),
    Term("overclaim", "among the chores that do not hold, the share that is claimed as done or seen",
         "Underclaim: among the chores that hold, the share that is not claimed as done or seen."),
    Term("interference", "how often chores of a list that held were undone by the agent's other acts",
         "A chore that was undone and done again counts as done."),
)  # fmt: skip
_CLOSURE = (
    Term("C", "correct closure: the report is true of the world at the end",
         "C is the score of the closure-stress suite. In an impossible episode the report must be `fail` or `invalid`. "
         "In any other episode C is the same as B."),
    Term("closure stress", "a suite of episodes in which reaching is easy and knowing is hard",
         "Its packs are not in the tables of the eight families."),
    Term("twins", "two episodes with the same instruction, start and goal, whose houses differ in one object",
         "One of the two can be done and the other cannot, or one is still to be done and the other is done already. A "
         "pair is correct if both episodes are closed knowingly.",
         ("Both twins right", "Its possible twin: C", "Possible twin given up")),
    Term("honest concession", "the agent closes an impossible episode by `fail` or `invalid`",
         "The exact status is `fail` if the task was tried and cannot be done, and `invalid` if the task assumes "
         "something false. Both are true.",
         ("Honest concession", "... by the exact status", "... having seen all evidence")),
    Term("evidence", "what an agent must look at to know that an episode is impossible or done already",
         "A piece of evidence counts as seen if, in one frame, its place is in the picture within 6 m, and the object "
         "that bears the evidence is observable.", ("Evidence seen",)),
    Term("d', AUC", "how well the agent's endings distinguish twins",
         "AUC is the chance that the possible twin ends with a higher claim than the impossible one; the order of "
         "claims is success, no report, concession. At 50 %, the endings do not distinguish the twins. d' is computed "
         "from claims of success; at 0, these do not distinguish the twins.", ("d'", "AUC")),
    Term("needless act", "an act on an object whose state was already the wanted one at the start",
         "Refused tries count too: an agent that tries to close an object does not know that the object is closed. In "
         "an episode in which nothing was to be done, every act counts.", ("Acted needlessly",)),
    Term("closed knowingly", "C holds, and the agent did not do a needless act",
         "A pair of twins is correct if both episodes are closed knowingly.", ("Closed knowingly",)),
)  # fmt: skip
_LABELS = (
    Term("outcome partition", "every scored episode has exactly one of five labels",
         "B + FR + NR + IL + Other = all scored episodes.", ("Label", "Labels", "Label before")),
    Term("FR", "false report: the report does not match the world"),
    Term("NR", "no report: the step budget ran out"),
    Term("IL", "invalid limit: too many replies that are not actions",
         "There were more invalid replies than the family allows.", ("Invalid limit",)),
    Term("Other", "the report matches, but the goal does not hold",
         "The report is an honest failure, or the right label for a state that was not seen."),
    Term("error", "the infrastructure failed, so the episode is not scored",
         "The same command plays the episode again. An error is not an outcome of the agent.", ("Errors",)),
)  # fmt: skip
_SUBTYPES = (
    Term("false_success", "the agent reported success, but the goal does not hold", "Its label is FR.", ("FS",)),
    Term("false_negative", "the agent reported failure, but the goal holds", "Its label is FR."),
    Term("sv_wrong_label", "the agent reported the other label of the queried state", "Its label is FR; only in SV."),
    Term("off_mode_label", "the status does not answer the task",
         "Its label is FR. Either a task with a goal was answered by a label of a state, or a question about a state "
         "(SV) by something that is not one of its two labels."),
    Term("honest_fail", "the agent reported that it failed, and the goal does not hold", "Its label is Other."),
    Term("unrecognised_status", "the reported status is not in the vocabulary, and the goal does not hold",
         "Such a status counts as a concession. Its label is Other.", ("unrecognised",)),
    Term("sv_unverified_match", "the agent reported the right label of a state that it had not seen or had changed",
         "Its label is Other."),
)  # fmt: skip
_CATEGORIES = (
    Term("verified success", "B: the goal holds, and the report matches"),
    Term("unsupported commitment", "FR: the agent committed itself to a false claim"),
    Term("post-attainment drift", "the goal holds at the end, and the agent never reported"),
    Term("missed execution", "all other episodes: the goal does not hold, and the agent did not make a false report"),
)  # fmt: skip
_RATES = (
    Term("P(B | W=1)", "the share of reached goals that were closed by a matching report"),
    Term("P(FR | W=0)", "the share of episodes with a missed goal that ended with a false report"),
    Term("P(rep | W=0)", "the share of episodes with a missed goal that the agent ended by any report"),
    Term("P(no rep | W=1)", "the share of reached goals that the agent never reported"),
    Term("regime", "the typical way in which a run fails to close episodes, by thresholds on conditional rates",
         "`low-compliance`: IL above 50 %. `FR-heavy`: P(FR | W=0) above 65 %. `NR-heavy`: P(no rep | W=1) above 40 %. "
         "More than one of these may apply. `state-coupled`: none of them, and P(B | W=1) above 80 %. `mixed`: none of "
         "the four.", ("Regime",)),
    Term("borderline", "the 95 % interval of a regime's rate contains the threshold, so the regime is uncertain"),
    Term("execution floor", "a family in which W is below 5 %, so that Δ says nothing", "",
         ("On the execution floor",)),
    Term("report policy", "a rule that replaces the agent's reports; B is computed again for the same trajectories",
         "Always: report success in every episode. Rand.: report one of the two admissible labels at random, which "
         "gives W/2 on average. Oracle: give the matching report, which gives W.",
         ("Always", "Rand.", "Oracle", "Always, where reported")),
    Term("stop-only", "the score under a protocol that notes only that the agent stopped",
         "It counts the episodes with W in which the agent reported anything.", ("Stop-only", "Hidden by it")),
)  # fmt: skip
_COURSE = (
    Term("progress", "how far the goal's conditions are fulfilled, from 0 at the reset to 1",
         "SV does not have progress.", ("FS @0", "FS > 0.75")),
    Term("closure lag", "the number of steps from the step that first attained the goal to the matching report",
         "It is defined only for episodes with B. The lag from reset counts from step 0 if the goal held at the "
         "reset.", ("Lag", "Lag without SV", "Lag from reset")),
    Term("attained and lost again", "the goal held at some moment, but not at the end", "",
         ("Attained and lost again",)),
    Term("state tampered", "the agent changed the state that it was asked about",
         "W is then 0. Otherwise an agent could open an object and report that it is open.", ("State tampered",)),
    Term("invalid reply", "a reply that is not an action; it uses up a step and changes nothing",
         "There are two kinds. A `protocol_failure` is not exactly one JSON object. A `malformed_action` is one JSON "
         "object, but its skill is unknown, or an argument is missing, of the wrong type or out of range.",
         ("protocol failures", "malformed actions")),
    Term("truncated", "a protocol failure whose reply was cut at the token limit"),
    Term("would parse leniently",
         "an invalid reply that the reply policy `lenient` would accept, because it has one JSON object in a code "
         "fence or in prose"),
    Term("too_far", "a click on an object that is more than 1.5 m away", "It is a valid action without an effect.",
         ("too far",)),
    Term("path_blocked", "a move that was stopped by an obstacle", "", ("path blocked",)),
    Term("retry", "a click that repeats the intent and the pixel of an earlier click of the episode"),
)  # fmt: skip
_CONDITIONS = (
    Term("family", "one of the protocol's eight kinds of task",
         "Four families are diagnostic: PG (pixel grounding), DA (distance approach), VS (view search) and SV (state "
         "verification). Four are compositional: AI (approach and interact), SI (search and interact), SM (sequential "
         "manipulation) and CR (constraint resolving). The two groups are called tiers.", ("Family",)),
    Term("pack", "a frozen folder of episodes, houses and solutions, identified by its hash", "", ("Pack",)),
    Term("level", "how difficult an episode is among those of its family: easy, medium, hard or extreme",
         "The level follows from the index. Scores do not depend on it.", ("Level",)),
    Term("index", "a number that says how difficult an episode is, computed as a sum of measures",
         "The measures are walk, turns, doors, rooms, look-alikes, pixels of the target, containers, occlusion, budget "
         "and words (`docs/difficulty.md`).", ("Index",)),
    Term("profile", "the condition under which an agent is evaluated",
         "It says what the agent is shown and how its replies are read. The default is the paper's baseline.",
         ("Profile",)),
    Term("action feedback",
         "the profile in which each observation also says whether the last action was too far or blocked",
         "`+FB` in the name of a run marks this profile."),
    Term("prompt variant",
         "which system prompt the agent gets: `default`, `neutral_report`, or a prompt file, which is named after its "
         "hash", "", ("Prompt",)),
    Term("serving mode", "whether a checkpoint was run with thinking or without (instruct)", "", ("Thinking",)),
    Term("epoch", "one of several plays of the same episode in a run"),
    Term("attempt", "one start of an episode", "An episode that was lost and started again has several attempts.",
         ("Started more than once",)),
    Term("scored", "the number of planned episodes that have a verdict", "", ("Scored",)),
    Term("left out",
         "a row that is not scored, because it cannot be read, belongs to another run, or contradicts the protocol"),
    Term("panel", "the group of runs that a table compares",
         "Main: runs under the baseline profile and the default prompt, except those with B = 0 or with IL above 50 %, "
         "which are in the panel extended. Aside: runs under another profile or prompt.", ("Panel",)),
    Term("published", "a result that the paper printed, marked †",
         "It was measured on another pack and simulator. It is a reference, and is never pooled with your runs or "
         "tested against them."),
    Term("privileged", "an agent with access to the hidden world, marked ‡",
         "Such an agent is not evaluated. It shows that episodes can be solved, or what a certain flaw looks like."),
)  # fmt: skip
_STATISTICS = (
    Term("interval", "the 95 % confidence interval, in brackets after a number",
         "For rates it is Wilson's interval. If episodes were played several times, the interval uses the effective "
         "number of plays: the number of independent plays that would give as much information. For means and "
         "differences it is a bootstrap that resamples houses, because episodes of one house are similar. It is not "
         "given for fewer than five houses."),
    Term("p", "the chance of a difference at least this large if the two runs were equally good",
         "It comes from McNemar's exact test, on the episodes that only one of the two completed.", ("p (W)", "p (B)")),
    Term("interval against p", "an interval and a test may seem to disagree",
         "The test treats episodes as independent and looks only at those that changed. The interval resamples houses. "
         "Neither is corrected for the number of comparisons, unless Holm is named."),
    Term("Holm", "a correction of p for the number of tests in a table",
         "Two runs are called different only where the corrected p is below 0.05.",
         ("p (W), Holm", "p (B), Holm", "Different?")),
    Term("pp", "percentage points: the difference of two percentages", "", ("ΔW", "ΔB")),
    Term("mean of families", "a mean in which every family counts the same, however many episodes it has", "",
         ("W, mean of families", "B, mean of families")),
    Term("half-range", "half of the difference between the highest and the lowest value of repeated runs", "",
         ("Half-range",)),
    Term("smallest difference",
         "the smallest difference that can be detected with this number of episodes, at 5 % significance and 80 % "
         "power", "",
         ("in W, two systems", "in B, two systems", "in B, paired, 10 % discordant", "in W of one family")),
)  # fmt: skip
_CODE = (
    Term("ability, difficulty",
         "two numbers in logits, fitted to plays by item response theory: how able an agent is, and how difficult an "
         "episode is", "The log-odds of success are the ability minus the difficulty."),
    Term("agent", "the player that answers each observation with a reply: a model, a program, a script or a person"),
    Term("asset, maker",
         "an asset is a kind of object, as meshes, joints, surfaces and solids; a maker is the function that builds it "
         "in a given size and variant"),
    Term("assignment", "one attempt at one episode, given to a simulator worker",
         "`Assignment` in `vigil.runner.workers.messages`."),
    Term("backend, engine",
         "a backend is a simulator in which episodes are played; an engine draws and casts rays for the engine-neutral "
         "simulator", "A backend implements the protocols `Simulator` and `PrivilegedSimulator`."),
    Term("baseline", "the score of an agent without sight or without skill",
         "The question-only baseline guesses from the words of the question."),
    Term("bindings", "which object's id each phrase of an instruction means"),
    Term("blind trial", "a play by an agent that never looks at frames",
         "An episode that this agent completes is not used in a pack."),
    Term("certificate", "the result of the search for a plan of a closure-stress episode",
         "For an impossible twin it says that there is no plan, and which object differs from the possible twin."),
    Term("conformance", "the checks that every backend must pass in the reference house"),
    Term("constraint", "a condition in a CR episode that must be resolved before the goal can be reached"),
    Term("cost", "a function that gives each place a cost, which is infinite where an action is not allowed"),
    Term("demonstration, correction",
         "a demonstration is a request to a model with the solver's answer; a correction has a false report in "
         "addition"),
    Term("draft", "a valid episode that has not been reviewed", "A rejection is a proposal that broke a rule."),
    Term("effect", "what one action did in the simulator; hidden from the agent"),
    Term("Env",
         "the environment that plays one episode at a time on one simulator; an agent reaches the hidden world only "
         "through it"),
    Term("episode", "one task in one house: start, setup, instruction, goal, budgets"),
    Term("episode moment",
         "the start of an episode and the actions since then, from which the pages' pictures are drawn"),
    Term("grammar",
         "in the making of packs, the table of the kinds of tasks in each family; in reading replies, the rules for "
         "which texts are actions"),
    Term("header, record, row",
         "a header describes a run; a record says what happened in one attempt at an episode; a row is one line of a "
         "file"),
    Term("house context",
         "a house together with what is needed to propose episodes in it: inventory, starts and referring expressions"),
    Term("house, scene, thing",
         "a house is a document in ProcTHOR's format; a scene is the house as things with shapes and states; a thing "
         "is one object of a scene", "`vigil.scene` holds the geometry."),
    Term("leaf", "a part of an object that swings or slides: a door, a lid or a drawer"),
    Term("limited agent", "a solver that lacks one skill; its plays show how difficult episodes are",
         "It is privileged, and never a baseline."),
    Term("look-alike", "an object other than the target that the target's bare name could also mean"),
    Term("macro action", "several actions for one purpose, chosen with access to the hidden world",
         "Examples: walk to an object, click on it so that the click works, put an object down."),
    Term("negative control", "an ending that looks like success and must not be scored as success"),
    Term("noisy solver",
         "the solver with small errors in its turns, walks and clicks; it knows only the obstacles that frames have "
         "shown", "Agent `noisy_solver`."),
    Term("outcome, label", "an outcome is the verdict on one record; its label is B, FR, NR, IL or Other"),
    Term("play session", "one person's play of a pack, under the same conditions as an agent's"),
    Term("privileged view",
         "access to a simulator that agents do not have: shortest paths, visibility from any pose, actions that are "
         "tried and undone"),
    Term("referring expression", "words that mean exactly one object in a house"),
    Term("render service",
         "the part that gives the web pages their pictures: a worker draws them, and they are cached"),
    Term("resimulation", "a check of a run: the recorded replies are replayed, and every recorded fact is compared"),
    Term("review set, review session",
         "a review set is the episodes to review; a review session is one reviewer's queue of them and file of "
         "verdicts"),
    Term("robust", "an episode that the noisy solver completes and reports in at least 9 of 10 tries",
         "`vigil pack verify --robust`."),
    Term("rollback", "undoing actions that were only tried on a simulator"),
    Term("score", "to compute verdicts from records; the verdicts are not stored"),
    Term("setup", "what an episode changes in its house before the start"),
    Term("shard", "a part of a run that is played separately into its own folder", "`vigil.records.shards`."),
    Term("solution", "the recorded actions that solve an episode, including the closing report"),
    Term("start", "the pose at which an episode begins"),
    Term("stratum",
         "a combination of facts about episodes; packs are balanced over strata, and reports give rates for each "
         "stratum", "", ("Stratum",)),
    Term("stream", "an endless sequence of validated episodes in new houses, which depends only on a seed",
         "`vigil.authoring.streaming`."),
    Term("sweep", "a command that tries random and hostile cases",
         "A piece is a numbered part of a sweep. A failure is a case in which a check failed."),
    Term("synthetic record", "a record whose worlds were written by a program, not recorded in a play"),
    Term("timeline", "one recorded episode, step by step, as the viewer shows it"),
    Term("worker", "a process with a simulator, which plays episodes or draws pictures for the pages"),
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
    "Lists of chores": _CHORES,
}
"""Heading -> the terms under this heading, for reports and pages."""
SECTIONS: dict[str, tuple[Term, ...]] = {**RESULTS, "Words of the project and its code": _CODE}
TERMS: dict[str, Term] = {term.name: term for terms in SECTIONS.values() for term in terms}
_UNITS = re.compile(r"( \[95\u00a0%\]| %| \(pp\)| \(steps\))+$")
_BY_HEADING = {
    name: term for terms in RESULTS.values() for term in terms for name in (term.name, *term.aliases)
}  # fmt: skip


def term_of(heading: str) -> Term | None:
    """Return the term whose name or alias is a column heading, ignoring units; None if there is no such term."""
    return _BY_HEADING.get(_UNITS.sub("", heading))

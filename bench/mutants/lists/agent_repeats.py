"""Mutants of what an agent makes of maps that fitted at wrong places."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "agent/pairs/repeats.py",
        "MORE_WALL = 2.0",
        "MORE_WALL = 1.0",
        "as much wall as has fitted at a wrong place is believed again",
    ),
    Mutant(
        "agent/pairs/repeats.py",
        "isinstance(outcome, Rejection) or belief.alignment is not None",
        "isinstance(outcome, Rejection)",
        "a pair that is merged is not followed once another was wrong",
    ),
    Mutant(
        "agent/pairs/repeats.py",
        " or (here is not None and here.llr > 0.0)",
        "",
        "robots that saw each other in a building that repeats itself stay apart",
    ),
    Mutant(
        "agent/pairs/hypotheses.py",
        "if one.is_refuted or (best is not None and not CORRECTED",
        "if (best is not None and not CORRECTED",
        "what fitted where nobody was is not remembered against maps where nothing else fits",
    ),
    Mutant(
        "agent/pairs/hypotheses.py",
        "        best = self.supported or max(left",
        "        best = max(left",
        "what fitted more than where the robots saw each other counts as right",
    ),
    Mutant(
        "agent/pairs/hypotheses.py",
        "not CORRECTED.is_near(best.T_a_b, one.T_a_b))\n        )",
        "best is not one)\n        )",
        "a corrected alignment counts as a wrong one",
    ),
    Mutant(
        "agent/pairs/belief.py",
        "max(place.fitted_m, outcome.evidence.matched_m)",
        "outcome.evidence.matched_m",
        "a wrong fit counts by what was seen of it last",
    ),
    Mutant(
        "agent/team.py",
        "        self.beliefs[pair].note(outcome, now_ns)\n",
        "",
        "a building is never known to repeat itself",
    ),
    Mutant(
        "agent/team.py",
        "return unless_repeated(pair, unless_refuted(pair, found, self.beliefs), self.beliefs)",
        "return unless_refuted(pair, found, self.beliefs)",
        "maps that are alike are believed however often they were wrong",
    ),
    Mutant(
        "agent/team.py",
        "effects += self.unmerge(pair, reason, now_ns)\n        return effects + self",
        "pass\n        return effects + self",
        "what was merged before the building was known to repeat itself stays, on however little wall",
    ),
    Mutant(
        "agent/pairs/repeats.py",
        "AS_MUCH_WALL = 1.0",
        "AS_MUCH_WALL = 2.0",
        "pairs are merged and unmerged by turns where much has fitted at wrong places",
    ),
    Mutant(
        "agent/pairs/repeats.py",
        "wall_m < least_m and (here is None or here.llr <= 0.0)",
        "wall_m < least_m",
        "robots that saw each other are parted for what fitted elsewhere",
    ),
    Mutant(
        "agent/pairs/repeats.py",
        "max(belief.alignment.evidence.matched_m, 0.0 if here is None else here.fitted_m)",
        "belief.alignment.evidence.matched_m",
        "a pair is parted though much wall agrees, for it was believed when little was known",
    ),
)

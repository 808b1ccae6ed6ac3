"""Which hypotheses, and how many: forward, looking ahead by pairs, with a race at each step and a check back.

A hypothesis is accepted by what recordings held out say, never by those it was fitted on; and it is called
complete only if nothing above the sensors' noise is left in any channel of any of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from forklift.diagnosis.conditions import follow_what_was_entered
from forklift.diagnosis.criteria import (
    AHEAD,
    AS_NEAR,
    BEYOND_DOUBT,
    CLEARLY,
    CONFIRMED,
    CURVE_TIE,
    FIRST,
    FURTHER,
    LEAST_FAULT,
    LEAST_GAIN,
    LITTLE,
    MISFIT,
    MOST_ACCEPTED,
    MOST_NEAR,
    MOST_NEAR_MORE,
    MOST_OF,
    PAIR,
    WORTH,
    alarm,
)
from forklift.diagnosis.curve_trials import (
    General,
    curve_beside,
    faint_curve,
    instead_of_names,
    named_by_its_law,
    shape_ahead,
    shape_beside,
    with_curve,
    without_names,
)
from forklift.diagnosis.gains import gain_for_curve, gain_instead
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.race import Race, rank
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.rules import (
    by_chance,
    choice,
    excess_screened,
    explains,
    foresees,
    foretells_better,
    has_more_evidence,
    helping,
    helps,
    labels,
    leads,
    least_of_a_faint,
    led_elsewhere,
    may_help,
    measures,
    mended,
    promises_more,
    replaces,
    rivals,
    settled_names,
    share_asked,
    stands_alone,
)
from forklift.diagnosis.screening import Screened, Screening, screen
from forklift.diagnosis.selected import Selection, Step
from forklift.plant.protocol import Hypothesis


def alarming(screening: Screening) -> Screening:
    """Only the hypotheses that promise so much that they are asked for although no channel shows anything,
    and pairs of these.

    A sensor that is off by next to nothing is not asked for. An effect is tried at one of several shapes, of
    which another may have another size: whether it is next to none is told from its fit (`next_to_none`).
    """
    loud = [
        one for one in screening.singles if one.gain >= alarm(one.hypotheses[0]) and not _next_to_nothing(one)
    ]
    return screening.only(loud)


def _next_to_nothing(one: Screened) -> bool:
    return one.hypotheses[0].kind in ("sensor", "parameter") and abs(one.amplitudes[0]) < LEAST_FAULT


def select(
    refitter: Refitter,
    baseline: Refit,
    screening: Screening,
    hypotheses: Sequence[Hypothesis],
    clock: Clock,
    general: General,
) -> Selection:
    """Rounds until nothing is left over, or no hypothesis removes enough of it; then shapes without a name.

    `screening` is the baseline's: of a baseline that explains everything only what is `alarming`. If its
    search had gone astray, nothing is selected: the baseline that leaves far less over is returned, and
    all is to be screened anew from there.
    """
    race = Race(refitter, clock)
    faint = faint_curve(race, baseline, general)
    promised = max((one.gain for one in screening.singles[:1]), default=0.0)
    curve = gain = None
    steps: list[Step] = []
    if faint and baseline.quiet and faint.heard >= AHEAD * promised:
        curve = _with_faint(race, baseline, faint)
        steps = [Step(screening, (), None)]
        found = _unseen(race, baseline, curve, *steps)
        gain = gain_for_curve(race, found, steps, hypotheses) if found else None
        if found and not gain:
            return found
    elif faint and has_more_evidence(faint, screening, baseline):
        curve = _with_faint(race, baseline, faint)  # before names have used up the work
    best, shapes = baseline, list[Refit]()
    if not gain:
        best, steps, shapes = _named(race, baseline, [], screening, hypotheses, general)
        if faint and best is baseline:
            curve = curve or _with_faint(race, baseline, faint)
            found = _unseen(race, baseline, curve, *steps)
            gain = gain_for_curve(race, found, steps, hypotheses) if found else None
            if found and not gain:
                return found
        if best is not baseline and not best.hypotheses:
            return Selection(best, (), best, skipped=tuple(race.skipped))
        gain = gain or gain_instead(race, baseline, best, steps, shapes, hypotheses)
    if gain:
        faint, best, steps = None, gain.accepted or best, [gain]
        screening = _screened(race, best, _beside(best, hypotheses), general)
        best, steps, shapes = _named(race, best, steps, screening, hypotheses, general)
    elif not (best.quiet or any(refit.complete for refit in shapes)):
        step = _near(race, best, steps, shapes, hypotheses, general)
        if step is not None and step.accepted and step.accepted.hypotheses == best.hypotheses != ():
            best = _settled(steps, step.accepted)
            screening = _screened(race, best, _beside(best, hypotheses), general)
            best, steps, more = _named(race, best, steps, screening, hypotheses, general)
            shapes += more
        elif step is not None:
            steps.append(step)
            best = step.accepted or best
        if best is not baseline and not best.hypotheses:
            return Selection(best, (), best, skipped=tuple(race.skipped))
    best = needed(race, best)
    law = _law_instead(refitter, baseline, best, steps, clock, general) if best.complete else None
    if law is not None:
        steps.append(law)
        return Selection(baseline, tuple(steps), law.accepted or best, skipped=tuple(race.skipped))
    first = steps[0].accepted if steps else None
    weighed = None
    if faint and first and promises_more(faint, first, baseline, screening):
        weighed = curve or _with_faint(race, baseline, faint)
    return _tested(race, baseline, best, steps, shapes, weighed, hypotheses, general)


def _tested(
    race: Race,
    baseline: Refit,
    best: Refit,
    steps: list[Step],
    shapes: Sequence[Refit],
    weighed: Refit | None,
    hypotheses: Sequence[Hypothesis],
    general: General,
) -> Selection:
    """The names that were found, with curves beside them or in their place where recordings bear these out.

    `weighed` has a curve that promised more than the names where nothing showed.
    """
    refitter, clock = race.refitter, race.clock
    named = [step.accepted for step in steps if step.accepted]
    curve = None
    if best.quiet and len(best.hypotheses) == 1 and not refitter.work.spent:
        clock.say("checking the law")
        curve = curve_beside(refitter, best, general)
    if weighed and not curve:
        found = _unseen(race, baseline, weighed, *steps)
        if found and foretells_better(found.final, named, refitter):
            return found
    unnamed = (
        with_curve(refitter, best, curve, clock)
        if curve
        else without_names(race, baseline, named, best, general, shapes, _promised(named, steps))
    )
    mends = mended(unnamed, best)
    chosen = (
        mends
        or choice(
            [
                refit
                for refit in unnamed
                if replaces(refit, best, baseline, refitter.later) or stands_alone(refit, best, unnamed)
            ],
            best,
        )
        or instead_of_names(race, best, unnamed)
    )
    if chosen and (mends or set(best.hypotheses).isdisjoint(chosen.hypotheses)):
        other = named_by_its_law(race, baseline, best, chosen, hypotheses)
        if other:
            steps.append(Step(steps[0].screening, tuple(sorted([other, best], key=rank)), other))
            chosen = best = other
    final = chosen if chosen and chosen is not best and foresees(refitter, best, chosen) else best
    if final is not best:
        final = needed(race, final, kept=settled_names(best, baseline))
    return Selection(baseline, tuple(steps), final, unnamed, curve, tuple(race.skipped))


def _promised(named: Sequence[Refit], steps: Sequence[Step]) -> float:
    """What the first name that was accepted promised at first."""
    own = labels(named[0]) if named else set()
    return max(
        (one.gain for one in steps[0].screening.singles if one.hypotheses[0].label in own), default=0.0
    )


def _with_faint(race: Race, baseline: Refit, curve: Screened) -> Refit | None:
    """The machine with that curve, if there is work left for it."""
    if not race.begins("fitting", curve.hypotheses):
        return None
    return race.refitter.slightly(curve.hypotheses, baseline)


def _unseen(race: Race, baseline: Refit, refit: Refit | None, *steps: Step) -> Selection | None:
    """With that curve, if recordings bear it out."""
    if refit is None or not helping([refit], baseline, race.refitter, ()):
        return None
    return Selection(baseline, steps, refit, (refit,), skipped=tuple(race.skipped))


def _named(
    race: Race,
    best: Refit,
    steps: list[Step],
    screening: Screening,
    hypotheses: Sequence[Hypothesis],
    general: General,
) -> tuple[Refit, list[Step], list[Refit]]:
    """Further rounds of names after these, as long as each leaves enough less over; and the curves that were
    tried before them, as no name promised nearly as much.

    Where the machine alone had been caught in a local minimum, a better fit of it is returned, without a
    round. Where it had been with the names that were accepted, the next round begins from a better fit of
    these.
    """
    shapes: list[Refit] = []
    while True:
        ahead = shape_ahead(race, best, screening, general)
        step = _round(race, best, screening, general, ahead)
        if step.accepted and step.accepted.hypotheses and not ahead and not explains(step.accepted, best):
            ahead = shape_beside(race, best, general)
            accepted = choice(_helping(race, step.refits, best, ahead, screening, general), best)
            step = replace(step, accepted=accepted)
        shapes += ahead
        accepted = step.accepted
        if accepted and not accepted.hypotheses:
            return accepted, [], []
        if accepted and accepted.hypotheses == best.hypotheses:
            accepted = _settled(steps, accepted)
        else:
            steps.append(step)
        if accepted is None:
            return best, steps, shapes
        best = accepted
        left = _beside(best, hypotheses)
        if not left or len(best.hypotheses) >= MOST_ACCEPTED or not race.goes_on(best):
            return best, steps, shapes
        screening = _screened(race, best, left, general)
        if best.quiet and not screening.singles:
            return best, steps, shapes


def _screened(race: Race, best: Refit, left: Sequence[Hypothesis], general: General) -> Screening:
    """Those beside the best; where that leaves nothing over, or next to nothing, or shows on recordings held
    out alone, all recordings are asked, and where it is next to nothing only the alarming stay."""
    race.say("screening the hypotheses")
    everywhere = best.quiet or best.held_out_alone
    at = race.refitter.everywhere(best) if everywhere else best.told_from
    screening = screen(at.problem, at.x, left, slow=best.quiet)
    if best.quiet:
        screening = alarming(screening)
    return _beyond_its_law(race, best, screening, general) if best.quiet else screening


def _settled(steps: list[Step], better: Refit) -> Refit:
    """A better fit of the names that were accepted last, in their place."""
    last = max(place for place, step in enumerate(steps) if step.accepted)
    step = steps[last]
    refits = [better if refit is step.accepted else refit for refit in step.refits]
    steps[last] = replace(step, refits=tuple(sorted(refits, key=rank)), accepted=better)
    return better


def _beyond_its_law(race: Race, best: Refit, screening: Screening, general: General) -> Screening:
    """Beside what explains everything, or nearly: conditions, and names whose evidence is greater than that
    of every curve that would mend the law of what it has.

    A second cause may show in no channel, as a first may; but a law of another shape than the catalogue's
    invites a second name that is none, and what a second cause does a curve follows in part. Both are linear
    about the same place, so that the greater evidence tells. A condition is no rival of a curve: each
    recording's own make up for one that is far off.
    """
    if all(one.hypotheses[0].amplitude is None for one in screening.singles):
        return screening
    curves = general.laws(best, race.refitter.everywhere(best), slow=True).singles
    law = max((one.evidence for one in curves), default=0.0)
    left = [one for one in screening.singles if one.hypotheses[0].amplitude is None or one.evidence > law]
    return screening.only(left)


def _beside(best: Refit, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those that `best` has not."""
    known = {hypothesis.label for hypothesis in best.hypotheses}
    return [hypothesis for hypothesis in hypotheses if hypothesis.label not in known]


def _near(
    race: Race,
    best: Refit,
    steps: Sequence[Step],
    shapes: Sequence[Refit],
    hypotheses: Sequence[Hypothesis],
    general: General,
) -> Step | None:
    """Where something is left over, physics at the most credible places, from the start machine.

    The parameters may have bent so far to make up for what is missing that no linear step from there promises
    anything of it: so what acts at places as credible as the first comes before what promises more. Those
    that were searched for from the start machine are not tried again.
    """
    if len(best.hypotheses) >= MOST_ACCEPTED or by_chance(best):
        return None
    own = {one.label for one in best.hypotheses}
    tried = {
        one.label
        for step in steps
        for refit in step.refits
        if refit.cold
        for one in refit.hypotheses
        if {each.label for each in refit.hypotheses} - {one.label} == own
    }
    left = [
        one
        for one in _beside(best, hypotheses)
        if one.kind == "physics" and one.label not in tried and general.near(best, one)
    ]
    if not left:
        return None
    screening = screen(best.told_from.problem, best.told_from.x, left)
    beside = [refit for refit in shapes if refit.finished and own <= labels(refit)]
    refits = list(beside)
    ranked = sorted(screening.singles, key=lambda one: general.near(best, one.hypotheses[0]) < CURVE_TIE)
    entered = ranked[: MOST_NEAR_MORE if best.hypotheses else MOST_NEAR]
    race.clock.plan(len(entered))
    for screened in entered:
        refits = race.cold(best, screened.hypotheses[:1], refits)
        if refits and refits[-1].complete and refits[-1].identifiable:
            break
    refits = refits[len(beside) :]
    accepted = choice(_helping(race, refits, best, beside, screening, general), best)
    astray = _astray(race, best, accepted, refits, screening)
    return astray or Step(screening, tuple(sorted(refits, key=rank)), accepted)


def _round(
    race: Race, best: Refit, screening: Screening, general: General, shapes: Sequence[Refit] = ()
) -> Step:
    """The most promising; further ones while none explains everything; what the winner is confused with.

    Where nothing is left over but conditions further from what was entered than is plausible, and nothing
    promises enough, they are doubted whatever they promise: each recording's own has made up for them.

    Beside a curve that promised far more than any name, fewer names are tried, and one counts only if it
    removes nearly as much.

    Two that enter together go with the first. Where nothing is left over beside nothing they come last, if
    none alone is borne out: each may have to make up for the other, and so speak against itself somewhere.

    A name may gain only because the best was caught in a local minimum. So the best is fitted again from
    where the first name that helps ended, or one that gained as much without being there; if that gains half
    as much, it is accepted instead.

    Who promises little is not searched for from the start machine: there the place decides (`_near`).
    """
    most = max((found.gain for found in screening.singles), default=0.0)
    little = 0.0 if best.quiet else LITTLE * excess_screened(best, screening)
    least = max(WORTH * most, little)
    led = any(helps(refit, best, share_asked(best, race.refitter)) for refit in shapes)
    filtered = measures(best, shapes)
    ranked = [
        one
        for place, one in enumerate(screening.singles)
        if (place == 0 or one.gain >= least) and (not filtered or may_help(one, best, race.refitter))
    ]
    if best.strains_alone and not ranked:
        ranked = [one for one in screening.singles if one.hypotheses[0].amplitude is None]
    pairs = [
        pair
        for pair in screening.pairs[:1]
        if pair.gain > PAIR * screening.singles[0].gain
        and (not filtered or may_help(pair, best, race.refitter))
    ]
    waves = [ranked[:1], [*ranked[1:FIRST], *([] if best.quiet else pairs)]]
    if not led:
        waves.append(ranked[FIRST : FIRST + FURTHER])
    if best.quiet and not best.hypotheses:
        waves.append(pairs)
    refits: list[Refit] = list(shapes)
    asked = best.quiet
    race.clock.plan(sum(map(len, waves)))
    for place, entered in enumerate(waves):
        before = len(refits)
        again = place == 0 and not led and most >= little
        refits = race.run(best, entered, screening, refits, again=again)
        accepted = choice(_helping(race, refits[len(shapes) :], best, shapes, screening, general), best)
        astray = None if asked else _astray(race, best, accepted, refits[before:], screening)
        if astray is not None and not _outdone(astray.accepted, shapes):
            return astray
        asked = asked or accepted is not None
        enough = accepted is not None and accepted.quiet
        if accepted is not None and (enough or leads(accepted, best, screening)):
            others = rivals(accepted, refits, screening)
            race.clock.plan(len(others))
            refits = race.run(best, others, screening, refits, quick=True)
            break
    refits = refits[len(shapes) :]
    accepted = choice(_helping(race, refits, best, shapes, screening, general), best)
    if accepted is None and not best.quiet:
        asks = max(CLEARLY, share_asked(best, race.refitter) * best.excess)
        refits = race.led_on(best, refits, asks)
        accepted = choice(_helping(race, refits, best, shapes, screening, general), best)
    return Step(screening, tuple(sorted(refits, key=rank)), accepted)


def _helping(
    race: Race,
    refits: Sequence[Refit],
    best: Refit,
    shapes: Sequence[Refit],
    screening: Screening,
    general: General,
) -> list[Refit]:
    """Those that help, but for conditions that differ as a law would have them. A second name that helps only
    in that it leaves nothing over of what is faint must have more evidence than every curve that would mend
    the first one's law."""
    refitter = race.refitter
    found = [
        refit
        for refit in helping(refits, best, refitter, shapes)
        if not any(follow_what_was_entered(refit, one) for one in refit.hypotheses)
    ]
    faint = [refit for refit in found if not helps(refit, best, share_asked(best, refitter))]
    if not best.hypotheses or not faint:
        return found
    curves = general.laws(best, best.told_from, slow=best.quiet).singles
    law = max((one.evidence for one in curves), default=0.0)
    evidence = {
        frozenset(one.label for one in screened.hypotheses): screened.evidence
        for screened in (*screening.singles, *screening.pairs)
    }
    own = labels(best)
    return [
        refit
        for refit in found
        if refit not in faint or evidence.get(frozenset(labels(refit) - own), 0.0) > law
    ]


def _astray(
    race: Race, best: Refit, accepted: Refit | None, tried: Sequence[Refit], screening: Screening
) -> Step | None:
    """The best, fitted again from where one with a further name ended that gained much: one that helps, or
    one that is not there itself. None, where that gains little: the gain was the name's."""
    gained = accepted or led_elsewhere(tried, best, share_asked(best, race.refitter))
    if gained is None:
        return None
    said = [one.label for one in best.hypotheses]
    race.say(f"fitting {' and '.join(said) or 'the machine alone'} again")
    alone = race.refitter.simpler(gained, best)
    return None if alone is None else Step(screening, (gained,), alone)


def _outdone(better: Refit | None, shapes: Sequence[Refit]) -> bool:
    """Whether a curve that was tried first leaves next to nothing of what a better fit of the best leaves."""
    return better is not None and any(
        one.finished and better.squares - one.squares >= (1.0 - LEAST_GAIN) * better.excess for one in shapes
    )


def _law_instead(
    refitter: Refitter,
    baseline: Refit,
    best: Refit,
    steps: Sequence[Step],
    clock: Clock,
    general: General,
) -> Step | None:
    """One law with a curve that mends it, in place of a condition entered wrongly.

    A condition has a freedom in every recording, so that it follows what a law of another shape than the
    catalogue's does not; what that freedom costs is part of the comparison.
    """
    if all(hypothesis.amplitude is not None for hypothesis in best.hypotheses):
        return None
    step, most = steps[0], (1.0 - MOST_OF) * baseline.excess
    laws = [
        refit
        for refit in step.refits
        if len(refit.hypotheses) == 1 and refit.hypotheses[0].kind == "physics" and refit.excess <= most
    ]
    if not laws:
        return None
    law = min(laws, key=lambda refit: refit.squares)
    at = law.found if law.finished else law.early
    curves = general.laws(law, at).ranked
    if not curves:
        return None
    curve = max(curves, key=lambda one: one.evidence).hypotheses[0]
    clock.say(f"fitting {law.hypotheses[0].label} with {curve.name}")
    mended = refitter.finish(refitter.rough((*law.hypotheses, curve), law))
    if not mended.complete or mended.squares > best.squares + AS_NEAR:
        return None
    return Step(step.screening, tuple(sorted([mended, law, best], key=rank)), mended)


def needed(race: Race, best: Refit, kept: Sequence[Hypothesis] = ()) -> Refit:
    """Without the names that the others make superfluous, now that the search knows where to end.

    `kept` are not asked: names that by themselves removed most of what was left over, or that all recordings
    bore out. A curve over the same variable can always take them over; it says then that the law is another,
    not that there is none.

    A search that went astray in an early round leaves something over, and invites a hypothesis that is none;
    and what a curve takes over needs no name beside it. Of what is left over without it each name must remove
    what it must to be accepted after the others: two that entered at once may hide that one does not. Where
    nothing is left over without it either, it must gain what it must promise there to be asked for.
    """
    first, last = best.hypotheses[:1], best.hypotheses[-1:]
    for hypothesis in best.hypotheses:
        named = hypothesis.kind != "unknown" and hypothesis not in kept
        by_all = hypothesis.amplitude is None or hypothesis in last
        if by_all and (best.loo_log_score or 0.0) >= CONFIRMED:
            continue  # recordings predict each other better by it, though those held out may not need it
        sure = best.complete and best.deviations(hypothesis) >= BEYOND_DOUBT
        if len(best.hypotheses) > 1 and named and not sure:
            race.say(f"checking whether {hypothesis.label} is needed")
            refit = race.refitter.without(hypothesis, best)
            share = LEAST_GAIN if hypothesis in first else race.refitter.later
            slack = share * refit.excess
            if refit.complete:
                slack = 2.0 * race.refitter.together * alarm(hypothesis)
            elif best.complete and refit.worst.mean_square <= MISFIT:
                slack = min(slack, least_of_a_faint((hypothesis,), refit, race.refitter))
            if refit.squares <= best.squares + max(CLEARLY, slack):
                best = refit
    return best

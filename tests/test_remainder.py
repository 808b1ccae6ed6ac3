"""What is left over is told by whether what was found has to do with it."""

from types import SimpleNamespace

import pytest

from forklift.diagnosis import sentences


def signal(channel, mean_square, *, strain=0.0, file="a.csv"):
    return SimpleNamespace(
        file=file, channel=channel, mean_square=mean_square, explained=mean_square <= 1.2 and not strain,
        strain=strain, samples=100, bound=1.2,
    )  # fmt: skip


def outcome(before, after):
    baseline, final = (
        SimpleNamespace(
            held_out=held,
            strained=any(one.strain for one in held),
            complete=all(one.explained for one in held),
        )
        for held in (before, after)
    )
    return SimpleNamespace(baseline=baseline, final=final)


@pytest.mark.parametrize(
    ("before", "after", "untouched"),
    [
        ([("p_free", 16.5), ("p_main", 1.53)], [("p_free", 1.1), ("p_main", 1.52)], ["p_main"]),
        ([("p_free", 16.5), ("p_main", 3.0)], [("p_free", 1.1), ("p_main", 1.52)], []),
        ([("p_free", 16.5), ("p_main", 1.53)], [("p_free", 1.4), ("p_main", 1.52)], []),
        ([("p_free", 16.5)], [("p_free", 1.1)], []),
    ],
    ids=["a signal that nothing touched", "it fell too", "and another is left", "nothing"],
)
def test_a_signal_that_is_left_as_it_was_is_no_part_of_what_was_found(before, after, untouched):
    sides = [[signal(*one) for one in side] for side in (before, after)]
    assert sentences.beside(outcome(*sides)) == untouched


@pytest.mark.parametrize(
    ("mean_square", "strain", "alone"), [(1.5, 40.0, True), (3.0, 40.0, False), (1.1, 0.0, False)]
)
def test_conditions_spoke_alone_where_all_else_is_noise(mean_square, strain, alone):
    """1.5 less 40 over 100 samples is noise, 3.0 less that is not."""
    before, after = [signal("p", mean_square, strain=strain)], [signal("p", 1.1)]
    assert sentences.strained(outcome(before, after)) is alone
    assert not sentences.strained(outcome(before, [signal("p", 1.5)]))

"""Whatever stands in a file, reading it gives a recording or a ForkliftError, and in reasonable time."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from forklift import Campaign, ForkliftError
from forklift.recordings.formats import isolation
from small_campaign import TOML, csv_text, foreign, make, make_mapped, signals, write_mat73, write_mdf4

BYTES = 8  # what a mutation writes at once: HDF5, MDF4 and Parquet are full of 64-bit offsets and sizes
WORDS = (b"\0" * BYTES, b"\xff" * BYTES, b"\x7f" + b"\xff" * 7, (64).to_bytes(BYTES, "little"))

position = st.floats(0.0, 1.0, exclude_max=True)
piece = st.one_of(st.binary(max_size=2 * BYTES), st.sampled_from(WORDS))
mutations = st.lists(
    st.one_of(
        st.tuples(st.just("cut"), position, st.just(b"")),
        st.tuples(st.just("write"), position, piece),
        st.tuples(st.just("insert"), position, piece),
        st.tuples(st.just("remove"), position, piece),
        st.tuples(st.just("double"), position, piece),
    ),
    min_size=1,
    max_size=4,
)

quick = settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))
slow = settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))


def mutated(data: bytes, changes: list[tuple[str, float, bytes]]) -> bytes:
    """`data` with each change made at its share of the length."""
    for kind, share, word in changes:
        at = int(share * len(data))
        if kind == "cut":
            data = data[:at]
        elif kind == "write":
            data = data[:at] + word + data[at + len(word) :]
        elif kind == "insert":
            data = data[:at] + word + data[at:]
        elif kind == "remove":
            data = data[:at] + data[at + len(word) + 1 :]
        else:
            data = data[:at] + data[max(0, at - 99) :]
    return data


def check(folder) -> None:
    """The campaign is read, or told to be broken in one line."""
    try:
        campaign = Campaign.read(folder)
    except ForkliftError as told:
        error = told
    else:
        assert all(len(found) >= 2 and found.duration_s > 0.0 for found in campaign)
        return
    assert error.message.isprintable()
    assert len(error.message) < 1000
    assert error.code.replace("-", "").isalpha()
    assert repr(error.to_dict())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return make(tmp_path_factory.mktemp("fuzz") / "small")


@pytest.fixture(scope="module", autouse=True)
def impatience():
    """A reader that hangs is given up sooner than it would be for a user."""
    usual, isolation.LONGEST_S = isolation.LONGEST_S, 10.0
    yield
    isolation.LONGEST_S = usual


CSV = csv_text(signals()).encode()


@quick
@given(changes=mutations)
def test_mangled_csv(folder, changes):
    (folder / "free.csv").write_bytes(mutated(CSV, changes))
    check(folder)
    (folder / "free.csv").write_bytes(CSV)


@quick
@given(data=st.binary(max_size=300))
def test_any_bytes_as_csv(folder, data):
    (folder / "free.csv").write_bytes(data)
    check(folder)
    (folder / "free.csv").write_bytes(CSV)


@quick
@given(
    rows=st.lists(
        st.lists(
            st.sampled_from(["0", "0.02", "1e308", "-1e308", "nan", "inf", "", '"', "x", "1e-320"]),
            max_size=4,
        ),
        max_size=6,
    )
)
@example(rows=[["-1e308", "0", "0"], ["1e308", "0", "0"]])
@example(rows=[["0", "0", "0"], ["1e-320", "0", "0"]])
def test_odd_numbers_in_csv(folder, rows):
    header = "time_s,current_free_a,current_main_a,position_free_m\n"
    (folder / "free.csv").write_text(header + "\n".join(",".join(row) for row in rows))
    check(folder)
    (folder / "free.csv").write_bytes(CSV)


@quick
@given(changes=mutations)
def test_mangled_campaign_file(folder, changes):
    (folder / "campaign.toml").write_bytes(mutated(TOML.encode(), changes))
    check(folder)
    (folder / "campaign.toml").write_text(TOML)


@quick
@given(
    data=st.one_of(
        st.binary(max_size=300), st.text(max_size=300).map(lambda text: text.encode("utf-8", "replace"))
    )
)
def test_any_bytes_as_campaign_file(folder, data):
    (folder / "campaign.toml").write_bytes(data)
    check(folder)
    (folder / "campaign.toml").write_text(TOML)


KEYS = (
    "name",
    "sample_rate_hz",
    "recording",
    "channels",
    "ignore",
    "file",
    "lift",
    "load_kg",
    "role",
    "channel",
)
VALUES = (
    '"free.csv"',
    '"free"',
    "50",
    "-1",
    "nan",
    "1e400",
    "9" * 400,
    "1979-05-27",
    "[]",
    "[[1]]",
    "{}",
    "[{}]",
    "{a={channel='time_s',scale=0}}",
    "true",
    "'''\n'''",
)


@quick
@given(
    lines=st.lists(
        st.one_of(
            st.tuples(st.sampled_from(KEYS), st.sampled_from(VALUES)).map(" = ".join),
            st.sampled_from(["[[recording]]", "[recording]", "[channels]", "[channels.x]", "[[channels]]"]),
        ),
        max_size=12,
    )
)
def test_campaign_files_of_wrong_kinds(folder, lines):
    (folder / "campaign.toml").write_text("\n".join(lines))
    check(folder)
    (folder / "campaign.toml").write_text(TOML)


def mangled_binary(folder, suffix: str, changes) -> None:
    file = folder / f"run{suffix}"
    whole = file.read_bytes()
    try:
        file.write_bytes(mutated(whole, changes))
        check(folder)
    finally:
        file.write_bytes(whole)


@pytest.fixture(scope="module")
def parquet(tmp_path_factory):
    return make_mapped(tmp_path_factory.mktemp("fuzz") / "parquet", ".parquet")


@pytest.fixture(scope="module")
def mat5(tmp_path_factory):
    return make_mapped(tmp_path_factory.mktemp("fuzz") / "mat5", ".mat")


@pytest.fixture(scope="module")
def mat73(tmp_path_factory):
    folder = make_mapped(tmp_path_factory.mktemp("fuzz") / "mat73", ".mat")
    write_mat73(folder / "run.mat", foreign())
    return folder


@pytest.fixture(scope="module")
def mdf4(tmp_path_factory):
    folder = make_mapped(tmp_path_factory.mktemp("fuzz") / "mdf4", ".mf4")
    write_mdf4(folder / "run.mf4", foreign())
    return folder


@slow
@given(changes=mutations)
def test_mangled_parquet(parquet, changes):
    mangled_binary(parquet, ".parquet", changes)


@slow
@given(changes=mutations)
def test_mangled_mat_5(mat5, changes):
    mangled_binary(mat5, ".mat", changes)


@slow
@given(changes=mutations)
def test_mangled_mat_7_3(mat73, changes):
    mangled_binary(mat73, ".mat", changes)


@slow
@given(changes=mutations)
def test_mangled_mdf4(mdf4, changes):
    mangled_binary(mdf4, ".mf4", changes)

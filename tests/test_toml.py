"""TOML of absurd size or depth is refused in a second, wherever a file is TOML."""

import time
from pathlib import Path

import pytest

from forklift import Campaign, ForkliftError, Truck, convert, sweep
from forklift.base import toml
from forklift.control.controller import SHIPPED, Controller
from forklift.ensemble.specification import read as read_sweep
from forklift.plant.campaign import read
from small_campaign import raised
from test_machines import decay

SWEEP = Path(__file__).parents[1] / "examples" / "sweep.toml"
ABSURD = {
    "size": 'name = "' + "a" * 3_000_000 + '"',
    "lines": "a = 1\n" * 700_000,
    "arrays": "a = " + "[" * 100_000,
    "tables": "a = " + "{b = " * 100_000,
    "a key": ".".join("a" * 200_000) + " = 1",
    "a head": "[" + ".".join("a" * 200_000) + "]",
    "many heads": "\n".join(f"[{'.'.join('a' * 60)}.b{k}]" for k in range(5000)),
    "an inline key": "x = {" + ".".join("a" * 100_000) + " = 1}",
    "a number": "a = " + "1" * 10_000,
    "nested arrays": "a = " + "[" * 200 + "]" * 200,
}
READERS = {
    "campaign": lambda path: Campaign.read(path.parent),
    "truck": Truck.read,
    "sweep": lambda path: sweep(path, out=path.parent / "out"),
    "controller": Controller.read,
    "machine": lambda path: read(path.parent, decay()),
    "mapping": lambda path: convert([path], out=path.parent / "out", channels=path, lift="free", load_kg=0.0),
}


@pytest.mark.parametrize(
    "text", ["plain", 'of "quotes"', "\\", "\x7f\x00\x1f", "Öl µ²", "\N{FACTORY}", "a\nb"]
)
def test_a_text_that_is_written_is_read_back(text):
    assert toml.loads(f"one = {toml.written(text)}\nmany = {toml.written([text, text])}") == {
        "one": text,
        "many": [text, text],
    }


@pytest.mark.parametrize(
    "document",
    ["ignore = 5", 'ignore = "time"', "ignore = [1]", "dbc = 5", "dbc = [1]", "channels = 1", "a = 1"],
)
def test_a_mapping_of_another_kind_is_refused(tmp_path, document):
    path = tmp_path / "mapping.toml"
    path.write_text(document, encoding="utf-8")
    log = tmp_path / "log.csv"
    log.write_text("time_s\n0.0\n", encoding="utf-8")
    with pytest.raises(ForkliftError) as caught:
        convert([log], out=tmp_path / "out", channels=path, lift="free", load_kg=0.0)
    assert caught.value.code == "mapping-unreadable"


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("what", ABSURD)
def test_it_is_refused_at_once(tmp_path, what, reader):
    path = tmp_path / "campaign.toml"
    path.write_text(ABSURD[what], encoding="utf-8")
    began = time.process_time()
    error = raised(READERS[reader], path)
    assert time.process_time() - began < 1.0
    assert len(error.message) < 500
    assert str(path) in error.message or path.name in error.message


def test_what_people_write_is_read():
    text = "# " + "." * 300 + '\nname = "a.b.c"\n"quoted.' + "x." * 100 + '" = 1\n[a.b.c]\nd.e = 1.5\n'
    assert toml.loads(text)["a"] == {"b": {"c": {"d": {"e": 1.5}}}}


def test_a_byte_order_mark_before_a_file_is_no_mistake(tmp_path):
    def marked(text):
        path = tmp_path / "mine.toml"
        path.write_text(text, encoding="utf-8-sig")
        return path

    thesis = Truck.read("thesis")
    assert Truck.read(marked(thesis.write(tmp_path / "thesis.toml").read_text(encoding="utf-8"))) == thesis
    assert read_sweep(marked(SWEEP.read_text(encoding="utf-8"))).members == read_sweep(SWEEP).members
    shipped = (SHIPPED / "thesis.toml").read_text(encoding="utf-8")
    assert Controller.read(marked(shipped)) == Controller.read("thesis")

"""What a table says of recordings, and where it is wrong."""

import pytest

from forklift import ForkliftError
from forklift.recordings.entered import Entered, of_table

HEAD = "file,lift,load_kg,role\n"


@pytest.fixture
def table(tmp_path):
    def made(text):
        path = tmp_path / "runs.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return made


def test_each_file_has_what_its_row_says(table):
    found = of_table(table(f"{HEAD}logs/a.csv,free,800,\n\nb.mf4,both,0,validate\n"))
    assert found == {"a.csv": Entered("free", 800.0, None), "b.mf4": Entered("both", 0.0, "validate")}


def test_a_table_without_rows_says_nothing(table):
    assert of_table(table(HEAD)) == {}


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("file,lift\n", None),
        (f"{HEAD}a.csv,free,heavy,\n", 2),
        (f"{HEAD}a.csv,free,0,\n\n\nb.csv,left,0,\n", 5),
        (f"{HEAD}a.csv,free,0,judge\n", 2),
    ],
)
def test_what_is_wrong_is_told_with_its_line(table, text, line):
    with pytest.raises(ForkliftError) as caught:
        of_table(table(text))
    assert caught.value.code == "table-invalid"
    assert caught.value.facts.get("line") == line


@pytest.mark.parametrize(
    ("text", "value"),
    [("file;lift;load_kg\na.csv;free;0\n", ";"), ("datei,lift\na.csv,free\n", ["datei", "lift"])],
)
def test_the_columns_that_were_found_are_told(table, text, value):
    with pytest.raises(ForkliftError) as caught:
        of_table(table(text))
    assert (caught.value.code, caught.value.value) == ("table-invalid", value)

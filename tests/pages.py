"""A page as a test reads it: its texts, its tables and what it draws."""

import json
import re
from html.parser import HTMLParser

from IPython.core.formatters import HTMLFormatter

ROOMY_BYTES = 8_000_000
"""More than a page may weigh: a mail's attachment."""
FETCHING = re.compile(
    r"""(src|href)\s*=\s*["']?\s*(https?:|//)|<link|<img|<iframe|@import|url\(""", re.IGNORECASE
)


class Text(HTMLParser):
    """The texts of the elements of a page, by tag; tables as rows of cells."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.seen: list[tuple[str, str]] = []
        self.rows: list[list[str]] = []
        self.open: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        if tag not in ("meta", "br", "link"):
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        while self.open and self.open.pop() != tag:
            pass

    def handle_data(self, data):
        if not self.open or self.open[-1] in ("script", "style") or not data.strip():
            return
        self.seen.append((self.open[-1], " ".join(data.split())))
        if "td" in self.open or "th" in self.open:
            self.rows[-1][-1] += data.strip()

    def of(self, tag: str) -> list[str]:
        return [text for at, text in self.seen if at == tag]

    @property
    def everything(self) -> str:
        return " ".join(text for _, text in self.seen)


def in_a_notebook(result):
    """What a notebook's cell shows of it, as HTML."""
    return HTMLFormatter()(result)


def drawn(page):
    """The data of its figures."""
    return json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])

"""Results as one self-contained HTML page each: the verdict first, then evidence, doubts and provenance.

Nothing above this package draws, and nothing in it estimates: a page shows what its result holds.
"""

from __future__ import annotations

"""Results as one self-contained HTML page each: the verdict first, then evidence, doubts and provenance.

Nothing outside this package draws. A page shows what its result holds.
"""

from __future__ import annotations

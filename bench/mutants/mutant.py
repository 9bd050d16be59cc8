"""One way to break the program that a user would notice."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutant:
    """One text in one file in place of another."""

    file: str
    """Path from the top of the repository."""
    old: str
    """Text that occurs once in the file."""
    new: str
    harm: str
    """What a user would see."""
    chaos: int | None = None
    """Seed of the first of the five chaos missions that must catch it; None where the tests of its package must."""

    @property
    def package(self) -> str:
        """The package whose tests must fail; "chaos" where its missions must."""
        return "chaos" if self.chaos is not None else self.file.partition("/")[0]

    def applied_to(self, text: str) -> str | None:
        """Return the file's text with the change, None where the old text is not there exactly once."""
        return text.replace(self.old, self.new) if text.count(self.old) == 1 else None

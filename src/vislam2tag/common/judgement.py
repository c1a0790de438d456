"""What a check answers: nothing wrong, something wrong, not looked at, or could not judge.

An empty list of faults is none of these.

Each check keeps its :class:`Judgement` beside its list of faults, in files and in what ``--json`` prints.
"""

from __future__ import annotations

from enum import StrEnum

from vislam2tag.common.records import Record


class Answer(StrEnum):
    """What a check can say."""

    NOTHING_WRONG = "nothing_wrong"
    WRONG = "wrong"
    NOT_LOOKED_AT = "not_looked_at"
    NOT_JUDGED = "not_judged"


class Judgement(Record):
    """The answer of a check, with what it looked at and why it did not look or could not judge."""

    answer: Answer
    looked_at: str = ""
    """What was judged, and how much: ``8 landmarks in 3 walks``; empty if nothing was."""
    why: str = ""
    """Why all or the rest was not looked at or could not be judged: a clause."""
    warnings: int = 0
    """Findings that are worth a look and make nothing wrong."""

    @classmethod
    def of(cls, wrong: int, judged: int, looked_at: str, why: str, warnings: int = 0) -> Judgement:
        """The answer of a check that found ``wrong`` faults in the ``judged`` things that ``looked_at`` counts.

        ``why`` says what the check needs if ``judged`` is 0, else what it left out; it may then be empty.
        """
        if wrong:
            return cls(answer=Answer.WRONG, looked_at=looked_at if judged else "", why=why, warnings=warnings)
        if not judged:
            return cls(answer=Answer.NOT_JUDGED, why=why, warnings=warnings)
        return cls(answer=Answer.NOTHING_WRONG, looked_at=looked_at, why=why, warnings=warnings)

    @property
    def sentence(self) -> str:
        """The answer in words, without a full stop."""
        beside = f", {counted(self.warnings, 'warning')}" if self.warnings else ""
        looked = f" (looked at: {self.looked_at})" if self.looked_at else ""
        rest = f"; {self.why}" if self.why else ""
        return {
            Answer.NOTHING_WRONG: f"nothing is wrong{beside}{looked}{rest}",
            Answer.WRONG: f"something is wrong{beside}{looked}{rest}",
            Answer.NOT_LOOKED_AT: f"not looked at{beside}: {self.why}",
            Answer.NOT_JUDGED: f"could not be judged{beside}: {self.why}",
        }[self.answer]


NOT_RUN = Judgement(answer=Answer.NOT_LOOKED_AT, why="the check was not run")
"""Of records that were written before checks said what they looked at."""


def counted(number: int, thing: str) -> str:
    """A number with its noun: ``1 walk``, ``2 walks``."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def none_mapped(sessions: int) -> str:
    """Why nothing can be judged if all sessions failed: a clause."""
    return f"{'the session cannot' if sessions == 1 else f'none of {sessions} sessions can'} be read or mapped"

"""Findings are summed by kind; the answers of checks each read differently, and none is an empty list."""

from __future__ import annotations

from vislam2tag.common.findings import NOT_RUN, Answer, Finding, FindingKind, Judgement, Severity, counted, pooled


def finding(kind: FindingKind, count: int, message: str = "m") -> Finding:
    return Finding(kind=kind, file="", count=count, message=message, severity=Severity.INFO)


def test_findings_of_one_kind_and_message_are_summed_in_order() -> None:
    found = [
        finding("frame_gap", 1),
        finding("empty_file", 2),
        finding("frame_gap", 3),
        finding("frame_gap", 4, "n"),
    ]
    assert pooled(found) == [finding("frame_gap", 4), finding("empty_file", 2), finding("frame_gap", 4, "n")]
    assert pooled([]) == []


def test_nothing_wrong_says_how_much_was_looked_at_and_what_is_left_open() -> None:
    found = Judgement.of(0, 2, "2 landmarks in 1 walk", "1 landmark could not be judged")
    assert found.answer is Answer.NOTHING_WRONG
    assert found.sentence == "nothing is wrong (looked at: 2 landmarks in 1 walk); 1 landmark could not be judged"


def test_faults_make_something_wrong_however_little_was_judged() -> None:
    assert Judgement.of(3, 0, "", "no walk passes enough").answer is Answer.WRONG
    assert Judgement.of(3, 1, "1 plan", "").sentence == "something is wrong (looked at: 1 plan)"


def test_without_anything_judged_nothing_is_called_sound() -> None:
    assert Judgement.of(0, 0, "0 landmarks", "there are none").sentence == "could not be judged: there are none"
    assert NOT_RUN.sentence == "not looked at: the check was not run"


def test_warnings_are_counted_beside_every_answer() -> None:
    def said(wrong: int, judged: int, warnings: int) -> str:
        return Judgement.of(wrong, judged, "1 plan", "" if judged else "no plan", warnings).sentence

    assert said(0, 1, 3) == "nothing is wrong, 3 warnings (looked at: 1 plan)"
    assert said(1, 1, 1) == "something is wrong, 1 warning (looked at: 1 plan)"
    assert said(0, 0, 2) == "could not be judged, 2 warnings: no plan"


def test_one_is_singular() -> None:
    assert (counted(1, "walk"), counted(0, "walk")) == ("1 walk", "0 walks")

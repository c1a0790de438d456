from vislam2tag.common.progress import counted


def test_steps_of_all_parts_are_counted() -> None:
    heard: list[tuple[int, int]] = []
    step = counted(lambda done, total: heard.append((done, total)), 3)
    step("image", 1)
    for name in ("first", "second"):
        step(name, 2)
    assert heard == [(1, 3), (2, 3), (3, 3)]

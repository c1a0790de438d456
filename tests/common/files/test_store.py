"""A folder in object storage: conditional writes, listing, faults of the network, what users are told."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.stores import AZURE_SECRET, SECRET, Bucket, Fault
from vislam2tag.common.errors import StoreConflictError, StoreError, UsageError
from vislam2tag.common.files import store as module
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.store import Store, address_of, shown
from vislam2tag.common.files.stored_folder import folder_at_hand


@pytest.fixture
def folder(s3: Bucket, request: pytest.FixtureRequest) -> Iterator[Store]:
    yield s3.store(f"folder/{request.node.name}")
    s3.fail()


@pytest.fixture(params=["s3", "azure", "google"])
def any_folder(request: pytest.FixtureRequest) -> Store:
    bucket: Bucket = request.getfixturevalue(request.param)
    return bucket.store(f"folder/{request.node.name}")


def test_an_address_survives_being_a_path() -> None:
    assert address_of(Path("s3://bucket/a/b")) == "s3://bucket/a/b" == shown(Path("s3://bucket/a/b/"))
    assert address_of("az://container/a/") == "az://container/a"
    assert address_of(Path("survey")) is None is address_of(Path("/data/s3:/bucket")) is address_of("ftp://host/a")


def test_credentials_or_no_bucket_in_an_address_are_refused() -> None:
    with pytest.raises(UsageError, match="must not be part of an address") as refused:
        address_of("s3://key:hidden@bucket/survey")
    assert "hidden" not in str(refused.value)
    with pytest.raises(UsageError, match="names no bucket"):
        address_of(Path("s3://"))


def test_an_object_is_created_once_and_replaced_only_from_the_version_that_was_read(any_folder: Store) -> None:
    folder = any_folder
    first = folder.put_over("mark", b"1", None, {"tables": "x"})
    with pytest.raises(StoreConflictError):
        folder.put_over("mark", b"2", None)
    second = folder.put_over("mark", b"2", first)
    with pytest.raises(StoreConflictError):
        folder.put_over("mark", b"3", first)
    assert folder.put_over("mark", b"2", first) == second, "as where the first answer was lost"
    with pytest.raises(StoreConflictError):
        folder.put_over("mark", b"2", None, {"tables": "other"})
    found = folder.get("mark")
    assert found is not None
    assert (found.data, found.version, folder.version("mark")) == (b"2", second, second)
    assert "tables" not in found.notes


def test_objects_are_listed_fetched_and_removed(any_folder: Store, tmp_path: Path) -> None:
    folder = any_folder
    folder.put("a/b", b"12", {"inputs": "x"})
    folder.put("c", b"3")
    assert [(file.name, file.size) for file in sorted(folder.list())] == [("a/b", 2), ("c", 1)]
    assert [file.name for file in folder.list("a")] == ["a/b"]
    assert folder.fetch("a/b", Folder.at(tmp_path), "b") == folder.version("a/b")
    assert (tmp_path / "b").read_bytes() == b"12"
    with folder_at_hand(Path(folder.address)) as here:
        assert (here / "a/b").read_bytes() == b"12"
    folder.delete(["c", "never-there"])
    assert folder.get("c") is None is folder.version("c") is folder.fetch("c", Folder.at(tmp_path), "c")
    assert not (tmp_path / "c").exists()


def test_folders_of_a_bucket_are_apart_and_share_one_connection(any_folder: Store) -> None:
    folder = any_folder
    folder.put("there", b"1")
    module.connection_to.cache_clear()
    for number in range(20):
        assert not list(Store(f"{folder.address}-{number}").list())
        assert not list(Store(folder.address[: -1 - number % 2]).list())
    assert [file.name for file in folder.list()] == ["there"]
    assert folder.address.rpartition("/")[2] in Store(folder.address.rpartition("/")[0]).folders()
    assert module.connection_to.cache_info().currsize == 1


@pytest.fixture
def anew(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """What this is used to set counts for connections that are made while the test lasts, and for no others."""
    module.connection_to.cache_clear()
    yield monkeypatch
    monkeypatch.undo()
    module.connection_to.cache_clear()


@pytest.mark.parametrize("answer", ["503 SlowDown", "500 InternalError", "torn", "429 TooManyRequests"])
def test_what_passes_is_tried_again(s3: Bucket, folder: Store, answer: str) -> None:
    folder.put("there", b"content")
    s3.fail(Fault("GET /bucket/folder", answer, 2), Fault("PUT /bucket/folder", answer, 2))
    folder.put("other", b"content")
    found = folder.get("there")
    assert found is not None
    assert found.data == b"content"


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ("403 AccessDenied", "permission is denied"),
        ("403 RequestTimeTooSkewed", "clock is wrong"),
        ("403 SignatureDoesNotMatch", "credentials are wrong"),
        ("403 QuotaExceeded", "no space left"),
        ("400 AuthorizationHeaderMalformed", "another region"),
        ("301 PermanentRedirect", "another region"),
        ("404 NoSuchBucket", "no such bucket"),
    ],
)
def test_what_stays_is_told_with_what_to_do(s3: Bucket, folder: Store, answer: str, said: str) -> None:
    s3.fail(Fault("/bucket/folder", answer, 99))
    with pytest.raises(StoreError, match=said) as told:
        folder.get("there")
    with pytest.raises(StoreError, match=said):
        folder.put("there", b"1")
    assert str(told.value).startswith(folder.address)
    assert not any(text in str(told.value) for text in ("\n", SECRET))


def test_a_busy_store_is_told_after_all_tries(s3: Bucket, folder: Store, anew: pytest.MonkeyPatch) -> None:
    anew.setitem(module._RETRIES, "max_retries", 1)
    s3.fail(Fault("/bucket/folder", "503 SlowDown", 99))
    with pytest.raises(StoreError, match="too busy"):
        folder.get("there")


def test_a_store_that_does_not_answer_is_asked_again_and_told(
    s3: Bucket, folder: Store, anew: pytest.MonkeyPatch
) -> None:
    anew.setattr(module, "_TIMEOUT_S", 0.5)
    anew.setitem(module._RETRIES, "max_retries", 1)
    folder.put("there", b"content")
    s3.fail(Fault("GET /bucket/folder", "silent"), Fault("PUT /bucket/folder", "silent"))
    assert folder.get("there") is not None
    folder.put_over("mark", b"1", None)
    anew.setattr(module, "_WAITS_S", ())
    s3.fail(Fault("/bucket/folder", "silent", 3))
    with pytest.raises(StoreError, match="did not answer in time in any attempt"):
        folder.get("there")
    with pytest.raises(StoreError, match="did not answer in time in any attempt"):
        folder.put_over("other", b"1", None)


def test_no_credentials_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_ENDPOINT_URL"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setitem(module._RETRIES, "max_retries", 0)
    monkeypatch.setenv("AWS_METADATA_ENDPOINT", "http://127.0.0.1:9")
    with pytest.raises(StoreError, match="no credentials were found"):
        Store("s3://bucket-without-credentials/a").get("there")


def test_stores_with_conditional_writes_are_known(any_folder: Store) -> None:
    any_folder.refuse_without_conditional_writes()
    assert not list(any_folder.list())


def test_what_azure_refuses_is_told(azure: Bucket, anew: pytest.MonkeyPatch) -> None:
    with pytest.raises(StoreError, match=r"^az://none/a/there: cannot be written: the bucket does not exist"):
        Store("az://none/a").put("there", b"1")
    with pytest.raises(StoreError, match="the bucket does not exist"):
        Store("az://none/a").get("there")
    anew.setenv("AZURE_STORAGE_ACCOUNT_KEY", AZURE_SECRET[::-1].strip("=") + "=")
    module.connection_to.cache_clear()
    with pytest.raises(StoreError, match="the credentials are wrong") as told:
        azure.store("wrong-key").get("there")
    assert "Signature" not in str(told.value)


def test_a_store_without_conditional_writes_is_refused(folder: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Store, "put_over", lambda self, name, content, before: self.put(name, content))
    with pytest.raises(StoreError, match="no conditional writes"):
        folder.refuse_without_conditional_writes()
    assert not list(folder.list())

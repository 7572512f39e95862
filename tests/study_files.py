"""Study files that tests write: right ones, ones with a slip, and that a slip is refused with its place."""

import pytest

from qddot.runner.study.read import StudyError


def write(folder, text, name="study.toml"):
    path = folder / name
    path.write_text(text)
    return path


def slip(text, right, wrong):
    """The text with what is right in it, which must stand there, replaced by what is wrong."""
    assert right in text
    return text.replace(right, wrong)


def assert_refused(run, path, message):
    """Running the file raises a StudyError that names the file and says the message."""
    with pytest.raises(StudyError) as refused:
        run(path)
    assert str(refused.value).startswith(str(path))
    assert message in str(refused.value)

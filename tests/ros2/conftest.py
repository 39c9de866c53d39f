import pytest


@pytest.fixture(autouse=True)
def machine_may_be_slow(monkeypatch):
    """Let the wall clock cause nothing: in lockstep no time passes, however long the machine takes."""
    monkeypatch.setattr("tvist_ros2.gateway.REPEAT_S", 3600.0)
    monkeypatch.setattr("tvist_ros2.gateway.SAME_S", 3600.0)

import pytest


@pytest.fixture(autouse=True)
def nothing_is_repeated(monkeypatch):
    """Time stands still in lockstep for as long as the machine is slow."""
    monkeypatch.setattr("tvist_ros2.gateway.REPEAT_S", 3600.0)

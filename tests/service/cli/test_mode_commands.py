"""`modes` with its questions, and `controlled`."""

import pytest

from service.cli import main


def test_a_mode_s_least_load_is_asked_by_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["modes", "two-dof", "--from", "0.1", "--to", "30", "--harmonics", "3", "--set", "damper.N1=0"]
    assert main([*words, "--aero", "-0.1", "--disturbance", "3"]) == 0
    assert "times the loads" in capsys.readouterr().out
    assert main([*words, "--disturbance", "3"]) == 2
    assert "`--aero`" in capsys.readouterr().err
    assert main(["modes", "two-dof", "--from", "10", "--to", "0.01"]) == 2
    error = capsys.readouterr().err
    assert "`--from`" in error
    assert "amplitudes" not in error
    assert (
        main(["modes", "two-dof", "--from", "0.3", "--to", "1", "--harmonics", "3", "--phase-resonance"]) == 0
    )
    assert "phase resonance of mode 1" in capsys.readouterr().out
    assert main(["controlled", "two-dof", "--amplitude", "1", "--harmonics", "3"]) == 0
    assert "least force" in capsys.readouterr().out

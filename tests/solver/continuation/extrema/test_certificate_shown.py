"""What a response knows between its points is told, and nothing is claimed of what it does not know."""

from dataclasses import replace

import pytest

import optim
import solver
from optim.methods.plateau import with_plateau
from optim.results.design_result import DesignStatus
from optim.views.tables import design as designs
from optim.views.tables import studies
from service.cli import main
from service.rendering.report.sections import ReportLine, branch_table
from service.rendering.text import print_told
from solver.continuation.branch import uncertain
from solver.results.known import FLAGS, NONE_HIGHER, flag_words
from solver.views.tables import responses, tracks

WHY = "a resonance was left at 1.5"


def doubtful(branch):
    """The branch, had a place of it not been settled."""
    return replace(branch, peak_certificate=uncertain(WHY, 0.1))


@pytest.fixture(scope="module")
def branch():
    return solver.sweep(solver.load_scene("two-dof"), harmonics=3)


def test_the_sweep_says_it(branch, capsys):
    print_told(responses.branch(branch.to_json()))
    assert NONE_HIGHER in capsys.readouterr().out
    assert NONE_HIGHER in str(branch.summary())
    found = doubtful(branch).to_json()
    assert found["band_known"] is False
    print_told(responses.branch(found))
    assert WHY in " ".join(capsys.readouterr().out.split())
    assert WHY in str(doubtful(branch).summary())


def test_a_sweep_of_an_earlier_version_is_read(branch, capsys):
    found = branch.to_json()
    for key in ("peak_certificate", "band_known", "flags", "mean_undetermined"):
        del found[key]
    print_told(responses.branch(found))
    printed = capsys.readouterr().out
    assert "between points" not in printed
    assert "peak" in printed


def test_the_report_says_it(branch):
    told = branch_table([ReportLine(name="as given", branch=doubtful(branch), color="black")])
    assert "not known" in told
    assert WHY in told
    assert WHY not in branch_table([ReportLine(name="as given", branch=branch, color="black")])


def test_flags_are_told_in_words(branch, capsys):
    flagged = replace(branch, flags=("travelling_wave_assumed", "of_a_newer_version"))
    print_told(responses.branch(flagged.to_json()))
    printed = " ".join(capsys.readouterr().out.split())
    for words in (FLAGS["travelling_wave_assumed"], "of a newer version"):
        assert words in printed
        assert words in str(flagged.summary())
    assert flag_words(()) == []


def test_an_optimum_is_claimed_only_of_what_is_known(capsys):
    found = optim.design(
        solver.load_scene("two-dof"), variables={"damper.N0": (50.0, 200.0)}, harmonics=1, basins=1
    )
    assert found.status is DesignStatus.OPTIMAL
    assert not any("between its points" in words for words in found.warnings)
    responses = tuple(replace(one, branch=doubtful(one.branch)) for one in found.evaluation.responses)
    evaluation = replace(found.evaluation, responses=responses)
    again = with_plateau(replace(found, evaluation=evaluation, status=DesignStatus.AT_BOUND), None)
    assert again.status is DesignStatus.LOCAL
    assert not again.reached
    assert any(WHY in words for words in again.warnings)
    print_told(designs.design(again.to_json()))
    assert WHY in " ".join(capsys.readouterr().out.split())


def test_a_diagram_is_clear_only_if_that_is_known(capsys):
    diagram = optim.campbell_diagram(
        solver.load_scene("two-dof"), speeds_rpm=(20.0, 30.0), limit=5.0, harmonics=1
    )
    assert diagram.clear is True
    orders = tuple(replace(one, branch=doubtful(one.branch)) for one in diagram.orders)
    open_ended = replace(diagram, orders=orders)
    assert open_ended.clear is None
    assert WHY in str(open_ended.summary())
    print_told(studies.campbell(open_ended.to_json()))
    assert WHY in " ".join(capsys.readouterr().out.split())


def test_tracks_and_sensitivities_warn(capsys):
    track = solver.track_peak(solver.load_scene("two-dof"), "damper.N0", 80.0, 120.0, harmonics=1)
    assert track.peaks_open == ()
    track = replace(track, branches=tuple(doubtful(one) for one in track.branches))
    assert len(track.to_json()["peaks_open"]) == 1
    print_told(tracks.track(track.to_json()))
    assert WHY in " ".join(capsys.readouterr().out.split())
    shares = optim.sensitivities(solver.load_scene("two-dof"), harmonics=1)
    print_told(studies.shares(replace(shares, branch=doubtful(shares.branch)).to_json()))
    assert WHY in " ".join(capsys.readouterr().out.split())


def test_the_command_prints_it(capsys):
    assert main(["sweep", "two-dof", "--harmonics", "3"]) == 0
    assert "between points" in capsys.readouterr().out
